//! The filter over a reset: what is kept of it, and how it goes on after the time it missed.
//!
//! In: the filter, each packet; after a reset the bytes kept and the [`Outage`]. Out: bytes; the filter as it was, its
//! covariance grown. All that is kept is named in two lists, [`Filter::each_of_the_state`] and the covariance's, which both
//! ways go through: a state that is added there is kept.
//!
//! **What was missed.** Between the two rates known, at the end of what was kept and at the first step after, the unit is taken to
//! have turned at their mean `w`. The rotation `w T` may be off by half their difference for all of `T`, by [`SWING`] of the faster
//! one (a nutation that both ends miss), and by the faster one for as long as `T` itself is not known:
//! `sd = T (|w1 - w0| / 2 + SWING max(|w0|, |w1|)) + sd_T max(|w0|, |w1|)`. With the noise of the gyros over `T` and over the
//! two windows that the kept covariance may be late, and the bias' own variance times `T^2`, its square is added to each axis. A gyro at the
//! end of its range says nothing of the rate: [`super::Params::saturated_rate_sd`] over `T` is added then.
//!
//! Refuses numbers that are none, and an outage after which the attitude is no longer known to [`super::Params::lost_sd`]: then the
//! filter finds its attitude afresh.

use nalgebra::{Matrix3, UnitQuaternion, Vector3};

use super::{Filter, passage::walks, seconds, square, step::Step};
use crate::attitude::{from_rotation_vector, renormalised};

/// \[1\] part of a rate that may have come and gone between two looks at it: a nutation cone of 6 deg.
const SWING: f32 = 0.1;

/// Numbers of the state: quaternion, bias, gyro matrix, rate, field, iron.
const STATE_NUMBERS: usize = 4 + 3 + 9 + 3 + 17 + 12;
/// Numbers of the covariance: attitude, attitude with its drivers, drivers.
const COVARIANCE_NUMBERS: usize = 6 + 3 * 12 + 12 * 13 / 2;
/// Bytes that are kept: the time of the state \[us\], then its numbers.
pub const KEPT_BYTES: usize = 8 + 4 * (STATE_NUMBERS + COVARIANCE_NUMBERS);

/// What a reset missed.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Outage {
    /// \[s\] from the time of what was kept to its end, which is the start of a new clock after a reset.
    pub lasted_s: f32,
    /// \[s\] standard deviation of that.
    pub sd_s: f32,
    /// \[us\] when it ended, in the clock of what comes after it: 0 for a clock that starts then.
    pub ended_us: u64,
}

/// How an attitude goes on once the gyros are heard.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Going {
    /// At once, with all that was kept.
    On(Outage),
    /// From an attitude with this covariance \[rad^2\] in n, unless the first window finds a better one.
    Unless(Outage, Matrix3<f32>),
}

impl Filter {
    /// Keeps the state, and the covariance unless the work on it is half done: then the one kept before stands. `false`
    /// where there is no attitude to keep.
    pub fn keep(&mut self, bytes: &mut [u8; KEPT_BYTES]) -> bool {
        let Some(last_us) = self.last_us.filter(|_| self.aligned) else {
            return false;
        };
        let (time, numbers) = bytes.split_at_mut(8);
        time.copy_from_slice(&last_us.to_le_bytes());
        let (state, covariance) = numbers.split_at_mut(4 * STATE_NUMBERS);
        let mut state = state.as_chunks_mut::<4>().0.iter_mut();
        self.each_of_the_state(&mut |number| {
            if let Some(bytes) = state.next() {
                *bytes = number.to_le_bytes();
            }
        });
        if !self.pending.is_half_done() {
            let mut covariance = covariance.as_chunks_mut::<4>().0.iter_mut();
            self.covariance.each_kept(&mut |number| {
                if let Some(bytes) = covariance.next() {
                    *bytes = number.to_le_bytes();
                }
            });
        }
        true
    }

    /// \[us\] when the state was kept, in its own clock.
    pub fn kept_at_us(bytes: &[u8; KEPT_BYTES]) -> u64 {
        u64::from_le_bytes(core::array::from_fn(|k| bytes[k]))
    }

    /// Goes on from what was kept once the gyros are heard. The filter is one that knows nothing yet.
    pub fn resume(&mut self, bytes: &[u8; KEPT_BYTES], outage: Outage) {
        let mut numbers = bytes[8..].as_chunks::<4>().0.iter();
        let mut next = |number: &mut f32| {
            if let Some(bytes) = numbers.next() {
                *number = f32::from_le_bytes(*bytes);
            }
        };
        self.each_of_the_state(&mut next);
        self.covariance.each_kept(&mut next);
        self.iron.go_on();
        // A checksum has seen the bytes; a norm of zero, or none, is what would do harm all the same.
        let norm = self.q_nb.as_vector().norm_squared();
        let is_sound =
            norm > 0.9 && norm < 1.1 && self.is_finite() && self.covariance.is_finite() && self.iron.is_finite();
        if !is_sound {
            return self.begin_anew();
        }
        self.q_nb = renormalised(self.q_nb);
        self.going = Some(Going::On(outage));
    }

