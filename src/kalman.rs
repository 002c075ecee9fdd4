//! Attitude, gyro bias and gyro matrix from increments, specific force and field: a multiplicative Kalman filter.
//!
//! In: one [`Step`] at a time: the rotation the gyros saw, and whatever was sampled of specific force and field, each at
//! its own instant. Out: the attitude at any step, its covariance, and once a window one [`Innovation`] for every
//! scalar that was compared.
//!
//! **State.** The quaternion `q_nb` carries the attitude and a small rotation vector `a` in n its error,
//! `q_true = q(a) q_nb`, reset to zero after every update (E. J. Lefferts, F. L. Markley, M. D. Shuster, "Kalman
//! filtering for spacecraft attitude estimation", J. Guid. Control 5(5), 1982, with the error on the side of n instead of
//! b). With the error in n nothing rotates the covariance, and heading and tilt are its own axes. Beside it stand the
//! gyros' bias `b`, their matrix error `M` (scale and misalignment; `rate = (1 - M) gyro - b`) and the horizontal
//! velocity `v`: 17 error states. The bias alone does not do: on hand-moved recordings the filter without `M` ends 60 %
//! worse, because a scale error of half a percent turns into degrees within a minute.
//!
//! **Propagation** is exact for the attitude: `q <- q(-earth rate dt) q q(increment)`. The error obeys
//! `da/dt = -dcm_nb (db + dM gyro)`; its integral over a window is gathered sample by sample and the covariance follows
//! once a window.
//!
//! **Accelerometers** measure tilt only as far as the velocity is bounded: what a tilt `a` adds to the horizontal
//! velocity, `dv/dt = -g (a_E, -a_N)`, goes on growing, what hand, wind or table do to it does not. So specific force is
//! summed in n to a velocity and compared with zero, once a window. Single samples of a shaken unit are worth nothing,
//! ten seconds of them are worth a tenth of a degree.
//!
//! **Magnetometers** are averaged in n over the window and compared with the reference along two axes across the field:
//! east (heading) and in the meridian (dip), each with its own variance. What norm and dip show of a disturbance says
//! how large it is, and a disturbance has no preferred direction: that variance is added to both.
//!
//! Scalars one at a time, Joseph's form, a gate each. What is rejected for [`Params::recovery_s`] starts the attitude
//! afresh with TRIAD, so no gate locks the filter out; so does an attitude that is no longer known to
//! [`Params::lost_sd`].
//!
//! Refuses (and says so, [`Refusal`]) steps that are not finite or do not go forward in time; a gap longer than
//! [`Params::longest_gap_s`] starts the attitude afresh. The state is finite whatever comes in.

mod covariance;
mod field;
mod innovation;
mod iron;
mod params;
mod window;

use nalgebra::{Matrix3, UnitQuaternion, Vector2, Vector3};

pub use self::{
    covariance::STATES,
    field::Reference,
    innovation::{INNOVATIONS, Innovation, Innovations, Quantity},
    iron::HardIron,
    params::{Delays, Params, Rest},
};
use self::{
    covariance::{BIAS, Covariance, GYRO_MATRIX, VELOCITY},
    innovation::Correction,
    window::{Means, Window},
};
use crate::{
    attitude::{dcm_nb, from_rotation_vector, renormalised},
    triad::{Sighting, triad},
};

/// A vector sampled at an instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sampled {
    /// Components in b: specific force \[m/s2\] or field \[uT\].
    pub value_b: Vector3<f32>,
    /// White variance of each component, in the square of that unit.
    pub variance: f32,
    /// [us] when it was sampled, as stamped; [`Params::delays`] are taken off.
    pub at_us: u64,
}

