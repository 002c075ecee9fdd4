//! What a turn of the trajectory and a force along it change of every sample: the rows of the normal matrix of the motion.
//!
//! In: the problem along a trajectory, and the knots. Out: [`Rows`], channel by channel, in units of noise.
//!
//! With `w`, `m` the rate and field at the sample, `a` its axis and `r` its lever, a turn `th` and a specific force `s`, both in b,
//! change it by
//!
//! ```text
//! gyro   a.(th' + w x th)
//! accel  a.(s + dw' x r + dw x (w x r) + w x (dw x r)),  dw = th' + w x th,  dw' = th'' + w' x th + w x th'
//! mag    a.(m x th)
//! ```
//!
//! A low-pass of the first order is the mean of these over its past, by Gauss and Laguerre's three points: exact to the fifth
//! order of its time constant.

use nalgebra::Vector3;
use twin::predict::{Channel, Feel, Kind, UnitDescription};

use crate::{
    null::problem::Problem,
    parity::smooth::{
        banded::Panel,
        basis::{Knots, SUPPORT},
    },
};

/// Unknowns a knot: a turn, a force.
pub const UNKNOWNS: usize = 6;

/// Of these, the turn's, which stand first: all that gyros and magnetometers see.
const TURN: usize = 3;

/// Points and weights of the mean over an exponential past (Abramowitz and Stegun, table 25.9).
const LAGUERRE: [(f64, f64); 3] = [
    (0.415_774_556_783, 0.711_093_009_929),
    (2.294_280_360_279, 0.278_517_733_569),
    (6.289_945_082_937, 0.010_389_256_501_6),
];

/// The samples of one channel.
#[derive(Clone, Debug, Default)]
pub struct Rows {
    /// The first knot of each.
    pub first: Vec<usize>,
    /// Knots that each depends on.
    pub knots: usize,
    /// Unknowns of a knot that count: its turn, or all.
    pub unknowns: usize,
    /// Derivatives of each by these unknowns, knot by knot.
    pub slopes: Vec<f64>,
}

/// Unknowns that a sample may depend on.
pub fn width(problem: &Problem, knots: &Knots) -> usize {
    UNKNOWNS * reached(past_s(problem.twin.unit()), knots)
}

/// Knots that a sample depends on that looks so far back \[s\].
fn reached(past_s: f64, knots: &Knots) -> usize {
    SUPPORT + (past_s / knots.step_s).ceil() as usize
}

/// \[s\] that the slowest low-pass of a unit looks back.
pub fn past_s(unit: &UnitDescription) -> f64 {
    let channels = unit.channels.iter();
    let moved = channels.filter(|channel| channel.sensor != Kind::Thermometer);
    moved.map(|channel| LAGUERRE[2].0 * channel.tau_s()).fold(0.0, f64::max)
}

impl Rows {
    /// Of a channel.
    pub fn along(problem: &Problem, channel: usize, knots: &Knots, feel: &dyn Fn(f64) -> Feel) -> Self {
        let own = &problem.twin.unit().channels[channel];
        let frame = &problem.frames[channel];
        let mut rows = Self {
            knots: reached(LAGUERRE[2].0 * own.tau_s(), knots),
            unknowns: if own.sensor == Kind::Accelerometer {
                UNKNOWNS
            } else {
                TURN
            },
            ..Self::default()
        };
        if own.sensor == Kind::Thermometer {
            return rows;
        }
        let tau_s = own.tau_s();
        let points: &[(f64, f64)] = if tau_s > 0.0 { &LAGUERRE } else { &[(0.0, 1.0)] };
        for (sample, row) in frame.series.rows.iter().enumerate() {
            let t_s = problem.twin.starts_s()[*row as usize] + own.slot_s;
            let earliest_s = t_s - tau_s * points[points.len() - 1].0;
            let first = knots.weights(earliest_s, 0).0;
            let mut slopes = vec![0.0; rows.width()];
            for (past, share) in points {
                let at_s = t_s - tau_s * past;
                let by = changes(own, &feel(at_s));
                for (order, [turn, force]) in by.iter().enumerate() {
                    let (knot, weights) = knots.weights(at_s, order);
                    for (at, weight) in weights.iter().enumerate() {
                        let from = rows.unknowns * (knot + at - first);
                        let scale = share * weight / frame.weights[sample];
                        let own = &mut slopes[from..from + rows.unknowns];
                        let by = turn.iter().chain(force);
                        own.iter_mut().zip(by).for_each(|(own, by)| *own += scale * by);
                    }
                }
            }
            rows.first.push(first);
            rows.slopes.extend(slopes);
        }
        rows
    }

    /// Derivatives a sample.
    pub fn width(&self) -> usize {
        self.knots * self.unknowns
    }

    /// Those of a sample by all unknowns of its knots, in the room that is given.
    pub fn whole<'a>(&self, sample: usize, room: &'a mut [f64]) -> &'a [f64] {
        let whole = &mut room[..UNKNOWNS * self.knots];
        whole.fill(0.0);
        let own = self.slopes[self.width() * sample..].chunks_exact(self.unknowns);
        for (whole, own) in whole.chunks_exact_mut(UNKNOWNS).zip(own) {
            whole[..self.unknowns].copy_from_slice(own);
        }
        whole
    }

    /// What a sample changes by with unknowns of these sizes, of which the first is that of its first knot.
    pub fn of<const N: usize>(&self, sample: usize, sizes: &Panel<N>) -> [f64; N] {
        let mut sums = [0.0; N];
        let own = &self.slopes[self.width() * sample..self.width() * (sample + 1)];
        for (own, sizes) in own.chunks_exact(self.unknowns).zip(sizes.chunks_exact(UNKNOWNS)) {
            for (slope, size) in own.iter().zip(sizes) {
                sums.iter_mut().zip(size).for_each(|(sum, size)| *sum += slope * size);
            }
        }
        sums
    }
}

/// Derivatives of a reading by turn and force, their first and their second derivatives.
fn changes(channel: &Channel, feel: &Feel) -> [[Vector3<f64>; 2]; 3] {
    let (a, r, w) = (channel.axis_b, channel.lever_m, feel.rate_b);
    let none = Vector3::zeros();
    match channel.sensor {
        Kind::Gyro => [[a.cross(&w), none], [a, none], [none; 2]],
        Kind::Accelerometer => {
            let by_rate_dot = r.cross(&a);
            let by_rate = w.cross(&r).cross(&a) + r.cross(&a.cross(&w));
            [
                [by_rate.cross(&w) + by_rate_dot.cross(&feel.rate_dot_b), a],
                [by_rate + by_rate_dot.cross(&w), none],
                [by_rate_dot, none],
            ]
        }
        Kind::Magnetometer => [[a.cross(&feel.field_b_ut), none], [none; 2], [none; 2]],
        Kind::Thermometer => [[none; 2]; 3],
    }
}
