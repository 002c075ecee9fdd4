//! The state from one instant to the next.
//!
//! In: an instant, some milliseconds before or after the state's. Out: attitude, angle spun and rates there, and the covariance with
//! what walks meanwhile: after a surprise the derivatives walk faster.

use nalgebra::{UnitQuaternion, Vector3};

use super::{
    Spin,
    covariance::{ACROSS_UP, ATTITUDE, BIAS, IRON, SPIN_UP},
    seconds_between,
};
use crate::{
    attitude::{dcm_nb, from_rotation_vector, renormalised},
    geometry::PLATES,
};

/// [rad/s2/sqrt(s)] walk of the spin's derivative: fins and motors change it by that in a second.
const SPIN_WALK: f32 = 2.0;
/// [rad/s2/sqrt(s)] the same after a surprise: a yo-yo takes 19 rad/s away in a second.
pub(super) const SURPRISED_WALK: f32 = 60.0;
/// [rad/s2/sqrt(s)] walk of the derivative of the rate across: a cone of 1 deg at 0.4 turns a second has 0.1 rad/s2.
pub(super) const ACROSS_WALK: f32 = 0.2;
/// [rad/sqrt(s)] angle noise that no model explains.
const ANGLE_WALK: f32 = 1e-4;
/// [rad/s/sqrt(s)] walk of a gyro's bias.
const BIAS_WALK: f32 = 1.5e-6;
/// \[s\] longest step of the covariance: between two slices of the gyros there are 20 ms.
const LONGEST_STEP_S: f32 = 0.03;
/// [uT/sqrt(s)] walk of the iron.
const IRON_WALK: f32 = 0.01;

impl Spin {
    /// Attitude and angle spun after so long, of either sign.
    pub(super) fn carried(&self, dt_s: f32) -> (UnitQuaternion<f32>, f32) {
        let half = 0.5 * dt_s;
        let ([y, z], [y_up, z_up]) = (self.across, self.across_up);
        let across = [(y + half * y_up) * dt_s, (z + half * z_up) * dt_s];
        let spun = (self.spin + half * self.spin_up) * dt_s;
        let turned = from_rotation_vector(self.turning_b(across)) * from_rotation_vector(Vector3::new(spun, 0.0, 0.0));
        let earth = from_rotation_vector(self.surroundings.earth_rate_n * -dt_s);
        (renormalised(earth * self.q_nb * turned), spun)
    }

    /// The state at another instant.
    pub(super) fn carry(&mut self, at_us: u64) {
        let dt_s = seconds_between(self.at_us, at_us);
        self.at_us = at_us;
        if dt_s == 0.0 {
            return;
        }
        let steps = ((dt_s.abs() / LONGEST_STEP_S) as u16).saturating_add(1);
        for _ in 0..steps {
            self.carry_by(dt_s / f32::from(steps));
        }
    }

    fn carry_by(&mut self, dt_s: f32) {
        let dcm = dcm_nb(&self.q_nb);
        let [y_b, z_b] = self.across_b();
        let axes_n = [dcm.column(0).into_owned(), dcm * y_b, dcm * z_b];
        self.covariance.predict(&axes_n, dt_s);
        let (q_nb, spun) = self.carried(dt_s);
        self.q_nb = q_nb;
        self.phase = wrapped(self.phase + spun);
        self.spin += self.spin_up * dt_s;
        for axis in 0..2 {
            self.across[axis] += self.across_up[axis] * dt_s;
        }
        let lasted_s = dt_s.abs();
        let surprised = self.surprised_s > 0.0;
        self.surprised_s -= dt_s;
        let walk = |of: f32| of * of * lasted_s;
        let covariance = &mut self.covariance;
        covariance.open(SPIN_UP, walk(if surprised { SURPRISED_WALK } else { SPIN_WALK }));
        let across_walk = walk(if surprised { 5.0 * ACROSS_WALK } else { ACROSS_WALK });
        for axis in 0..2 {
            covariance.open(ACROSS_UP + axis, across_walk);
        }
        for axis in 0..3 {
            covariance.open(ATTITUDE + axis, walk(ANGLE_WALK));
            covariance.open(IRON + axis, walk(IRON_WALK));
        }
        for gyro in 0..PLATES {
            covariance.open(BIAS + gyro, walk(BIAS_WALK));
        }
    }
}

/// The same angle within half a turn.
fn wrapped(angle: f32) -> f32 {
    const TURN: f32 = core::f32::consts::TAU;
    if angle > 0.5 * TURN {
        angle - TURN
    } else if angle < -0.5 * TURN {
        angle + TURN
    } else {
        angle
    }
}
