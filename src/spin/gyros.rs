//! A slice of the gyros: each for itself.
//!
//! In: the four integrals of a slice. Out: the state corrected by `z_i = n_i . (w_x, g T u) + sees_i w_x + b_i + l_i load`, and the
//! noise that the residuals show. A gyro at its stop is an inequality.

use nalgebra::ComplexField;

use super::{
    GATE, Spin,
    covariance::{ACROSS, BIAS, BY_LOAD, SEES_SPIN, SPIN},
};
use crate::{
    attitude::sin_cos,
    calibration::{Measured, Set},
    geometry::PLATES,
    increments::slices::BEYOND,
    sample::NOT_READ,
};

/// \[s\] time constant of the gyros' low-pass (12.7 Hz).
const GYRO_TAU_S: f32 = 0.0125;
/// Parts of a slice's noise that its neighbours do not have: trapezoids over two intervals share their ends.
const SLICE_NOISE: f32 = 0.5;
/// Square of the standard deviations from which a gyro's sample weighs less.
const FAR: f32 = 9.0;
/// Of how many gyro residuals their noise is the mean: a second of three.
const ROUGH: f32 = 150.0;
/// \[counts\] the end of a gyro's range, 320 deg/s.
const STOP_COUNTS: f32 = 4368.0;
/// [rad/s] how near its stop a gyro may be said to be beyond it: noise and the slice's own change.
const STOP_SD: f32 = 0.2;

impl Spin {
    pub(super) fn take_slice(&mut self, set: &Set, measured: &Measured, quarters: &[i16; PLATES], lasts_us: u16) {
        let across_b = self.across_b();
        let turning_b = self.turning_b(self.across);
        // First-order low-pass, and a mean by trapezoids over two intervals.
        let lag = self.spin * GYRO_TAU_S;
        let (_, cos) = sin_cos(self.spin * 0.5e-6 * f32::from(lasts_us));
        let left = 0.5 * (1.0 + cos) / ComplexField::sqrt(1.0 + lag * lag);
        let load = self.load();
        let gives = |quarters: &&i16| **quarters != NOT_READ && quarters.unsigned_abs() != BEYOND.unsigned_abs();
        self.seen = quarters.iter().filter(gives).count() >= 3;
        self.answering =
            (quarters.iter().enumerate()).fold(0, |all, (k, quarters)| all | u16::from(*quarters != NOT_READ) << k);
        let lasts_s = 1e-6 * f32::from(lasts_us);
        self.lasting.last(lasts_s);
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
            let r = if far > r { far } else { r };
            if k == self.lasting.gyro {
                self.lasting.sampled = sampled;
                let off = left_over / ComplexField::sqrt(of_state + r);
                self.lasting.hear(off, self.spin, self.phase, lasts_s);
            }
            self.lasting
                .tell(0.5 * left * left * (1.0 - axis.axis_b.x * axis.axis_b.x) / r);
            self.covariance.update(&row, residual, r, f32::MAX);
        }
    }
}