/// What came since the step before.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    /// [us] end of the increment.
    pub at_us: u64,
    /// [s] time the increment covers; what is missing to the step before is a gap.
    pub covered_s: f32,
    /// [rad] rotation vector that the gyros saw over it, in b.
    pub angle_b: Vector3<f32>,
    /// [rad^2] white variance of each component of it.
    pub angle_variance: f32,
    /// [rad/s] rate at its end, in b: carries samples over the few milliseconds to their instants.
    pub rate_b: Vector3<f32>,
    /// A gyro stood at the end of its range: the increment is a lower bound.
    pub saturated: bool,
    /// Specific force, if it was sampled.
    pub acc: Option<Sampled>,
    /// Field, if it was sampled.
    pub mag: Option<Sampled>,
    /// After lift-off nothing is taken for rest, and specific force for the vertical only if every sample of a window
    /// is near one g.
    pub lift_off: bool,
}

/// Why a step, or a part of it, was left out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
pub enum Refusal {
    /// Increment or rate is not finite, or the increment is longer than a turn: the step counts as a gap.
    NotARotation,
    /// It does not end later than the step before: left out.
    NotLater,
    /// The gap before it is too long: the attitude starts afresh.
    Gap,
}

/// What a step led to.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Outcome {
    /// What was wrong with it.
    pub refusal: Option<Refusal>,
    /// One for each scalar compared, when it closed a window.
    pub innovations: Innovations,
    /// The attitude was found afresh with TRIAD.
    pub aligned: bool,
}

/// The filter: its parameters and its whole state.
#[derive(Clone, Debug)]
pub struct Filter {
    /// Parameters.
    pub params: Params,
    /// Attitude at the gyros' latest true instant. Until [`Filter::aligned`], relative to where the window began.
    pub q_nb: UnitQuaternion<f32>,
    /// [rad/s] gyro bias in b.
    pub bias_b: Vector3<f32>,
    /// [1] gyro matrix error: `rate = (1 - matrix) gyro - bias`.
    pub gyro_matrix: Matrix3<f32>,
    /// [m/s] velocity north and east, as far as it is bounded.
    pub velocity_n: Vector2<f32>,
    /// Covariance of the error state.
    pub covariance: Covariance,
    /// The field that is expected.
    pub reference: Reference,
    /// Hard iron that the calibration does not know.
    pub iron: HardIron,
    /// Whether the attitude has been found.
    pub aligned: bool,
    window: Window,
    rate_b: Vector3<f32>,
    last_us: Option<u64>,
    /// [s] for how long each kind of measurement has been rejected without a break: velocity, field.
    rejected_s: [f32; 2],
    /// [s] for how long the field has been disturbed without a break.
    disturbed_s: f32,
}

impl Filter {
    /// A filter that knows nothing yet: it aligns itself after its first window, at rest or in motion.
    pub fn new(params: Params) -> Self {
        Filter {
            q_nb: UnitQuaternion::identity(),
            bias_b: Vector3::zeros(),
            gyro_matrix: Matrix3::zeros(),
            velocity_n: Vector2::zeros(),
            covariance: Covariance::new(&params),
            reference: params.field,
            iron: HardIron::none(),
            aligned: false,
            window: Window::default(),
            rate_b: Vector3::zeros(),
            last_us: None,
            rejected_s: [0.0; 2],
            disturbed_s: 0.0,
            params,
        }
    }

    /// A filter that goes on from an attitude with covariance \[rad^2\] in n, as after a reset in flight.
    pub fn resumed(params: Params, q_nb: UnitQuaternion<f32>, covariance_n: Matrix3<f32>) -> Self {
        let mut filter = Filter::new(params);
        filter.q_nb = q_nb;
        filter.covariance.align(&covariance_n);
        filter.aligned = true;
        filter
    }

    /// Attitude now: at the end of the latest step, the gyros' delay bridged with their latest rate.
    pub fn attitude(&self) -> UnitQuaternion<f32> {
        self.q_nb * from_rotation_vector(self.rate_b * self.params.delays.gyro_s)
    }

    /// [rad^2] covariance of the attitude's error as a small rotation vector in n, as of the last window.
    pub fn attitude_covariance_n(&self) -> Matrix3<f32> {
        self.covariance.attitude()
    }

