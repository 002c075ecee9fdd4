//! The inverse of a 3 x 3 information matrix, as far as there is one.
//!
//! In: `N = H^T W H`, symmetric and not negative. Out: its inverse on what is known, and what that is. No eigenvalue
//! iteration: for symmetric 3 x 3 matrices the adjugate has the same eigenvectors with the products of the other two
//! eigenvalues, so its largest column is the direction of a missing rank.

use nalgebra::{ComplexField, Matrix3, Vector3};

/// What of a vector is known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Known {
    /// All of it.
    All,
    /// All but its component along this unit vector, in b.
    Across(Vector3<f32>),
    /// Its component along this unit vector only, in b.
    Along(Vector3<f32>),
    /// Nothing.
    Nothing,
}

/// A direction of which less than this part of the mean information is known is unknown. Two orders above f32 rounding
/// of a determinant, and far below what an axis with ten times the noise still tells.
const UNKNOWN: f32 = 1e-5;

/// Covariance on what is known, and what is.
pub(super) fn invert(information: &Matrix3<f32>) -> (Matrix3<f32>, Known) {
    let mean = information.trace() / 3.0;
    if !(mean > 0.0 && mean.is_normal()) {
        return (Matrix3::zeros(), Known::Nothing);
    }
    // Scaled to a mean eigenvalue of one, so that no product over- or underflows.
    let scaled = information * (1.0 / mean);
    let adjugate = adjugate(&scaled);
    let determinant = scaled.row(0).transpose().dot(&adjugate.column(0));
    // Products of eigenvalues: of all three, and the sum of those of two.
    let (three, two) = (determinant, adjugate.trace());
    if two < UNKNOWN {
        let known_b = largest_column(&scaled);
        let variance = 1.0 / (mean * known_b.dot(&(scaled * known_b)));
        return (known_b * known_b.transpose() * variance, Known::Along(known_b));
    }
    if three < UNKNOWN * two {
        let unknown_b = largest_column(&adjugate);
        // The unknown direction is given the mean information, and that is taken out again.
        let filler = unknown_b * unknown_b.transpose();
        let filled = scaled - filler * unknown_b.dot(&(scaled * unknown_b)) + filler;
        let inverse = self::adjugate(&filled) / filled.determinant() - filler;
        return (inverse / mean, Known::Across(unknown_b));
    }
    (adjugate * (1.0 / (determinant * mean)), Known::All)
}

/// Of a symmetric matrix: `A adj(A) = det(A) I`, six cofactors.
fn adjugate(a: &Matrix3<f32>) -> Matrix3<f32> {
    let (xx, yy, zz) = (
        a.m22 * a.m33 - a.m23 * a.m23,
        a.m11 * a.m33 - a.m13 * a.m13,
        a.m11 * a.m22 - a.m12 * a.m12,
    );
    let (xy, xz, yz) = (
        a.m13 * a.m23 - a.m12 * a.m33,
        a.m12 * a.m23 - a.m13 * a.m22,
        a.m12 * a.m13 - a.m11 * a.m23,
    );
    Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz)
}

fn largest_column(a: &Matrix3<f32>) -> Vector3<f32> {
    let mut largest = a.column(0).into_owned();
    for k in 1..3 {
        if a.column(k).norm_squared() > largest.norm_squared() {
            largest = a.column(k).into_owned();
        }
    }
    largest / ComplexField::sqrt(largest.norm_squared())
}

#[cfg(test)]
mod tests {
    use nalgebra::UnitQuaternion;

    use super::*;

    fn of_eigenvalues(values: [f32; 3], turned: &UnitQuaternion<f32>) -> Matrix3<f32> {
        let dcm = turned.to_rotation_matrix().into_inner();
        dcm * Matrix3::from_diagonal(&Vector3::from(values)) * dcm.transpose()
    }

    #[test]
    fn rank_is_found_whatever_the_unit_and_however_it_is_turned() {
        for step in 0..100 {
            let turned = UnitQuaternion::from_euler_angles(0.3 * step as f32, 0.2 * step as f32, 0.1 * step as f32);
            for unit in [1e-12, 1e-3, 1.0, 1e6, 1e12] {
                let rank = |values: [f32; 3]| match invert(&of_eigenvalues(values.map(|v| v * unit), &turned)).1 {
                    Known::All => 3,
                    Known::Across(_) => 2,
                    Known::Along(_) => 1,
                    Known::Nothing => 0,
                };
                assert_eq!(rank([1.0, 2.0, 0.01]), 3, "{step} {unit}");
                assert_eq!(rank([1.0, 2.0, 0.0]), 2, "{step} {unit}");
                assert_eq!(rank([0.0, 2.0, 0.0]), 1, "{step} {unit}");
            }
        }
    }

    #[test]
    fn the_inverse_on_what_is_known_is_the_pseudo_inverse() {
        let turned = UnitQuaternion::from_euler_angles(0.4, -1.0, 2.0);
        for (values, inverses) in [
            ([4.0, 2.0, 1.0], [0.25, 0.5, 1.0]),
            ([4.0, 2.0, 0.0], [0.25, 0.5, 0.0]),
            ([4.0, 0.0, 0.0], [0.25, 0.0, 0.0]),
        ] {
            let found = invert(&of_eigenvalues(values, &turned)).0;
            // Ten roundings of numbers up to one.
            assert!((found - of_eigenvalues(inverses, &turned)).norm() < 1e-6, "{values:?}");
        }
    }

    #[test]
    fn what_is_not_a_number_tells_nothing() {
        for bad in [f32::NAN, f32::INFINITY, -1.0, 0.0] {
            assert_eq!(invert(&(Matrix3::identity() * bad)).1, Known::Nothing);
        }
    }
}
