//! When a rocket's spin is followed by a filter of its own, and the way there and back.
//!
//! In: each cycle. Out: whether [`Spin`] has it. It begins at lift-off, or without that line when the unit turns about x_b at
//! [`BEGINS`], and in a unit that was reset meanwhile when two gyros stand at their stops. It ends when the spin was below [`ENDS`]
//! for [`QUIET`] cycles with no gyro at its stop; then the filter of slow motion goes on from what was found. Between the two
//! limits nothing changes, so that a rate near one of them does not switch to and fro.
//!
//! Refuses to begin without an attitude, a field, or slices of the gyros (periods of more than a fifth of a second have no place for
//! them all): the filter of slow motion then carries on as it can.

use nalgebra::{Matrix3, Vector3};

use super::{Estimate, Estimator, parts};
use crate::{
    calibration::Measured,
    faults::Vectors,
    geometry::TRIAD_AXES,
    increments::{Increments, Slice, slices::BEYOND},
    kalman::{self, Delays, Outage, Params},
    sample::Sample,
    spin::{self, Spin, Start, Surroundings, pad::Pad},
};

/// [rad/s] the spin at which it begins: 77 % of what the first gyro to stop can see of it, so that a second of spin-up at half a
/// turn a second in a second leaves some packets before; faster than the tables of a laboratory (200 deg/s).
const BEGINS: f32 = 4.5;
/// \[1\] and by so much the spin must exceed the rate across it: a hand turns a unit about any axis.
const MOSTLY: f32 = 5.0;
/// [rad/s] the spin below which it may end.
const ENDS: f32 = 1.0;
/// Cycles for which it must have been: 5 s at 5 Hz, far longer than a motor's ignition or a yo-yo lasts.
const QUIET: u8 = 25;
/// [rad/s] what is known of a component of the rate at the begin: the gyros' noise and a change of some rad/s2.
const RATE_SD: f32 = 0.05;
/// [rad/s] spin that is taken for a start where the gyros say no more than that it is beyond them, and how far it may be off.
const UNSEEN: [f32; 2] = [12.0, 6.0];
/// \[us\] longest period whose slices have all a place.
const LONGEST_US: u32 = 250_000;

/// The spin's filter, while it is on.
#[derive(Clone, Debug)]
pub(super) struct Boost {
    spin: Option<Spin>,
    pad: Pad,
    lifted: bool,
    quiet: u8,
}

impl Boost {
    /// Before lift-off.
    pub const WAITING: Boost = Boost {
        spin: None,
        pad: Pad::EMPTY,
        lifted: false,
        quiet: 0,
    };

    /// Keeps the spin's filter, if it has the cycles: then what was kept is as old as it is, and the filter's own bytes have that time.
    pub fn keep(&mut self, of_filter: &mut [u8; kalman::KEPT_BYTES], of_spin: &mut [u8]) {
        let of_spin = of_spin.first_chunk_mut();
        match (&mut self.spin, of_spin) {
            (Some(spin), Some(bytes)) => {
                spin.keep(bytes);
                of_filter[..8].copy_from_slice(&spin.at_us().to_le_bytes());
            }
            (_, Some(bytes)) => *bytes = [0; spin::kept::KEPT_BYTES],
            _ => {}
        }
    }

    /// Whether the spin's filter has the cycles.
    pub fn is_on(&self) -> bool {
        self.spin.is_some()
    }
}

/// Gyros of a slice at their stops, and the sign of the first of them.
fn stopped(slice: &Slice) -> (usize, i16) {
    let at_stop = |quarters: &&i16| quarters.unsigned_abs() == BEYOND.unsigned_abs();
    let count = slice.quarters.iter().filter(at_stop).count();
    (count, slice.quarters[0].signum())
}

impl Estimator {
    /// A cycle before lift-off: what it tells of each sensor.
    #[inline(never)]
    pub(super) fn learn_on_pad(
        &mut self,
        sample: &Sample,
        measured: &Measured,
        increments: &Increments,
        vectors: &Vectors,
    ) {
        let force = (vectors.force_b.used == 0xFFF).then(|| {
            let counts = sample.reading.acc_p.as_flattened();
            let beyond = |k: usize| {
                let axis = &self.set.acc[k];
                axis.value(counts[k], 0.0) - axis.axis_b.dot(&vectors.force_b.vector_b)
            };
            let each = core::array::from_fn::<f32, TRIAD_AXES, _>(beyond);
            (vectors.force_b.vector_b.x, each)
        });
        let pad = &mut self.boost.pad;
        pad.take(&self.set, &measured.gyros_above_c, increments, force);
        if let Some(sd) = pad.force_sd() {
            self.filter.params.acc_error = Params::ROOM.acc_error.max(sd);
        }
    }

    /// A cycle outside the spin: whether the spin begins.
    pub(super) fn see_about_boost(&mut self, lift_off: bool, increments: &Increments, vectors: &Vectors) {
        let lifts = lift_off && !core::mem::replace(&mut self.boost.lifted, lift_off);
        let rate_b = vectors.rate_b.vector_b - self.filter.bias_b;
        let [along, across] = [rate_b.x * rate_b.x, rate_b.y * rate_b.y + rate_b.z * rate_b.z];
        let spins = along > BEGINS * BEGINS && along > MOSTLY * MOSTLY * across;
        if lift_off || spins {
            self.begin_boost(lifts || spins, lift_off, &rate_b, increments);
        }
    }

