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
//! **Propagation** is exact for the attitude: `q <- q(-earth rate dt - C wrong) q q(increment)` with what the gyros are
//! known to be wrong by, in the mean attitude `C` of the step (`path`). The error obeys
//! `da/dt = -dcm_nb (db + dM gyro)`; its integral over a window is gathered sample by sample and the covariance follows
//! once a window.
//!
//! **Accelerometers** measure tilt only as far as the velocity is bounded: what a tilt `a` adds to the horizontal
//! velocity, `dv/dt = -g (a_E, -a_N)`, goes on growing, what hand, wind or table do to it does not. So specific force is
//! summed in n to a velocity and compared with zero, once a window. Single samples of a shaken unit are worth nothing,
//! ten seconds of them are worth a tenth of a degree. What moves too fast for the samples is seen in their second
//! differences, or, where it is folded down to nothing that moves, along the vertical.
//!
//! **Magnetometers** are averaged in n over the window and compared with the reference along two axes across the field:
//! east (heading) and in the meridian (dip), each with its own variance. What norm and dip show of a disturbance says
//! how large it is, and a disturbance has no preferred direction: that variance is added to both.
//!
//! **What is wrong with both lasts** longer than a window: a corner of the room has its own north, a hand its own sway. The gain
//! takes such windows for one witness ([`Params::field_lasts_s`]), by a variance as many times larger; the record of an
//! innovation has the variance that its residual shows.
//!
//! Scalars one at a time, Joseph's form, a gate each. What is rejected for [`Params::recovery_s`] starts the attitude
//! afresh with TRIAD, so no gate locks the filter out; so does an attitude that is no longer known to
//! [`Params::lost_sd`].
//!
//! Refuses (and says so, [`Refusal`]) steps that are not finite or do not go forward in time; a gap longer than
//! [`Params::longest_gap_s`] starts the attitude afresh. The state is finite whatever comes in.

mod compare;
mod covariance;
mod field;
mod field_sums;
mod innovation;
mod iron;
mod joseph;
mod kept;
mod known;
mod measured;
mod nose;
mod params;
mod passage;
mod path;
mod pending;
mod propagate;
mod rest;
mod settle;
mod spell;
mod start;
mod state;
mod step;
mod window;

use nalgebra::{Matrix3, UnitQuaternion, Vector2, Vector3};

pub use self::{
    covariance::Covariance,
    field::Reference,
    innovation::{INNOVATIONS, Innovation, Innovations, Quantity},
    iron::HardIron,
    kept::{KEPT_BYTES, Outage},
    known::Known,
    nose::Nose,
    params::{Delays, Params, Rest},
    state::STATES,
    step::{Outcome, Refusal, Sampled, Step},
};
use self::{
    field_sums::{FieldSums, MeanField},
    innovation::Correction,
    kept::Going,
    measured::Measured,
    passage::walks,
    pending::{Pace, Pending, Stage},
    rest::Contradicted,
    spell::Spell,
    start::UNKNOWN,
    state::are_finite,
    window::Window,
};
use crate::attitude::from_rotation_vector;

