//! How an attitude is written: quaternion, matrix, Euler angles, rotation vector. The conventions of all of them.
//!
//! **Frames.** `n` is north-east-down, `b` is forward-right-down; both are right-handed. The thesis' left-handed frame
//! e has no attitude: no proper rotation leads to it.
//!
//! **Quaternion** `q_nb`: Hamilton's algebra (`ij = k`), scalar first when written out, unit norm, and it takes
//! components in b to components in n: `v_n = q_nb v_b q_nb*`. Products read right to left with the letters meeting,
//! `q_na = q_nb q_ba`, and `dq_nb/dt = 1/2 q_nb (0, rate_b)`. The paper of the Kalman filter (Lefferts, Markley,
//! Shuster 1982) writes the vector first and multiplies the other way round (Shuster's product, `p (x) q = q p` here);
//! nothing in this crate does.
//!
//! **Matrix** `dcm_bn`: takes components in n to components in b, the passive matrix of thesis Eqs 2.15 and 2.39. Its
//! rows are n's components of b's axes. Eq 2.30 of the thesis is the transpose (the active matrix), and Eq 2.40, which
//! equates the two, gives the vector part the wrong sign; Eq 2.9 multiplies its two turns in the wrong order.
//!
//! **Euler angles** 3-2-1: from n, yaw about down, then pitch about the new right, then roll about the new forward,
//! `q_nb = q(yaw) q(pitch) q(roll)`. With `m = dcm_bn`, `yaw = atan2(m12, m11)`, `sin pitch = -m13`,
//! `roll = atan2(m23, m33)`; the thesis prints tangents (Eqs 2.36 to 2.38), which is wrong by 5.7 deg at a pitch of
//! 30 deg and cannot tell quadrants. A quaternion holds half angles; Eqs 2.24 and 2.25 hold whole ones.
//!
//! **Rotation vector**: axis times angle \[rad\], in b when it multiplies from the right.
//!
//! Refuses a matrix that is no rotation ([`from_dcm_bn`]); an attitude that came from storage goes through
//! [`from_parts`].

use core::f32::consts::FRAC_2_PI;

use nalgebra::{ComplexField, Matrix3, Quaternion, RealField, UnitQuaternion, Vector3};

/// Euler angles 3-2-1.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
pub struct Euler {
    /// \[rad\] about b's forward axis, right side down; -pi to pi.
    pub roll: f32,
    /// \[rad\] about the right axis, nose up; -pi/2 to pi/2.
    pub pitch: f32,
    /// \[rad\] about down, nose right; -pi to pi. Zero is north.
    pub yaw: f32,
}

/// How far `m m'` may stand from the identity in any element before [`from_dcm_bn`] refuses. Matrices typed from four
/// printed digits pass; a reflection, a scaling or rubbish does not.
const ORTHONORMAL: f32 = 1e-3;

/// Below this cosine of the pitch, roll and yaw turn about the same axis and only their sum or difference is known:
/// 0.06 deg from the vertical, where f32 rounding of the matrix reaches a degree in either.
const GIMBAL_LOCK: f32 = 1e-3;

/// Up to this angle \[rad\] the series below are exact in f32: what they leave out is less than 3e-9.
const SERIES: f32 = 1.0;

/// Below this square of an angle both are one to the last digit of f32.
const NO_ANGLE: f32 = 5e-8;

/// Taylor coefficients of `sin(h)/h` and `cos(h)` in `h^2`.
const SINE: [f32; 6] = [
    1.0,
    -1.0 / 6.0,
    1.0 / 120.0,
    -1.0 / 5040.0,
    1.0 / 362_880.0,
    -1.0 / 39_916_800.0,
];
const COSINE: [f32; 6] = [1.0, -0.5, 1.0 / 24.0, -1.0 / 720.0, 1.0 / 40_320.0, -1.0 / 3_628_800.0];

/// `sin(x)/x` and `cos(x)` by `x^2`, which is at most that of [`SERIES`].
///
/// libm's go through f64, which the target computes in software: a thousand instructions for both.
fn series(square: f32) -> (f32, f32) {
    let sum = |of: [f32; 6]| {
        of.into_iter()
            .rev()
            .fold(0.0, |sum, coefficient| sum * square + coefficient)
    };
    (sum(SINE), sum(COSINE))
}

