//! TRIAD: attitude from two directions, and its covariance.
//!
//! In: two directions seen in b and the same two known in n (any length), with their angular standard deviations. Out:
//! `q_nb` and the covariance of its error. The first pair is matched exactly, the second fixes the turn about it (thesis
//! section 2.4; M. D. Shuster, S. D. Oh, "Three-axis attitude determination from vector observations", J. Guid. Control
//! 4(1), 1981): with `t1 = v1`, `t2 = v1 x v2 / |v1 x v2|`, `t3 = t1 x t2` in each frame, `dcm_bn = T_b T_n'`.
//!
//! Covariance in b, for the small rotation vector by which the found attitude differs from the true one:
//!
//! `P = s1 I + [(s2 - s1) w1 w1' + s1 (w1.w2) (w1 w2' + w2 w1')] / |w1 x w2|^2`
//!
//! with `w` the unit directions in b and `s` the sum of the variances of a direction in b and in n. This is thesis
//! Eq 2.51 corrected: as printed, its bracket takes `(s2 - s1) w1 w1'` into the second term's factor, and standard
//! deviations stand where variances must. A Monte Carlo holds it.
//!
//! Refuses vectors that are zero or not finite, and directions closer to each other or to opposition than
//! [`LEAST_ANGLE_DEG`]: the turn about them is not observable.
//!
//! ```
//! use emems::triad::{Sighting, triad};
//! use nalgebra::{UnitQuaternion, Vector3};
//!
//! let q_nb = UnitQuaternion::from_euler_angles(0.1, -0.2, 0.3);
//! let sighting = |known_n: Vector3<f32>, seen_sd| Sighting { seen_b: q_nb.inverse() * known_n, known_n, seen_sd, known_sd: 1e-3 };
//! let force = sighting(Vector3::new(0.0, 0.0, -9.81), 0.005);
//! let field = sighting(Vector3::new(17.0, 0.3, 41.0), 0.02);
//! let found = triad(&force, &field).unwrap();
//! assert!(found.q_nb.angle_to(&q_nb) < 1e-5);
//! // The field, which is known less well, only says the turn about the force.
//! assert!(found.covariance_b.trace() > 0.02_f32.powi(2));
//! ```

use nalgebra::{ComplexField, Matrix3, UnitQuaternion, Vector3};

use crate::attitude;

/// \[deg\] least angle between the two directions, or between one and the other's opposite. At 5 deg the error about them
/// is eleven times that of the directions.
pub const LEAST_ANGLE_DEG: f32 = 5.0;

/// Sine of [`LEAST_ANGLE_DEG`].
const LEAST_SINE: f32 = 0.087_155_74;

/// A direction seen and known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sighting {
    /// As seen, in b; any length and unit.
    pub seen_b: Vector3<f32>,
    /// As known, in n; any length and unit.
    pub known_n: Vector3<f32>,
    /// \[rad\] standard deviation of the direction seen, about each axis across it.
    pub seen_sd: f32,
    /// \[rad\] the same of the direction known.
    pub known_sd: f32,
}

/// What TRIAD found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Observation {
    /// Attitude.
    pub q_nb: UnitQuaternion<f32>,
    /// [rad^2] covariance of its error as a small rotation vector in b.
    pub covariance_b: Matrix3<f32>,
}

/// Why there is no attitude.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
pub enum Unobservable {
    /// A vector is zero or not finite, or a standard deviation is not a positive number.
    NotADirection,
    /// The directions stand closer than [`LEAST_ANGLE_DEG`] to one line.
    Collinear,
}

impl Sighting {
    /// [rad^2] variance of the direction.
    fn variance(&self) -> f32 {
        self.seen_sd * self.seen_sd + self.known_sd * self.known_sd
    }
}

/// Attitude from two sightings, the first trusted about two axes and the second about the third.
pub fn triad(first: &Sighting, second: &Sighting) -> Result<Observation, Unobservable> {
    let (variance_1, variance_2) = (first.variance(), second.variance());
    if !(variance_1 > 0.0 && variance_1.is_finite() && variance_2 > 0.0 && variance_2.is_finite()) {
        return Err(Unobservable::NotADirection);
    }
    let (w1, w2) = (direction(first.seen_b)?, direction(second.seen_b)?);
    let q_nb = turned(axes(w1, w2)?, &known_axes(first.known_n, second.known_n)?);
    let (w1_w2, cross) = (w1 * w2.transpose(), w1.cross(&w2).norm_squared());
    let coupled = (w1_w2 + w1_w2.transpose()) * (variance_1 * w1.dot(&w2));
    let about_first = w1 * w1.transpose() * (variance_2 - variance_1);
    let covariance_b = Matrix3::from_diagonal_element(variance_1) + (about_first + coupled) / cross;
    Ok(Observation { q_nb, covariance_b })
}

/// The axes that two known directions span, for [`attitude()`]: they need not be found anew for every sighting of them.
pub fn known_axes(first_n: Vector3<f32>, second_n: Vector3<f32>) -> Result<Matrix3<f32>, Unobservable> {
    axes(direction(first_n)?, direction(second_n)?)
}

/// The attitude of [`triad`] alone, from two directions seen and the axes that they are known to span.
pub fn attitude(
    first_b: Vector3<f32>,
    second_b: Vector3<f32>,
    known_axes_n: &Matrix3<f32>,
) -> Result<UnitQuaternion<f32>, Unobservable> {
    Ok(turned(axes(direction(first_b)?, direction(second_b)?)?, known_axes_n))
}