/// The filter: its parameters and its whole state.
#[derive(Clone, Debug)]
pub struct Filter {
    /// Parameters.
    pub params: Params,
    /// Attitude at the gyros' latest true instant. Until [`Filter::aligned`], relative to where the window began.
    pub q_nb: UnitQuaternion<f32>,
    /// [rad/s] gyro bias in b.
    pub bias_b: Vector3<f32>,
    /// \[1\] gyro matrix error: `rate = (1 - matrix) gyro - bias`.
    pub gyro_matrix: Matrix3<f32>,
    /// [m/s] velocity north and east, as far as it is bounded.
    pub velocity_n: Vector2<f32>,
    /// Covariance of the error state, but for what is pending.
    covariance: Covariance,
    /// What the latest window measured.
    measured: Measured,
    /// What that corrects.
    correction: Correction,
    /// What it still has to do.
    pending: Pending,
    /// Nothing of it but what is known of the iron is to be done in the next step.
    spared: bool,
    /// How often the covariance was complete, round and round.
    settlements: u8,
    /// Rounding made a variance negative.
    unsound: bool,
    /// The field that is expected.
    pub reference: Reference,
    /// Hard iron that the calibration does not know.
    pub iron: HardIron,
    /// Whether the attitude has been found.
    pub aligned: bool,
    window: Window,
    rate_b: Vector3<f32>,
    /// [rad/s] as the gyros had it at the end of the step before.
    gyro_b: Option<Vector3<f32>>,
    last_us: Option<u64>,
    /// \[s\] since the gyros were last heard.
    silent_s: f32,
    /// \[s\] for how long each kind of measurement has been rejected without a break: velocity, field.
    rejected_s: [f32; 2],
    /// The field is not the reference's.
    spell: Spell,
    /// The window before was one of rest.
    rested: bool,
    /// Rest contradicts the bias without a break.
    contradicted: Option<Contradicted>,
    /// How it goes on after a reset, until the gyros are heard.
    going: Option<Going>,
    /// [rad^2] covariance in n of an attitude from before, for when the first window finds none.
    known_before: Option<Matrix3<f32>>,
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
            measured: Measured::nothing(),
            correction: Correction::default(),
            pending: Pending::nothing(),
            spared: false,
            settlements: 0,
            unsound: false,
            reference: params.field,
            iron: HardIron::none(&params),
            aligned: false,
            window: Window::EMPTY,
            rate_b: Vector3::zeros(),
            gyro_b: None,
            last_us: None,
            silent_s: 0.0,
            rejected_s: [0.0; 2],
            spell: Spell::default(),
            rested: false,
            contradicted: None,
            going: None,
            known_before: None,
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

    /// [rad^2] covariance of the attitude's error as a small rotation vector in n, as of the last window, with what the field
    /// [contradicts](Filter::doubt).
    pub fn attitude_covariance_n(&self) -> Matrix3<f32> {
        let mut covariance_n = self.covariance().attitude();
        covariance_n.m33 += self.doubt();
        covariance_n
    }

    /// [rad^2] by how much the attitude about the vertical is in doubt beside its covariance, because the field contradicts it.
    pub fn doubt(&self) -> f32 {
        self.spell.doubt()
    }

    /// [rad/s] bias covariance in b.
    pub fn bias_covariance_b(&self) -> Matrix3<f32> {
        self.covariance().bias()
    }

    /// Takes a step.
    pub fn step(&mut self, step: &Step) -> Outcome {
        let mut outcome = Outcome::default();
        self.take(step, &mut outcome);
        outcome
    }

    /// Takes a step, and adds what it led to to an outcome that is empty yet: moving one costs as much as some steps.
    pub fn take(&mut self, step: &Step, outcome: &mut Outcome) {
        let rotation = step.is_a_rotation();
        if rotation {
            self.bridge(step);
        }
        let since_s = match self.last_us {
            Some(last_us) if step.at_us <= last_us => {
                outcome.refusal = Some(Refusal::NotLater);
                return;
            }
            Some(last_us) => seconds(step.at_us - last_us),
            None if rotation => step.covered_s,
            None => 0.0,
        };
        self.last_us = Some(step.at_us);
        if !rotation {
            outcome.refusal = Some(Refusal::NotARotation);
        }
        let covered_s = match rotation {
            true if step.covered_s < since_s => step.covered_s,
            true => since_s,
            false => 0.0,
        };
        let gap_s = since_s - covered_s;
        if self.silent_s + gap_s >= self.params.longest_gap_s {
            outcome.refusal = Some(Refusal::Gap);
            self.lose(since_s, outcome);
            return;
        }
        let dcm_nb = self.propagate(step, covered_s, gap_s, rotation);
        if rotation {
            self.gather(step, &dcm_nb);
        }
        if self.window.duration_s >= self.params.window_s - HALF_A_MILLISECOND {
            self.settle(outcome);
            self.close(outcome, step.lift_off);
            if since_s >= LONG_STEP_S {
                self.correct_now(outcome);
            }
        } else if !self.pending.is_done() && (!self.spared || self.pending.stage() == Stage::Learn) {
            let pace = if since_s < LONG_STEP_S || self.spared {
                Pace::Small
            } else {
                Pace::Large
            };
            self.work(pace, outcome);
        }
        self.spared = false;
    }

