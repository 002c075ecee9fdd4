//! What a window measured against the state: bias at rest, velocity, field.
//!
//! In: the window's means and the covariance before it. Out: the correction, scalar by scalar, and whether each kind was
//! accepted.

use super::{
    Filter, Quantity,
    innovation::{Correction, Noise, Scalar},
    square,
    state::{Row, State, VELOCITY},
    window::Means,
};

impl Filter {
    /// At rest the gyros measure their own bias and the Earth's rate. What rest shows for [`Params::recovery_s`] is true
    /// whatever was believed before.
    pub(super) fn compare_rest(&mut self, means: &Means, correction: &mut Correction) {
        let earth_b = self.q_nb.inverse_transform_vector(&self.params.earth_rate_n);
        let noise = Noise::white(square(self.params.rest.bias_sd) + means.rate_variance);
        if self.bias_rejected_s >= self.params.recovery_s {
            self.bias_rejected_s = 0.0;
            self.covariance.forget_bias(self.params.bias_sd);
        }
        let mut accepted = true;
        for axis in 0..3 {
            let scalar = Scalar {
                quantity: Quantity::Bias,
                predicted: self.bias_b[axis],
                measured: means.rate_b[axis] - earth_b[axis],
                row: Row::Driver(axis),
                noise,
            };
            accepted &= self.compare(&scalar, &self.covariance.of_driver(axis), correction);
        }
        self.bias_rejected_s = if accepted {
            0.0
        } else {
            self.bias_rejected_s + means.duration_s
        };
    }

    /// The velocity is bounded: zero is measured of it. What it gained in the window, it gained by the mean tilt.
    pub(super) fn compare_velocity(&mut self, means: &Means, start: &[State; 3], correction: &mut Correction) -> bool {
        let tilt = self.pending.passage.tilt;
        let noise = Noise::lasting(means.velocity_variance, self.params.velocity_lasts_s, means.duration_s);
        let mut accepted = true;
        for (axis, (mean, factor)) in [(&start[1], -tilt), (&start[0], tilt)].into_iter().enumerate() {
            let mut column = self.covariance.of_driven(VELOCITY + axis);
            column.add(mean, factor);
            let scalar = Scalar {
                quantity: Quantity::Velocity,
                predicted: self.velocity_n[axis],
                measured: 0.0,
                row: Row::Velocity(axis),
                noise,
            };
            accepted &= self.compare(&scalar, &column, correction);
        }
        accepted
    }

    /// A scalar, of whose `P h'` the passage is still to be made.
    fn compare(&mut self, scalar: &Scalar, start: &State, correction: &mut Correction) -> bool {
        let Some((before, own)) = self.pending.next(start, &scalar.row) else {
            return true;
        };
        let accepted = correction.compare(scalar, before, own);
        if accepted {
            self.pending.keep();
        }
        accepted
    }

    /// The mean field against the reference, across it: east and in the meridian. `None` where the field is too
    /// disturbed for its rejection to say anything of the attitude.
    pub(super) fn compare_field(
        &mut self,
        means: &Means,
        start: &[State; 3],
        correction: &mut Correction,
    ) -> Option<bool> {
        let sums = self.window.field()?;
        self.reference
            .learn(&self.params, means.duration_s, sums, &self.iron.iron_b);
        let mean = self.mean_field(sums);
        let compared = self.reference.compare(&self.params, means.duration_s, &mean)?;
        let disturbed = compared.disturbance > square(self.params.field_gate);
        self.disturbed_s = if disturbed {
            self.disturbed_s + means.duration_s
        } else {
            0.0
        };
        correction.usable = !disturbed || self.disturbed_s > self.params.coast_s;
        let mut accepted = true;
        for scalar in &compared.scalars {
            let row = self.pending.passage.mean_row(&scalar.row_n);
            let column = State::combined(start, &scalar.row_n);
            let scalar = Scalar {
                quantity: scalar.quantity,
                predicted: 0.0,
                measured: scalar.residual,
                row: Row::Of(&row),
                noise: scalar.noise,
            };
            accepted &= self.compare(&scalar, &column, correction);
        }
        correction.usable = true;
        (!disturbed).then_some(accepted)
    }
}
