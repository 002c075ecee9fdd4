//! The spectrum of what one channel leaves, and how far a line stands in it.
//!
//! In: a residual. Out: a [`Transform`], and of it how far a line stands above its neighbours: noise and drift have no line,
//! whatever spectrum they have, so this is what tells a tone from a walk of the zero that is as strong, or from noise that is
//! as loud. And how much power each frequency has (the largest of a periodogram; Fisher 1929), of one channel or of several that
//! are one part's: this sees a tone that is too weak for the neighbours to tell, or that stands between two frequencies.

use std::{f64::consts::PI, sync::Arc};

use twin::fourier::{self, Complex, Fft};

/// Bins on either side that tell the level about a bin.
const AROUND: usize = 12;

/// The nearest of them: Hann's window leaks a line into two bins on either side.
const NEAREST: usize = 3;

/// Cycles of the log below which a line is no line but a shape, and has no level on its lower side.
const FEWEST: usize = NEAREST + 3;

/// Cycles of the log below which the calibration takes up most of a tone.
const SLOWEST: usize = 3;

/// A transform ready to be repeated.
pub struct Spectrum {
    transform: Arc<dyn Fft<f64>>,
}

/// A residual's transform, of the frequencies from none to half a cycle a sample.
pub struct Transform {
    bins: Vec<Complex<f64>>,
    count: usize,
}

impl Spectrum {
    /// Of a residual of so many samples, taken as evenly spaced: a hole breaks the phase of a tone and leaves its frequency.
    pub fn new(count: usize) -> Self {
        Spectrum {
            transform: fourier::forward(count),
        }
    }

    /// Of one residual.
    pub fn of(&self, values: &[f64]) -> Transform {
        let mut bins: Vec<Complex<f64>> = values.iter().map(|value| Complex::from(*value)).collect();
        self.transform.process(&mut bins);
        bins.truncate(values.len() / 2 + 1);
        Transform {
            bins,
            count: values.len(),
        }
    }
}

impl Transform {
    /// How plain the strongest line is: minus the logarithm of how rare it is in one bin of noise. The ratio itself, over a level
    /// that few bins tell, has a long tail: the strongest of hundreds would be the largest of all that is looked at where there
    /// is nothing.
    pub fn plainness(&self) -> f64 {
        // Over the mean of k bins of noise a bin is F-distributed with 2 and 2 k degrees of freedom.
        let k = (AROUND + 1 - NEAREST) as f64;
        k * (self.line() / k).ln_1p()
    }

    /// The power of the strongest line over the mean power about it, of that side where it is higher: a spectrum that only
    /// falls has no line.
    fn line(&self) -> f64 {
        let mut sums = vec![0.0];
        for bin in 0..self.count / 2 {
            sums.push(sums.last().copied().unwrap_or(0.0) + self.windowed(bin).norm_sqr());
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

    /// A bin of the residual under Hann's window, which is its bins times 1/2 and its neighbours' times -1/4.
    fn windowed(&self, bin: usize) -> Complex<f64> {
        // The window's ends lie half a sample outside.
        let turn = Complex::cis(PI / self.count as f64);
        let below = match bin {
            0 => self.bins.get(1).map_or(Complex::ZERO, Complex::conj),
            _ => self.bins[bin - 1],
        };
        let above = self.bins.get(bin + 1).copied().unwrap_or(Complex::ZERO);
        self.bins[bin] * 0.5 - (below * turn + above * turn.conj()) * 0.25
    }

    /// The power of each frequency in units of noise, one on the average, from [`SLOWEST`] cycles of the log on. Not over the
    /// mean of what is there: where slow errors are allowed for, noise has less than one at high frequencies, and slow ones
    /// would all be lines.
    pub fn powers(&self) -> Vec<f64> {
        let noise = self.count.max(1) as f64;
        // Half a cycle a sample has one degree of freedom and not two, and the longer tail.
        let bins = self.bins.iter().take(self.count.div_ceil(2)).skip(SLOWEST);
        bins.map(|bin| bin.norm_sqr() / noise).collect()
    }
}

/// The most that one frequency has in all of some channels together, given the [`Transform::powers`] of each.
pub fn strongest<'a>(channels: impl Iterator<Item = &'a Vec<f64>>) -> f64 {
    let mut sums: Vec<f64> = Vec::new();
    for powers in channels {
        sums.resize(sums.len().max(powers.len()), 0.0);
        sums.iter_mut().zip(powers).for_each(|(sum, power)| *sum += power);
    }
    sums.into_iter().fold(0.0, f64::max)
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
        let (alone, with) = (spectrum.of(&walk(0.0)).line(), spectrum.of(&walk(3.0)).line());
        assert!(alone < 20.0 && with > 60.0, "{alone} {with}");
    }

    #[test]
    fn the_strongest_line_of_noise_has_the_tail_of_an_exponential() {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(9);
        let spectrum = Spectrum::new(COUNT);
        let mut strongest: Vec<f64> = (0..1000)
            .map(|_| {
                let noise: Vec<f64> = (0..COUNT).map(|_| StandardNormal.sample(&mut random)).collect();
                spectrum.of(&noise).plainness()
            })
            .collect();
        strongest.sort_by(f64::total_cmp);
        // From one in ten to one in a hundred of a Gumbel law: ln(-ln 0.9) - ln(-ln 0.99) = 2.35.
        let tail = strongest[990] - strongest[900];
        assert!((1.5..3.2).contains(&tail), "{tail}");
    }

    #[test]
    fn a_weak_tone_in_the_axes_of_one_part_is_the_most_that_they_share() {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(3);
        let spectrum = Spectrum::new(COUNT);
        // Twelve cycles and a half, which have a third of their energy in no bin.
        let mut powers = |amplitude: f64| {
            let tone = |row: usize| amplitude * (row as f64 * 12.5 * 2.0 * PI / COUNT as f64).sin();
            let mut sample =
                |row: usize| -> f64 { Distribution::<f64>::sample(&StandardNormal, &mut random) + tone(row) };
            spectrum.of(&(0..COUNT).map(&mut sample).collect::<Vec<f64>>()).powers()
        };
        let (alone, with) = ([(); 3].map(|()| powers(0.0)), [(); 3].map(|()| powers(0.2)));
        let strongest = |channels: &[Vec<f64>]| super::strongest(channels.iter());
        // The largest of 750 sums of three exponentials is 10 to 16.
        assert!(strongest(&alone) < 17.0, "{}", strongest(&alone));
        assert!(strongest(&with) > 20.0, "{}", strongest(&with));
        assert!(strongest(&with) > strongest(&with[..1]) + 5.0);
    }

    #[test]
    fn nothing_and_next_to_nothing_have_no_line() {
        for count in [0, 1, 5, 12, 13, 40] {
            let spectrum = Spectrum::new(count);
            assert_eq!(spectrum.of(&vec![0.0; count]).plainness(), 0.0, "{count}");
            assert_eq!(
                strongest([spectrum.of(&vec![0.0; count]).powers()].iter()),
                0.0,
                "{count}"
            );
            assert!(spectrum.of(&walk(3.0)[..count]).plainness().is_finite(), "{count}");
        }
    }
}
