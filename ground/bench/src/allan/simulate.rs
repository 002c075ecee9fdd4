//! Noise of known size, for tests: rate samples as a gyro that averages over its sampling interval would give them.

use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::{Xoshiro256PlusPlus, rand_core::SeedableRng};
use rustfft::{FftPlanner, num_complex::Complex};

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
            // Spectrum B^2 / (2 pi f), one-sided B^2 / (pi f): the filter (1 - z^-1)^(-1/2) on white noise (Kasdin, "Discrete simulation
            // of colored noise", Proc. IEEE 1995) gives 1 / (2 pi f) per unit variance, two-sided.
            for (value, pink) in rate.iter_mut().zip(pink(count, &mut draw)) {
                *value += self.bias_instability * pink;
            }
        }
        rate
    }
}

fn pink(count: usize, draw: &mut impl FnMut() -> f64) -> Vec<f64> {
    let length = (2 * count).next_power_of_two();
    let zero = Complex::new(0.0, 0.0);
    let (mut filter, mut white) = (vec![zero; length], vec![zero; length]);
    let mut tap = 1.0;
    for k in 0..count {
        filter[k].re = tap;
        tap *= (k as f64 + 0.5) / (k as f64 + 1.0);
        white[k].re = draw();
    }
    let mut planner = FftPlanner::new();
    let (forward, inverse) = (planner.plan_fft_forward(length), planner.plan_fft_inverse(length));
    forward.process(&mut filter);
    forward.process(&mut white);
    white
        .iter_mut()
        .zip(&filter)
        .for_each(|(white, filter)| *white *= filter);
    inverse.process(&mut white);
    white[..count].iter().map(|value| value.re / length as f64).collect()
}
