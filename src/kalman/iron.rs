//! Hard iron that came with the unit after its calibration: a field fixed in b, learnt from motion.
//!
//! In: a window's sums of the field in n, of the field in b and of the attitude. Out: `iron_b`, by which the field is
//! corrected before it is compared. The field of the site is the same throughout a window, `m_n = F + R_k iron_b`, and
//! turns of the unit within it part the two: with `F` eliminated, a window of `N` samples tells
//!
//! `(N - (sum R)'(sum R)/N) iron_b = sum m_b - (sum R)'(sum m_n)/N`.
//!
//! The relative attitude within a window is the gyros' alone, so this needs no attitude and cannot drag one along.
//! Windows add up with weights: one whose field goes on moving after the correction (iron outside, a gradient crossed)
//! tells little.

use nalgebra::{Matrix3, Vector3};

use super::{Params, square, window::FieldSums};

/// What has been learnt.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HardIron {
    /// [uT] in b.
    pub iron_b: Vector3<f32>,
    information: Matrix3<f32>,
    weighted: Vector3<f32>,
}

impl HardIron {
    /// None yet.
    pub fn none() -> Self {
        HardIron {
            iron_b: Vector3::zeros(),
            information: Matrix3::zeros(),
            weighted: Vector3::zeros(),
        }
    }

    /// Learns from a window.
    pub(super) fn learn(&mut self, params: &Params, sums: &FieldSums) {
        if params.iron_sd_ut <= 0.0 || sums.count < 2.0 {
            return;
        }
        let unrest = sums.mean(&self.iron_b).spread;
        let variance = square(params.iron_noise_ut) + params.iron_per_spread * unrest;
        let weight = 1.0 / (variance * sums.count);
        let turned = sums.turned.transpose();
        let parted = Matrix3::from_diagonal_element(sums.count) - turned * sums.turned / sums.count;
        self.information += parted * weight;
        self.weighted += (sums.total_b - turned * sums.total_n / sums.count) * weight;
        let known = self.information + Matrix3::from_diagonal_element(1.0 / square(params.iron_sd_ut));
        if let Some(inverse) = known.try_inverse() {
            self.iron_b = inverse * self.weighted;
        }
    }

    pub(super) fn is_finite(&self) -> bool {
        self.iron_b
            .iter()
            .chain(self.information.iter())
            .chain(self.weighted.iter())
            .all(|part| part.is_finite())
    }
}