    /// Goes on from an attitude with covariance \[rad^2\] in n and a bias with deviations \[rad/s\] in b, unless the first window
    /// finds a better one. The filter is one that knows nothing yet.
    pub fn resume_near(
        &mut self,
        q_nb: UnitQuaternion<f32>,
        covariance_n: Matrix3<f32>,
        (bias_b, bias_sd): (Vector3<f32>, [f32; 3]),
        outage: Outage,
    ) {
        self.q_nb = q_nb;
        self.bias_b = bias_b;
        self.covariance.know_bias(&bias_sd);
        self.going = Some(Going::Unless(outage, covariance_n));
        if !self.is_finite() || !self.covariance.is_finite() {
            self.begin_anew();
        }
    }

    /// Before the first step in which the gyros were heard: the attitude carried over the outage.
    pub(super) fn bridge(&mut self, step: &Step) {
        let Some(going) = self.going.take() else { return };
        let covered_us = (step.covered_s * 1e6) as u64;
        let from_us = step.at_us.saturating_sub(covered_us);
        self.last_us = Some(from_us);
        let rate_b = step.rate_b - self.gyro_matrix * step.rate_b - self.bias_b;
        let (outage, before_b) = match going {
            Going::On(outage) => (outage, self.rate_b),
            Going::Unless(outage, _) => (outage, rate_b),
        };
        let params = &self.params;
        let missed_s = outage.lasted_s + seconds(from_us.saturating_sub(outage.ended_us));
        let fastest = if before_b.norm() > rate_b.norm() {
            before_b.norm()
        } else {
            rate_b.norm()
        };
        let missed_sd = missed_s * ((rate_b - before_b).norm() / 2.0 + SWING * fastest) + outage.sd_s * fastest;
        let mut variance = square(missed_sd)
            + square(params.angle_noise) * (missed_s + 2.0 * params.window_s)
            + self.covariance.bias().diagonal().max() * square(missed_s);
        if step.saturated {
            variance += square(params.saturated_rate_sd * missed_s);
        }
        let turned_n = from_rotation_vector(-params.earth_rate_n * missed_s);
        let turned_b = from_rotation_vector((before_b + rate_b) * (missed_s / 2.0));
        match going {
            Going::On(_) => {
                let walks = walks(params, missed_s);
                self.covariance.go_on(params.velocity_sd, variance);
                self.covariance.drift(&walks);
                self.aligned = self.covariance.worst() < square(params.lost_sd);
                if !self.aligned {
                    return self.begin_anew();
                }
                self.settlements = self.settlements.wrapping_add(1);
            }
            Going::Unless(_, covariance_n) => {
                let grown = covariance_n + Matrix3::from_diagonal_element(variance);
                self.known_before = (grown.diagonal().max() < square(params.lost_sd)).then_some(grown);
            }
        }
        self.q_nb = renormalised(turned_n * self.q_nb * turned_b);
    }

    /// After a first window that found no attitude: the one known before it, if there is one.
    pub(super) fn fall_back(&mut self) -> bool {
        let Some(covariance_n) = self.known_before.take() else {
            return false;
        };
        let turned = self.measured.means.angle_variance;
        self.covariance
            .align(&(covariance_n + Matrix3::from_diagonal_element(turned)));
        self.covariance.forget_velocity(self.params.velocity_sd);
        self.aligned = true;
        true
    }

    /// What is kept beside the covariance, and in which order.
    fn each_of_the_state(&mut self, visit: &mut dyn FnMut(&mut f32)) {
        self.q_nb.as_mut_unchecked().coords.iter_mut().for_each(&mut *visit);
        self.bias_b.iter_mut().for_each(&mut *visit);
        self.gyro_matrix.iter_mut().for_each(&mut *visit);
        self.rate_b.iter_mut().for_each(&mut *visit);
        self.reference.each(visit);
        self.iron.each(visit);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kalman::Params;

    #[test]
    fn the_lists_are_as_long_as_they_say() {
        let mut filter = Filter::new(Params::ROOM);
        let (mut state, mut covariance) = (0, 0);
        filter.each_of_the_state(&mut |_| state += 1);
        filter.covariance.each_kept(&mut |_| covariance += 1);
        assert_eq!((state, covariance), (STATE_NUMBERS, COVARIANCE_NUMBERS));
    }
}