fn turned(axes_b: Matrix3<f32>, axes_n: &Matrix3<f32>) -> UnitQuaternion<f32> {
    attitude::from_rotation(&(axes_b * axes_n.transpose()))
}

/// A vector's direction. The scale is taken out first, since squares of f32 leave its range at 1e19.
pub(crate) fn direction(v: Vector3<f32>) -> Result<Vector3<f32>, Unobservable> {
    let largest = v.amax();
    // f32::max passes over NaN, so each component is looked at.
    if !(v.iter().all(|component| component.is_finite()) && largest > f32::MIN_POSITIVE) {
        return Err(Unobservable::NotADirection);
    }
    let scaled = v / largest;
    Ok(scaled / scaled.norm())
}

/// The three axes that two directions span, one a column.
fn axes(v1: Vector3<f32>, v2: Vector3<f32>) -> Result<Matrix3<f32>, Unobservable> {
    let cross = v1.cross(&v2);
    let sine = ComplexField::sqrt(cross.norm_squared());
    if sine < LEAST_SINE {
        return Err(Unobservable::Collinear);
    }
    let across = cross / sine;
    Ok(Matrix3::from_columns(&[v1, across, v1.cross(&across)]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::attitude::{Euler, from_euler};

    /// The golden covariance is in units of 1e-6 and the f32 sum loses a few of its seven digits.
    const COVARIANCE_ROUNDING: f32 = 2e-10;

    fn golden_attitude() -> UnitQuaternion<f32> {
        let deg = core::f32::consts::PI / 180.0;
        from_euler(Euler {
            roll: 10.0 * deg,
            pitch: -20.0 * deg,
            yaw: 30.0 * deg,
        })
    }

    fn sighting(known_n: Vector3<f32>, seen_sd: f32, known_sd: f32) -> Sighting {
        Sighting {
            seen_b: golden_attitude().inverse_transform_vector(&known_n),
            known_n,
            seen_sd,
            known_sd,
        }
    }

    fn golden() -> [Sighting; 2] {
        [
            sighting(Vector3::new(0.0, 0.0, -1.0), 0.004, 0.001),
            sighting(Vector3::new(0.7, -0.2, -0.5), 0.02, 0.003),
        ]
    }

    #[test]
    fn two_directions_give_the_attitude_they_were_seen_at() {
        let [up, other] = golden();
        let found = triad(&up, &other).unwrap();
        assert!(attitude::angle_between(&found.q_nb, &golden_attitude()) < 1e-6);
        let swapped = triad(&other, &up).unwrap();
        assert!(attitude::angle_between(&swapped.q_nb, &golden_attitude()) < 1e-6);
    }

    #[test]
    fn the_attitude_alone_is_that_of_the_whole() {
        let [up, other] = golden();
        let axes_n = known_axes(up.known_n, other.known_n).unwrap();
        assert_eq!(
            attitude(up.seen_b, other.seen_b, &axes_n),
            triad(&up, &other).map(|found| found.q_nb)
        );
        assert_eq!(attitude(up.seen_b, up.seen_b, &axes_n), Err(Unobservable::Collinear));
    }

    #[test]
    fn the_covariance_is_the_corrected_equation_2_51() {
        let [up, other] = golden();
        #[rustfmt::skip]
        let golden = Matrix3::new(
            81.142_67, 34.838_19, 181.050_1,
            34.838_19, 35.642_116, 97.839_711,
            181.050_1, 97.839_711, 527.158_6,
        ) * 1e-6;
        let found = triad(&up, &other).unwrap().covariance_b;
        assert!((found - golden).amax() < COVARIANCE_ROUNDING, "{found}");
    }

    #[test]
    fn length_does_not_matter_over_the_whole_range() {
        let [mut up, mut other] = golden();
        up.seen_b *= 1e-30;
        other.seen_b *= 1e30;
        let found = triad(&up, &other).unwrap();
        assert!(attitude::angle_between(&found.q_nb, &golden_attitude()) < 1e-6);
    }

    #[test]
    fn what_is_no_direction_is_refused() {
        let [up, other] = golden();
        for bad in [f32::NAN, f32::INFINITY, 0.0] {
            let seen_b = Vector3::repeat(bad);
            assert_eq!(
                triad(&Sighting { seen_b, ..up }, &other),
                Err(Unobservable::NotADirection)
            );
            assert_eq!(
                triad(
                    &up,
                    &Sighting {
                        known_n: seen_b,
                        ..other
                    }
                ),
                Err(Unobservable::NotADirection)
            );
        }
        for seen_sd in [f32::NAN, f32::INFINITY] {
            assert_eq!(
                triad(&Sighting { seen_sd, ..up }, &other),
                Err(Unobservable::NotADirection)
            );
        }
        let mut one_bad = up;
        one_bad.seen_b.y = f32::NAN;
        assert_eq!(triad(&one_bad, &other), Err(Unobservable::NotADirection));
    }

    #[test]
    fn collinear_directions_are_refused_up_to_five_degrees() {
        let at = |angle_deg: f32| {
            let angle = angle_deg * core::f32::consts::PI / 180.0;
            let other_n = Vector3::new(ComplexField::sin(angle), 0.0, -ComplexField::cos(angle));
            triad(&sighting(-Vector3::z(), 0.01, 0.0), &sighting(other_n, 0.01, 0.0))
        };
        for angle_deg in [0.0, 4.9, 175.1, 180.0] {
            assert_eq!(at(angle_deg), Err(Unobservable::Collinear), "{angle_deg}");
        }
        for angle_deg in [5.1, 90.0, 174.9] {
            assert!(at(angle_deg).is_ok(), "{angle_deg}");
        }
    }
}
