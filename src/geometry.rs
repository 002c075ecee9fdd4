//! Where the sensors point: plate rotations and gyro axes in the right-handed body frame b (forward, right, down).
//!
//! The plates stand on the faces of a nearly regular tetrahedron, tilted by atan(1/3) (thesis, section 3.2; the exact
//! angle is 18.4349 deg, its 18.4345 a slip). The thesis' frame e is left-handed: `x_b = z_e, y_b = y_e, z_b = x_e`; it
//! does not appear here, but only in [`frame_e`], the door for figures written in it. Gyro `i` senses the right-handed rate
//! about `-z` of plate `i`.

pub mod frame_e;

use nalgebra::{Matrix3, Matrix4x3, SMatrix, Vector3};

use crate::redundancy;

/// How many plates there are.
pub const PLATES: usize = 4;

/// Axes of four three-axis sensors: x, y, z of plate 1, then of plate 2, and so on.
pub const TRIAD_AXES: usize = 3 * PLATES;

/// cos atan(1/3) = 3/sqrt(10).
const C: f32 = 0.948_683_3;
/// sin atan(1/3) = 1/sqrt(10).
const S: f32 = 0.316_227_77;
/// sin 60 deg.
const H: f32 = 0.866_025_4;

/// Rotation of plate `plate` (0 to 3) to b: `v_b = dcm_bp * v_p`. Determinant +1.
pub fn dcm_bp(plate: usize) -> Matrix3<f32> {
    match plate {
        0 => Matrix3::new(-S, 0.0, C, 0.0, -1.0, 0.0, C, 0.0, S),
        1 => Matrix3::new(S / 2.0, H, -C / 2.0, -S * H, 0.5, C * H, C, 0.0, S),
        2 => Matrix3::new(S / 2.0, -H, -C / 2.0, S * H, 0.5, -C * H, C, 0.0, S),
        _ => Matrix3::new(-1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, -1.0),
    }
}

/// Sense axes in b of the accelerometers, which are those of the magnetometers too: the rows of the 12 x 3 stack
/// `[M1; M2; M3; M4]^T` of section 3.3. Each plate is a rotation, so the stack `H` has `H^T H = 4 I` and its pseudo-inverse
/// is `H^T / 4`: the mean of the four plates.
pub fn triad_axes_b() -> [Vector3<f32>; TRIAD_AXES] {
    core::array::from_fn(|k| {
        let [x_b, y_b, z_b] = axes_b(k / 3);
        match k % 3 {
            0 => x_b,
            1 => y_b,
            _ => z_b,
        }
    })
}

/// \[m\] place of a plate's accelerometer in b, from the unit's centre of rotation.
///
/// Reference design: 16 mm and -9 mm along the plate's axes from its middle, which is 42 mm (sides) or 38 mm (base) from
/// the centre, against `z_p`. A calibration says where they are on a unit.
pub fn accelerometer_place_b(plate: usize) -> Vector3<f32> {
    let distance = if plate < 3 { 0.042 } else { 0.038 };
    dcm_bp(plate) * Vector3::new(0.016, -0.009, -distance)
}

/// Axes of a plate in b.
fn axes_b(plate: usize) -> [Vector3<f32>; 3] {
    <[[f32; 3]; 3]>::from(dcm_bp(plate)).map(Vector3::from)
}

/// Sense axis in b of a plate's gyro.
pub fn gyro_axis_b(plate: usize) -> Vector3<f32> {
    let [_, _, z_b] = axes_b(plate);
    -z_b
}

/// Sense axes of the four gyros in b, one a row: `gyro = gyro_axes_b() * omega_b`.
pub fn gyro_axes_b() -> Matrix4x3<f32> {
    Matrix4x3::from_rows(&[0, 1, 2, 3].map(|plate| gyro_axis_b(plate).transpose()))
}

