//! The field of a plate, and the gate of the field.
//!
//! In: three axes of a magnetometer. Out: the state corrected by two components across the field, the one along its way in b with the
//! variance of the conversion's unknown age. A gate that stays shut is opened: about the spin, then about all axes.

use nalgebra::{Matrix3, Vector3};

use super::{
    GATE, Spin,
    covariance::{ATTITUDE, IRON, Row, SPIN},
    square,
};
use crate::{
    attitude::dcm_nb,
    calibration::{Measured, Set},
    sample::Kind,
};

/// \[s\] by how much the age of a magnetometer that was asked is not known: 3 % of the 6 ms it measures for, as the ADIS16265's
/// data sheet has its clock (that of the HMC5883L says nothing).
const FIELD_AGE_S: f32 = 0.000_2;
/// \[uT\] what is left of a magnetometer's own bias, beside its noise.
const FIELD_REST_UT: f32 = 0.12;
/// Packets whose field is refused before the angle about the spin is opened, and before all is.
const SHUT: [u8; 2] = [3, 10];

impl Spin {
    /// The field of a plate; whether it was taken, `None` if it was not read whole.
    pub(super) fn take_field(&mut self, set: &Set, measured: &Measured, plate: usize) -> Option<bool> {
        let first = plate.wrapping_mul(3);
        let present = measured.present.of(Kind::Magnetometer).wrapping_shr(first as u32) & 0b111;
        if present != 0b111 {
            return None;
        }
        let dcm = dcm_nb(&self.q_nb);
        let field_b = dcm.tr_mul(&self.surroundings.field_n_ut);
        let mut residual_b = Vector3::zeros();
        let mut noise: f32 = 0.0;
        for k in first..first + 3 {
            let axis = &set.mag[k];
            residual_b += axis.axis_b * (measured.mag[k] - axis.axis_b.dot(&(field_b + self.iron_b)));
            noise = noise.max(axis.noise);
        }
        let white = square(noise) + square(FIELD_REST_UT);
        // Along the way of the field in b an unknown age is as good as anything.
        let way_b = self.rate_b().cross(&field_b);
        let speed = way_b.norm();
        let along_b = if speed > 1.0 { way_b / speed } else { Vector3::x() };
        let other_b = if speed > 1.0 {
            let across_b = along_b.cross(&field_b);
            across_b / across_b.norm()
        } else {
            Vector3::y()
        };
        // The third axis lies along the field: it sees no attitude, but norm and scale, which would be taken for the angle between
        // nose and field. Where that is near a right one, a part of the norm in 300 is two degrees.
        let axes = [along_b, other_b];
        let aged = square(FIELD_AGE_S * speed);
        let (off_n, _) = self.surroundings.across_field();
        let sd = self.surroundings.field_sd;
        let mut all = true;
        for (axis_b, r) in axes.iter().zip([white + aged, white]) {
            // h . C_bn (m x a) = a . (C_nb h x m)
            let seen = (dcm * axis_b).cross(&self.surroundings.field_n_ut);
            // The field turned is the attitude turned back.
            let sees = off_n.map(|off_n| -sd * seen.dot(&off_n));
            let row: [(usize, f32); 6] = [
                (ATTITUDE, seen.x),
                (ATTITUDE + 1, seen.y),
                (ATTITUDE + 2, seen.z),
                (IRON, axis_b.x),
                (IRON + 1, axis_b.y),
                (IRON + 2, axis_b.z),
            ];
            let off = self
                .covariance
                .consider(row.as_slice() as Row, &sees, axis_b.dot(&residual_b), r, GATE);
            all &= off <= GATE;
        }
        Some(all)
    }

    /// A gate that stays shut opens the angle about the spin, and then all.
    pub(super) fn mind_the_gate(&mut self, [refused, taken]: [u8; 2]) {
        if refused == 0 && taken == 0 {
            return;
        }
        if taken >= refused {
            self.refused = 0;
            return;
        }
        self.refused = self.refused.saturating_add(1);
        let nose_n = dcm_nb(&self.q_nb).column(0).into_owned();
        let [roll, all] = SHUT;
        // The accelerometers have just said that the spin changed, and the field says that it did: two witnesses.
        let roll = if self.surprised_s > 0.0 { 1 } else { roll };
        if self.refused.is_multiple_of(roll) {
            self.covariance.open_attitude(&(nose_n * nose_n.transpose()));
            self.covariance.open(SPIN, 0.25);
        }
        if self.refused >= all {
            self.refused = 0;
            self.covariance
                .open_attitude(&Matrix3::from_diagonal_element(square(0.3)));
        }
    }
}