    /// [rad/s] bias covariance in b.
    pub fn bias_covariance_b(&self) -> Matrix3<f32> {
        self.covariance.bias()
    }

    /// Takes a step.
    pub fn step(&mut self, step: &Step) -> Outcome {
        let mut outcome = Outcome::default();
        let since_s = match self.last_us {
            Some(last_us) if step.at_us <= last_us => {
                outcome.refusal = Some(Refusal::NotLater);
                return outcome;
            }
            Some(last_us) => (step.at_us - last_us) as f32 * 1e-6,
            None => step.covered_s,
        };
        self.last_us = Some(step.at_us);
        let rotation = is_a_rotation(step);
        if !rotation {
            outcome.refusal = Some(Refusal::NotARotation);
        }
        let covered_s = if rotation { step.covered_s.min(since_s) } else { 0.0 };
        let gap_s = since_s - covered_s;
        if !(gap_s < self.params.longest_gap_s) {
            outcome.refusal = Some(Refusal::Gap);
            self.lose(since_s);
            return outcome;
        }
        self.propagate(step, covered_s, gap_s.max(0.0), rotation);
        if rotation {
            self.gather(step);
        }
        if self.window.duration_s >= self.params.window_s - HALF_A_MILLISECOND {
            self.close(&mut outcome, step.lift_off);
            if !self.is_finite() {
                // Nothing above can lead here with finite input; the radiation that flips a bit of the state can.
                *self = Filter::new(self.params);
            }
        }
        outcome
    }

    /// Attitude over `covered_s` by the gyros and over `gap_s` by the latest rate known.
    fn propagate(&mut self, step: &Step, covered_s: f32, gap_s: f32, rotation: bool) {
        let before = dcm_nb(&self.q_nb);
        let gyro_b = if rotation { step.angle_b } else { Vector3::zeros() };
        let turned_b = gyro_b - self.gyro_matrix * gyro_b - self.bias_b * covered_s + self.rate_b * gap_s;
        let earth_n = self.params.earth_rate_n * -(covered_s + gap_s);
        self.q_nb = renormalised(from_rotation_vector(earth_n) * self.q_nb * from_rotation_vector(turned_b));
        let mean = (before + dcm_nb(&self.q_nb)) * 0.5;
        let params = &self.params;
        let mut variance = params.angle_noise * params.angle_noise * (covered_s + gap_s)
            + params.turn_noise * params.turn_noise * turned_b.norm();
        variance += square(params.gap_rate_sd * gap_s);
        if rotation {
            variance += step.angle_variance;
            self.rate_b = step.rate_b - self.gyro_matrix * step.rate_b - self.bias_b;
        }
        if step.saturated {
            variance += square(params.saturated_rate_sd * covered_s);
        }
        self.window.turn(&mean, &gyro_b, covered_s, gap_s, variance);
    }

    /// The samples of a step, each carried to n with the attitude at its own instant.
    fn gather(&mut self, step: &Step) {
        let dcm = dcm_nb(&self.q_nb);
        let delays = self.params.delays;
        let (rate_b, window_s) = (self.rate_b, self.params.window_s);
        let carried = |sampled: Option<Sampled>, delay_s: f32| {
            let sampled = sampled.filter(is_sampled)?;
            let late_s = (sampled.at_us as i64).wrapping_sub(step.at_us as i64) as f32 * 1e-6;
            let offset_s = late_s + delays.gyro_s - delay_s;
            let near = offset_s > -window_s && offset_s < window_s;
            near.then(|| (sampled, dcm * dcm_nb(&from_rotation_vector(rate_b * offset_s))))
        };
        if let Some((acc, dcm)) = carried(step.acc, delays.acc_s) {
            self.window
                .take_acc(&(dcm * acc.value_b), acc.variance, self.params.gravity);
        }
        if let Some((mag, dcm)) = carried(step.mag, delays.mag_s) {
            self.window.take_mag(&mag.value_b, &dcm, mag.variance);
        }
    }

