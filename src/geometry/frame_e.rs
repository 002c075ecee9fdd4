//! The one door between the thesis' frame e and the body frame b.
//!
//! In: components of a vector in e. Out: its components in b, `x_b = z_e, y_b = y_e, z_b = x_e` (Eq 5.1), and the other way
//! round by the same permutation. For polar vectors (force, field) and for the right-hand-rule rate alike: the gyro rows
//! of Eq 3.36 give components along the directions of e of such a rate, with no further sign.
//!
//! Frame e is left-handed: every plate matrix of section 3.3 has determinant -1 while accelerometers and magnetometers are
//! right-handed (datasheets), and Tables 4.1 and 4.6 give `dg/dt = + w x g`. Cross products, quaternions, Euler angles and
//! TRIAD written for right-handed frames are wrong in it, and no test at rest shows it. So this is for figures that come
//! from or go to a page of the thesis, and nothing inside the unit calls it.

use nalgebra::Vector3;

/// Components in e to components in b, or in b to components in e. Determinant -1: its own inverse, not a rotation.
pub fn mirror_e_b(components: Vector3<f32>) -> Vector3<f32> {
    Vector3::new(components.z, components.y, components.x)
}

#[cfg(test)]
mod tests {
    use nalgebra::{Matrix3, UnitQuaternion};

    use super::*;
    use crate::geometry::{dcm_bp, gyro_axes_b};

    /// [m/s2] f32 rounding of a force of 9.8 turned twice.
    const ROUNDING: f32 = 5e-6;
    /// \[s\]
    const DURATION: f32 = 2.0;

    /// Force in a right-handed frame that turned at `rate` [rad/s] for [`DURATION`]; what is fixed in n turns backwards.
    fn turned(rate: Vector3<f32>, force: Vector3<f32>) -> Vector3<f32> {
        UnitQuaternion::from_scaled_axis(rate * DURATION).inverse_transform_vector(&force)
    }

    /// Euler (10, -20, 30) deg, then 2 s at this rate (golden vectors computed in f64 from Eqs 2.15 and 2.18).
    const RATE_B: Vector3<f32> = Vector3::new(0.1, -0.2, 0.3);
    const FORCE_B: Vector3<f32> = Vector3::new(-3.354_071_8, -1.600_209, -9.075_237);
    const FORCE_AFTER_B: Vector3<f32> = Vector3::new(-7.154_090_3, 0.051_818_67, -6.707_212);

    #[test]
    fn in_b_the_force_follows_the_rotation() {
        assert!((turned(RATE_B, FORCE_B) - FORCE_AFTER_B).norm() < ROUNDING);
    }

    #[test]
    fn components_in_e_put_into_the_kinematics_are_wrong_by_54_degrees() {
        let after_e = turned(mirror_e_b(RATE_B), mirror_e_b(FORCE_B));
        assert!((after_e - Vector3::new(-9.728_945, -0.307_143_8, 1.193_182_8)).norm() < ROUNDING);
        let wrong_deg = after_e.angle(&mirror_e_b(FORCE_AFTER_B)).to_degrees();
        assert!((wrong_deg - 53.87).abs() < 0.01, "{wrong_deg}");
    }

    #[test]
    fn through_the_door_and_back_nothing_changes() {
        assert_eq!(mirror_e_b(mirror_e_b(RATE_B)), RATE_B);
        let mirror = Matrix3::from_columns(&[Vector3::x(), Vector3::y(), Vector3::z()].map(mirror_e_b));
        assert_eq!(mirror.determinant(), -1.0);
        for plate in 0..4 {
            assert!(((mirror * dcm_bp(plate)).determinant() + 1.0).abs() < ROUNDING);
        }
    }

    #[test]
    fn gyro_axes_of_the_thesis_come_through_unchanged_in_sign() {
        // Eq 3.35 in e: gyro 4 is +x_e, gyro 1 is (-s, 0, -c).
        let axes_b = gyro_axes_b();
        assert_eq!(mirror_e_b(axes_b.row(3).transpose()), Vector3::x());
        let first_e = mirror_e_b(axes_b.row(0).transpose());
        assert!((first_e - Vector3::new(-0.316_227_77, 0.0, -0.948_683_3)).norm() < ROUNDING);
    }
}
