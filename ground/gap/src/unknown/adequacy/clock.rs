//! The clock of a part that converts by its own: how much older or younger than described its readings are.
//!
//! In: the instants of the samples and what a second of age adds to each. Out: how much of an even scatter of ages a channel
//! shows, and the same drawn for a simulated log, a saw-tooth over samples.

use nalgebra::DVector;
use rand_distr::{Distribution, Uniform};
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::null::interval::phase;

/// Part by which a clock inside a part may be off: an RC oscillator's few percent.
const OFF: f64 = 0.05;

/// Beats a sample between the two clocks below which the age drifts and does not scatter: that is the calibration's, whose
/// instant is open and may drift.
const SLOWEST: f64 = 0.1;

/// Draws after which any beat will do: a clock and a sampling that are as slow as each other have no other.
const TRIES: usize = 20;

/// Squares to which one of a sample is cut, in units of what is expected.
const FARTHEST: f64 = 16.0;

/// Variance of two ages that are a whole period apart, over that of ages evenly between them.
const AT_ONCE: f64 = 3.0;

/// Variance of a square of noise.
const OF_SQUARE: f64 = 2.0;

/// Variance of the part of its clock's scatter that a channel has, before anything is known of it: of a clock that may keep step,
/// and of one that cannot, which scatters evenly if it is as described.
const OF_PART_SHOWN: f64 = 1.0;
const OF_CLOCK: f64 = 0.05;

/// When a part converts by its own clock.
#[derive(Clone, Debug)]
pub struct Clock {
    /// \[s\] between conversions.
    pub period_s: f64,
    /// \[s\] instant of each sample.
    pub instants_s: Vec<f64>,
    /// What a second of age adds to each sample, in units of noise.
    pub slopes: Vec<f64>,
}

impl Clock {
    /// A clock that scatters a channel as much as what is `left` of it shows.
    pub fn as_shown(mut self, left: impl Iterator<Item = f64>) -> Self {
        let part = self.part_shown(left);
        self.slopes.iter_mut().for_each(|slope| *slope *= part.sqrt());
        self
    }

    /// Variance of a reading's age over that of one spread evenly over a period, by what is `left` of a channel: a clock that
    /// keeps step with the cycle scatters nothing, or, where it converts just when it is read, by a whole period. By least
    /// squares of the squares, each with the weight that its own scatter leaves it, and evenly where they tell little: what is a
    /// tenth of a thermometer's noise its squares do not show, and it is one line of its spectrum.
    pub fn part_shown(&self, left: impl Iterator<Item = f64>) -> f64 {
        let (mut along, mut energy) = (0.0, 0.0);
        for (slope, left) in self.slopes.iter().zip(left).filter(|(_, left)| left.is_finite()) {
            let even = (slope * self.period_s).powi(2) / 12.0;
            let weight = (1.0 + even).powi(-2);
            // One outlier is no scatter.
            let square = left.powi(2).min(FARTHEST * (1.0 + even));
            along += weight * even * (square - 1.0);
            energy += weight * even * even;
        }
        let open = if self.may_keep_step() { OF_PART_SHOWN } else { OF_CLOCK };
        let told = open / OF_SQUARE;
        ((1.0 + told * along) / (1.0 + told * energy)).clamp(0.0, AT_ONCE)
    }

    /// Whether it may convert a whole number of times a sample.
    fn may_keep_step(&self) -> bool {
        let beats = |rate: f64| (rate * self.step_s() / self.period_s).floor();
        beats(1.0 + OFF) > beats(1.0 - OFF)
    }

    /// \[s\] between samples.
    fn step_s(&self) -> f64 {
        self.instants_s.get(1).map_or(0.0, |second| second - self.instants_s[0])
    }

    /// Adds what a clock of unknown phase and rate makes of a channel. The mean age is the calibration's.
    pub fn age(&self, residual: &mut DVector<f64>, random: &mut Xoshiro256PlusPlus) {
        let mut between = |low: f64, high: f64| Uniform::new(low, high).map_or(low, |law| law.sample(&mut *random));
        let step_s = self.step_s();
        let begun = between(0.0, 1.0);
        let mut period_s = self.period_s;
        for _ in 0..TRIES {
            period_s = self.period_s * (1.0 + between(-OFF, OFF));
            let beat = (step_s / period_s).fract();
            if (SLOWEST..1.0 - SLOWEST).contains(&beat) {
                break;
            }
        }
        let ages_s: Vec<f64> = (self.instants_s.iter())
            .map(|t_s| phase(t_s / period_s + begun) * period_s)
            .collect();
        let mean_s = ages_s.iter().sum::<f64>() / ages_s.len().max(1) as f64;
        for ((residual, age_s), slope) in residual.iter_mut().zip(ages_s).zip(&self.slopes) {
            *residual += slope * (age_s - mean_s);
        }
    }
}

#[cfg(test)]
mod tests {
    use rand_distr::StandardNormal;
    use rand_xoshiro::rand_core::SeedableRng;

    use super::*;

    const SAMPLES: usize = 1500;

    /// How much of its clock's scatter a channel is taken to have that has so much of it.
    fn shown(part: f64) -> f64 {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(11);
        let clock = Clock {
            period_s: 0.02,
            instants_s: (0..SAMPLES).map(|row| row as f64 * 0.2).collect(),
            slopes: (0..SAMPLES).map(|row| 200.0 * (row as f64 * 0.05).cos()).collect(),
        };
        let mut left = DVector::zeros(SAMPLES);
        clock.age(&mut left, &mut random);
        left *= part.sqrt();
        left.apply(|value| *value += Distribution::<f64>::sample(&StandardNormal, &mut random));
        let shown = clock.clone().as_shown(left.iter().copied());
        (shown.slopes[0] / clock.slopes[0]).powi(2)
    }

    #[test]
    fn a_clock_that_cannot_keep_step_is_spread_evenly_unless_much_says_otherwise() {
        let shown = |period_s: f64, slope: f64| {
            let clock = Clock {
                period_s,
                instants_s: (0..SAMPLES).map(|row| row as f64 * 0.2).collect(),
                slopes: vec![slope / period_s; SAMPLES],
            };
            clock.part_shown((0..SAMPLES).map(|_| 1.0))
        };
        assert!(shown(0.25, 1.0) > 0.8, "{}", shown(0.25, 1.0));
        assert!(shown(0.02, 1.0) < 0.2, "{}", shown(0.02, 1.0));
        // Twice the noise, and none of it there: no such clock.
        assert!(shown(0.25, 5.0) < 0.2, "{}", shown(0.25, 5.0));
    }

    #[test]
    fn a_clock_scatters_as_much_as_its_channel_shows() {
        // The squares of 1500 samples tell the part to a tenth.
        for part in [0.0, 0.5, 1.0, AT_ONCE] {
            let shown = shown(part);
            assert!((shown - part).abs() < 0.3, "{part} {shown}");
        }
    }
}
