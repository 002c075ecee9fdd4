//! Hard iron that came with the unit after its calibration: a field fixed in b, learnt from motion.
//!
//! In: a window's sums of the field in n, of the field in b and of the attitude. Out: `iron_b`, by which the field of later
//! windows is corrected before it is compared. The field of the site is the same throughout a window, `m_n = F + R_k iron_b`, and
//! turns of the unit within it part the two: with `F` eliminated, a window of `N` samples tells
//!
//! `(1 - (sum R)'(sum R)/N^2) iron_b = (sum m_b - (sum R)'(sum m_n)/N)/N`.
//!
//! The relative attitude within a window is the gyros' alone, so this needs no attitude and cannot drag one along.
//! Windows add up with weights: one whose field goes on moving after the correction (iron outside, a gradient crossed)
//! tells little.
//!
//! **Iron that comes or goes** (a magnet stuck to the unit, a battery changed) would be outside to that sum for ever. So the
//! same equations are also kept for the latest windows alone, and where another iron makes the field stand still that the
//! present one leaves moving, it takes its place with its own covariance. A window that no one iron explains together with
//! those before it (a magnet on its way) begins them afresh.

use nalgebra::{Matrix3, Vector3};

use super::{Params, at_least, field_sums::FieldSums, square, state::are_finite};

/// The latest windows are explained by one iron while the field moves by less than so many times what else moves it (as
/// variances).
const EXPLAINED: f32 = 4.0;

/// Another iron must leave the field so many times quieter than the present one does.
const QUIETER: f32 = 2.0;

/// What has been learnt.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HardIron {
    /// \[uT\] in b.
    pub iron_b: Vector3<f32>,
    /// [uT^2] its covariance.
    pub covariance: Matrix3<f32>,
    information: Matrix3<f32>,
    weighted: Vector3<f32>,
    recent: Equations,
}

/// Windows added up, each by the number of its samples.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Equations {
    windows: f32,
    /// \[1\] left side.
    parted: Matrix3<f32>,
    /// \[uT\] right side.
    seen: Vector3<f32>,
    /// [uT^2] mean square distance of the field in n from its mean.
    squares: f32,
}

impl Equations {
    fn of(sums: &FieldSums) -> Equations {
        let turned = sums.turned.transpose() / sums.count;
        Equations {
            windows: 1.0,
            parted: Matrix3::identity() - turned * sums.turned / sums.count,
            seen: (sums.total_b - turned * sums.total_n) / sums.count,
            squares: sums.mean(&Vector3::zeros()).spread,
        }
    }

    fn after(&self, before: &Equations, kept: f32) -> Equations {
        Equations {
            windows: self.windows + before.windows * kept,
            parted: self.parted + before.parted * kept,
            seen: self.seen + before.seen * kept,
            squares: self.squares + before.squares * kept,
        }
    }

    /// [uT^2] how far the field goes on moving within a window with `iron_b` taken off.
    fn unrest(&self, iron_b: &Vector3<f32>) -> f32 {
        let squares = self.squares - 2.0 * iron_b.dot(&self.seen) + iron_b.dot(&(self.parted * iron_b));
        at_least(0.0, squares / self.windows)
    }
}

impl HardIron {
    /// None yet.
    pub fn none(params: &Params) -> Self {
        let variance = square(params.iron_sd_ut);
        let information = if variance > 0.0 { 1.0 / variance } else { 0.0 };
        HardIron {
            iron_b: Vector3::zeros(),
            covariance: Matrix3::from_diagonal_element(variance),
            information: Matrix3::from_diagonal_element(information),
            weighted: Vector3::zeros(),
            recent: Equations::default(),
        }
    }

    /// Another filter has found it, with this covariance.
    pub(super) fn take_over(&mut self, iron_b: Vector3<f32>, covariance: &Matrix3<f32>) {
        // Of an iron that is not looked for, or a covariance that is none, nothing is taken.
        if let Some(information) = covariance.try_inverse().filter(|_| self.information.trace() > 0.0) {
            self.weighted = information * iron_b;
            self.information = information;
            self.recent = Equations::default();
            self.solve();
        }
    }

    /// Learns from a window. Whether the iron turned out to be another.
    pub(super) fn learn(&mut self, params: &Params, duration_s: f32, sums: &FieldSums) -> bool {
        if params.iron_sd_ut <= 0.0 || sums.count < 2.0 {
            return false;
        }
        let noise = square(params.iron_noise_ut);
        let window = Equations::of(sums);
        let kept = at_least(0.0, 1.0 - duration_s / params.iron_change_s);
        let recent = window.after(&self.recent, kept);
        let unknown = Matrix3::from_diagonal_element(1.0 / square(params.iron_change_sd_ut));
        let mut latest = HardIron {
            information: recent.parted / noise + unknown,
            weighted: recent.seen / noise,
            recent,
            ..*self
        };
        latest.solve();
        let left = recent.unrest(&latest.iron_b);
        self.recent = if left > EXPLAINED * noise { window } else { recent };
        if left <= EXPLAINED * noise && recent.unrest(&self.iron_b) > noise + QUIETER * left {
            *self = latest;
            return true;
        }
        // What the present iron leaves moving is not all the world's while it is not yet known well.
        let unrest = window.unrest(&self.iron_b).min(left);
        let weight = 1.0 / (noise + params.iron_per_spread * unrest);
        self.information += window.parted * weight;
        self.weighted += window.seen * weight;
        self.solve();
        false
    }

    /// The numbers that say all but the latest windows; [`HardIron::go_on`] makes the rest of them.
    pub(super) fn each(&mut self, visit: &mut dyn FnMut(&mut f32)) {
        self.information.iter_mut().for_each(&mut *visit);
        self.weighted.iter_mut().for_each(visit);
    }

    /// After its numbers were replaced.
    pub(super) fn go_on(&mut self) {
        self.solve();
    }

    fn solve(&mut self) {
        // Information is a sum that began positive definite; rounding does not take that away.
        self.covariance = self.information.try_inverse().unwrap_or_else(Matrix3::zeros);
        self.iron_b = self.covariance * self.weighted;
    }

    /// [uT^2] variance of a component of a window's mean field by what is not known of the iron.
    pub(super) fn variance(&self, sums: &FieldSums) -> f32 {
        let turned = sums.turned / sums.count;
        // The trace of T P T'.
        (turned * self.covariance).dot(&turned) / 3.0
    }

    pub(super) fn is_finite(&self) -> bool {
        let Equations {
            parted, seen, squares, ..
        } = &self.recent;
        let matrices = [&self.covariance, &self.information, parted];
        let vectors = [&self.iron_b, &self.weighted, seen];
        matrices.into_iter().all(|matrix| are_finite(matrix.as_slice()))
            && vectors.into_iter().all(|vector| are_finite(vector.as_slice()))
            && squares.is_finite()
    }
}

#[cfg(test)]
mod tests;
