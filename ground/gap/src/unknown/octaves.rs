//! Energy by octave of frequency, with nothing lost between them.
//!
//! In: a series in the order of its rows. Out: the energy of each octave, from half the sampling rate downwards, and of all
//! that is below the last; and what of it is above noise ([`excess`]). The octaves are those of the orthonormal Haar wavelet
//! (Percival and Walden, "Wavelet methods for time series analysis", 2000, chapter 4), whose energies add up to that of the series exactly; they overlap in frequency
//! like a filter of two taps, so a tone also shows in the neighbours of its octave.
//!
//! A hole in the series is passed over: its neighbours are taken as consecutive.

use core::fmt;

/// Octaves at most: 2.5 Hz to 0.01 Hz for packets.
const DEEPEST: usize = 8;

/// What a series in units of noise has above noise.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Excess {
    /// Squares of noise, of the octaves that have more than chance leaves.
    pub energy: f64,
    /// Their standard deviation.
    pub error: f64,
    /// ln of the odds of louder octaves against the floor.
    pub log_bayes_factor: f64,
}

/// Of a series whose samples have `floor` squares of noise and of what else is to be expected; `tails` is the excess kurtosis of noise.
///
/// An octave of `n` numbers and energy `E` is likelier by `n (s - 1 - ln s) / 2`, `s = E / (n floor)`, if it is as loud as it is, at the
/// price of a parameter, `ln n / 2` (Schwarz 1978); heavy tails make an energy vary more, `n (2 + tails)`. Each octave is as likely as the
/// others. What is expected beside noise may all be in one octave (the beat of a clock is), so all of it is taken off the energy.
pub fn excess(series: &[f64], floor: f64, tails: f64) -> Excess {
    let spare = (floor - 1.0).max(0.0) * series.len() as f64;
    let counts = counts(series.len());
    let (mut energy, mut variance, mut odds) = (0.0, 0.0, 0.0);
    for (own, count) in energies(series).into_iter().zip(&counts) {
        let many = own / (count * floor.max(1.0));
        if *count < 1.0 || many <= 1.0 {
            continue;
        }
        let louder = count * (many - 1.0 - many.ln()) / (2.0 + tails) - 0.5 * count.ln();
        odds += louder.min(f64::MAX.ln() / 2.0).exp() / counts.len() as f64;
        if louder > 0.0 {
            energy += own - count;
            variance += own * own * (2.0 + tails) / count;
        }
    }
    Excess {
        energy: (energy - spare).max(0.0),
        error: variance.sqrt(),
        log_bayes_factor: odds.max(f64::MIN_POSITIVE).ln(),
    }
}

/// How many numbers each of the [`energies`] of so long a series is the sum of.
fn counts(length: usize) -> Vec<f64> {
    let (mut counts, mut smooth) = (Vec::new(), length);
    while counts.len() < DEEPEST && smooth >= 4 {
        smooth /= 2;
        counts.push(smooth as f64);
    }
    let above: f64 = counts.iter().sum();
    counts.push(length as f64 - above);
    counts
}

/// Energies of the octaves, highest frequency first, then of what is below them; fewer for a short series.
pub fn energies(series: &[f64]) -> Vec<f64> {
    let mut energies = Vec::new();
    let mut smooth = series.to_vec();
    let mut lone = 0.0;
    while energies.len() < DEEPEST && smooth.len() >= 4 {
        let pairs = smooth.chunks_exact(2);
        // The last of an odd number goes with the slowest.
        lone += pairs.remainder().iter().map(|value| value * value).sum::<f64>();
        energies.push(pairs.clone().map(|pair| (pair[0] - pair[1]).powi(2) / 2.0).sum());
        smooth = pairs.map(|pair| (pair[0] + pair[1]) / 2f64.sqrt()).collect();
    }
    energies.push(lone + smooth.iter().map(|value| value * value).sum::<f64>());
    energies
}

/// A name for one of them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Octave {
    from_hz: f64,
    to_hz: f64,
}

impl Octave {
    /// Number `octave` of `count` for a series sampled every `step_s`.
    pub fn new(octave: usize, count: usize, step_s: f64) -> Self {
        let to_hz = 0.5 / step_s / f64::powi(2.0, octave as i32);
        Octave {
            from_hz: if octave + 1 == count { 0.0 } else { to_hz / 2.0 },
            to_hz,
        }
    }
}

impl fmt::Display for Octave {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.from_hz > 0.0 {
            write!(f, "{:.3} to {:.3} Hz", self.from_hz, self.to_hz)
        } else {
            write!(f, "below {:.3} Hz", self.to_hz)
        }
    }
}

#[cfg(test)]
mod tests {
    use rand_distr::{Distribution, StandardNormal};
    use rand_xoshiro::{Xoshiro256PlusPlus, rand_core::SeedableRng};

    use super::*;

    #[test]
    fn the_octaves_hold_the_whole_energy() {
        let series: Vec<f64> = (0..1501)
            .map(|k| (f64::from(k) * 0.7).sin() + 0.1 * f64::from(k % 7))
            .collect();
        let whole: f64 = series.iter().map(|value| value * value).sum();
        // Rounding of some thousand sums.
        assert!((energies(&series).iter().sum::<f64>() - whole).abs() < 1e-9 * whole);
    }

    #[test]
    fn a_fast_change_is_in_the_first_octave_and_a_constant_below_the_last() {
        let fast: Vec<f64> = (0..1024).map(|k| if k % 2 == 0 { 1.0 } else { -1.0 }).collect();
        assert_eq!(energies(&fast)[0], 1024.0);
        let slow = energies(&vec![1.0; 1024]);
        assert!((slow[DEEPEST] - 1024.0).abs() < 1e-9);
    }

    #[test]
    fn octaves_are_named_by_their_frequencies() {
        assert_eq!(Octave::new(0, 9, 0.2).to_string(), "1.250 to 2.500 Hz");
        assert_eq!(Octave::new(8, 9, 0.2).to_string(), "below 0.010 Hz");
    }

    #[test]
    fn a_short_series_is_all_below() {
        assert_eq!(energies(&[1.0, 2.0]), [5.0]);
        assert_eq!(counts(2), [2.0]);
    }

    /// White noise of unit variance and a sine of this amplitude.
    fn noise_and(amplitude: f64, seed: u64) -> Vec<f64> {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
        let noise = |random: &mut Xoshiro256PlusPlus| -> f64 { StandardNormal.sample(random) };
        (0..1500)
            .map(|k| noise(&mut random) + amplitude * (f64::from(k) * 0.1).sin())
            .collect()
    }

    #[test]
    fn a_slow_tone_stands_out_of_its_octave_and_noise_out_of_none() {
        let tone = excess(&noise_and(0.5, 1), 1.0, 1.0);
        // The wave's energy is 1500 x 0.5^2 / 2 = 188, in two octaves or three.
        assert!(tone.log_bayes_factor > 10.0, "{tone:?}");
        assert!((tone.energy - 188.0).abs() < 3.0 * tone.error, "{tone:?}");
        let found = (0..100).filter(|seed| excess(&noise_and(0.0, *seed), 1.0, 1.0).log_bayes_factor > 3.0);
        assert!(found.count() <= 5);
    }

    #[test]
    fn what_is_expected_anywhere_is_no_excess() {
        let tone = excess(&noise_and(0.5, 1), 1.0 + 0.5f64.powi(2), 1.0);
        assert_eq!(tone.energy, 0.0);
    }
}
