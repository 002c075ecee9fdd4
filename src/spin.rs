//! The attitude of a spinning rocket, through the time when its gyros stand at their stops.
//!
//! In: cycles of the unit, from an attitude that was known before the spin. Out: attitude, its covariance, and what the gyros'
//! biases were found to be, for who carries on after it. Between two packets it takes every slice of the gyros
//! ([`crate::increments::slices`]), three readings of the accelerometers and the field of each plate, each at its own instant.
//!
//! **Why another filter.** At three turns a second the gyros that see the spin are at their stops: what is lost is the angle about
//! x_b, not the attitude. One gyro lies across the spin and goes on; accelerometers at four places measure the spin by what they
//! disagree on ([`forces`]); the field turns with the body, and the accelerometers' rate, good to a tenth of a degree in a packet's
//! period, says how often it went round. So the rate is a state here, where it is an input before and after the spin.
//!
//! **State**, with errors in the order of [`covariance`]: `q_nb`; the spin `w_x` and its derivative; the rate across the spin `u` in
//! two axes that do not spin, and its derivative, because a cone of half a turn a second is slow there and at the spin's rate in b;
//! each gyro's bias, what it sees of the spin beyond its axis, and by how much each g along x_b moves its bias, since it was learnt
//! under the one of the pad; the hard iron; the levers' scale. With `phi` the angle spun,
//!
//! ```text
//! w_b = (w_x, T u),  T = [c s; -s c],  dphi/dt = w_x          q <- q exp((0, T u) dt) exp(x w_x dt), less the Earth's rate
//! gyro   z_i = n_i . (w_x, g T u) + sees_i w_x + b_i + l_i load          g: what low-pass and slice leave of a rate that turns with the spin
//! force  see [`forces`]
//! field  y_k = h_k . (C_bn m + iron)
//! ```
//!
//! **Noise.** The derivatives walk: `w_x'` as `motion` says, and faster for a moment
//! after the accelerometers contradicted what was believed of a rate that fewer than three gyros see (ignition, yo-yo). What the
//! gyros' residuals show over a second is taken for their noise if it is more than their samples': vibration is measured, not
//! assumed. So is what accelerometers disagree on beside the rate. A gyro at its stop is an inequality: it is used, at its stop, only
//! where less is believed.
//!
//! Scalars one at a time, Joseph's form. Gyros far off weigh less, by P. J. Huber's rule; force and field have a gate each, and a
//! field's gate that stays shut opens the angle about the spin, then all.
//! By how much the field's direction is told wrong is considered, not estimated ([`covariance`]): it is the same in all readings, and the
//! attitude has of it what its gains took. Of the angle between nose and field they take little: iron along x_b looks the same, and
//! the pad's gravity knows that angle better.
//!
//! Refuses to go on (and says so) when a number is no longer one, or when there was no slice for a second.
//!
//! A cycle's readings are put in order in `cycle`; `motion` carries the state to each; `gyros`, `accelerometers` and
//! `magnetometers` correct it. [`kept`] is what a reset leaves of it.

mod accelerometers;
pub mod covariance;
mod cycle;
pub mod forces;
mod gyros;
pub mod kept;
mod lasting;
mod magnetometers;
mod motion;
pub mod pad;

use nalgebra::{Matrix3, SMatrix, UnitQuaternion, Vector3};

use self::{
    covariance::{
        ACROSS, ACROSS_UP, ATTITUDE, BIAS, BY_LOAD, Covariance, IRON, LEVER, SEES_SPIN, SPIN, SPIN_UP, STATES,
    },
    lasting::Lasting,
    pad::Pad,
};
use crate::{
    attitude::{from_rotation_vector, renormalised, sin_cos},
    calibration::Set,
    geometry::{PLATES, TRIAD_AXES},
    kalman::{Delays, Known},
};

/// Squared gates.
const GATE: f32 = 25.0;
/// [rad/s] and \[1\] what noise of the gyros and usual residual of the force equations it begins with: a lift-off shakes before it
/// can have shown by how much.
const BEGINS_ROUGH: f32 = 0.01;
const BEGINS_USUAL: f32 = 10.0;

