//! What some channels would see together: a vector, a small rotation, a factor, free in each stretch of time.
//!
//! In: for each sample what each of its components adds to it. Out: the energy along them of what a fit leaves.

use nalgebra::{Cholesky, Const, SMatrix, SVector};

use super::{Fitted, View, aspects::place};

/// Something of `D` components that some channels would see together, free in each stretch of time.
pub struct Common<const D: usize> {
    /// Per channel, for each sample its stretch and what each component adds to it; empty for a channel that is not looked at.
    rows: Vec<Vec<(usize, SVector<f64, D>)>>,
    factors: Vec<Option<Cholesky<f64, Const<D>>>>,
}

impl<const D: usize> Common<D> {
    /// `design` gives what the components add to a sample; only channels that are seen count.
    pub fn new(
        views: &[View],
        stretches: usize,
        design: impl Fn(&View, usize) -> SVector<f64, D>,
        is_seen: impl Fn(usize) -> bool,
    ) -> Self {
        /// Of the mean of the diagonal: directions no sensor looks along stay closed.
        const RIDGE: f64 = 1e-3;
        let mut normal = vec![SMatrix::<f64, D, D>::zeros(); stretches];
        let mut rows = Vec::new();
        for (index, view) in views.iter().enumerate() {
            let row = |(row, phase): (usize, &f64)| (place(*phase, stretches), design(view, row));
            let own: Vec<(usize, SVector<f64, D>)> = match is_seen(index) {
                true => view.phase.iter().enumerate().map(row).collect(),
                false => Vec::new(),
            };
            own.iter()
                .for_each(|(stretch, add)| normal[*stretch] += add * add.transpose());
            rows.push(own);
        }
        let factor = |normal: &SMatrix<f64, D, D>| {
            Cholesky::new(normal + SMatrix::identity() * (RIDGE * normal.trace() / D as f64))
        };
        Common {
            rows,
            factors: normal.iter().map(factor).collect(),
        }
    }

    /// The energy along the components, over all stretches.
    pub fn sum(&self, fitted: &Fitted) -> f64 {
        let mut scores = vec![SVector::zeros(); self.factors.len()];
        for (rows, rest) in self.rows.iter().zip(&fitted.rest) {
            for ((stretch, add), value) in rows.iter().zip(rest.iter()) {
                scores[*stretch] += add * *value;
            }
        }
        let energy = |(factor, score): (&Option<Cholesky<f64, Const<D>>>, &SVector<f64, D>)| {
            factor.as_ref().map_or(0.0, |factor| score.dot(&factor.solve(score)))
        };
        self.factors.iter().zip(&scores).map(energy).sum()
    }
}