    /// A window is complete: covariance over it, then everything it measured.
    fn close(&mut self, outcome: &mut Outcome, lift_off: bool) {
        let window = core::mem::take(&mut self.window);
        let means = window.means(&self.params, lift_off);
        if !self.aligned {
            self.covariance.predict(&self.params, &window, &means);
            outcome.aligned = self.align(&means, UNKNOWN);
            if !outcome.aligned {
                self.covariance.forget_attitude();
            }
            return;
        }
        self.velocity_n += means.velocity_change_n;
        self.covariance.predict(&self.params, &window, &means);
        let mut correction = Correction::new(self.params.gate);
        if means.rest {
            self.compare_rest(&means, &mut correction);
        }
        let velocity = means.vertical.then(|| self.compare_velocity(&means, &mut correction));
        if velocity.is_none() {
            self.velocity_n = Vector2::zeros();
            self.covariance.forget_velocity(self.params.velocity_sd);
        }
        let field = self.compare_field(&window, &means, &mut correction);
        self.inject(&correction);
        outcome.innovations = correction.innovations;
        let bounded = self.covariance.keep_bounds();
        outcome.aligned = self.recover(&means, bounded, [velocity, field]);
    }

    /// Counts rejections that say something of the attitude, and finds it afresh where it must be. Whether it did.
    fn recover(&mut self, means: &Means, bounded: bool, accepted: [Option<bool>; 2]) -> bool {
        for (rejected_s, accepted) in self.rejected_s.iter_mut().zip(accepted) {
            match accepted {
                Some(false) => *rejected_s += means.duration_s,
                Some(true) => *rejected_s = 0.0,
                None => {}
            }
        }
        let worst = self.covariance.attitude().diagonal().max();
        if !bounded
            || self
                .rejected_s
                .into_iter()
                .any(|rejected_s| rejected_s >= self.params.recovery_s)
        {
            return self.align(means, UNKNOWN);
        }
        worst > square(self.params.lost_sd) && self.align(means, MUCH_BETTER * worst)
    }

    /// At rest the gyros measure their own bias and the Earth's rate.
    fn compare_rest(&mut self, means: &Means, correction: &mut Correction) {
        let earth_b = self.q_nb.inverse_transform_vector(&self.params.earth_rate_n);
        let variance = square(self.params.rest.bias_sd);
        for axis in 0..3 {
            let measured = means.rate_b[axis] - earth_b[axis];
            let rows = [(BIAS + axis, 1.0)];
            correction.compare(
                &mut self.covariance,
                Quantity::Bias,
                self.bias_b[axis],
                measured,
                &rows,
                variance,
            );
        }
    }

    /// The velocity is bounded: zero is measured of it.
    fn compare_velocity(&mut self, means: &Means, correction: &mut Correction) -> bool {
        let mut accepted = true;
        for axis in 0..2 {
            let rows = [(VELOCITY + axis, 1.0)];
            let (predicted, variance) = (self.velocity_n[axis], means.velocity_variance);
            accepted &= correction.compare(
                &mut self.covariance,
                Quantity::Velocity,
                predicted,
                0.0,
                &rows,
                variance,
            );
        }
        accepted
    }

    /// The mean field against the reference, across it: east and in the meridian. `None` where the field is too
    /// disturbed for its rejection to say anything of the attitude.
    fn compare_field(&mut self, window: &Window, means: &Means, correction: &mut Correction) -> Option<bool> {
        let sums = means.field?;
        self.iron.learn(&self.params, &sums);
        self.reference
            .learn(&self.params, means.duration_s, &sums, &self.iron.iron_b);
        let compared = self.reference.compare(&self.params, &sums.mean(&self.iron.iron_b))?;
        let disturbed = compared.disturbance > self.params.field_gate;
        self.disturbed_s = if disturbed {
            self.disturbed_s + means.duration_s
        } else {
            0.0
        };
        correction.usable = !disturbed || self.disturbed_s > self.params.coast_s;
        let mut accepted = true;
        for scalar in &compared.scalars {
            let (quantity, rows) = (scalar.quantity, &window.mean_rows(&scalar.row_n));
            let covariance = &mut self.covariance;
            accepted &= correction.compare(covariance, quantity, 0.0, scalar.residual, rows, scalar.variance);
        }
        correction.usable = true;
        (!disturbed).then_some(accepted)
    }

