//! How the filter finds its attitude, afresh when it must, and how it gives it up.
//!
//! In: a window's means. Out: attitude and covariance by TRIAD, bias and gyro matrix kept.

use nalgebra::{ComplexField, Vector2, Vector3};

use super::{Filter, Outcome, Window, passage::walks, square};
use crate::{
    attitude::dcm_nb,
    triad::{Sighting, triad},
};

/// [rad^2] more than any attitude's variance: whatever TRIAD finds is better than nothing.
pub(super) const UNKNOWN: f32 = 1e3;

/// A window that begins afresh throws the history away: only for a variance this many times smaller.
const MUCH_BETTER: f32 = 0.1;

impl Filter {
    /// Counts rejections that say something of the attitude, and finds it afresh where it must be. Whether it did. Only
    /// where it may have to be is the covariance's work done for it.
    pub(super) fn recover(&mut self) -> bool {
        let means = &self.measured.means;
        let accepted = [self.measured.velocity_accepted, self.measured.field_accepted];
        for (rejected_s, accepted) in self.rejected_s.iter_mut().zip(accepted) {
            match accepted {
                Some(false) => *rejected_s += means.duration_s,
                Some(true) => *rejected_s = 0.0,
                None => {}
            }
        }
        let recovery_s = self.params.recovery_s;
        let rejected = self.rejected_s.into_iter().any(|rejected_s| rejected_s >= recovery_s);
        if rejected || core::mem::take(&mut self.unsound) {
            self.settle_covariance();
            // What was rejected for so long may have taught the bias before, as when a gyro lied.
            self.covariance.forget_bias(self.params.bias_sd);
            return self.align(UNKNOWN);
        }
        let lost = square(self.params.lost_sd);
        // Scalars only make it less, and the drive makes it twice as much in no window that the gyros were heard in.
        if 2.0 * (self.covariance.worst() + means.angle_variance) < lost {
            return false;
        }
        self.settle_covariance();
        let worst = self.covariance.worst();
        worst > lost && self.align(MUCH_BETTER * worst)
    }

    /// TRIAD on the means of a window, both gathered in the axes that `q_nb` leads to. Whether it could, with no
    /// variance above `most` \[rad^2\].
    pub(super) fn align(&mut self, most: f32) -> bool {
        let means = &self.measured.means;
        let (Some(mean), true) = (self.measured.field, means.near_one_g) else {
            return false;
        };
        let disturbance = self.reference.disturbance(&mean.mag_n, &means.acc_n);
        let down = Sighting {
            seen_b: -means.acc_n,
            known_n: Vector3::z(),
            seen_sd: ComplexField::sqrt(means.tilt_variance),
            known_sd: 0.0,
        };
        let field = Sighting {
            seen_b: mean.mag_n,
            known_n: self.reference.heading_n(),
            seen_sd: mean.direction_sd(&self.params, disturbance),
            known_sd: 0.0,
        };
        let Ok(found) = triad(&down, &field) else {
            return false;
        };
        if found.covariance_b.diagonal().max() > most {
            return false;
        }
        let velocity_sd = means.start_velocity_sd(&self.params);
        let dcm = dcm_nb(&found.q_nb);
        self.covariance.align(&(dcm * found.covariance_b * dcm.transpose()));
        self.covariance.forget_velocity(velocity_sd);
        self.turn(&found.q_nb);
        self.velocity_n = Vector2::zeros();
        let contradicted = self.rejected_s[1] >= self.params.recovery_s;
        self.spell.have_other_attitude(contradicted);
        self.rejected_s = [0.0; 2];
        self.aligned = true;
        true
    }

    /// The attitude is not known any more; bias and matrix have aged.
    pub(super) fn lose(&mut self, since_s: f32, outcome: &mut Outcome) {
        self.settle(outcome);
        outcome.aligned = false;
        self.silent_s = 0.0;
        self.window = Window::EMPTY;
        self.aligned = false;
        self.known_before = None;
        self.rate_b = Vector3::zeros();
        self.gyro_b = None;
        self.velocity_n = Vector2::zeros();
        self.covariance.age(&self.params, &walks(&self.params, since_s));
        self.settlements = self.settlements.wrapping_add(1);
    }
}