/// A quarter of a turn \[rad\] in three parts: of the first two as few digits that a product with up to 32,768 quarters is exact
/// (W. J. Cody, W. Waite, Software Manual for the Elementary Functions, 1980).
const QUARTER: [f32; 3] = [1.570_312_5, 0.000_483_512_88, 3.139_164_8e-7];

/// Sine and cosine of an angle \[rad\]: by the series up to [`SERIES`], of others without their quarters of a turn. Beyond 50,000 rad,
/// where f32 has no digit left below 0.004 rad, both are only numbers up to one; NaN of what is no angle.
pub(crate) fn sin_cos(angle: f32) -> (f32, f32) {
    let square = angle * angle;
    if square < SERIES * SERIES {
        let (sinc, cos) = series(square);
        return (angle * sinc, cos);
    }
    if !angle.is_finite() {
        return (f32::NAN, f32::NAN);
    }
    let quarters = (angle * FRAC_2_PI + if angle < 0.0 { -0.5 } else { 0.5 }) as i32;
    let rest = QUARTER
        .into_iter()
        .fold(angle, |rest, part| rest - quarters as f32 * part);
    let rest = rest.clamp(-SERIES, SERIES);
    let (sinc, cos) = series(rest * rest);
    let sin = rest * sinc;
    match quarters & 3 {
        0 => (sin, cos),
        1 => (cos, -sin),
        2 => (-sin, -cos),
        _ => (-cos, sin),
    }
}

/// Quaternion of a rotation vector: exact for any angle, `(cos a/2, sin(a/2)/a v)`.
pub fn from_rotation_vector(angle: Vector3<f32>) -> UnitQuaternion<f32> {
    let half = angle * 0.5;
    let square = half.norm_squared();
    let (sinc, cos) = if square < NO_ANGLE {
        (1.0, 1.0)
    } else if square < SERIES * SERIES {
        series(square)
    } else {
        let norm = ComplexField::sqrt(square);
        let (sin, cos) = sin_cos(norm);
        (sin / norm, cos)
    };
    UnitQuaternion::new_unchecked(Quaternion::from_parts(cos, half * sinc))
}

/// The shorter rotation vector of a quaternion \[rad\].
pub fn rotation_vector(q: &UnitQuaternion<f32>) -> Vector3<f32> {
    let (scalar, vector) = (q.w, q.imag());
    let norm = vector.norm();
    if norm < f32::EPSILON {
        return vector * if scalar < 0.0 { -2.0 } else { 2.0 };
    }
    let (scalar, sign) = if scalar < 0.0 { (-scalar, -1.0) } else { (scalar, 1.0) };
    vector * (sign * 2.0 * RealField::atan2(norm, scalar) / norm)
}

/// A quaternion whose parts (scalar first) may have come from anywhere: `None` unless it is finite and its norm is
/// within a tenth of one.
pub fn from_parts(parts: [f32; 4]) -> Option<UnitQuaternion<f32>> {
    let q = Quaternion::new(parts[0], parts[1], parts[2], parts[3]);
    let norm = q.norm();
    (norm > 0.9 && norm < 1.1).then(|| UnitQuaternion::new_unchecked(q / norm))
}

/// One Newton step towards norm one: what keeps a product of unit quaternions a unit quaternion, without a root.
pub fn renormalised(q: UnitQuaternion<f32>) -> UnitQuaternion<f32> {
    UnitQuaternion::new_unchecked(q.into_inner() * (1.5 - 0.5 * q.norm_squared()))
}

/// Matrix that takes components in n to components in b (thesis Eq 2.39).
pub fn dcm_bn(q_nb: &UnitQuaternion<f32>) -> Matrix3<f32> {
    dcm_nb(q_nb).transpose()
}

/// Matrix that takes components in b to components in n.
pub fn dcm_nb(q_nb: &UnitQuaternion<f32>) -> Matrix3<f32> {
    let (w, x, y, z) = (q_nb.w, q_nb.i, q_nb.j, q_nb.k);
    Matrix3::new(
        1.0 - 2.0 * (y * y + z * z),
        2.0 * (x * y - w * z),
        2.0 * (x * z + w * y),
        2.0 * (x * y + w * z),
        1.0 - 2.0 * (x * x + z * z),
        2.0 * (y * z - w * x),
        2.0 * (x * z - w * y),
        2.0 * (y * z + w * x),
        1.0 - 2.0 * (x * x + y * y),
    )
}

