//! The thesis' calibrations in f64, as matrices applied to counts.
//!
//! What Eqs 4.18 and 4.38 do in one product, with the errata: scale factors of Eqs 4.21 and 4.40 are reciprocals, biases are
//! divided by them, Eq 4.40's rows are for gravity. The unit does the same axis by axis and solves for the vector.

use nalgebra::{DMatrix, DVector, Vector3};

/// Rows of counts per unit in frame e from the printed rows of Eq 4.39, each multiplied by its factor of Eq 4.40, and of
/// specific force where the print is of gravity.
pub fn accelerometer_rows_e(printed: &[[f64; 3]; 12], factors: &[f64; 12]) -> DMatrix<f64> {
    DMatrix::from_fn(12, 3, |k, axis| -printed[k][axis] / factors[k])
}

/// Rows of counts per unit in frame e behind `H S_F` (Eq 4.23): with `H = (H S_F) S_F^-1` the pseudo-inverse of the rows
/// weighted by `S_F^2`, rows are `S_F u`, `u = pinv(H) / S_F^2`.
pub fn gyro_rows_e(printed: &[[f64; 4]; 3], factors: &[f64; 4]) -> Option<DMatrix<f64>> {
    let h = DMatrix::from_fn(3, 4, |axis, k| printed[axis][k] / factors[k]);
    let inverse = h.pseudo_inverse(1e-12).ok()?;
    Some(DMatrix::from_fn(4, 3, |k, axis| inverse[(k, axis)] / factors[k]))
}

/// Least squares of `counts = rows v + bias`, axes weighted by `weights`.
pub fn vector_e(rows: &DMatrix<f64>, bias: &[f64], weights: &[f64], counts: &[f64]) -> Option<Vector3<f64>> {
    let weight = DVector::from_column_slice(weights);
    let whitened = DMatrix::from_fn(rows.nrows(), 3, |k, axis| rows[(k, axis)] * weight[k]);
    let off = DVector::from_fn(rows.nrows(), |k, _| (counts[k] - bias[k]) * weight[k]);
    let found = whitened.pseudo_inverse(1e-12).ok()? * off;
    Some(Vector3::new(found[0], found[1], found[2]))
}
