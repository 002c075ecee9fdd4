//! Weighted least squares by the singular values of the whitened rows.
//!
//! In: rows of sense axes, values, variances. Out: the vector of least length that fits best, its covariance, and the rank.
//! With `A = W^1/2 H = U S V^T` the solution is `V S^+ U^T W^1/2 y` and its covariance `V (S^+)^2 V^T` (Golub and Van Loan,
//! "Matrix Computations", section 5.5), where the unit inverts `H^T W H`.

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};

/// Singular values below this part of the largest are zero: the axes are rounded to f32.
const RANK: f64 = 1e-6;

/// The vector, its covariance, and how many directions of it are known.
pub fn least_squares(
    axes_b: &[Vector3<f64>],
    values: &[f64],
    variances: &[f64],
) -> (Vector3<f64>, Matrix3<f64>, usize) {
    // Padded with empty rows to at least three, so that every direction has its singular vector.
    let rows = axes_b.len().max(3);
    let mut whitened = DMatrix::zeros(rows, 3);
    let mut measured = DVector::zeros(rows);
    for (k, axis_b) in axes_b.iter().enumerate() {
        let weight = variances[k].sqrt().recip();
        whitened.set_row(k, &(axis_b.transpose() * weight));
        measured[k] = values[k] * weight;
    }
    let svd = whitened.svd(true, true);
    let (Some(u), Some(v_t)) = (svd.u, svd.v_t) else {
        return (Vector3::zeros(), Matrix3::zeros(), 0);
    };
    let least = RANK * svd.singular_values.max();
    let (mut vector, mut covariance, mut rank) = (Vector3::zeros(), Matrix3::zeros(), 0);
    for (k, singular) in svd.singular_values.iter().enumerate() {
        if *singular > least {
            let direction: Vector3<f64> = v_t.fixed_view::<1, 3>(k, 0).transpose();
            vector += direction * (u.column(k).dot(&measured) / singular);
            covariance += direction * direction.transpose() / (singular * singular);
            rank += 1;
        }
    }
    (vector, covariance, rank)
}
