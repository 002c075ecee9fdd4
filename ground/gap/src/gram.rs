//! Sufficient statistics of a linear model, with what the calibration leaves open already marginalised.
//!
//! In, a channel at a time: the residual `r` and the columns `[N | E]` in units of the channel's noise, `N` being what the
//! calibration leaves open (bias, scale, axis, drift) with its prior sigmas `L`, `E` the columns of the effects that
//! touch the channel. Out: [`Normal`], that is `E'PE`, `E'Pr`, `r'Pr` and the determinant, with
//! `P = (I + N L^2 N')^-1 = I - N (L^-2 + N'N)^-1 N'` (Woodbury). Channels add up, because their noise is their own.
//! Source: Kennedy and O'Hagan 2001 for the need of it; Rasmussen and Williams 2006, A.3, for the identities.
//!
//! Everything after this works on matrices whose size is the number of parameters, not of samples.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// Cross products of the columns `[N | E | r]` of one channel, which add up over stretches of time.
#[derive(Clone, Debug, PartialEq)]
pub struct Gram {
    nuisances: usize,
    products: DMatrix<f64>,
    samples: usize,
}

impl Gram {
    /// Of columns given as one matrix, nuisances first, and the residual.
    pub fn new(nuisances: usize, columns: &DMatrix<f64>, residual: &DVector<f64>) -> Self {
        let width = columns.ncols();
        let mut products = DMatrix::zeros(width + 1, width + 1);
        products.view_mut((0, 0), (width, width)).copy_from(&columns.tr_mul(columns));
        let score = columns.tr_mul(residual);
        products.view_mut((0, width), (width, 1)).copy_from(&score);
        products.view_mut((width, 0), (1, width)).copy_from(&score.transpose());
        products[(width, width)] = residual.norm_squared();
        Gram {
            nuisances,
            products,
            samples: residual.len(),
        }
    }

    /// Both stretches together.
    pub fn add(&mut self, other: &Gram) {
        self.products += &other.products;
        self.samples += other.samples;
    }

    /// Marginalises the nuisances, with prior `sigmas` in their own units.
    pub fn marginalise(&self, sigmas: &[f64]) -> Normal {
        let width = self.products.nrows() - 1;
        let open = self.nuisances;
        let effects = width - open;
        let scaled = |row: usize| sigmas.get(row).copied().unwrap_or(0.0);
        let core = DMatrix::from_fn(open, open, |row, column| {
            f64::from(u8::from(row == column)) + scaled(row) * self.products[(row, column)] * scaled(column)
        });
        let cross = DMatrix::from_fn(open, effects + 1, |row, column| scaled(row) * self.products[(row, open + column)]);
        let rest = self.products.view((open, open), (effects + 1, effects + 1));
        let (explained, log_determinant, solved) = match Cholesky::new(core) {
            Some(factor) => {
                let solved = factor.solve(&cross);
                (cross.tr_mul(&solved), log_determinant(&factor), solved)
            }
            // The core is I plus a Gram matrix: only values that are not finite bring us here.
            None => (DMatrix::zeros(effects + 1, effects + 1), 0.0, DMatrix::zeros(open, effects + 1)),
        };
        let marginal = rest - explained;
        Normal {
            information: marginal.view((0, 0), (effects, effects)).into_owned(),
            score: marginal.view((0, effects), (effects, 1)).column(0).into_owned(),
            energy: marginal[(effects, effects)],
            log_determinant,
            samples: self.samples,
            nuisance: solved.column(effects).into_owned(),
            nuisance_slope: solved.columns(0, effects).into_owned(),
        }
    }
}

/// Twice the sum of the logarithms of a factor's diagonal.
pub fn log_determinant(factor: &Cholesky<f64, Dyn>) -> f64 {
    2.0 * factor.l_dirty().diagonal().iter().map(|value| value.ln()).sum::<f64>()
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
    /// `ln det(I + N L^2 N')`.
    pub log_determinant: f64,
    /// Rows that went in.
    pub samples: usize,
    /// The nuisances' best values over their sigmas, with no effect in.
    pub nuisance: DVector<f64>,
    /// How those change with the effects: subtract this times the effects' parameters.
    pub nuisance_slope: DMatrix<f64>,
}

impl Normal {
    /// Nuisances over their sigmas once effects with these parameters are in.
    pub fn nuisance_given(&self, parameters: &DVector<f64>) -> DVector<f64> {
        &self.nuisance - &self.nuisance_slope * parameters
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Double precision over a few hundred operations on numbers near one.
    const ROUNDING: f64 = 1e-9;

    fn columns() -> DMatrix<f64> {
        DMatrix::from_fn(40, 5, |row, column| ((row * (column + 2)) as f64 * 0.37).sin() + f64::from(u8::from(column == 0)))
    }

    fn residual() -> DVector<f64> {
        DVector::from_fn(40, |row, _| ((row * row) as f64 * 0.11).cos())
    }

    #[test]
    fn woodbury_equals_the_inverse_it_stands_for() {
        let sigmas = [0.7, 2.0];
        let (all, r) = (columns(), residual());
        let (n, e) = (all.columns(0, 2).into_owned(), all.columns(2, 3).into_owned());
        let prior = DMatrix::from_diagonal(&DVector::from_iterator(2, sigmas.iter().map(|s| s * s)));
        let covariance = DMatrix::identity(40, 40) + &n * prior * n.transpose();
        let precision = covariance.clone().try_inverse().expect("positive definite");
        let normal = Gram::new(2, &all, &r).marginalise(&sigmas);
        assert!((normal.information - e.transpose() * &precision * &e).norm() < ROUNDING);
        assert!((normal.score - e.transpose() * &precision * &r).norm() < ROUNDING);
        assert!((normal.energy - (r.transpose() * &precision * &r)[0]).abs() < ROUNDING);
        assert!((normal.log_determinant - covariance.determinant().ln()).abs() < ROUNDING);
    }

    #[test]
    fn stretches_of_time_add_up_to_the_whole() {
        let (all, r) = (columns(), residual());
        let mut sum = Gram::new(2, &all.rows(0, 15).into_owned(), &r.rows(0, 15).into_owned());
        sum.add(&Gram::new(2, &all.rows(15, 25).into_owned(), &r.rows(15, 25).into_owned()));
        let whole = Gram::new(2, &all, &r);
        assert!((sum.products - whole.products).norm() < ROUNDING);
        assert_eq!(sum.samples, whole.samples);
    }

    #[test]
    fn an_effect_that_equals_a_nuisance_keeps_only_what_its_prior_leaves() {
        let ones = DMatrix::from_element(10_000, 2, 1.0);
        let sigma = 0.1;
        let normal = Gram::new(1, &ones, &DVector::zeros(10_000)).marginalise(&[sigma]);
        // 1 / (sigma^2 + 1/n): beyond the calibration's own sigma no number of samples tells more.
        let expected = 1.0 / (sigma * sigma + 1e-4);
        assert!((normal.information[(0, 0)] - expected).abs() < 1e-6 * expected);
    }
}