/// What it begins with.
#[derive(Clone, Debug)]
pub struct Start<'a> {
    /// \[us\] instant of the attitude and the rate.
    pub at_us: u64,
    /// Attitude.
    pub q_nb: UnitQuaternion<f32>,
    /// \[rad2\] its covariance, in n.
    pub covariance_n: Matrix3<f32>,
    /// [rad/s] rate in b.
    pub rate_b: Vector3<f32>,
    /// [rad/s] what is known of each component.
    pub rate_sd: f32,
    /// [rad/s] bias of the gyros in b and the variance of a component, for gyros that did not stand on the pad.
    pub bias_b: Vector3<f32>,
    /// [rad2/s2] its variance.
    pub bias_variance: f32,
    /// What each sensor had on the pad.
    pub pad: &'a Pad,
    /// \[uT\] hard iron and its covariance, in b.
    pub iron_b: Vector3<f32>,
    /// \[uT2\]
    pub iron_covariance: Matrix3<f32>,
    /// What does not change in the spin.
    pub surroundings: Surroundings,
}

/// What does not change in the spin.
#[derive(Clone, Copy, Debug)]
pub struct Surroundings {
    /// \[uT\] field, in n.
    pub field_n_ut: Vector3<f32>,
    /// \[rad\] how far its direction is not known.
    pub field_sd: f32,
    /// [rad/s] rate of the Earth, in n.
    pub earth_rate_n: Vector3<f32>,
    /// [rad/s for each g] by how much force moves a gyro's bias, standard deviation.
    pub bias_per_g: f32,
    /// How late the sensors are.
    pub delays: Delays,
}

impl Surroundings {
    /// Two axes across the field about which its direction may be off, in n, the first of them level; and the field's level part.
    fn across_field(&self) -> ([Vector3<f32>; 2], f32) {
        let along_n = self.field_n_ut.normalize();
        let level_n = Vector3::z().cross(&along_n);
        let level = level_n.norm();
        let first_n = if level > LEVEL { level_n / level } else { Vector3::x() };
        ([first_n, along_n.cross(&first_n)], level)
    }

    /// \[rad\] what the heading has in common with the field's error about the second axis, of variance one. The field alone
    /// gives a heading of variance `V = (field_sd^2 + iron^2 / field^2) / level^2`, and an error of it by `field_sd / level` for each of that
    /// error. A heading of variance `P`, of which a rail may have told too, has the part `P / V` from the field.
    fn in_heading(&self, heading_variance: f32, iron_variance: f32) -> f32 {
        let (_, level) = self.across_field();
        if level <= LEVEL {
            return 0.0;
        }
        let of_iron = iron_variance / self.field_n_ut.norm_squared();
        let alone = (square(self.field_sd) + of_iron) / square(level);
        let part = if heading_variance < alone {
            heading_variance / alone
        } else {
            1.0
        };
        part * self.field_sd / level
    }
}

/// Level part of a field that is too steep to say a heading.
const LEVEL: f32 = 1e-3;

/// The filter of the spin phase.
#[derive(Clone, Debug)]
pub struct Spin {
    surroundings: Surroundings,
    /// \[us\] instant of the state.
    at_us: u64,
    q_nb: UnitQuaternion<f32>,
    spin: f32,
    spin_up: f32,
    phase: f32,
    across: [f32; 2],
    across_up: [f32; 2],
    bias: [f32; PLATES],
    sees_spin: [f32; PLATES],
    iron_b: Vector3<f32>,
    lever: f32,
    covariance: Covariance,
    /// [m/s2] what each accelerometer axis had on the pad beyond the force.
    force_rest: [f32; TRIAD_AXES],
    /// [rad2/s2] noise that the gyros show.
    rough: f32,
    /// \[1\] what the force equations' squares usually are over what they should be.
    usual: f32,
    /// Three gyros saw the latest slice.
    seen: bool,
    /// Gyros that answered in it, bit `k` the `k`-th.
    answering: u16,
    /// \[s\] for which a surprise still lasts.
    surprised_s: f32,
    /// Packets in a row whose field was refused.
    refused: u8,
    /// The force before, and when.
    force: Option<(u64, Vector3<f32>)>,
    /// What of the gyros' noise lasts.
    lasting: Lasting,
    /// [m/s2] by what the force had changed before that.
    changed_b: Option<Vector3<f32>>,
    /// [m2/s4] mean square of a component of what shakes it.
    shaken: f32,
    /// [rad/s for each g] ...
    by_load: [f32; PLATES],
    /// [m/s2] ... more along x_b than on the pad.
    pad_force: f32,
    /// \[us\] instant of the latest slice.
    slice_us: u64,
}