/// Least-squares rate from the gyros whose bit in `present` is set (bit 0 is plate 1): `omega_b = matrix * gyro`, with
/// columns of zeros for the absent ones. `None` for fewer than three: three axes of the tetrahedron span space, two
/// do not.
pub fn rate_from_gyros(present: u8) -> Option<SMatrix<f32, 3, 4>> {
    let axes_b = gyro_axes_b();
    if present & 0xF == 0xF {
        // With all four `G^T G` is diagonal.
        let of_axis = Vector3::new(1.0 / 1.35, 1.0 / 1.35, 1.0 / 1.3);
        return Some(SMatrix::from_fn(|axis, plate| axes_b[(plate, axis)] * of_axis[axis]));
    }
    let axes_b = core::array::from_fn(|plate| axes_b.row(plate).transpose());
    redundancy::matrix(&axes_b, present.into()).map(|(matrix, _)| matrix)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// f32 rounding of products of three numbers below one.
    const ROUNDING: f32 = 3e-7;

    #[test]
    fn plates_are_right_handed_rotations() {
        for plate in 0..4 {
            let dcm = dcm_bp(plate);
            assert!((dcm.determinant() - 1.0).abs() < ROUNDING, "plate {plate}");
            assert!(
                (dcm * dcm.transpose() - Matrix3::identity()).norm() < 4.0 * ROUNDING,
                "plate {plate}"
            );
        }
    }

    #[test]
    fn the_pseudo_inverse_of_the_stack_is_a_quarter_of_its_transpose() {
        let axes_b = SMatrix::<f32, 12, 3>::from_fn(|k, axis| triad_axes_b()[k][axis]);
        assert!((axes_b.transpose() * axes_b - Matrix3::identity() * 4.0).norm() < 12.0 * ROUNDING);
        let force_b = Vector3::new(1.0, -2.0, 9.8);
        assert!((axes_b.transpose() * (axes_b * force_b) / 4.0 - force_b).norm() < 20.0 * ROUNDING);
    }

    #[test]
    fn plate_four_measures_down_along_its_z() {
        let rest = triad_axes_b().map(|axis_b| axis_b.dot(&Vector3::new(0.0, 0.0, -1.0)));
        assert_eq!(rest[9..], [0.0, 0.0, 1.0]);
        assert!((rest[0] + C).abs() < ROUNDING && (rest[2] + S).abs() < ROUNDING);
    }

    #[test]
    fn gyro_axes_are_those_of_the_thesis_in_b() {
        let expected = Matrix4x3::new(-C, 0.0, -S, C / 2.0, -C * H, -S, C / 2.0, C * H, -S, 0.0, 0.0, 1.0);
        assert!((gyro_axes_b() - expected).norm() < ROUNDING);
    }

    #[test]
    fn four_gyros_give_the_exact_pseudo_inverse() {
        // M_GIRO in b: rows 3, 2, 1 of the exact matrix behind Eq 3.36.
        #[rustfmt::skip]
        let expected = SMatrix::<f32, 3, 4>::new(
            -0.702_728_4, 0.351_364_18, 0.351_364_18, 0.0,
            0.0, -0.608_580_62, 0.608_580_62, 0.0,
            -0.243_252_13, -0.243_252_13, -0.243_252_13, 0.769_230_8,
        );
        assert!((rate_from_gyros(0xF).unwrap() - expected).norm() < 1e-6);
    }

    #[test]
    fn any_three_gyros_give_the_rate_and_two_do_not() {
        let omega_b = Vector3::new(0.1, -0.2, 0.3);
        let gyro = gyro_axes_b() * omega_b;
        for present in [0b0111, 0b1011, 0b1101, 0b1110, 0b1111] {
            let found = rate_from_gyros(present).unwrap() * gyro;
            assert!((found - omega_b).norm() < 1e-6, "{present:04b}");
        }
        assert_eq!(rate_from_gyros(0b0011), None);
        assert_eq!(rate_from_gyros(0), None);
    }
}
