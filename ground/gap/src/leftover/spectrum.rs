//! The spectrum of what one channel leaves: how far a line stands above its neighbours.
//!
//! In: a residual. Out: a ratio of powers. Noise and drift have no line, whatever spectrum they have, so this is what tells
//! a tone from a walk of the zero that is as strong, or from noise that is as loud.

use std::sync::Arc;

use rustfft::{Fft, FftPlanner, num_complex::Complex};

/// Bins on either side that tell the level about a bin.
const AROUND: usize = 12;

/// The nearest of them: Hann's window leaks a line into two bins on either side.
const NEAREST: usize = 3;

/// Cycles of the log below which a line is no line but a shape, and has no level on its lower side.
const FEWEST: usize = NEAREST + 3;

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

    /// How plain the strongest line is: minus the logarithm of how rare it is in one bin of noise. The ratio itself, over a level
    /// that few bins tell, has a long tail: the strongest of hundreds would be the largest of all that is looked at where there
    /// is nothing.
    pub fn plainness(&self, values: &[f64]) -> f64 {
        // Over the mean of k bins of noise a bin is F-distributed with 2 and 2 k degrees of freedom.
        let k = (AROUND + 1 - NEAREST) as f64;
        k * (self.line(values) / k).ln_1p()
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
    fn the_strongest_line_of_noise_has_the_tail_of_an_exponential() {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(9);
        let spectrum = Spectrum::new(COUNT);
        let mut strongest: Vec<f64> = (0..1000)
            .map(|_| {
                let noise: Vec<f64> = (0..COUNT).map(|_| StandardNormal.sample(&mut random)).collect();
                spectrum.plainness(&noise)
            })
            .collect();
        strongest.sort_by(f64::total_cmp);
        // From one in ten to one in a hundred of a Gumbel law: ln(-ln 0.9) - ln(-ln 0.99) = 2.35.
        let tail = strongest[990] - strongest[900];
        assert!((1.5..3.2).contains(&tail), "{tail}");
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
