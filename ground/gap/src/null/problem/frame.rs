//! One channel of the fit windows: its samples, what one of them weighs, and what its calibration leaves open.
//!
//! In: columns and residuals in units of noise. Out: what the calibration can imitate of them, and what it leaves.

use std::sync::Arc;

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use crate::{
    input::log::Series,
    null::{
        colour::Colour,
        normal::{Normal, widen},
    },
};

/// One channel of the fit windows.
#[derive(Clone, Debug)]
pub struct Frame {
    /// Its samples.
    pub series: Series,
    /// Physical units a unit of noise in the fit, sample by sample.
    pub weights: DVector<f64>,
    /// What makes its columns white; `None` where they are taken for white.
    pub colour: Option<Colour>,
    /// The sensor's own noise over that, as described.
    pub own: DVector<f64>,
    /// What the calibration leaves open, in units of noise for one prior sigma. Every fit has it, and most change nothing of it.
    pub nuisance: Arc<DMatrix<f64>>,
    /// Names and prior sigmas of those columns.
    pub nuisance_names: Vec<(String, f64)>,
    /// `r'Pr` with no effect in.
    pub quiet_energy: f64,
    pub(super) factor: Option<Cholesky<f64, Dyn>>,
}

impl Frame {
    /// `L^-1 N'x`: what the calibration can imitate of a column.
    pub fn open_part(&self, column: &DVector<f64>) -> DVector<f64> {
        let mut open = DMatrix::from_columns(&[self.nuisance.tr_mul(column)]);
        self.solve_open(&mut open);
        open.column(0).into_owned()
    }

    /// `N'x` to `L^-1 N'x`, in place.
    pub fn solve_open(&self, open: &mut DMatrix<f64>) {
        match &self.factor {
            Some(factor) => {
                factor.l_dirty().solve_lower_triangular_mut(open);
            }
            None => open.fill(0.0),
        }
    }

    /// What of a residual the calibration does not take up.
    pub fn left(&self, residual: &DVector<f64>) -> DVector<f64> {
        let mut left = residual.clone();
        if let Some(factor) = &self.factor {
            left.gemv(
                -1.0,
                &self.nuisance,
                &factor.solve(&self.nuisance.tr_mul(residual)),
                1.0,
            );
        }
        left
    }

    /// A column in units of white noise, of one in physical units.
    pub fn white(&self, column: DVector<f64>) -> DVector<f64> {
        match &self.colour {
            Some(_) => self.whites(DMatrix::from_columns(&[column])).column(0).into_owned(),
            None => column.component_div(&self.weights),
        }
    }

    /// The same of several columns.
    pub fn whites(&self, mut columns: DMatrix<f64>) -> DMatrix<f64> {
        (columns.column_iter_mut()).for_each(|mut column| column.component_div_assign(&self.weights));
        match &self.colour {
            Some(colour) => colour.applied(columns),
            None => columns,
        }
    }

    /// What each sample of a column in physical units makes of its inner product with one in white noise.
    pub fn dual(&self, white: &DVector<f64>) -> DVector<f64> {
        match &self.colour {
            Some(colour) => colour.dual(white).component_div(&self.weights),
            None => white.component_div(&self.weights),
        }
    }

    /// The columns in physical units that these are in white noise.
    pub fn physical(&self, white: DMatrix<f64>) -> DMatrix<f64> {
        let mut columns = match &self.colour {
            Some(colour) => colour.taken_back(white),
            None => white,
        };
        (columns.column_iter_mut()).for_each(|mut column| column.component_mul_assign(&self.weights));
        columns
    }

    /// Takes its noise for one of this colour, from white: colours do not add up.
    pub fn tint(&mut self, colour: Colour) {
        self.nuisance = colour.applied((*self.nuisance).clone()).into();
        self.colour = Some(colour);
        self.factorise();
    }

    /// Weighs its samples anew: the noise of each is so many times what it was taken for.
    pub fn reweigh(&mut self, factors: &DVector<f64>) {
        self.weights.component_mul_assign(factors);
        for mut column in Arc::make_mut(&mut self.nuisance).column_iter_mut() {
            column.component_div_assign(factors);
        }
        self.factorise();
    }

    /// Opens further columns of its calibration, in units of noise for one prior sigma.
    pub fn widen(&mut self, columns: &DMatrix<f64>) {
        widen(Arc::make_mut(&mut self.nuisance), columns);
        self.factorise();
    }

    /// After its columns have changed.
    pub(super) fn factorise(&mut self) {
        let open = self.nuisance.ncols();
        self.factor = Cholesky::new(DMatrix::identity(open, open) + self.nuisance.tr_mul(&self.nuisance));
    }

    /// Normal equations of some columns with the calibration marginalised.
    pub fn normal(&self, effects: &DMatrix<f64>, residual: &DVector<f64>) -> Normal {
        Normal::marginal(&self.nuisance, self.factor.as_ref(), effects, residual)
    }
}
