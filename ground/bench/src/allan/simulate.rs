//! Noise of known size, for tests: rate samples as a gyro that averages over its sampling interval would give them.

use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::{Xoshiro256PlusPlus, rand_core::SeedableRng};
use twin::fourier::{self, Complex};

use super::terms::Term;

/// Coefficients as in IEEE 952, in the record's own unit and seconds.
#[derive(Clone, Copy, Debug, Default)]
pub struct Noise {
    pub quantisation: f64,
    pub arw: f64,
    pub bias_instability: f64,
    pub rrw: f64,
    pub ramp: f64,
}

impl Noise {
    /// `count` rates at `step_s`.
    pub fn rate(&self, count: usize, step_s: f64, seed: u64) -> Vec<f64> {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
        let mut draw = move || -> f64 { StandardNormal.sample(&mut random) };
        let mut rate: Vec<f64> = (0..count).map(|k| self.ramp * k as f64 * step_s).collect();
        if self.quantisation > 0.0 {
            let mut before = draw();
            for value in &mut rate {
                let here = draw();
                *value += self.quantisation * (here - before) / step_s;
                before = here;
            }
        }
        if self.arw > 0.0 {
            rate.iter_mut()
                .for_each(|value| *value += self.arw / step_s.sqrt() * draw());
        }
        if self.rrw > 0.0 {
            // The mean of a Wiener process over an interval, and its end: correlated as 1/2, variances 1/3 and 1.
            let (mut walk, scale) = (0.0, self.rrw * step_s.sqrt());
            for value in &mut rate {
                let (end, within) = (draw(), draw());
                *value += scale * (walk + 0.5 * end + within / 12.0_f64.sqrt());
                walk += end;
            }
        }
        if self.bias_instability > 0.0 {
            for (value, flicker) in rate.iter_mut().zip(flicker(count, step_s, &mut draw)) {
                *value += self.bias_instability * flicker;
            }
        }
        rate
    }
}

/// Flicker rate averaged over each sampling interval, all frequencies of `1 / (2 pi f)` included. Its steps are stationary
/// with the autocovariance of the angle's second differences, and are drawn exactly by circulant embedding (Davies and
/// Harte, "Tests for Hurst effect", Biometrika 1987). A filter on white noise (Kasdin 1995) would have its own spectrum near
/// the Nyquist frequency.
fn flicker(count: usize, step_s: f64, draw: &mut impl FnMut() -> f64) -> Vec<f64> {
    let half = count.next_power_of_two();
    let angle = |lag: i64| Term::BiasInstability.autocovariance(lag as f64 * step_s);
    let power = |lag: i64| 6.0 * angle(lag) - 4.0 * (angle(lag - 1) + angle(lag + 1)) + angle(lag - 2) + angle(lag + 2);
    let mut spectrum: Vec<Complex<f64>> = (0..=half)
        .chain((1..half).rev())
        .map(|lag| Complex::new(power(lag as i64), 0.0))
        .collect();
    let forward = fourier::forward(2 * half);
    forward.process(&mut spectrum);
    for bin in &mut spectrum {
        // Rounding makes the bin at zero, where flicker's steps have no power, a little negative.
        *bin = Complex::new(draw(), draw()) * (bin.re.max(0.0) / (2 * half) as f64).sqrt();
    }
    forward.process(&mut spectrum);
    let mut rate = 0.0;
    let steps = spectrum[..count].iter().map(|step| step.re / step_s);
    steps
        .map(|step| {
            rate += step;
            rate
        })
        .collect()
}
