//! The spin's filter over a reset: what is kept of it, and how it goes on after the time that was missed.
//!
//! In: the filter, each packet; after a reset the bytes kept and the [`Outage`]. Out: bytes; the filter as it was, carried over the
//! outage as from one measurement to the next, its derivatives walking meanwhile. Where the outage may have been longer or shorter
//! by `sd`, the angle about the spin is unknown by `w_x sd`, at most by half a turn, and the attitude across it by `|u| sd`. The axes
//! across the spin turn with that angle, so that the rate along them is unknown by as much of itself.
//!
//! Kept are the state, the covariance of the attitude, and of each other state its variance alone: 325 numbers are too many to be
//! written in each packet, and what the states have in common is soon found again.
//!
//! Refuses numbers that are none, an attitude that is none, and an outage of more than two seconds, of which nobody knows.

use core::f32::consts::PI;

use nalgebra::Matrix3;

use super::{
    Spin, Start,
    covariance::{ACROSS, ACROSS_UP, STATES},
    square,
};
use crate::{
    attitude::{dcm_nb, renormalised},
    calibration::Set,
    geometry::{PLATES, TRIAD_AXES},
    kalman::Outage,
};

/// Numbers of the state: quaternion, seven that are one each, two components across twice, three of each gyro, iron, and the force at
/// rest of each axis.
const STATE_NUMBERS: usize = 4 + 7 + 2 * 2 + 3 * PLATES + 3 + TRIAD_AXES;
/// Numbers of the covariance: of the attitude, and a variance of every other state.
const COVARIANCE_NUMBERS: usize = 6 + STATES - 3;
/// Bytes that are kept.
pub const KEPT_BYTES: usize = 4 * (STATE_NUMBERS + COVARIANCE_NUMBERS);

/// \[s\] no outage that anybody knows of is longer.
const LONGEST_S: f32 = 2.0;

impl Spin {
    /// \[us\] instant of the state.
    pub fn at_us(&self) -> u64 {
        self.at_us
    }

    /// Keeps it.
    pub fn keep(&mut self, bytes: &mut [u8; KEPT_BYTES]) {
        let mut numbers = bytes.as_chunks_mut::<4>().0.iter_mut();
        self.each(&mut |number| {
            if let Some(bytes) = numbers.next() {
                *bytes = number.to_le_bytes();
            }
        });
    }

    /// Goes on from what was kept, at the start of the new clock. `start` has what does not change in the spin.
    #[inline(never)]
    pub fn resumed(bytes: &[u8; KEPT_BYTES], outage: Outage, start: &Start, set: &Set) -> Option<Self> {
        let mut spin = Spin::begin(start, set);
        let mut numbers = bytes.as_chunks::<4>().0.iter();
        spin.each(&mut |number| {
            if let Some(bytes) = numbers.next() {
                *number = f32::from_le_bytes(*bytes);
            }
        });
        let norm = spin.q_nb.as_vector().norm_squared();
        let is_sound = norm > 0.9 && norm < 1.1 && spin.is_finite() && spin.covariance.keep_sound();
        if !(is_sound && outage.lasted_s < LONGEST_S) {
            return None;
        }
        spin.q_nb = renormalised(spin.q_nb);
        spin.consider_the_field();
        spin.at_us = outage.ended_us.wrapping_sub((outage.lasted_s * 1e6) as u64);
        spin.carry(outage.ended_us);
        spin.slice_us = outage.ended_us;
        let nose_n = dcm_nb(&spin.q_nb).column(0).into_owned();
        let along = nose_n * nose_n.transpose();
        let [about, across] = [spin.spin * spin.spin, spin.across.iter().map(|rate| rate * rate).sum()];
        let unknown = |squared_rate: f32| (squared_rate * square(outage.sd_s)).min(PI * PI);
        let turned = unknown(about).min(1.0);
        for axis in 0..2 {
            let of = |of: [f32; 2]| (of[0] * of[0] + of[1] * of[1]) * turned;
            spin.covariance.open(ACROSS + axis, of(spin.across));
            spin.covariance.open(ACROSS_UP + axis, of(spin.across_up));
        }
        spin.covariance
            .open_attitude(&(along * unknown(about) + (Matrix3::identity() - along) * unknown(across)));
        Some(spin)
    }

    /// What is kept, and in which order.
    fn each(&mut self, visit: &mut dyn FnMut(&mut f32)) {
        self.q_nb.as_mut_unchecked().coords.iter_mut().for_each(&mut *visit);
        let alone = [
            &mut self.spin,
            &mut self.spin_up,
            &mut self.phase,
            &mut self.lever,
            &mut self.rough,
            &mut self.usual,
            &mut self.pad_force,
        ];
        alone.into_iter().for_each(&mut *visit);
        self.across.iter_mut().for_each(&mut *visit);
        self.across_up.iter_mut().for_each(&mut *visit);
        for of_gyros in [&mut self.bias, &mut self.sees_spin, &mut self.by_load] {
            of_gyros.iter_mut().for_each(&mut *visit);
        }
        self.iron_b.iter_mut().for_each(&mut *visit);
        self.force_rest.iter_mut().for_each(&mut *visit);
        self.covariance.each_kept(visit);
    }
}
