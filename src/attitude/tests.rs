// Golden numbers are written with the digits they were printed with.
#![allow(clippy::excessive_precision)]

use core::f32::consts::{FRAC_PI_2, PI};

use super::*;

/// Rounding of a dozen f32 operations on numbers up to one.
const ROUNDING: f32 = 1e-6;

const DEG: f32 = PI / 180.0;

/// Golden attitude of the thesis' angles (10, -20, 30) deg.
const GOLDEN: Euler = Euler {
    roll: 10.0 * DEG,
    pitch: -20.0 * DEG,
    yaw: 30.0 * DEG,
};

fn close(found: f32, expected: f32, tolerance: f32) {
    assert!((found - expected).abs() < tolerance, "{found} is not {expected}");
}

/// A spread of attitudes: every axis of a 3x3x3 grid, every 15 deg.
fn attitudes() -> impl Iterator<Item = UnitQuaternion<f32>> {
    (0..27).filter(|grid| *grid != 13).flat_map(|grid| {
        let axis = Vector3::new(
            (grid % 3) as f32 - 1.0,
            (grid / 3 % 3) as f32 - 1.0,
            (grid / 9) as f32 - 1.0,
        );
        (0..24).map(move |step| from_rotation_vector(axis.normalize() * (step as f32 * 15.0 * DEG)))
    })
}

#[test]
fn euler_angles_give_the_golden_quaternion_and_matrix() {
    let q_nb = from_euler(GOLDEN);
    for (part, golden) in
        [q_nb.w, q_nb.i, q_nb.j, q_nb.k]
            .into_iter()
            .zip([0.943_714_36, 0.127_679_44, -0.144_878_13, 0.268_535_82])
    {
        close(part, golden, ROUNDING);
    }
    #[rustfmt::skip]
    let golden = Matrix3::new(
        0.813_797_68, 0.469_846_31, 0.342_020_14,
        -0.543_838_14, 0.823_172_94, 0.163_175_91,
        -0.204_874_13, -0.318_795_78, 0.925_416_58,
    );
    assert!((dcm_bn(&q_nb) - golden).amax() < ROUNDING);
}

#[test]
fn a_body_rate_turns_it_as_the_golden_vectors_say() {
    // 2 s at (0.1, -0.2, 0.3) rad/s.
    let q_nb = from_euler(GOLDEN) * from_rotation_vector(Vector3::new(0.2, -0.4, 0.6));
    let golden = [0.758_951_01, 0.221_036_84, -0.330_408_96, 0.515_718_91];
    for (part, golden) in [q_nb.w, q_nb.i, q_nb.j, q_nb.k].into_iter().zip(golden) {
        close(part, golden, ROUNDING);
    }
    let acc_b = dcm_bn(&q_nb) * Vector3::new(0.0, 0.0, -9.806_65);
    assert!((acc_b - Vector3::new(-7.154_090_4, 0.051_818_67, -6.707_212)).amax() < 10.0 * ROUNDING);
}

#[test]
fn components_in_the_left_handed_frame_e_would_be_wrong_by_54_deg() {
    // x_b = z_e: the same motion, its components taken in e's order and used in these kinematics.
    let e = |v: Vector3<f32>| Vector3::new(v.z, v.y, v.x);
    let acc_b = |q: &UnitQuaternion<f32>, down: Vector3<f32>| q.inverse_transform_vector(&down) * -9.806_65;
    let (start, angle_b) = (from_euler(GOLDEN), Vector3::new(0.2, -0.4, 0.6));
    let truth = acc_b(&(start * from_rotation_vector(angle_b)), Vector3::z());
    // In e the specific force at the start is known; turn it by the rate in e.
    let start_e = e(acc_b(&start, Vector3::z()));
    let misused = from_rotation_vector(e(angle_b)).inverse_transform_vector(&start_e);
    let off = misused.angle(&e(truth));
    close(off / DEG, 53.87, 0.01);
    let right = from_rotation_vector(angle_b).inverse_transform_vector(&acc_b(&start, Vector3::z()));
    assert!((right - truth).norm() < 1e-5);
}

#[test]
fn every_attitude_comes_back_from_its_matrix_half_turns_included() {
    for q in attitudes() {
        let back = from_dcm_bn(&dcm_bn(&q)).unwrap();
        // An angle of twice the root of rounding would be lost in an arc cosine; the vector part keeps it.
        assert!(angle_between(&q, &back) < 2.0 * ROUNDING, "{q}");
    }
}

