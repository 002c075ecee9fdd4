//! The thesis' three methods as rows of sensitivity: MT, LMS EC, MV SEC.
//!
//! In: what a method found for one sensor. Out: its axes. Biases are in counts and noise in the unit of the sensor.

use nalgebra::{ComplexField, Matrix3, Vector3};

use super::Axis;
use crate::geometry::dcm_bp;

/// MT: the nominal direction, the datasheet's scale, no bias (section 4.1).
pub fn mt(axis_b: Vector3<f32>, scale: f32, noise: f32) -> Axis {
    Axis::from_sensitivity(axis_b / scale, 0.0, noise)
}

/// LMS EC of one sensor of three axes: `counts = sensitivity_b v_b + bias_counts`, rows in counts per unit along b
/// (the rows of `M_FB`, Eq 4.33, taken out of frame e and turned to specific force).
pub fn lms_ec(sensitivity_b: &Matrix3<f32>, bias_counts: [f32; 3], noise: f32) -> [Axis; 3] {
    core::array::from_fn(|k| Axis::from_sensitivity(sensitivity_b.row(k).transpose(), bias_counts[k], noise))
}

/// MV SEC of one sensor of three axes on `plate`: `counts = shape v_p + centre_counts` with `shape` the ellipsoid's lower
/// triangle in counts per unit. The ellipsoid leaves a rotation open; the triangle says that x is the plate's x and y lies
/// in its x-y plane.
pub fn mv_sec(plate: usize, shape: &Matrix3<f32>, centre_counts: [f32; 3], noise: f32) -> [Axis; 3] {
    lms_ec(&(shape * dcm_bp(plate).transpose()), centre_counts, noise)
}

/// Which of the two ways the last row of the ellipsoid's triangle is written in angles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Angles {
    /// Eq 4.44 of the thesis, corrected: `c (sin phi cos lambda, sin lambda, cos phi cos lambda)`. Table 6.1 is in these.
    Thesis,
    /// As public magnetometer code citing Foster and Elkaim has it: `c (sin lambda, sin phi cos lambda, cos phi cos lambda)`.
    Common,
}

/// The lower triangle of an ellipsoid given by semi-axes `[a, b, c]` and angles `[rho, phi, lambda]` \[rad\].
pub fn ellipsoid([a, b, c]: [f32; 3], [rho, phi, lambda]: [f32; 3], angles: Angles) -> Matrix3<f32> {
    let (sin, cos) = (ComplexField::sin, ComplexField::cos);
    let (along, across) = (sin(phi) * cos(lambda), sin(lambda));
    let (x, y) = match angles {
        Angles::Thesis => (along, across),
        Angles::Common => (across, along),
    };
    #[rustfmt::skip]
    let shape = Matrix3::new(
        a, 0.0, 0.0,
        b * sin(rho), b * cos(rho), 0.0,
        c * x, c * y, c * cos(phi) * cos(lambda),
    );
    shape
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{geometry::triad_axes_b, redundancy::solve};

    /// Relative f32 rounding of a 3 x 3 solution.
    const ROUNDING: f32 = 2e-6;

    /// The field in plate axes that `counts` mean.
    fn field_p(plate: usize, axes: &[Axis; 3], counts: [f32; 3]) -> Vector3<f32> {
        let along: [f32; 3] = core::array::from_fn(|k| axes[k].scale * (counts[k] - axes[k].bias_counts));
        dcm_bp(plate).transpose() * solve(&axes.map(|axis| axis.axis_b), &along, &[1.0; 3], 0b111).vector_b
    }

    fn undone(angles: Angles) -> [Vector3<f32>; 2] {
        let degrees = |angles: [f32; 3]| angles.map(f32::to_radians);
        // Table 6.1, and a larger example.
        let table = ellipsoid([1.0855, 1.034, 1.0529], degrees([0.0514, 0.0488, -0.0033]), angles);
        let large = ellipsoid([1.05, 0.93, 1.12], degrees([3.0, -2.0, 1.5]), angles);
        [
            field_p(
                2,
                &mv_sec(2, &table, [199.9729, 80.5599, -110.4864], 1.0),
                [300.0, 250.0, 50.0],
            ),
            field_p(1, &mv_sec(1, &large, [25.0, -40.0, 60.0], 1.0), [150.0, -200.0, 90.0]),
        ]
    }

    #[test]
    fn table_6_1_undoes_its_ellipsoid_in_both_ways_of_writing_the_angles() {
        // v = T B + v0 solved in f64.
        let golden = [
            (
                Angles::Thesis,
                [92.148_41, 163.785_97, 152.354_22],
                [119.047_62, -178.518_13, 35.645_975],
            ),
            (
                Angles::Common,
                [92.148_41, 163.785_97, 152.289_08],
                [119.047_62, -178.518_13, 17.457_966],
            ),
        ];
        for (angles, table, large) in golden {
            let found = undone(angles);
            assert!(
                (found[0] - Vector3::from(table)).norm() < 250.0 * ROUNDING,
                "{angles:?} {}",
                found[0]
            );
            assert!(
                (found[1] - Vector3::from(large)).norm() < 250.0 * ROUNDING,
                "{angles:?} {}",
                found[1]
            );
        }
    }

    #[test]
    fn a_sphere_is_mt_and_so_is_a_nominal_matrix() {
        for plate in 0..4 {
            let [x, y, z] = mv_sec(plate, &(Matrix3::identity() / 0.092), [0.0; 3], 0.2);
            let nominal = [0, 1, 2].map(|k| mt(triad_axes_b()[3 * plate + k], 0.092, 0.2));
            for (found, expected) in [x, y, z].iter().zip(&nominal) {
                assert!((found.axis_b - expected.axis_b).norm() < ROUNDING);
                assert!((found.scale - 0.092).abs() < ROUNDING && found.bias_counts == 0.0);
            }
        }
    }
}
