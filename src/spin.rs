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
//! **Noise.** The derivatives walk: `w_x'` by [`SPIN_WALK`] [rad/s2/sqrt(s)], and by [`SURPRISED_WALK`] for [`SURPRISED_S`]
//! after the accelerometers contradicted what was believed of a rate that fewer than three gyros see (ignition, yo-yo). What the
//! gyros' residuals show over a second is taken for their noise if it is more than their samples': vibration is measured, not
//! assumed. So is what accelerometers disagree on beside the rate. A gyro at its stop is an inequality: it is used, at its stop, only
//! where less is believed.
//!
//! Scalars one at a time, Joseph's form. Gyros far off weigh less, by P. J. Huber's rule; force and field have a gate each, and a
//! field's gate that stays shut opens the angle about the spin, then all.
//! The field's model error is considered, not estimated (S. F. Schmidt, 1966): it is added to the covariance that is said.
//!
//! Refuses to go on (and says so) when a number is no longer one, or when there was no slice for [`LONGEST_GAP_S`].

pub mod covariance;
pub mod forces;
pub mod pad;

use nalgebra::{ComplexField, Matrix3, SMatrix, UnitQuaternion, Vector3};

use self::{
    covariance::{
        ACROSS, ACROSS_UP, ATTITUDE, BIAS, BY_LOAD, Covariance, IRON, LEVER, Row, SEES_SPIN, SPIN, SPIN_UP, STATES,
    },
    forces::{Believed, EQUATIONS},
    pad::Pad,
};
use crate::{
    attitude::{dcm_nb, from_rotation_vector, renormalised, sin_cos},
    calibration::{Measured, Set},
    geometry::{PLATES, TRIAD_AXES},
    increments::{Increments, SLICES, forces::READINGS, slices::BEYOND},
    kalman::{Delays, Known},
    sample::{Kind, NO_SLOT, NOT_READ, Sample},
};

/// [rad/s2/sqrt(s)] walk of the spin's derivative: fins and motors change it by that in a second.
const SPIN_WALK: f32 = 2.0;
/// [rad/s2/sqrt(s)] the same after a surprise: a yo-yo takes 19 rad/s away in a second.
const SURPRISED_WALK: f32 = 60.0;
/// [s] how long a surprise lasts.
const SURPRISED_S: f32 = 0.6;
/// [rad/s2/sqrt(s)] walk of the derivative of the rate across: a cone of 1 deg at 0.4 turns a second has 0.1 rad/s2.
const ACROSS_WALK: f32 = 0.2;
/// [rad/sqrt(s)] angle noise that no model explains.
const ANGLE_WALK: f32 = 1e-4;
/// [rad/s/sqrt(s)] walk of a gyro's bias.
const BIAS_WALK: f32 = 1.5e-6;
/// [uT/sqrt(s)] walk of the iron.
const IRON_WALK: f32 = 0.01;
/// [s] time constant of the gyros' low-pass (12.7 Hz).
const GYRO_TAU_S: f32 = 0.0125;
/// Parts of a slice's noise that its neighbours do not have: trapezoids over two intervals share their ends.
const SLICE_NOISE: f32 = 0.5;
/// [s] by how much the ages of two accelerometers' conversions differ: uniform over 20 ms.
const FORCE_AGE_S: f32 = 0.006;
/// [s] by how much a magnetometer's age is not known: uniform over 13.3 ms.
const FIELD_AGE_S: f32 = 0.003_85;
/// [uT] what is left of a magnetometer's own bias, beside its noise.
const FIELD_REST_UT: f32 = 0.12;
/// Squared gates.
const GATE: f32 = 25.0;
/// Square of the standard deviations from which a gyro's sample weighs less.
const FAR: f32 = 9.0;
/// Mean square of the force equations' residuals, over what they should be, that is a surprise.
const SURPRISE: f32 = 4.0;
/// Of how many readings the force equations' usual residual is the mean.
const USUAL: f32 = 20.0;
/// Of how many gyro residuals their noise is the mean: a second of three.
const ROUGH: f32 = 150.0;
/// [s] longest time without a slice.
const LONGEST_GAP_S: f32 = 1.0;
/// [rad/s] and [1] what noise of the gyros and usual residual of the force equations it begins with: a lift-off shakes before it
/// can have shown by how much.
const BEGINS_ROUGH: f32 = 0.01;
const BEGINS_USUAL: f32 = 10.0;
/// Packets whose field is refused before the angle about the spin is opened, and before all is.
const SHUT: [u8; 2] = [3, 10];
/// [m/s2] of the data sheet's g.
const STANDARD_GRAVITY: f32 = 9.806_65;
/// [us] what is stamped later is not of this flight.
const FAR_US: u64 = 2_000_000;