/// Quaternion of a matrix, by the largest of its four components (S. W. Shepperd, "Quaternion from rotation matrix",
/// J. Guid. Control 1(3), 1978): thesis Eqs 2.41 to 2.44 divide by the scalar, which is zero for every half turn.
/// `None` for a matrix that is not finite, not orthonormal or left-handed.
pub fn from_dcm_bn(dcm_bn: &Matrix3<f32>) -> Option<UnitQuaternion<f32>> {
    let defect = (dcm_bn * dcm_bn.transpose() - Matrix3::identity()).amax();
    // A comparison with NaN is false.
    (defect < ORTHONORMAL && dcm_bn.determinant() > 0.0).then(|| from_rotation(dcm_bn))
}

/// [`from_dcm_bn`] of a matrix that is known to be a rotation.
pub(crate) fn from_rotation(dcm_bn: &Matrix3<f32>) -> UnitQuaternion<f32> {
    let m = dcm_bn;
    let trace = m.trace();
    let squares = [trace, m[(0, 0)], m[(1, 1)], m[(2, 2)]];
    let largest = (0..4).fold(0, |best, k| if squares[k] > squares[best] { k } else { best });
    // Row k: 4 q_k (q_0, q_1, q_2, q_3), from sums and differences of elements only.
    let (yz, zx, xy) = (m[(1, 2)] - m[(2, 1)], m[(2, 0)] - m[(0, 2)], m[(0, 1)] - m[(1, 0)]);
    let (s_xy, s_xz, s_yz) = (m[(0, 1)] + m[(1, 0)], m[(0, 2)] + m[(2, 0)], m[(1, 2)] + m[(2, 1)]);
    let diagonal = |k: usize| 1.0 + 2.0 * m[(k, k)] - trace;
    let q = match largest {
        0 => Quaternion::new(1.0 + trace, yz, zx, xy),
        1 => Quaternion::new(yz, diagonal(0), s_xy, s_xz),
        2 => Quaternion::new(zx, s_xy, diagonal(1), s_yz),
        _ => Quaternion::new(xy, s_xz, s_yz, diagonal(2)),
    };
    UnitQuaternion::new_normalize(q)
}

/// Quaternion of Euler angles (thesis Eqs 2.32 to 2.35).
pub fn from_euler(euler: Euler) -> UnitQuaternion<f32> {
    let turn = |x, y, z| from_rotation_vector(Vector3::new(x, y, z));
    turn(0.0, 0.0, euler.yaw) * turn(0.0, euler.pitch, 0.0) * turn(euler.roll, 0.0, 0.0)
}

/// Euler angles of a quaternion. In gimbal lock the roll is given as zero and the yaw holds what both turn together.
pub fn euler(q_nb: &UnitQuaternion<f32>) -> Euler {
    let m = dcm_bn(q_nb);
    let cos_pitch = ComplexField::sqrt(m[(0, 0)] * m[(0, 0)] + m[(0, 1)] * m[(0, 1)]);
    // Near the vertical the cosine holds digits that the sine has lost.
    let pitch = RealField::atan2(-m[(0, 2)], cos_pitch);
    if cos_pitch < GIMBAL_LOCK {
        let yaw = RealField::atan2(-m[(1, 0)], m[(1, 1)]);
        return Euler { roll: 0.0, pitch, yaw };
    }
    Euler {
        roll: RealField::atan2(m[(1, 2)], m[(2, 2)]),
        pitch,
        yaw: RealField::atan2(m[(0, 1)], m[(0, 0)]),
    }
}

/// \[rad\] angle of the smallest turn between two attitudes; keeps its digits where an arc cosine has none.
pub fn angle_between(a: &UnitQuaternion<f32>, b: &UnitQuaternion<f32>) -> f32 {
    let between = a.conjugate() * b;
    2.0 * RealField::atan2(between.imag().norm(), ComplexField::abs(between.w))
}

#[cfg(test)]
mod tests;
