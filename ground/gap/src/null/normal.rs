//! Sufficient statistics of a linear model, with what the calibration leaves open already marginalised.
//!
//! In, a channel at a time: the residual `r` and the columns `N` and `E` in units of the channel's noise, `N` being what the
//! calibration leaves open (bias, scale, axis, drift), times its prior sigmas `L`, `E` the columns of the effects that
//! touch the channel. Out: [`Normal`], that is `E'PE`, `E'Pr` and `r'Pr` with
//! `P = (I + N L L'N')^-1 = I - N L (I + L'N'N L)^-1 L'N'` (Woodbury). Channels add up, because their noise is their own.
//! Source: Kennedy and O'Hagan 2001 for the need of it; Rasmussen and Williams 2006, A.3, for the identities.
//!
//! Everything after this works on matrices whose size is the number of parameters, not of samples.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// Twice the sum of the logarithms of a factor's diagonal.
pub fn log_determinant(factor: &Cholesky<f64, Dyn>) -> f64 {
    2.0 * factor.l_dirty().diagonal().iter().map(|value| value.ln()).sum::<f64>()
}

/// Puts further columns beside those of a matrix.
pub fn widen(matrix: &mut DMatrix<f64>, columns: &DMatrix<f64>) {
    let before = matrix.ncols();
    let mut wider = std::mem::replace(matrix, DMatrix::zeros(0, 0)).resize_horizontally(before + columns.ncols(), 0.0);
    wider.columns_mut(before, columns.ncols()).copy_from(columns);
    *matrix = wider;
}

/// Normal equations of the effects with the nuisances marginalised.
#[derive(Clone, Debug, PartialEq)]
pub struct Normal {
    /// `E'PE`.
    pub information: DMatrix<f64>,
    /// `E'Pr`.
    pub score: DVector<f64>,
    /// `r'Pr`.
    pub energy: f64,
}

impl Normal {
    /// Of columns `effects` and a `residual`, with `nuisance` the columns `N L` (one prior sigma each) and `factor` the
    /// Cholesky factor of `I + L N'N L`; `None` stands for one that is not finite and marginalises nothing.
    pub fn marginal(
        nuisance: &DMatrix<f64>,
        factor: Option<&Cholesky<f64, Dyn>>,
        effects: &DMatrix<f64>,
        residual: &DVector<f64>,
    ) -> Self {
        let (mut information, mut score) = (effects.tr_mul(effects), effects.tr_mul(residual));
        let mut energy = residual.norm_squared();
        if let Some(factor) = factor {
            // With `L` the factor, x'Py = x'y - (L^-1 N'x)'(L^-1 N'y).
            let mut open_effects = nuisance.tr_mul(effects);
            let mut open_residual = nuisance.tr_mul(residual);
            let lower = factor.l_dirty();
            lower.solve_lower_triangular_mut(&mut open_effects);
            lower.solve_lower_triangular_mut(&mut open_residual);
            information -= open_effects.tr_mul(&open_effects);
            score -= open_effects.tr_mul(&open_residual);
            energy -= open_residual.norm_squared();
        }
        Normal {
            information,
            score,
            energy,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Double precision over a few hundred operations on numbers near one.
    const ROUNDING: f64 = 1e-9;

    fn columns() -> DMatrix<f64> {
        DMatrix::from_fn(40, 5, |row, column| {
            ((row * (column + 2)) as f64 * 0.37).sin() + f64::from(u8::from(column == 0))
        })
    }

    fn residual() -> DVector<f64> {
        DVector::from_fn(40, |row, _| ((row * row) as f64 * 0.11).cos())
    }

    fn marginal(nuisance: &DMatrix<f64>, effects: &DMatrix<f64>, residual: &DVector<f64>) -> Normal {
        let open = nuisance.ncols();
        let factor = Cholesky::new(DMatrix::identity(open, open) + nuisance.tr_mul(nuisance));
        Normal::marginal(nuisance, factor.as_ref(), effects, residual)
    }

    #[test]
    fn woodbury_equals_the_inverse_it_stands_for() {
        let (all, r) = (columns(), residual());
        let n = all.columns(0, 2) * DMatrix::from_diagonal(&DVector::from_column_slice(&[0.7, 2.0]));
        let e = all.columns(2, 3).into_owned();
        let covariance = DMatrix::identity(40, 40) + &n * n.transpose();
        let precision = covariance.try_inverse().expect("positive definite");
        let normal = marginal(&n, &e, &r);
        assert!((normal.information - e.transpose() * &precision * &e).norm() < ROUNDING);
        assert!((normal.score - e.transpose() * &precision * &r).norm() < ROUNDING);
        assert!((normal.energy - (r.transpose() * &precision * &r)[0]).abs() < ROUNDING);
    }

    #[test]
    fn an_effect_that_equals_a_nuisance_keeps_only_what_its_prior_leaves() {
        let ones = DMatrix::from_element(10_000, 1, 1.0);
        let sigma = 0.1;
        let normal = marginal(&(&ones * sigma), &ones, &DVector::zeros(10_000));
        // 1 / (sigma^2 + 1/n): beyond the calibration's own sigma no number of samples tells more.
        let expected = 1.0 / (sigma * sigma + 1e-4);
        assert!((normal.information[(0, 0)] - expected).abs() < 1e-6 * expected);
    }
}
