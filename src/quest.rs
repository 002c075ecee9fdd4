//! QUEST: the attitude that fits any number of directions best.
//!
//! In: sightings as for [`crate::triad`], two or more. Out: the `q_nb` that minimises Wahba's loss
//! `1/2 sum a_i |w_i - dcm_bn v_i|^2` with weights `a_i = 1/variance`, scaled to sum one, and the covariance of its
//! error (M. D. Shuster, S. D. Oh, "Three-axis attitude determination from vector observations", J. Guid. Control 4(1),
//! 1981). The best quaternion is the eigenvector of the largest eigenvalue of Davenport's matrix K.
//!
//! The paper finds the eigenvalue by Newton's method on K's characteristic polynomial and needs sequential rotations
//! near half turns. In f32 that polynomial loses half its digits, so the eigenvector comes from Jacobi's rotations
//! instead: the same optimum, no special case, a fixed bound on the work.
//!
//! Covariance in b: `(sum 1/s_i (I - w_i w_i'))^-1`, the inverse of what the directions tell about each axis; for two
//! sightings never larger than TRIAD's.
//!
//! Refuses what TRIAD refuses: no direction, and directions all near one line.

use nalgebra::{Matrix3, Matrix4, Quaternion, UnitQuaternion, Vector3};

use crate::triad::{Observation, Sighting, Unobservable, direction};

/// Sweeps of Jacobi's method; a 4x4 matrix in f32 needs four at most, and one more costs little.
const SWEEPS: usize = 6;

/// Least of the information about any axis, relative to the greatest: the square of the sine of five degrees, as for
/// TRIAD with two equal sightings.
const LEAST_INFORMATION: f32 = 0.0038;

/// The attitude that fits all `sightings` best.
pub fn quest(sightings: &[Sighting]) -> Result<Observation, Unobservable> {
    let mut information_b = Matrix3::zeros();
    let mut profile = Matrix3::zeros();
    let total: f32 = sightings.iter().map(|sighting| 1.0 / variance(sighting)).sum();
    if !(total > 0.0 && total.is_finite()) {
        return Err(Unobservable::NotADirection);
    }
    for sighting in sightings {
        let (seen_b, known_n) = (direction(sighting.seen_b)?, direction(sighting.known_n)?);
        let weight = 1.0 / variance(sighting) / total;
        information_b += (Matrix3::identity() - seen_b * seen_b.transpose()) * weight;
        profile += known_n * seen_b.transpose() * weight;
    }
    let spread = information_b.symmetric_eigenvalues();
    if spread.min() <= LEAST_INFORMATION * spread.max() {
        return Err(Unobservable::Collinear);
    }
    let covariance_b = information_b.try_inverse().ok_or(Unobservable::Collinear)? / total;
    Ok(Observation {
        q_nb: best(&davenport(&profile)),
        covariance_b,
    })
}

fn variance(sighting: &Sighting) -> f32 {
    sighting.seen_sd * sighting.seen_sd + sighting.known_sd * sighting.known_sd
}

/// Davenport's matrix of `B = sum a_i v_i w_i'`, scalar first, for the quaternion that takes b to n.
fn davenport(profile: &Matrix3<f32>) -> Matrix4<f32> {
    let trace = profile.trace();
    let skew = Vector3::new(
        profile[(2, 1)] - profile[(1, 2)],
        profile[(0, 2)] - profile[(2, 0)],
        profile[(1, 0)] - profile[(0, 1)],
    );
    let symmetric = profile + profile.transpose() - Matrix3::from_diagonal_element(trace);
    let mut k = Matrix4::zeros();
    k[(0, 0)] = trace;
    k.fixed_view_mut::<3, 1>(1, 0).copy_from(&skew);
    k.fixed_view_mut::<1, 3>(0, 1).copy_from(&skew.transpose());
    k.fixed_view_mut::<3, 3>(1, 1).copy_from(&symmetric);
    k
}

/// Eigenvector of the largest eigenvalue, by cyclic Jacobi rotations (G. Golub, C. Van Loan, "Matrix Computations",
/// section 8.5).
fn best(k: &Matrix4<f32>) -> UnitQuaternion<f32> {
    let (mut k, mut vectors) = (*k, Matrix4::identity());
    for _ in 0..SWEEPS {
        for p in 0..3 {
            for q in p + 1..4 {
                rotate(&mut k, &mut vectors, p, q);
            }
        }
    }
    let largest = k.diagonal().imax();
    let v = vectors.column(largest);
    UnitQuaternion::new_normalize(Quaternion::new(v[0], v[1], v[2], v[3]))
}