impl Spin {
    /// Not inlined: what it builds on the way would lie on the stack under all that the unit does.
    #[inline(never)]
    pub fn begin(start: &Start, set: &Set) -> Self {
        let square = |x: f32| x * x;
        let [_, _, of_gyro] = set.uncertainty;
        let on_pad = start.pad.rate_variance(set);
        let earth_b = start.q_nb.inverse_transform_vector(&start.surroundings.earth_rate_n);
        let bias = core::array::from_fn(|k| {
            let axis_b = &set.gyro[k].axis_b;
            match on_pad {
                Some(_) => start.pad.rate[k] - axis_b.dot(&earth_b),
                None => axis_b.dot(&start.bias_b),
            }
        });
        let mut variances = [0.0; STATES];
        variances[SPIN] = square(start.rate_sd);
        variances[SPIN_UP] = square(3.0);
        for axis in 0..2 {
            variances[ACROSS + axis] = square(start.rate_sd);
            variances[ACROSS_UP + axis] = square(0.5);
        }
        for k in 0..PLATES {
            variances[BIAS + k] = on_pad.unwrap_or(start.bias_variance);
            let along = set.gyro[k].axis_b.x;
            variances[SEES_SPIN + k] = square(of_gyro.scale * along) + square(of_gyro.direction);
        }
        let shortest = set
            .place_b
            .iter()
            .fold(f32::MAX, |least, place| least.min(place.norm()));
        for variance in &mut variances[BY_LOAD..] {
            *variance = square(start.surroundings.bias_per_g);
        }
        variances[LEVER] = square(set.place_sigma / shortest.max(1e-3));
        let mut covariance = Covariance::of(&variances);
        covariance.set_block(ATTITUDE, &start.covariance_n);
        covariance.set_block(IRON, &start.iron_covariance);
        let mut spin = Spin {
            surroundings: start.surroundings,
            at_us: start.at_us,
            q_nb: start.q_nb,
            spin: start.rate_b.x,
            spin_up: 0.0,
            phase: 0.0,
            across: [start.rate_b.y, start.rate_b.z],
            across_up: [0.0; 2],
            bias,
            sees_spin: [0.0; PLATES],
            iron_b: start.iron_b,
            lever: 0.0,
            covariance,
            force_rest: if on_pad.is_some() {
                start.pad.force
            } else {
                [0.0; TRIAD_AXES]
            },
            rough: square(BEGINS_ROUGH),
            usual: BEGINS_USUAL,
            seen: true,
            answering: 0b1111,
            surprised_s: 0.0,
            refused: 0,
            force: None,
            lasting: Lasting::new(set),
            changed_b: None,
            shaken: 0.0,
            by_load: [0.0; PLATES],
            pad_force: start.pad.along_x,
            slice_us: start.at_us,
        };
        spin.consider_the_field();
        spin
    }

    /// The field's error is in the heading, as far as the heading is from the field.
    fn consider_the_field(&mut self) {
        let heading_variance = self.covariance.variance(ATTITUDE + 2);
        let iron_variance = self.covariance.block::<3, 3>(IRON, IRON).trace() / 3.0;
        let in_common = self.surroundings.in_heading(heading_variance, iron_variance);
        self.covariance.set_considered(&(Vector3::z() * in_common));
    }

    /// [rad/s] the rate in b.
    pub fn rate_b(&self) -> Vector3<f32> {
        Vector3::new(self.spin, 0.0, 0.0) + self.turning_b(self.across)
    }

    /// [rad/s] bias of each gyro.
    pub fn biases(&self) -> [f32; PLATES] {
        self.bias
    }

