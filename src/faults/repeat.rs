//! Sensors that repeat themselves: frozen registers, a bus that hands out the last answer.
//!
//! In: each sensor's counts. Out: whether it has repeated more often than its noise would let it. With noise of `s` counts
//! an axis repeats its code with a chance of at most `p = sum P(code)^2`, codes centred on the true value, and a sensor of
//! three axes with `p^3`. It is frozen after `n` repeats, `p^(3n) < `[`CHANCE`]: 5 at 3 mg a count and 4.6 mg of noise,
//! some twenty at 12 mg. A value that was not read neither repeats nor changes.
//!
//! Rounding alone has a standard deviation of [`ROUNDING`] and changes no code. An axis whose set has no more noise than that, as of a
//! plant without noise, may repeat itself for ever.
//!
//! Holds for sensors that convert anew between two reads: a unit that reads faster than its parts convert would see
//! repeats that are none.

use nalgebra::ComplexField;

use crate::sample::NOT_READ;

/// Chance of so many repeats in a row of a healthy sensor.
const CHANCE: f32 = 1e-9;
/// \[counts\] standard deviation of rounding: the root of 1/12, rounded up, because a set's numbers are rounded too.
const ROUNDING: f32 = 0.2887;

/// How often one sensor has repeated itself.
#[derive(Clone, Copy, Debug)]
pub(super) struct Repeats<const N: usize> {
    last: [i16; N],
    seen: u16,
    /// Repeats; `None` for a sensor that may repeat itself for ever.
    frozen_at: Option<u16>,
}

impl<const N: usize> Repeats<N> {
    /// A sensor whose axes have noise of these many counts.
    pub(super) fn new(noise_counts: [f32; N]) -> Self {
        let noisy = noise_counts.into_iter().filter(|sigma| *sigma > ROUNDING);
        let chance = noisy.fold(1.0, |chance, sigma| chance * repeat(sigma));
        let repeats = || ComplexField::ceil((ComplexField::ln(CHANCE) / ComplexField::ln(chance)).max(2.0)) as u16;
        Repeats {
            // What no part says, so that the first counts repeat nothing.
            last: [NOT_READ; N],
            seen: 0,
            frozen_at: (chance < 1.0).then(repeats),
        }
    }

    /// Takes a cycle's counts, `None` if not read; whether it is frozen.
    pub(super) fn frozen(&mut self, counts: Option<&[i16; N]>) -> bool {
        if let Some(counts) = counts {
            if self.last == *counts {
                self.seen = self.seen.saturating_add(1);
            } else {
                (self.last, self.seen) = (*counts, 0);
            }
        }
        self.frozen_at.is_some_and(|frozen_at| self.seen >= frozen_at)
    }
}

/// Chance that a code repeats with normal noise of `sigma` counts about the middle of a code.
fn repeat(sigma: f32) -> f32 {
    let within = |counts: f32| error_function(counts / (sigma * core::f32::consts::SQRT_2));
    let mut chance = within(0.5) * within(0.5);
    // Codes beyond five on each side hold little as soon as they matter: by then the density's integral is exact.
    for code in 1..=5 {
        let tail = (within(code as f32 + 0.5) - within(code as f32 - 0.5)) / 2.0;
        chance += 2.0 * tail * tail;
    }
    // 1 / (2 sqrt(pi) sigma).
    let smooth = 0.282_094_8 / sigma;
    if sigma > 2.0 { smooth } else { chance }
}

/// Abramowitz and Stegun, 7.1.26, for positive arguments: within 1.5e-7.
fn error_function(x: f32) -> f32 {
    let t = 1.0 / (1.0 + 0.327_591_1 * x);
    let series = [1.061_405_4, -1.453_152, 1.421_413_7, -0.284_496_74, 0.254_829_6];
    let polynomial = series.into_iter().fold(0.0, |sum, coefficient| sum * t + coefficient) * t;
    1.0 - polynomial * ComplexField::exp(-x * x)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chances_are_those_of_the_normal_distribution() {
        // Summed in f64 over all codes.
        for (sigma, expected) in [
            (0.2, 0.975_4),
            (0.38, 0.676_6),
            (1.0, 0.270_9),
            (1.53, 0.181_2),
            (2.7, 0.103_9),
            (10.0, 0.028_2),
        ] {
            assert!((repeat(sigma) - expected).abs() < 2e-3, "{sigma}: {}", repeat(sigma));
        }
    }

    #[test]
    fn it_takes_five_repeats_at_3_mg_and_some_twenty_at_12() {
        assert_eq!(Repeats::new([1.53; 3]).frozen_at, Some(5));
        assert_eq!(Repeats::new([0.38; 3]).frozen_at, Some(18));
        assert_eq!(Repeats::new([0.3; 3]).frozen_at, Some(36));
        assert_eq!(Repeats::new([2.68]).frozen_at, Some(10));
    }

    #[test]
    fn what_has_no_noise_but_rounding_may_repeat_itself_for_ever() {
        for noise_counts in [12.0_f32.sqrt().recip(), 1e-3] {
            let mut repeats = Repeats::new([noise_counts; 3]);
            assert!(
                (0..2 * u32::from(u16::MAX)).all(|_| !repeats.frozen(Some(&[1, 2, 3]))),
                "{noise_counts}"
            );
        }
        // One axis that has noise tells of all three.
        assert_eq!(Repeats::new([1e-3, 1e-3, 1.53]).frozen_at, Some(13));
    }

    #[test]
    fn a_frozen_sensor_is_found_and_one_that_moves_again_let_go() {
        let mut repeats = Repeats::new([1.53; 3]);
        let frozen: [bool; 8] = core::array::from_fn(|_| repeats.frozen(Some(&[1, 2, 3])));
        assert_eq!(frozen, [false, false, false, false, false, true, true, true]);
        assert!(repeats.frozen(None));
        assert!(!repeats.frozen(Some(&[1, 2, 4])));
    }
}