    /// A window is complete: everything it measured. What that says of the state, and does to the covariance, is pending.
    fn close(&mut self, outcome: &mut Outcome, lift_off: bool) {
        let means = self.window.means(&self.params, lift_off);
        // The first window of a rest still holds how the motion ended.
        let rests = core::mem::replace(&mut self.rested, means.rest) && means.rest;
        self.measured.means = means;
        self.measured.sums = *self.window.field();
        if !self.aligned {
            self.learn_iron();
        }
        let sums = self.measured.sums.if_any();
        self.measured.field = sums.map(|sums| self.mean_field(sums));
        if !self.aligned {
            // Of what a window does to it nothing else lasts until there is an attitude.
            self.covariance.drift(&walks(&self.params, means.duration_s));
            self.window.follow(&means);
            outcome.aligned = self.align(UNKNOWN) || self.fall_back();
            self.known_before = None;
            if !outcome.aligned {
                self.covariance.forget_attitude();
            }
            self.settlements = self.settlements.wrapping_add(1);
            self.keep_finite();
            return;
        }
        self.velocity_n += means.velocity_change_n;
        self.pending.passage.become_of(&self.params, &self.window, &means);
        self.measured.bias_b =
            rests.then(|| means.rate_b - self.q_nb.inverse_transform_vector(&self.params.earth_rate_n));
        if let Some(sums) = self.measured.sums.if_any() {
            let iron_b = &self.iron.iron_b;
            self.reference.learn(&self.params, means.duration_s, sums, iron_b);
        }
        let (reference, params) = (&self.reference, &self.params);
        self.measured.compared =
            (self.measured.field.as_ref()).and_then(|mean| reference.compare(params, means.duration_s, mean));
        self.window.follow(&means);
        self.pending.begin();
    }

    /// The iron, from the window's field.
    pub(super) fn learn_iron(&mut self) {
        let (iron_b, duration_s) = (self.iron.iron_b, self.measured.means.duration_s);
        if let Some(sums) = self.measured.sums.if_any() {
            if self.iron.learn(&self.params, duration_s, sums) {
                self.reference.have_other_iron(&self.params, &iron_b);
            }
            self.reference.follow(&self.params, &self.iron.iron_b);
        }
        self.keep_finite();
    }

    /// The mean field of a window without the iron, as far as that is known.
    fn mean_field(&self, sums: &FieldSums) -> MeanField {
        let mut mean = sums.mean(&self.iron.iron_b);
        mean.iron = self.iron.variance(sums);
        mean.white += mean.iron;
        mean
    }

    /// Begins anew unless all is finite: nothing can lead there with finite input; the radiation that flips a bit can.
    fn keep_finite(&mut self) {
        if !self.is_finite() || !self.iron.is_finite() {
            self.begin_anew();
        }
    }

    /// Not inlined: another filter would lie on the stack of every step.
    #[cold]
    #[inline(never)]
    fn begin_anew(&mut self) {
        *self = Filter::new(self.params);
    }

    /// Of the state; the covariance is looked at when its work is done, the iron when it is learnt.
    fn is_finite(&self) -> bool {
        are_finite(self.q_nb.as_vector().as_slice())
            && are_finite(self.bias_b.as_slice())
            && are_finite(self.gyro_matrix.as_slice())
            && are_finite(self.velocity_n.as_slice())
    }
}

/// \[s\] steps of this length or more have the correction with the window, and take large stages of what else is pending.
const LONG_STEP_S: f32 = 0.05;

/// Steps need not add up to a window to the microsecond.
const HALF_A_MILLISECOND: f32 = 5e-4;

/// Of microseconds. A conversion of 64 bits is a call on the target.
pub(crate) fn seconds(us: u64) -> f32 {
    let (high, low) = ((us >> 32) as u32, us as u32);
    high as f32 * 4_294.967_3 + low as f32 * 1e-6
}

/// The number, or the floor if it is below that or none. `f32::max` is a call on the target.
fn at_least(floor: f32, x: f32) -> f32 {
    if x > floor { x } else { floor }
}

fn square(x: f32) -> f32 {
    x * x
}

#[cfg(test)]
mod tests;