    /// Begins if it spins or lifts off, or has lifted off and spins too fast for the gyros.
    #[inline(never)]
    fn begin_boost(&mut self, seen: bool, lift_off: bool, rate_b: &Vector3<f32>, increments: &Increments) {
        let [first, ..] = &increments.slices;
        if !self.filter.aligned || first.is_none() || increments.covered_us > LONGEST_US {
            return;
        }
        let latest = increments.slices.iter().rfind(|slice| !slice.is_none());
        let (stopped, sign) = latest.map(stopped).unwrap_or_default();
        let unseen = lift_off && stopped >= 2;
        if !(seen || unseen) {
            return;
        }
        let delays = self.filter.params.delays;
        let at_us = increments.end_us.saturating_sub((delays.gyro_s * 1e6) as u64);
        let Some(surroundings) = self.surroundings(delays) else {
            return;
        };
        let covariance_n = self.filter.attitude_covariance_n();
        let nose_n = crate::attitude::dcm_nb(&self.filter.q_nb).column(0).into_owned();
        let lost = nose_n * nose_n.transpose() * (core::f32::consts::PI * core::f32::consts::PI);
        let (rate_b, rate_sd, covariance_n) = if unseen {
            // The first gyro looks against x_b.
            let spin = if sign > 0 { -UNSEEN[0] } else { UNSEEN[0] };
            (Vector3::new(spin, 0.0, 0.0), UNSEEN[1], covariance_n + lost)
        } else {
            (*rate_b, RATE_SD, covariance_n)
        };
        let start = Start {
            at_us,
            q_nb: self.filter.q_nb,
            covariance_n,
            rate_b,
            rate_sd,
            bias_b: self.filter.bias_b,
            bias_variance: self.filter.bias_covariance_b().trace() / 3.0,
            pad: &self.boost.pad,
            iron_b: self.filter.iron.iron_b,
            iron_covariance: self.filter.iron.covariance,
            surroundings,
        };
        self.boost.spin = Some(Spin::begin(&start, &self.set));
        self.boost.quiet = 0;
    }

    /// Goes on in the spin after a reset, if it was on.
    pub(super) fn resume_boost(&mut self, of_spin: &[u8], outage: Outage) {
        let (Some(bytes), Some(surroundings)) = (of_spin.first_chunk(), self.surroundings(self.filter.params.delays))
        else {
            return;
        };
        let start = Start {
            at_us: 0,
            q_nb: self.filter.q_nb,
            covariance_n: Matrix3::zeros(),
            rate_b: Vector3::zeros(),
            rate_sd: 0.0,
            bias_b: Vector3::zeros(),
            bias_variance: 0.0,
            pad: &Pad::EMPTY,
            iron_b: Vector3::zeros(),
            iron_covariance: Matrix3::zeros(),
            surroundings,
        };
        self.boost.spin = Spin::resumed(bytes, outage, &start, &self.set);
    }

    fn surroundings(&self, delays: Delays) -> Option<Surroundings> {
        let params = &self.filter.params;
        Some(Surroundings {
            field_n_ut: self.filter.reference.field_n_ut()?,
            field_sd: params.heading_sd,
            earth_rate_n: params.earth_rate_n,
            bias_per_g: params.bias_per_g,
            delays,
        })
    }

    /// A cycle of the spin.
    #[inline(never)]
    pub(super) fn go_on_in_boost(
        &mut self,
        sample: &Sample,
        measured: &Measured,
        increments: &Increments,
        vectors: &Vectors,
    ) -> Estimate {
        self.boost.lifted |= sample.reading.lift_off;
        let Some(spin) = &mut self.boost.spin else {
            return Estimate::NOTHING;
        };
        if !spin.take(&self.set, sample, measured, increments) {
            self.boost.spin = None;
            self.filter.forget();
            self.settlements = None;
            return self.estimate(vectors);
        }
        let known = spin.known(&self.set, increments.end_us);
        self.covariance_n = {
            let p = &known.covariance;
            [p[(0, 0)], p[(0, 1)], p[(0, 2)], p[(1, 1)], p[(1, 2)], p[(2, 2)]]
        };
        self.bias_sd = [3, 4, 5].map(|k| nalgebra::ComplexField::sqrt(known.covariance[(k, k)].max(0.0)));
        let at_stop = increments.slices.iter().any(|slice| stopped(slice).0 > 0);
        self.boost.quiet = if known.rate_b.norm() < ENDS && !at_stop {
            self.boost.quiet.saturating_add(1)
        } else {
            0
        };
        if self.boost.quiet >= QUIET {
            let delays = self.filter.params.delays;
            let true_us = increments.end_us.saturating_sub((delays.gyro_s * 1e6) as u64);
            self.filter.go_on(increments.end_us, &spin.known(&self.set, true_us));
            self.boost.spin = None;
            self.settlements = None;
        }
        self.estimate_with(vectors, Some(parts(known.q_nb)), known.bias_b)
    }
}