/// What it begins with.
#[derive(Clone, Debug)]
pub struct Start<'a> {
    /// [us] instant of the attitude and the rate.
    pub at_us: u64,
    /// Attitude.
    pub q_nb: UnitQuaternion<f32>,
    /// [rad2] its covariance, in n.
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
    /// [uT] hard iron and its covariance, in b.
    pub iron_b: Vector3<f32>,
    /// [uT2]
    pub iron_covariance: Matrix3<f32>,
    /// What does not change in the spin.
    pub place: Place,
}

/// What does not change in the spin.
#[derive(Clone, Copy, Debug)]
pub struct Place {
    /// [uT] field, in n.
    pub field_n_ut: Vector3<f32>,
    /// [rad] how far its direction is not known.
    pub field_sd: f32,
    /// [rad/s] rate of the Earth, in n.
    pub earth_rate_n: Vector3<f32>,
    /// [rad/s for each g] by how much force moves a gyro's bias, standard deviation.
    pub bias_per_g: f32,
    /// How late the sensors are.
    pub delays: Delays,
}

/// The filter of the spin phase.
#[derive(Clone, Debug)]
pub struct Spin {
    place: Place,
    /// [us] instant of the state.
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
    /// [1] what the force equations' squares usually are over what they should be.
    usual: f32,
    /// Three gyros saw the latest slice.
    seen: bool,
    /// [s] for which a surprise still lasts.
    surprised_s: f32,
    /// Packets in a row whose field was refused.
    refused: u8,
    /// The force before, and when.
    force: Option<(u64, Vector3<f32>)>,
    /// [rad/s for each g] ...
    by_load: [f32; PLATES],
    /// [m/s2] ... more along x_b than on the pad.
    pad_force: f32,
    /// [us] instant of the latest slice.
    slice_us: u64,
}

/// What a cycle brought, in the order of its instants.
#[derive(Clone, Copy, Debug)]
enum Event {
    /// A slice of the gyros.
    Slice(usize),
    /// A reading of the accelerometers before the packet's.
    Force(usize),
    /// The packet's.
    Forces,
    /// The field of a plate.
    Field(usize),
}

/// Most events of a cycle.
const EVENTS: usize = SLICES + READINGS + 1 + PLATES;

