//! One sense axis of one sensor: which way it points, what a count is worth, how sure that is.

use nalgebra::{ComplexField, Vector3};

/// A sense axis. The unit is that of its kind: m/s2, uT or rad/s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Axis {
    /// Unit vector in b it measures along.
    pub axis_b: Vector3<f32>,
    /// [unit/count] at the reference temperature.
    pub scale: f32,
    /// \[counts\] output without input, at the reference temperature.
    pub bias_counts: f32,
    /// [counts/degC] change of the bias.
    pub bias_per_c: f32,
    /// [counts/degC2] change of that.
    pub bias_per_c2: f32,
    /// [1/degC] relative change of the scale.
    pub scale_per_c: f32,
    /// [unit] standard deviation of the white noise of one sample. Large: counts less, and its faults are seen later.
    /// Small: the contrary, and below the truth it gives false alarms.
    pub noise: f32,
}

impl Axis {
    /// An axis with `sensitivity_b` [counts/unit] along each direction of b, without change over temperature.
    ///
    /// A sensitivity of zero gives an axis that no set is accepted with.
    pub fn from_sensitivity(sensitivity_b: Vector3<f32>, bias_counts: f32, noise: f32) -> Self {
        let counts_per_unit = ComplexField::sqrt(sensitivity_b.norm_squared());
        Axis {
            axis_b: sensitivity_b / counts_per_unit,
            scale: 1.0 / counts_per_unit,
            bias_counts,
            bias_per_c: 0.0,
            bias_per_c2: 0.0,
            scale_per_c: 0.0,
            noise,
        }
    }

    /// \[counts\] without input, `above_c` \[degC\] above the reference.
    pub fn bias_counts_at(&self, above_c: f32) -> f32 {
        self.bias_counts + above_c * (self.bias_per_c + above_c * self.bias_per_c2)
    }

    /// [unit/count] `above_c` \[degC\] above the reference.
    pub fn scale_at(&self, above_c: f32) -> f32 {
        self.scale * (1.0 + self.scale_per_c * above_c)
    }

    /// [unit] what it measured along itself.
    pub fn value(&self, counts: i16, above_c: f32) -> f32 {
        self.scale_at(above_c) * (f32::from(counts) - self.bias_counts_at(above_c))
    }

    /// The parameters in their written order.
    pub(super) fn numbers(&self) -> [f32; 9] {
        let [x, y, z] = self.axis_b.into();
        [
            x,
            y,
            z,
            self.scale,
            self.bias_counts,
            self.bias_per_c,
            self.bias_per_c2,
            self.scale_per_c,
            self.noise,
        ]
    }

    /// Of parameters in their written order.
    pub(super) fn of_numbers(numbers: [f32; 9]) -> Self {
        let [x, y, z, scale, bias_counts, bias_per_c, bias_per_c2, scale_per_c, noise] = numbers;
        Axis {
            axis_b: Vector3::new(x, y, z),
            scale,
            bias_counts,
            bias_per_c,
            bias_per_c2,
            scale_per_c,
            noise,
        }
    }
}

/// How far a calibration may be off, as standard deviations over all axes of a kind. They widen the thresholds of fault
/// detection: large means fewer alarms and later ones.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Uncertainty {
    /// [unit] of the biases.
    pub bias: f32,
    /// \[1\] of the scales.
    pub scale: f32,
    /// \[rad\] of the directions of the axes.
    pub direction: f32,
}

#[cfg(test)]
mod tests {
    use super::*;

    /// f32 rounding of values up to ten.
    const ROUNDING: f32 = 2e-6;

    #[test]
    fn a_row_of_sensitivity_is_a_direction_and_a_scale() {
        let axis = Axis::from_sensitivity(Vector3::new(0.0, -30.0, 40.0), 10.0, 0.1);
        assert!((axis.axis_b - Vector3::new(0.0, -0.6, 0.8)).norm() < ROUNDING);
        // 0.6 * 1 + 0.8 * 2 = 2.2 along it: -30 * -1 + 40 * 2 = 110 counts, and 10 of bias.
        assert!((axis.value(120, 0.0) - 2.2).abs() < ROUNDING);
    }

    #[test]
    fn bias_and_scale_follow_the_temperature() {
        let axis = Axis {
            bias_per_c: 0.5,
            bias_per_c2: -0.01,
            scale_per_c: 0.001,
            ..Axis::from_sensitivity(Vector3::new(50.0, 0.0, 0.0), 10.0, 0.1)
        };
        // At +20 degC the bias is 10 + 10 - 4 = 16 counts and a count is worth 2 % more.
        assert!((axis.value(116, 20.0) - 100.0 / 50.0 * 1.02).abs() < ROUNDING);
        assert!((axis.value(110, 0.0) - 2.0).abs() < ROUNDING);
    }
}