#[test]
fn matrices_that_are_no_rotation_are_refused() {
    let refused = |m: Matrix3<f32>| assert_eq!(from_dcm_bn(&m), None);
    refused(Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, -1.0)));
    refused(Matrix3::identity() * 1.01);
    refused(Matrix3::zeros());
    refused(Matrix3::identity() * f32::NAN);
    refused(Matrix3::from_element(f32::INFINITY));
}

#[test]
fn euler_angles_come_back_except_what_gimbal_lock_joins() {
    for q in attitudes() {
        assert!(angle_between(&q, &from_euler(euler(&q))) < 5.0 * ROUNDING, "{q}");
    }
    for pitch in [-FRAC_PI_2, FRAC_PI_2] {
        let locked = from_euler(Euler {
            roll: 0.3,
            pitch,
            yaw: 1.1,
        });
        let found = euler(&locked);
        assert_eq!(found.roll, 0.0);
        close(found.pitch, pitch, 1e-3);
        assert!(angle_between(&locked, &from_euler(found)) < 1e-3);
    }
}

#[test]
fn rotation_vectors_come_back_from_the_smallest_to_a_half_turn() {
    for norm in [0.0, 1e-20, 1e-7, 1e-3, 0.06, 1.0, 1.9999, 2.0001, 3.1] {
        let angle = Vector3::new(0.6, -0.64, 0.48) * norm;
        let q = from_rotation_vector(angle);
        close(q.norm(), 1.0, ROUNDING);
        assert!((rotation_vector(&q) - angle).norm() <= 2.0 * ROUNDING * norm, "{norm}");
        assert!(
            (rotation_vector(&UnitQuaternion::new_unchecked(-q.into_inner())) - angle).norm() <= 2.0 * ROUNDING * norm
        );
    }
}

#[test]
fn stored_quaternions_are_normalised_or_refused() {
    assert_eq!(from_parts([0.0; 4]), None);
    assert_eq!(from_parts([f32::NAN, 0.0, 0.0, 0.0]), None);
    assert_eq!(from_parts([f32::INFINITY, 0.0, 0.0, 0.0]), None);
    assert_eq!(from_parts([2.0, 0.0, 0.0, 0.0]), None);
    close(from_parts([0.95, 0.0, 0.0, 0.0]).unwrap().w, 1.0, ROUNDING);
}

#[test]
fn a_million_turns_keep_the_norm() {
    let turn = from_rotation_vector(Vector3::new(0.011, -0.023, 0.017));
    let q = (0..1_000_000).fold(UnitQuaternion::identity(), |q, _| renormalised(q * turn));
    close(q.norm(), 1.0, ROUNDING);
}

#[test]
fn sines_and_cosines_are_those_of_f64_through_more_than_a_turn() {
    for step in -500..=500 {
        let angle = 0.01 * step as f32;
        let (sin, cos) = sin_cos(angle);
        close(sin, ComplexField::sin(f64::from(angle)) as f32, ROUNDING);
        close(cos, ComplexField::cos(f64::from(angle)) as f32, ROUNDING);
    }
}

/// Against f64, a whole degree at a time: in every quarter and far out.
#[test]
fn sine_and_cosine_hold_for_any_number_of_turns() {
    for turns in [0, 1, 2, 100, 8_000] {
        for degrees in -360_i32..=360 {
            let angle = (degrees + 360 * turns * degrees.signum()) as f32 * DEG;
            let (sin, cos) = sin_cos(angle);
            let (exact_sin, exact_cos) = ComplexField::sin_cos(f64::from(angle));
            assert!(
                (f64::from(sin) - exact_sin).abs() < 2e-7 && (f64::from(cos) - exact_cos).abs() < 2e-7,
                "{angle}: {sin} {cos}, not {exact_sin} {exact_cos}"
            );
        }
    }
    for angle in [6e4, 1e9, 1e20, f32::MAX, -f32::MAX] {
        let (sin, cos) = sin_cos(angle);
        assert!((sin * sin + cos * cos - 1.0).abs() < ROUNDING, "{angle}: {sin} {cos}");
    }
    assert!(sin_cos(f32::NAN).0.is_nan() && sin_cos(f32::INFINITY).1.is_nan());
}
