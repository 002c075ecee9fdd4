//! What a window measured against the state: bias at rest, velocity, field; and the correction that makes.
//!
//! In: the window's measurements and the covariance before it. Out: the correction, scalar by scalar, whether each kind was
//! accepted, and the state with the correction. In four stages, which may be as many steps ([`super::pending`]): what
//! gyros go on to say meanwhile turns the attitude on the side of b, and its error stands on that of n. Only what the
//! gyros' own error adds to it meanwhile comes with it, by the drive of the window that has begun.

use nalgebra::{Matrix3, UnitQuaternion, Vector2, Vector3};

use super::{
    Filter, Outcome, Quantity,
    innovation::{Correction, Noise, Scalar},
    pending::Pending,
    spell::Shown,
    state::{DRIVEN, GYRO_MATRIX, Row, State, VELOCITY, dot},
};
use crate::attitude::{dcm_nb, from_rotation_vector, renormalised};

impl Filter {
    /// First: the bias at rest, and what the means see of the covariance.
    pub(super) fn look(&mut self) {
        self.correction.begin(self.params.gate);
        match self.measured.bias_b {
            Some(bias_b) => self.compare_rest(&bias_b),
            None => self.contradicted = None,
        }
        self.covariance
            .means_seen(&self.pending.passage, &mut self.measured.seen);
    }

    /// Fourth: the state has the correction. An attitude that is found afresh does without: it was found in the axes that the
    /// window was gathered in, before any correction of them.
    pub(super) fn correct(&mut self, outcome: &mut Outcome) {
        outcome.aligned = self.recover();
        if outcome.aligned {
            self.correction.error.driven = [0.0; DRIVEN];
        }
        // There is room for all.
        let _ = outcome.innovations.extend_from_slice(&self.correction.innovations);
        // In two parts: more than 64 bytes at once are copied by a call of eighty instructions.
        let State { driven, drivers } = self.correction.error;
        self.correct_by(&State { driven, drivers });
    }

    /// The state without an error as it is at the end of the latest window.
    #[inline(never)]
    pub(super) fn correct_by(&mut self, error: &State) {
        let [north, east, down, to_north, to_east] = error.driven;
        let mut rotation_n = Vector3::new(north, east, down);
        if self.window.duration_s > 0.0 {
            rotation_n += Vector3::from(self.window.drive.each_ref().map(|drive| dot(drive, &error.drivers)));
        }
        let (bias, matrix) = error.drivers.split_at(GYRO_MATRIX);
        self.bias_b += Vector3::from_row_slice(bias);
        self.gyro_matrix += Matrix3::from_row_slice(matrix);
        self.velocity_n += Vector2::new(to_north, to_east);
        self.turn(&from_rotation_vector(rotation_n));
        if !self.is_finite() {
            self.begin_anew();
        }
    }

    /// Turns the axes of n: the attitude, and what is gathered in them.
    pub(super) fn turn(&mut self, rotation: &UnitQuaternion<f32>) {
        self.q_nb = renormalised(rotation * self.q_nb);
        self.window.turn_axes(&dcm_nb(rotation));
    }

    /// Second. The velocity is bounded: zero is measured of it. What it gained in the window, it gained by the mean tilt.
    pub(super) fn compare_velocity(&mut self) {
        let (tilt, means) = (self.pending.passage.tilt, &self.measured.means);
        self.measured.velocity_accepted = None;
        if !means.vertical {
            self.velocity_n = Vector2::zeros();
            return;
        }
        let noise = Noise::lasting(means.velocity_variance, self.params.velocity_lasts_s, means.duration_s);
        let mut accepted = true;
        for (axis, (seen, factor)) in [(1, -tilt), (0, tilt)].into_iter().enumerate() {
            let mut column = self.covariance.of_driven(VELOCITY + axis);
            column.add(&self.measured.seen[seen], factor);
            let scalar = Scalar {
                quantity: Quantity::Velocity,
                predicted: self.velocity_n[axis],
                measured: 0.0,
                row: Row::Velocity(axis),
                noise,
            };
            accepted &= compare(&mut self.pending, &mut self.correction, &scalar, &column);
        }
        self.measured.velocity_accepted = Some(accepted);
    }

    /// Third. The mean field against the reference, across it: east and in the meridian. In a [`spell`](super::spell) it is used for
    /// what it is, and says that the attitude is another only when it has contradicted it for longer than it stood by it.
    pub(super) fn compare_field(&mut self) {
        self.measured.field_accepted = None;
        let Some(compared) = &self.measured.compared else {
            return;
        };
        let (params, duration_s) = (&self.params, self.measured.means.duration_s);
        let mut accepted = true;
        for scalar in &compared.scalars {
            let row = self.pending.passage.mean_row(&scalar.row_n);
            let column = State::combined(&self.measured.seen, &scalar.row_n);
            let mut compared_with = Scalar {
                quantity: scalar.quantity,
                predicted: 0.0,
                measured: scalar.residual,
                row: Row::Of(&row),
                noise: scalar.noise,
            };
            let Some((before, own)) = self.pending.next(&column, &compared_with.row) else {
                continue;
            };
            let looked = self.correction.look(&compared_with, before, own);
            if scalar.quantity == Quantity::FieldEast {
                self.correction.usable = self.spell.go_on(
                    params,
                    &Shown {
                        duration_s,
                        disturbance: compared.disturbance,
                        residual: looked.residual,
                        of_state: looked.of_state,
                        of_reference: compared.of_reference,
                        horizontal: compared.horizontal,
                    },
                );
            }
            if self.spell.lasts() && self.correction.usable {
                compared_with.noise = self.spell.noise(duration_s).and_white(scalar.noise.alone);
            }
            let is_accepted = self.correction.judge(&compared_with, &looked, own);
            if is_accepted {
                self.pending.keep();
            }
            accepted &= is_accepted;
        }
        self.correction.usable = true;
        self.measured.field_accepted = self.spell.judge(accepted, duration_s);
    }
}

/// A scalar, of whose `P h'` the passage is still to be made.
pub(super) fn compare(pending: &mut Pending, correction: &mut Correction, scalar: &Scalar, start: &State) -> bool {
    let Some((before, own)) = pending.next(start, &scalar.row) else {
        return true;
    };
    let looked = correction.look(scalar, before, own);
    let accepted = correction.judge(scalar, &looked, own);
    if accepted {
        pending.keep();
    }
    accepted
}
