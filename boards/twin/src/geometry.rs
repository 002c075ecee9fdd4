//! Where the plates are and how they are turned, in f64: the twin's own copy, so that it can hold the unit's f32 one to account.
//!
//! A tetrahedron of four plates, apex up: plates 1 to 3 (index 0 to 2) are its sides, plate 4 (index 3) its base, in
//! the thesis' frame e (section 3.3), taken here to the right-handed body frame b = (z_e, y_e, x_e), Eq. 5.1. The
//! tilt is exactly atan(1/3), of which the thesis prints a rounding.

use core::f64::consts::FRAC_1_SQRT_2;

use nalgebra::{Matrix3, Vector3};

/// How many plates the unit has.
pub const PLATES: usize = 4;

/// Plate frame to body frame: `v_b = dcm_bp(plate) * v_p`. Plates beyond the last are the last.
pub fn dcm_bp(plate: usize) -> Matrix3<f64> {
    let s = 0.1_f64.sqrt();
    let c = 3.0 * s;
    let h = 1.5_f64.sqrt() * FRAC_1_SQRT_2;
    match plate {
        0 => Matrix3::new(-s, 0.0, c, 0.0, -1.0, 0.0, c, 0.0, s),
        1 => Matrix3::new(s / 2.0, h, -c / 2.0, -s * h, 0.5, c * h, c, 0.0, s),
        2 => Matrix3::new(s / 2.0, -h, -c / 2.0, s * h, 0.5, -c * h, c, 0.0, s),
        _ => Matrix3::new(-1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, -1.0),
    }
}

/// Sense axis of a plate's gyro in b: its output is positive for a right-hand rotation about -z_p.
pub fn gyro_axis_b(plate: usize) -> Vector3<f64> {
    -dcm_bp(plate).column(2).into_owned()
}

/// \[m\] accelerometer's place in b, from the unit's centre of rotation. Reference design: 16 mm and -9 mm along the
/// plate's axes from its middle, which is 42 mm (sides) or 38 mm (base) from the centre, against z_p.
pub fn accelerometer_place_b(plate: usize) -> Vector3<f64> {
    let distance = if plate < 3 { 0.042 } else { 0.038 };
    dcm_bp(plate) * Vector3::new(0.016, -0.009, -distance)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The tables below have nine decimals.
    const PRINTED: f64 = 1e-9;

    #[test]
    fn every_plate_is_a_right_handed_rotation() {
        for plate in 0..PLATES {
            let m = dcm_bp(plate);
            assert!((m.determinant() - 1.0).abs() < 1e-14);
            assert!((m * m.transpose() - Matrix3::identity()).norm() < 1e-14);
        }
    }

    #[test]
    fn the_gyro_axes_are_those_of_the_tetrahedron() {
        let axes = [
            [-0.948683298, 0.0, -0.316227766],
            [0.474341649, -0.821583836, -0.316227766],
            [0.474341649, 0.821583836, -0.316227766],
            [0.0, 0.0, 1.0],
        ];
        for (plate, axis) in axes.into_iter().enumerate() {
            assert!((gyro_axis_b(plate) - Vector3::from(axis)).norm() < PRINTED);
        }
    }

    #[test]
    fn the_accelerometers_are_where_the_unit_has_them() {
        let places = [
            [-0.044904343, 0.009, 0.001897367],
            [0.014657943, -0.043388302, 0.001897367],
            [0.0302464, 0.034388302, 0.001897367],
            [-0.016, -0.009, 0.038],
        ];
        for (plate, place) in places.into_iter().enumerate() {
            assert!((accelerometer_place_b(plate) - Vector3::from(place)).norm() < PRINTED);
        }
    }
}
