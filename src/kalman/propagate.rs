//! The attitude carried on by the gyros, and the samples of the others carried to n with it.
//!
//! In: a step. Out: the attitude at its end, what gyro errors made of it, added to the window, and the step's samples, added
//! to the window too. Equations: the page of [`super`].

use nalgebra::{Matrix3, Vector3};

use super::{
    Filter, HALF_A_MILLISECOND, path, seconds, square,
    step::{Sampled, Step},
};
use crate::{
    attitude::{dcm_nb, from_rotation_vector, renormalised},
    root::root,
};

impl Filter {
    /// Attitude over `covered_s` by the gyros and over `gap_s` by the latest rate known; its matrix.
    pub(super) fn propagate(&mut self, step: &Step, covered_s: f32, gap_s: f32, rotation: bool) -> Matrix3<f32> {
        let gyro_b = if rotation { step.angle_b } else { Vector3::zeros() };
        let began_b = core::mem::replace(&mut self.gyro_b, rotation.then_some(step.rate_b));
        let rates_b = began_b
            .filter(|_| gap_s < HALF_A_MILLISECOND)
            .map(|began_b| [began_b, step.rate_b]);
        // The gap comes before what the increment covers.
        let bridged_b = self.rate_b * gap_s;
        if gap_s > 0.0 {
            self.q_nb *= from_rotation_vector(bridged_b);
        }
        let (ended_nb, mean) = path::through(&self.q_nb, &gyro_b, rates_b, covered_s);
        let wrong_b = self.gyro_matrix * gyro_b + self.bias_b * covered_s;
        let moved_n = mean * wrong_b + self.params.earth_rate_n * (covered_s + gap_s);
        self.q_nb = renormalised(from_rotation_vector(-moved_n) * ended_nb);
        let after = dcm_nb(&self.q_nb);
        let params = &self.params;
        let mut variance = params.angle_noise * params.angle_noise * (covered_s + gap_s)
            + params.turn_noise * params.turn_noise * root((gyro_b - wrong_b + bridged_b).norm_squared());
        // The rate missed is one and the same all through a gap, however many steps it lasts.
        let silent_s = self.silent_s + gap_s;
        variance += square(params.gap_rate_sd) * (square(silent_s) - square(self.silent_s));
        self.silent_s = if rotation { 0.0 } else { silent_s };
        if rotation {
            variance += step.angle_variance;
            self.rate_b = step.rate_b - self.gyro_matrix * step.rate_b - self.bias_b;
        }
        if step.saturated {
            variance += square(params.saturated_rate_sd * covered_s);
        }
        self.window.turn(&mean, &gyro_b, covered_s, gap_s, variance);
        if rotation {
            self.window.gyro_variance += step.angle_variance;
        }
        after
    }

    /// The samples of a step, each carried to n with the attitude at its own instant.
    pub(super) fn gather(&mut self, step: &Step, dcm: &Matrix3<f32>) {
        let delays = self.params.delays;
        let (rate_b, window_s) = (self.rate_b, self.params.window_s);
        let carried = |sampled: Option<Sampled>, delay_s: f32| {
            let sampled = sampled.filter(Sampled::is_believable)?;
            let late_s = if sampled.at_us < step.at_us {
                -seconds(step.at_us - sampled.at_us)
            } else {
                seconds(sampled.at_us - step.at_us)
            };
            let offset_s = late_s + delays.gyro_s - delay_s;
            let near = offset_s > -window_s && offset_s < window_s;
            near.then(|| (sampled, dcm * dcm_nb(&from_rotation_vector(rate_b * offset_s))))
        };
        if let Some((acc, dcm)) = carried(step.acc, delays.acc_s) {
            self.window.take_acc(&(dcm * acc.value_b), &acc, self.params.gravity);
        }
        if let Some((mag, dcm)) = carried(step.mag, delays.mag_s) {
            self.window.take_mag(&mag.value_b, &dcm, mag.variance);
        }
    }
}
