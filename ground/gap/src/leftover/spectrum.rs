//! The spectrum of what one channel leaves: how far a line stands above its neighbours.
//!
//! In: a residual. Out: a ratio of powers. Noise and drift have no line, whatever spectrum they have, so this is what tells
//! a tone from a walk of the zero that is as strong, or from noise that is as loud.

use std::sync::Arc;

use rustfft::{Fft, FftPlanner, num_complex::Complex};
use statrs::distribution::{ContinuousCDF, Normal};

/// Bins on either side that tell the level about a bin.
const AROUND: usize = 12;

/// The nearest of them: Hann's window leaks a line into two bins on either side.
const NEAREST: usize = 3;

/// Cycles of the log below which a line is no line but a shape, and has no level on its lower side.
const FEWEST: usize = NEAREST + 3;

/// Normal deviate below any that noise without a line has.
const NO_LINE: f64 = -8.0;

/// A transform ready to be repeated.
pub struct Spectrum {
    transform: Arc<dyn Fft<f64>>,
    window: Vec<f64>,
}

impl Spectrum {
    /// Of a residual of so many samples, taken as evenly spaced: a hole breaks the phase of a tone and leaves its frequency.
    pub fn new(count: usize) -> Self {
        let turn = |row: usize| std::f64::consts::TAU * (row as f64 + 0.5) / count as f64;
        Spectrum {
            transform: FftPlanner::new().plan_fft_forward(count),
            window: (0..count).map(|row| 0.5 - 0.5 * turn(row).cos()).collect(),
        }
    }

    /// How plain the strongest line is: the normal deviate as rare as it, from [`NO_LINE`], cubed. The strongest of hundreds of
    /// ratios has a long tail, and would be the largest of all that is looked at where there is nothing.
    pub fn plainness(&self, values: &[f64]) -> f64 {
        // Over the mean of k bins of noise a bin is F-distributed with 2 and 2 k degrees of freedom.
        let k = (AROUND + 1 - NEAREST) as f64;
        let line = self.line(values);
        if line <= 0.0 {
            return 0.0;
        }
        let beyond = (1.0 + line / k).powf(-k);
        let bins = (self.window.len() / 2).saturating_sub(2 * FEWEST) as f64;
        let p = -(bins * (-beyond).ln_1p()).exp_m1();
        (-Normal::standard().inverse_cdf(p) - NO_LINE).max(0.0).powi(3)
    }

    /// The power of the strongest line over the mean power about it, of that side where it is higher: a spectrum that only
    /// falls has no line.
    fn line(&self, values: &[f64]) -> f64 {
        let mut bins: Vec<Complex<f64>> = (values.iter().zip(&self.window))
            .map(|(value, window)| Complex::from(value * window))
            .collect();
        self.transform.process(&mut bins);
        let mut sums = vec![0.0];
        for bin in &bins[..bins.len() / 2] {
            sums.push(sums.last().copied().unwrap_or(0.0) + bin.norm_sqr());
        }
        let last = sums.len() - 1;
        let mean = |from: usize, to: usize| (sums[to] - sums[from]) / (to - from) as f64;
        let above = |bin: usize| {
            let below = mean(bin.saturating_sub(AROUND), bin + 1 - NEAREST);
            let level = below.max(mean(bin + NEAREST, (bin + AROUND + 1).min(last)));
            if level > 0.0 {
                (sums[bin + 1] - sums[bin]) / level
            } else {
                0.0
            }
        };
        (FEWEST..last.saturating_sub(FEWEST)).map(above).fold(0.0, f64::max)
    }
}

#[cfg(test)]
mod tests {
    use rand_distr::{Distribution, StandardNormal};
    use rand_xoshiro::{Xoshiro256PlusPlus, rand_core::SeedableRng};

    use super::*;

    const COUNT: usize = 1500;

    /// A walk of one a sample, and a tone of so large an amplitude.
    fn walk(amplitude: f64) -> Vec<f64> {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(5);
        let mut zero = 0.0;
        let mut sample = |row: usize| {
            let step: f64 = StandardNormal.sample(&mut random);
            zero += step;
            zero + amplitude * (row as f64 * 0.2).sin()
        };
        (0..COUNT).map(&mut sample).collect()
    }

    #[test]
    fn a_tone_is_told_from_the_walk_it_hides_in() {
        let spectrum = Spectrum::new(COUNT);
        // One exponential over the mean of ten, the largest of 700.
        let (alone, with) = (spectrum.line(&walk(0.0)), spectrum.line(&walk(3.0)));
        assert!(alone < 20.0 && with > 60.0, "{alone} {with}");
    }

    #[test]
    fn noise_is_as_plain_as_a_normal_deviate() {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(9);
        let spectrum = Spectrum::new(COUNT);
        let mut deviates: Vec<f64> = (0..1000)
            .map(|_| {
                let noise: Vec<f64> = (0..COUNT).map(|_| StandardNormal.sample(&mut random)).collect();
                spectrum.plainness(&noise).cbrt() + NO_LINE
            })
            .collect();
        deviates.sort_by(f64::total_cmp);
        let spread = deviates[841] - deviates[500];
        let far = deviates
            .iter()
            .filter(|deviate| **deviate - deviates[500] > 3.0 * spread);
        assert!(
            (0.7..1.3).contains(&spread) && far.count() < 6,
            "{spread} {:?}",
            &deviates[990..]
        );
    }

    #[test]
    fn nothing_and_next_to_nothing_have_no_line() {
        for count in [0, 1, 5, 12, 13, 40] {
            let spectrum = Spectrum::new(count);
            assert_eq!(spectrum.plainness(&vec![0.0; count]), 0.0, "{count}");
            assert!(spectrum.plainness(&walk(3.0)[..count]).is_finite(), "{count}");
        }
    }
}
