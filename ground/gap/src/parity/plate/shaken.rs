//! What is too quick for a body: knocks, and vibration.
//!
//! In: the specific forces of a plate at its full rate. Out: [`Knock`]s and [`Line`]s. No motion is needed: a hand, a robot arm or a table
//! moves below some ten hertz, and what stands above that is a knock when it is short, a vibration when it stays on.
//!
//! A knock is a second difference of the force beyond [`KNOCK_M_S2`]. A line is a peak of the spectrum above [`LEAST_HZ`] that stays: of
//! each frequency the median of all spans counts, so that knocks and the spans of rest, up to half of a log, do not.

use nalgebra::Vector3;
use packets::magnitude::median;
use twin::fourier::{self, Complex};

use crate::thresholds::KNOCK_M_S2;

/// \[s\] between two knocks: a plate that was hit rings for less.
const APART_S: f64 = 0.3;

/// \[Hz\] above what a hand, an arm or a table does.
pub const LEAST_HZ: f64 = 15.0;

/// Samples of a span: lines 1.1 Hz apart at 286 Hz.
const SPAN: usize = 256;

/// Spans from which on the middle one is known to a fifth: of three axes' noise it has six degrees of freedom.
const LEAST_SPANS: usize = 16;

/// Frequencies beside a line that are its own, and those that are no longer compared with it.
const NEAR: usize = 4;
const FAR: usize = 10;

/// Something hit the plate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Knock {
    /// \[s\]
    pub t_s: f64,
    /// [m/s2] second difference of the force.
    pub size: f64,
}

/// All knocks, rising.
pub fn knocks(t_s: &[f64], forces: &[Vector3<f64>]) -> Vec<Knock> {
    let mut knocks: Vec<Knock> = Vec::new();
    for (at, three) in forces.windows(3).enumerate() {
        let size = (three[0] - 2.0 * three[1] + three[2]).norm();
        if size < KNOCK_M_S2 {
            continue;
        }
        let now_s = t_s[at + 1];
        match knocks.last_mut() {
            Some(last) if now_s - last.t_s < APART_S => last.size = last.size.max(size),
            _ => knocks.push(Knock { t_s: now_s, size }),
        }
    }
    knocks
}

/// The strongest line of a triad.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Line {
    /// \[Hz\] as sampled: what vibrates faster than half the rate shows folded.
    pub hz: f64,
    /// Amplitude, in the unit of the samples, in the middle one of all spans.
    pub amplitude: f64,
    /// Over what stands beside it on the stronger side, as power: the skirt of a body's own motion falls, a line stands on both sides.
    pub over: f64,
}

/// The strongest line above [`LEAST_HZ`]; none of a log that is too short or too slow to have one.
pub fn line(step_s: f64, samples: &[Vector3<f64>]) -> Option<Line> {
    let first = (LEAST_HZ * step_s * SPAN as f64).ceil() as usize;
    let spans = samples.len() / SPAN;
    if first + 2 * FAR > SPAN / 2 || spans < LEAST_SPANS {
        return None;
    }
    let transform = fourier::forward(SPAN);
    let mut powers: Vec<Vec<f64>> = vec![Vec::new(); SPAN / 2];
    for span in samples.chunks_exact(SPAN) {
        let mut sums = vec![0.0; SPAN / 2];
        for axis in 0..3 {
            // Hann's window, whose gain is a half.
            let window = |at: usize| 0.5 - 0.5 * (std::f64::consts::TAU * at as f64 / SPAN as f64).cos();
            let mut own: Vec<Complex<f64>> = (span.iter().enumerate())
                .map(|(at, sample)| Complex::new(sample[axis] * window(at), 0.0))
                .collect();
            transform.process(&mut own);
            let scale = (4.0 / SPAN as f64).powi(2);
            sums.iter_mut()
                .zip(&own)
                .for_each(|(sum, own)| *sum += scale * own.norm_sqr());
        }
        powers.iter_mut().zip(sums).for_each(|(all, own)| all.push(own));
    }
    let middle = |own: &[f64]| median(own.iter().copied()).unwrap_or(0.0);
    let medians: Vec<f64> = powers.iter().map(|own| middle(own)).collect();
    let over = |at: usize| {
        let side = |from: usize, to: usize| middle(&medians[from..to]);
        let (below, above) = (side(at - FAR, at - NEAR), side(at + NEAR + 1, at + FAR + 1));
        medians[at] / below.max(above).max(f64::MIN_POSITIVE)
    };
    let all = (first.max(FAR)..SPAN / 2 - FAR).map(|at| (at, over(at)));
    let (at, over) = all.max_by(|one, other| one.1.total_cmp(&other.1))?;
    Some(Line {
        hz: at as f64 / (SPAN as f64 * step_s),
        amplitude: medians[at].sqrt(),
        over,
    })
}