    fn inject(&mut self, correction: &Correction) {
        let error = &correction.error;
        let rotation_n = Vector3::new(error[0], error[1], error[2]);
        self.q_nb = renormalised(from_rotation_vector(rotation_n) * self.q_nb);
        self.bias_b += error.fixed_rows::<3>(BIAS);
        for axis in 0..3 {
            for about in 0..3 {
                self.gyro_matrix[(axis, about)] += error[GYRO_MATRIX + 3 * axis + about];
            }
        }
        self.velocity_n += error.fixed_rows::<2>(VELOCITY);
    }

    /// TRIAD on the means of a window, both gathered in the axes that `q_nb` leads to. Whether it could, with no
    /// variance above `most` \[rad^2\].
    fn align(&mut self, means: &Means, most: f32) -> bool {
        let (Some(sums), true) = (means.field, means.near_one_g) else {
            return false;
        };
        let mean = sums.mean(&self.iron.iron_b);
        let disturbance = self.reference.disturbance(&mean.mag_n, &means.acc_n);
        let down = Sighting {
            seen_b: -means.acc_n,
            known_n: Vector3::z(),
            seen_sd: means.tilt_sd,
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
        self.q_nb = renormalised(found.q_nb * self.q_nb);
        let dcm = dcm_nb(&found.q_nb);
        self.covariance.align(&(dcm * found.covariance_b * dcm.transpose()));
        self.covariance.forget_velocity(means.start_velocity_sd(&self.params));
        self.velocity_n = Vector2::zeros();
        self.rejected_s = [0.0; 2];
        self.aligned = true;
        true
    }

    /// The attitude is not known any more; bias and matrix have aged.
    fn lose(&mut self, since_s: f32) {
        self.window = Window::default();
        self.aligned = false;
        self.rate_b = Vector3::zeros();
        self.velocity_n = Vector2::zeros();
        self.covariance.age(&self.params, since_s);
    }

    fn is_finite(&self) -> bool {
        let finite = |values: &[f32]| values.iter().all(|value| value.is_finite());
        finite(self.q_nb.as_vector().as_slice())
            && finite(self.bias_b.as_slice())
            && finite(self.gyro_matrix.as_slice())
            && finite(self.velocity_n.as_slice())
            && self.iron.is_finite()
            && self.covariance.is_finite()
    }
}

/// [rad^2] more than any attitude's variance: whatever TRIAD finds is better than nothing.
const UNKNOWN: f32 = 1e3;

/// A window that begins afresh throws the history away: only for a variance this many times smaller.
const MUCH_BETTER: f32 = 0.1;

/// Steps need not add up to a window to the microsecond.
const HALF_A_MILLISECOND: f32 = 5e-4;

/// [rad] longest increment that is believed: the rotation vector of more than a turn has lost count.
const LONGEST_TURN: f32 = core::f32::consts::TAU;

fn square(x: f32) -> f32 {
    x * x
}

/// Comparisons with NaN are false.
fn is_a_rotation(step: &Step) -> bool {
    step.angle_b.norm_squared() < LONGEST_TURN * LONGEST_TURN
        && step.rate_b.norm_squared() < 1e6
        && step.covered_s > 0.0
        && step.angle_variance >= 0.0
        && step.angle_variance < 1.0
}

/// Longer than any specific force or field that a sensor could give: what is beyond is a fault.
const LONGEST_SAMPLE: f32 = 1e4;

fn is_sampled(sampled: &Sampled) -> bool {
    let norm = sampled.value_b.norm();
    norm < LONGEST_SAMPLE && sampled.variance >= 0.0 && sampled.variance < LONGEST_SAMPLE
}

#[cfg(test)]
mod tests;