/// Turns the plane of `p` and `q` so that their element vanishes.
fn rotate(k: &mut Matrix4<f32>, vectors: &mut Matrix4<f32>, p: usize, q: usize) {
    let off = k[(p, q)];
    if nalgebra::ComplexField::abs(off) < f32::MIN_POSITIVE {
        return;
    }
    let ratio = (k[(q, q)] - k[(p, p)]) / (2.0 * off);
    let root = nalgebra::ComplexField::sqrt(1.0 + ratio * ratio);
    let tangent = if ratio >= 0.0 {
        1.0 / (ratio + root)
    } else {
        1.0 / (ratio - root)
    };
    let cosine = 1.0 / nalgebra::ComplexField::sqrt(1.0 + tangent * tangent);
    let sine = tangent * cosine;
    let mut turn = Matrix4::identity();
    turn[(p, p)] = cosine;
    turn[(q, q)] = cosine;
    turn[(p, q)] = sine;
    turn[(q, p)] = -sine;
    *k = turn.transpose() * *k * turn;
    *vectors *= turn;
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        attitude::{angle_between, from_rotation_vector},
        triad::triad,
    };

    /// An eigenvector's rounding is that of the matrix over the gap between eigenvalues, here a tenth.
    const ROUNDING: f32 = 5e-6;

    /// An inverse of condition 50 whose largest element is 4e-4, in f32.
    const COVARIANCE_ROUNDING: f32 = 5e-9;

    fn sighting(q_nb: &UnitQuaternion<f32>, known_n: Vector3<f32>, seen_sd: f32) -> Sighting {
        Sighting {
            seen_b: q_nb.inverse_transform_vector(&known_n),
            known_n,
            seen_sd,
            known_sd: 0.001,
        }
    }

    #[test]
    fn three_directions_give_any_attitude_half_turns_included() {
        for axis in [Vector3::x(), Vector3::y(), Vector3::z(), Vector3::new(0.6, 0.0, -0.8)] {
            for step in 0..24 {
                let q_nb = from_rotation_vector(axis * (step as f32 * core::f32::consts::PI / 12.0));
                let seen = [
                    sighting(&q_nb, -Vector3::z(), 0.01),
                    sighting(&q_nb, Vector3::new(0.4, 0.1, 0.9), 0.02),
                    sighting(&q_nb, Vector3::new(-0.3, 0.8, 0.2), 0.03),
                ];
                let found = quest(&seen).unwrap();
                let off = angle_between(&found.q_nb, &q_nb);
                assert!(off < ROUNDING, "{axis} {step} {off}");
            }
        }
    }

    #[test]
    fn it_lies_between_two_sightings_that_disagree_by_their_weights() {
        // 90 deg apart, but seen 91 deg apart: equal weights share the degree.
        let tilt = core::f32::consts::PI / 360.0;
        let q_nb = UnitQuaternion::identity();
        let mut seen = [sighting(&q_nb, Vector3::x(), 0.01), sighting(&q_nb, Vector3::y(), 0.01)];
        seen[1].seen_b = from_rotation_vector(Vector3::z() * tilt * 2.0) * Vector3::y();
        let found = quest(&seen).unwrap();
        assert!((angle_between(&found.q_nb, &q_nb) - tilt).abs() < 1e-5);
        assert!((triad(&seen[0], &seen[1]).unwrap().q_nb.angle()) < 1e-6);
    }

    #[test]
    fn its_covariance_is_never_larger_than_triads() {
        let q_nb = from_rotation_vector(Vector3::new(0.3, -0.7, 1.1));
        let seen = [
            sighting(&q_nb, -Vector3::z(), 0.004),
            sighting(&q_nb, Vector3::new(0.7, -0.2, -0.5), 0.02),
        ];
        let (both, first) = (
            quest(&seen).unwrap().covariance_b,
            triad(&seen[0], &seen[1]).unwrap().covariance_b,
        );
        let least = (first - both).symmetric_eigenvalues().min();
        assert!(least > -COVARIANCE_ROUNDING, "{least}");
        assert!(both.trace() < first.trace());
    }

    #[test]
    fn what_triad_refuses_is_refused() {
        let q_nb = UnitQuaternion::identity();
        let up = sighting(&q_nb, -Vector3::z(), 0.01);
        assert_eq!(quest(&[]), Err(Unobservable::NotADirection));
        assert_eq!(quest(&[up]), Err(Unobservable::Collinear));
        assert_eq!(quest(&[up, up]), Err(Unobservable::Collinear));
        let nan = Sighting {
            seen_b: Vector3::repeat(f32::NAN),
            ..up
        };
        assert_eq!(quest(&[up, nan]), Err(Unobservable::NotADirection));
    }
}