    /// What it knows at an instant that is at most some 20 ms from its latest measurement.
    pub fn known(&self, set: &Set, at_us: u64) -> Known {
        let dt_s = seconds_between(self.at_us, at_us);
        let least_squares = least_squares(set, self.answering);
        let mut covariance = SMatrix::<f32, 6, 6>::zeros();
        // What follows flies on under the force of now.
        let load = self.load();
        let block = |row, column| self.covariance.block::<PLATES, PLATES>(row, column);
        let crossed = block(BIAS, BY_LOAD) * load;
        let of_gyros = block(BIAS, BIAS) + crossed + crossed.transpose() + block(BY_LOAD, BY_LOAD) * (load * load);
        let with_gyros = self.covariance.block::<3, PLATES>(ATTITUDE, BIAS)
            + self.covariance.block::<3, PLATES>(ATTITUDE, BY_LOAD) * load;
        let with_bias = with_gyros * least_squares.transpose();
        let of_bias = least_squares * of_gyros * least_squares.transpose();
        let bias = nalgebra::Vector4::from_fn(|k, _| self.bias[k] + self.by_load[k] * load);
        covariance.fixed_view_mut::<3, 3>(0, 0).copy_from(&self.covariance_n());
        covariance.fixed_view_mut::<3, 3>(0, 3).copy_from(&with_bias);
        covariance
            .fixed_view_mut::<3, 3>(3, 0)
            .copy_from(&with_bias.transpose());
        covariance.fixed_view_mut::<3, 3>(3, 3).copy_from(&of_bias);
        Known {
            q_nb: self.carried(dt_s).0,
            rate_b: self.rate_b(),
            bias_b: least_squares * bias,
            covariance,
            sees_spin_b: least_squares * nalgebra::Vector4::from(self.sees_spin),
            sees_spin_variance: Vector3::from_fn(|row, _| {
                let seen = core::array::from_fn::<_, PLATES, _>(|k| (SEES_SPIN + k, least_squares[(row, k)]));
                self.covariance.along(&seen)
            }),
            iron_b: self.iron_b,
            iron_covariance: self.covariance.block::<3, 3>(IRON, IRON),
        }
    }

    /// \[rad2\] covariance of the attitude in n.
    pub fn covariance_n(&self) -> Matrix3<f32> {
        self.covariance.block(ATTITUDE, ATTITUDE)
    }

    /// Two components across the spin, in axes that do not spin, as a vector in b.
    fn turning_b(&self, across: [f32; 2]) -> Vector3<f32> {
        let [y_b, z_b] = self.across_b();
        y_b * across[0] + z_b * across[1]
    }

    /// The axes across the spin that do not spin, in b.
    fn across_b(&self) -> [Vector3<f32>; 2] {
        let (sin, cos) = sin_cos(self.phase);
        [Vector3::new(0.0, cos, -sin), Vector3::new(0.0, sin, cos)]
    }

    /// The state has what the scalars found.
    fn correct(&mut self) {
        let error = core::mem::replace(&mut self.covariance.error, [0.0; STATES]);
        let turned_n = Vector3::new(error[ATTITUDE], error[ATTITUDE + 1], error[ATTITUDE + 2]);
        self.q_nb = renormalised(from_rotation_vector(turned_n) * self.q_nb);
        self.spin += error[SPIN];
        self.spin_up += error[SPIN_UP];
        for axis in 0..2 {
            self.across[axis] += error[ACROSS + axis];
            self.across_up[axis] += error[ACROSS_UP + axis];
        }
        for k in 0..PLATES {
            self.bias[k] += error[BIAS + k];
            self.sees_spin[k] += error[SEES_SPIN + k];
            self.by_load[k] += error[BY_LOAD + k];
        }
        self.iron_b += Vector3::new(error[IRON], error[IRON + 1], error[IRON + 2]);
        self.lever += error[LEVER];
    }

    fn is_finite(&self) -> bool {
        let sum = self.q_nb.as_vector().sum()
            + self.spin
            + self.spin_up
            + self.phase
            + self.across.iter().chain(&self.across_up).sum::<f32>()
            + self
                .bias
                .iter()
                .chain(&self.sees_spin)
                .chain(&self.by_load)
                .sum::<f32>()
            + self.iron_b.sum()
            + self.lever;
        sum.is_finite() && self.spin.abs() < FASTEST
    }
}

/// [rad/s] no rocket spins as fast: 30 turns a second.
const FASTEST: f32 = 200.0;

fn square(x: f32) -> f32 {
    x * x
}

/// \[s\] from one instant to another.
fn seconds_between(from_us: u64, to_us: u64) -> f32 {
    let us = to_us.wrapping_sub(from_us) as i64;
    us as i32 as f32 * 1e-6
}

/// What is each gyro's as a vector of those that answer: who carries on takes the rate from them.
fn least_squares(set: &Set, answering: u16) -> SMatrix<f32, 3, PLATES> {
    let axes_b = set.gyro.map(|axis| axis.axis_b);
    crate::redundancy::matrix(&axes_b, answering)
        .map(|(matrix, _)| matrix)
        .unwrap_or_default()
}