impl Spin {
    /// Not inlined: what it builds on the way would lie on the stack under all that the unit does.
    #[inline(never)]
    pub fn begin(start: &Start, set: &Set) -> Self {
        let square = |x: f32| x * x;
        let [_, _, of_gyro] = set.uncertainty;
        let on_pad = start.pad.rate_variance(set);
        let earth_b = start.q_nb.inverse_transform_vector(&start.place.earth_rate_n);
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
            *variance = square(start.place.bias_per_g);
        }
        variances[LEVER] = square(set.place_sigma / shortest.max(1e-3));
        let mut covariance = Covariance::of(&variances);
        covariance.set_block(ATTITUDE, &start.covariance_n);
        covariance.set_block(IRON, &start.iron_covariance);
        Spin {
            place: start.place,
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
            surprised_s: 0.0,
            refused: 0,
            force: None,
            by_load: [0.0; PLATES],
            pad_force: start.pad.along_x,
            slice_us: start.at_us,
        }
    }

    /// Takes a cycle, its axes as `measured`. Whether it can go on.
    #[inline(never)]
    pub fn take(&mut self, set: &Set, sample: &Sample, measured: &Measured, increments: &Increments) -> bool {
        let delays = self.place.delays;
        let mut events: heapless::Vec<(u64, Event), EVENTS> = heapless::Vec::new();
        let mut note = |at_us: u64, late_s: f32, event: Event| {
            let at_us = at_us.saturating_sub((late_s * 1e6) as u64);
            let near = at_us.abs_diff(self.at_us) < FAR_US;
            if near {
                let place = events.iter().position(|(other_us, _)| *other_us > at_us);
                let _ = events.insert(place.unwrap_or(events.len()), (at_us, event));
            }
        };
        for (k, slice) in increments
            .slices
            .iter()
            .enumerate()
            .filter(|(_, slice)| !slice.is_none())
        {
            let back_us = u64::from(slice.before_us) + u64::from(slice.lasts_us) / 2;
            note(
                increments.end_us.saturating_sub(back_us),
                delays.gyro_s,
                Event::Slice(k),
            );
        }
        let began_us = increments.end_us.saturating_sub(increments.covered_us.into());
        for (k, force) in increments
            .forces
            .iter()
            .enumerate()
            .filter(|(_, force)| !force.is_none())
        {
            let since_us = u64::from(force.covered_us) + u64::from(force.after_us);
            note(began_us.saturating_add(since_us), delays.acc_s, Event::Force(k));
        }
        let slots_us = sample.slots_of(Kind::Accelerometer);
        let (sum_us, slots) = slots_us
            .iter()
            .filter(|slot_us| **slot_us != NO_SLOT)
            .fold((0, 0), |(sum, count), slot_us| (sum + u64::from(*slot_us), count + 1));
        if let Some(mean_us) = u64::checked_div(sum_us, slots) {
            note(sample.start_us.saturating_add(mean_us), delays.acc_s, Event::Forces);
        }
        for (plate, slot_us) in sample.slots_of(Kind::Magnetometer).iter().enumerate() {
            if *slot_us != NO_SLOT {
                note(
                    sample.start_us.saturating_add((*slot_us).into()),
                    delays.mag_s,
                    Event::Field(plate),
                );
            }
        }
        let mut of_field = [0_u8; 2];
        for (at_us, event) in &events {
            self.carry(*at_us);
            match *event {
                Event::Slice(k) => {
                    self.slice_us = *at_us;
                    self.take_slice(
                        set,
                        measured,
                        &increments.slices[k].quarters,
                        increments.slices[k].lasts_us,
                    );
                }
                Event::Force(k) => self.take_force(set, &increments.forces[k].acc_p),
                Event::Forces => self.take_force(set, &sample.reading.acc_p),
                Event::Field(plate) => {
                    if let Some(taken) = self.take_field(set, measured, plate) {
                        of_field[usize::from(taken)] += 1;
                    }
                }
            }
            self.correct();
        }
        self.mind_the_gate(of_field);
        let end_us = increments.end_us;
        let gap_s = end_us.saturating_sub(self.slice_us) as f32 * 1e-6;
        self.covariance.keep_sound() && self.is_finite() && gap_s < LONGEST_GAP_S
    }

    /// [rad/s] the rate in b.
    pub fn rate_b(&self) -> Vector3<f32> {
        Vector3::new(self.spin, 0.0, 0.0) + self.turning_b(self.across)
    }

    /// What it knows at an instant that is at most some 20 ms from its latest measurement.
    pub fn known(&self, set: &Set, at_us: u64) -> Known {
        let dt_s = seconds_between(self.at_us, at_us);
        let least_squares = least_squares(set);
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
        }
    }

    /// [rad2] covariance of the attitude in n, with what the field's model may be off by.
    pub fn covariance_n(&self) -> Matrix3<f32> {
        let along_n = self.place.field_n_ut.normalize();
        let across = Matrix3::identity() - along_n * along_n.transpose();
        self.covariance.block::<3, 3>(ATTITUDE, ATTITUDE) + across * (self.place.field_sd * self.place.field_sd)
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

    /// Attitude and angle spun after so long, of either sign.
    fn carried(&self, dt_s: f32) -> (UnitQuaternion<f32>, f32) {
        let half = 0.5 * dt_s;
        let across = [0, 1].map(|axis| (self.across[axis] + half * self.across_up[axis]) * dt_s);
        let spun = (self.spin + half * self.spin_up) * dt_s;
        let turned = from_rotation_vector(self.turning_b(across)) * from_rotation_vector(Vector3::new(spun, 0.0, 0.0));
        let earth = from_rotation_vector(self.place.earth_rate_n * -dt_s);
        (renormalised(earth * self.q_nb * turned), spun)
    }

    /// The state at another instant.
    fn carry(&mut self, at_us: u64) {
        let dt_s = seconds_between(self.at_us, at_us);
        self.at_us = at_us;
        if dt_s == 0.0 {
            return;
        }
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

    fn take_slice(&mut self, set: &Set, measured: &Measured, quarters: &[i16; PLATES], lasts_us: u16) {
        let across_b = self.across_b();
        let turning_b = self.turning_b(self.across);
        // First-order low-pass, and a mean by trapezoids over two intervals.
        let lag = self.spin * GYRO_TAU_S;
        let (_, cos) = sin_cos(self.spin * 0.5e-6 * f32::from(lasts_us));
        let left = 0.5 * (1.0 + cos) / ComplexField::sqrt(1.0 + lag * lag);
        let load = self.load();
        let gives = |quarters: &&i16| **quarters != NOT_READ && quarters.unsigned_abs() != BEYOND.unsigned_abs();
        self.seen = quarters.iter().filter(gives).count() >= 3;
        for (k, (quarters, axis)) in quarters.iter().zip(&set.gyro).enumerate() {
            if *quarters == NOT_READ {
                continue;
            }
            let sees = axis.axis_b.x + self.sees_spin[k];
            let row: [(usize, f32); 6] = [
                (SPIN, sees),
                (ACROSS, left * axis.axis_b.dot(&across_b[0])),
                (ACROSS + 1, left * axis.axis_b.dot(&across_b[1])),
                (BIAS + k, 1.0),
                (SEES_SPIN + k, self.spin),
                (BY_LOAD + k, load),
            ];
            let believed =
                sees * self.spin + left * axis.axis_b.dot(&turning_b) + self.bias[k] + self.by_load[k] * load;
            let above_c = measured.gyros_above_c[k];
            let value = |counts: f32| axis.scale_at(above_c) * (counts - axis.bias_counts_at(above_c));
            let sampled = SLICE_NOISE * axis.noise * axis.noise;
            if quarters.unsigned_abs() == BEYOND.unsigned_abs() {
                let stop = value(if *quarters > 0 { STOP_COUNTS } else { -STOP_COUNTS });
                let residual = stop - believed;
                // Only where less is believed than there is.
                if (residual > 0.0) == (*quarters > 0) {
                    let r = STOP_SD * STOP_SD;
                    self.covariance.update(&row, residual, r, f32::MAX);
                }
                continue;
            }
            let residual = value(0.25 * f32::from(*quarters)) - believed;
            let r = if self.rough > sampled { self.rough } else { sampled };
            let (off, left_over) = self.covariance.look(&row, residual, 0.0);
            let of_state = if off > 0.0 { left_over * left_over / off } else { 0.0 };
            // Where the rate is less known than the gyro, a residual says nothing of noise. What a gate refuses counts as at it.
            if of_state < r {
                let shown = (left_over * left_over - of_state).min(GATE * r);
                self.rough += (shown - self.rough) * (1.0 / ROUGH);
            }
            // A jerk is not missed for being one: what is far off weighs less, and is not left out.
            let far = left_over * left_over * (1.0 / FAR) - of_state;
            self.covariance
                .update(&row, residual, if far > r { far } else { r }, f32::MAX);
        }
    }

    fn take_force(&mut self, set: &Set, acc_p: &[[i16; 3]; PLATES]) {
        let mut used = 0;
        let counts = acc_p.as_flattened();
        let along = core::array::from_fn(|k| {
            if !WITHIN.contains(&counts[k]) {
                return 0.0;
            }
            used |= 1 << k;
            set.acc[k].value(counts[k], 0.0) - self.force_rest[k]
        });
        let [y_b, z_b] = self.across_b();
        let rate_b = self.rate_b();
        let turned_b = Vector3::new(0.0, rate_b.z, -rate_b.y) * self.spin;
        let believed = Believed {
            rate_b,
            rate_dot_b: Vector3::new(self.spin_up, 0.0, 0.0) + self.turning_b(self.across_up) + turned_b,
            across_b: [y_b, z_b],
            lever: self.lever,
        };
        let changing = self.spin * self.spin_up * 0.045;
        let mut reading = forces::Reading {
            along,
            used,
            variance: square(2.0 * FORCE_AGE_S * 2.0 * changing),
        };
        let Some(first) = forces::equations(set, &reading, &believed) else {
            return;
        };
        let found = match self.force.replace((self.at_us, first.force_b)) {
            Some((before_us, before_b)) if before_us < self.at_us => {
                let dt_s = seconds_between(before_us, self.at_us);
                let change = (first.force_b - before_b).norm() / dt_s;
                reading.variance += square(FORCE_AGE_S * change);
                forces::equations(set, &reading, &believed).unwrap_or(first)
            }
            _ => first,
        };
        let rows = |k: usize| -> [(usize, f32); forces::SEEN] {
            let [spin, spin_up, y, z, y_up, z_up, lever] = found.rows[k];
            [
                (SPIN, spin),
                (SPIN_UP, spin_up),
                (ACROSS, y),
                (ACROSS + 1, z),
                (ACROSS_UP, y_up),
                (ACROSS_UP + 1, z_up),
                (LEVER, lever),
            ]
        };
        let scale = if self.usual > 1.0 { self.usual } else { 1.0 };
        let count = found.count.min(EQUATIONS);
        let off = |covariance: &Covariance| {
            let each = (0..count).map(|k| covariance.look(&rows(k), found.residuals[k], scale).0);
            each.sum::<f32>() / count as f32
        };
        let mean = off(&self.covariance);
        // What is usual is learnt of what is no surprise.
        let surprising = if self.seen { f32::MAX } else { SURPRISE };
        let shown = scale * mean.min(SURPRISE);
        self.usual += (shown - self.usual) * (1.0 / USUAL);
        if mean > surprising && self.surprised_s <= 0.0 {
            self.surprised_s = SURPRISED_S;
            self.covariance.open(SPIN_UP, square(SURPRISED_WALK) * 0.1);
            self.covariance.open(SPIN, square(SURPRISED_WALK * 0.02));
            for axis in 0..2 {
                self.covariance.open(ACROSS_UP + axis, square(1.0));
                self.covariance.open(ACROSS + axis, square(0.05));
            }
        }
        // A reading that contradicts itself weighs less.
        let left = off(&self.covariance);
        let scale = if left > 1.0 { scale * left } else { scale };
        for k in 0..count {
            self.covariance.update(&rows(k), found.residuals[k], scale, GATE);
        }
    }

    /// [g] force along x_b beyond that of the pad.
    fn load(&self) -> f32 {
        self.force.map_or(0.0, |(_, force_b)| {
            (force_b.x - self.pad_force) * (1.0 / STANDARD_GRAVITY)
        })
    }

    /// The field of a plate; whether it was taken, `None` if it was not read whole.
    fn take_field(&mut self, set: &Set, measured: &Measured, plate: usize) -> Option<bool> {
        let first = 3 * plate;
        let present = measured.present.of(Kind::Magnetometer) >> first & 0b111;
        if present != 0b111 {
            return None;
        }
        let dcm = dcm_nb(&self.q_nb);
        let field_b = dcm.tr_mul(&self.place.field_n_ut);
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
        let mut all = true;
        for (axis_b, r) in axes.iter().zip([white + aged, white]) {
            // h . C_bn (m x a) = a . (C_nb h x m)
            let seen = (dcm * axis_b).cross(&self.place.field_n_ut);
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
                .update(row.as_slice() as Row, axis_b.dot(&residual_b), r, GATE);
            all &= off <= GATE;
        }
        Some(all)
    }

    /// A gate that stays shut opens the angle about the spin, and then all.
    fn mind_the_gate(&mut self, [refused, taken]: [u8; 2]) {
        if refused + taken == 0 {
            return;
        }
        if taken >= refused {
            self.refused = 0;
            return;
        }
        self.refused = self.refused.saturating_add(1);
        let nose_n = dcm_nb(&self.q_nb).column(0).into_owned();
        let [roll, all] = SHUT;
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

/// [counts] the end of a gyro's range, 320 deg/s.
const STOP_COUNTS: f32 = 4368.0;
/// [rad/s] how near its stop a gyro may be said to be beyond it: noise and the slice's own change.
const STOP_SD: f32 = 0.2;
/// [counts] an accelerometer that has a value.
const WITHIN: core::ops::Range<i16> = -2047..2047;
/// [rad/s] no rocket spins as fast: 30 turns a second.
const FASTEST: f32 = 200.0;

fn square(x: f32) -> f32 {
    x * x
}

/// [s] from one instant to another.
fn seconds_between(from_us: u64, to_us: u64) -> f32 {
    let us = to_us.wrapping_sub(from_us) as i64;
    us as i32 as f32 * 1e-6
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

/// The gyros' biases as a vector.
fn least_squares(set: &Set) -> SMatrix<f32, 3, PLATES> {
    let axes_b = set.gyro.map(|axis| axis.axis_b);
    crate::redundancy::matrix(&axes_b, 0b1111)
        .map(|(matrix, _)| matrix)
        .unwrap_or_default()
}
