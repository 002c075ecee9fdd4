//! Inner products of residual and columns with motion and calibration marginalised.
//!
//! In: a problem about the smoothed motion, its motion by an [`Elimination`], and columns of what can never be told from either. Out:
//! `<u, v> = u'v - (Q'u)'(Q'v) - c_u'c_v` with `c_u = L^-1 <C, u>` and `L L' = I + <C, C>`, `C` being what the calibration of
//! every channel leaves open and the known nulls. The motion joins the channels, so the calibration is one system of some
//! four hundred columns.
//!
//! What stays the same in many products is marginalised once: with [`Space::rest`] of `v`, `<u, v>` is `u'rest`. A column of the library
//! touches a few channels, so that costs a thousandth of marginalising `u`. [`Space::within`] has the products of many columns
//! with each other.

#[cfg(test)]
mod tests;
mod within;

use std::ops::AddAssign;

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

pub use self::within::Opened;
use crate::{library::products::Entries, null::problem::Problem};

/// A motion that can be eliminated, whichever way it is described.
pub trait Elimination {
    /// `Q'u` of columns, `Q` being orthonormal: what the motion can imitate of each, a column each.
    fn parts(&self, columns: &[&Entries]) -> DMatrix<f64>;

    /// Takes what such parts are in the samples of each channel, `Q` times them, from samples, a column each.
    fn take(&self, parts: &DMatrix<f64>, from: &mut [DMatrix<f64>]);

    /// Degrees of freedom that the motion leaves a channel.
    fn free(&self, channel: usize) -> f64;
}

/// A column and what of it can be imitated.
#[derive(Clone, Debug)]
pub struct Projected {
    /// In units of noise.
    pub column: Entries,
    /// Of a residual, what prior rows that are off give to its part in the motion; empty where none are.
    prior: DVector<f64>,
    /// `c_u`.
    open: DVector<f64>,
}

impl Projected {
    fn with_prior(&self, mut part: DVector<f64>) -> DVector<f64> {
        part.rows_mut(0, self.prior.len()).add_assign(&self.prior);
        part
    }
}

/// Where effects are looked for.
pub struct Space<'a> {
    /// The problem.
    pub problem: &'a Problem<'a>,
    motion: &'a dyn Elimination,
    nulls: Vec<Entries>,
    calibrated: DMatrix<f64>,
    factor: Option<Cholesky<f64, Dyn>>,
}

impl<'a> Space<'a> {
    /// Sets it up; `nulls` are columns for a standard deviation that leaves them free.
    pub fn new(problem: &'a Problem<'a>, motion: &'a dyn Elimination, nulls: Vec<Entries>) -> Self {
        Self::among(problem, motion, nulls, &[]).0
    }

    /// The same, and what calibration and nulls take of columns that are to be asked for.
    pub fn among(
        problem: &'a Problem<'a>,
        motion: &'a dyn Elimination,
        nulls: Vec<Entries>,
        columns: &[&Entries],
    ) -> (Self, Opened) {
        let mut space = Self::known(problem, motion, DMatrix::zeros(0, 0));
        space.nulls = nulls;
        let (inner, mut open) = space.opened(columns);
        space.set(inner);
        space.open_factor(&mut open);
        (space, Opened(open))
    }

    /// One without nulls whose [`Space::calibrated`] is known.
    pub fn known(problem: &'a Problem<'a>, motion: &'a dyn Elimination, calibrated: DMatrix<f64>) -> Self {
        let mut space = Self {
            problem,
            motion,
            nulls: Vec::new(),
            calibrated: DMatrix::zeros(0, 0),
            factor: None,
        };
        space.set(calibrated);
        space
    }

    /// One in which only the motion is marginalised yet; of calibration and nulls `I + C'(I - Q Q')C`, and `C'(I - Q Q')u` of columns.
    pub fn motion_only(
        problem: &'a Problem<'a>,
        motion: &'a dyn Elimination,
        nulls: Vec<Entries>,
        columns: &[&Entries],
    ) -> (Self, DMatrix<f64>, DMatrix<f64>) {
        let mut space = Self::known(problem, motion, DMatrix::zeros(0, 0));
        space.nulls = nulls;
        let (inner, open) = space.opened(columns);
        (space, inner, open)
    }

    /// Marginalises calibration and nulls, whose inner products these are.
    pub fn close(&mut self, inner: DMatrix<f64>) {
        self.set(inner);
    }

    fn set(&mut self, inner: DMatrix<f64>) {
        let calibration = inner.nrows() - self.nulls.len();
        self.calibrated = inner.view((0, 0), (calibration, calibration)).into_owned();
        self.factor = (inner.nrows() > 0).then(|| Cholesky::new(inner)).flatten();
    }

    /// `I + <C, C>` of the calibration alone.
    pub fn calibrated(&self) -> &DMatrix<f64> {
        &self.calibrated
    }

    /// Calibration, channel by channel, then nulls.
    fn columns(&self) -> Vec<Entries> {
        let own = self.problem.frames.iter().enumerate().flat_map(|(channel, frame)| {
            let columns = frame.nuisance.column_iter();
            columns.map(move |column| vec![(channel, column.into_owned())])
        });
        own.chain(self.nulls.iter().cloned()).collect()
    }

    /// `Q'u`.
    fn part(&self, column: &Entries) -> DVector<f64> {
        self.motion.parts(&[column]).column(0).into_owned()
    }

    /// Columns without what the motion imitates of them, of which these are the parts: in all samples of each channel, a column each.
    fn apart(&self, columns: &[&Entries], parts: &DMatrix<f64>) -> Vec<DMatrix<f64>> {
        let frames = self.problem.frames.iter();
        let mut apart: Vec<DMatrix<f64>> = frames
            .map(|frame| DMatrix::zeros(frame.weights.len(), columns.len()))
            .collect();
        for (at, column) in columns.iter().enumerate() {
            for (channel, values) in *column {
                apart[*channel].set_column(at, values);
            }
        }
        self.motion.take(parts, &mut apart);
        apart
    }

    /// The same of one.
    fn one_apart(&self, column: &Entries, part: &DVector<f64>) -> Entries {
        let apart = self.apart(&[column], &DMatrix::from_columns(std::slice::from_ref(part)));
        let values = apart.iter().map(|values| values.column(0).into_owned());
        values.enumerate().collect()
    }

    /// `C'u`.
    pub fn plain(&self, column: &Entries) -> DVector<f64> {
        let mut plain = Vec::new();
        for (channel, frame) in self.problem.frames.iter().enumerate() {
            match column.iter().find(|(own, _)| *own == channel) {
                Some((_, values)) => plain.extend(frame.nuisance.tr_mul(values).iter()),
                None => plain.extend(std::iter::repeat_n(0.0, frame.nuisance.ncols())),
            }
        }
        plain.extend(self.nulls.iter().map(|null| dot(null, column)));
        DVector::from_vec(plain)
    }

    /// What of a column can be imitated.
    pub fn project(&self, column: Entries) -> Projected {
        self.project_residual(column, &DVector::zeros(0))
    }

    /// What of a residual can be imitated, with what prior rows that are off give to its part.
    pub fn project_residual(&self, residual: Entries, prior: &DVector<f64>) -> Projected {
        let mut motion = self.part(&residual);
        motion.rows_mut(0, prior.len()).add_assign(prior);
        let open = match &self.factor {
            Some(factor) => {
                let mut open = self.plain(&self.one_apart(&residual, &motion));
                factor.l_dirty().solve_lower_triangular_mut(&mut open);
                open
            }
            None => DVector::zeros(0),
        };
        Projected {
            column: residual,
            prior: prior.clone(),
            open,
        }
    }

    /// What motion and calibration leave of a column or a residual: `<u, v> = u'rest(v)` for every column `u`.
    pub fn rest(&self, projected: &Projected) -> Entries {
        let left = self.left(projected).0;
        self.one_apart(&left, &projected.with_prior(self.part(&left)))
    }

    /// By how many of its own sigmas each parameter of the calibration is off, channel by channel, as this residual has it.
    pub fn calibration(&self, residual: &Projected) -> Vec<f64> {
        let own = self.problem.frames.iter().map(|frame| frame.nuisance.ncols()).sum();
        self.open(residual).iter().take(own).copied().collect()
    }

    /// What calibration and nulls come to, in their own sigmas.
    fn open(&self, residual: &Projected) -> DVector<f64> {
        let mut open = residual.open.clone();
        if let Some(factor) = &self.factor {
            factor.l_dirty().tr_solve_lower_triangular_mut(&mut open);
        }
        open
    }

    /// Variance and more of what calibration and nulls come to, as a factor: with rows `b` of what depends on them, in units of their sigmas,
    /// `L^-1 b` has the covariance as its inner products.
    pub fn open_factor(&self, right: &mut DMatrix<f64>) {
        if let Some(factor) = &self.factor {
            factor.l_dirty().solve_lower_triangular_mut(right);
        }
    }

    /// What the motion can imitate of each column of calibration and nulls.
    pub fn open_parts(&self) -> DMatrix<f64> {
        self.motion.parts(&self.columns().iter().collect::<Vec<_>>())
    }

    /// What calibration and nulls leave of a residual, and what of each channel's calibration that costs: the energy of how far it
    /// must be off, in its own sigmas. Without it a calibration could explain anything at no price.
    fn left(&self, residual: &Projected) -> (Entries, Vec<f64>) {
        let nothing = (self.problem.frames.iter()).map(|frame| DVector::zeros(frame.weights.len()));
        let mut left: Entries = nothing.enumerate().collect();
        for (channel, values) in &residual.column {
            left[*channel].1.copy_from(values);
        }
        let mut price = vec![0.0; self.problem.frames.len()];
        if self.factor.is_none() {
            return (left, price);
        }
        let found = self.open(residual);
        let mut next = 0;
        for (channel, frame) in self.problem.frames.iter().enumerate() {
            let own = found.rows(next, frame.nuisance.ncols());
            next += frame.nuisance.ncols();
            price[channel] = own.norm_squared();
            left[channel].1.gemv(-1.0, &frame.nuisance, &own, 1.0);
        }
        for (null, size) in self.nulls.iter().zip(found.iter().skip(next)) {
            for (channel, values) in null {
                left[*channel].1.axpy(-size, values, 1.0);
            }
        }
        (left, price)
    }

    /// The motion's part of what calibration and nulls leave of a residual.
    pub fn motion_part(&self, residual: &Projected) -> DVector<f64> {
        residual.with_prior(self.part(&self.left(residual).0))
    }

    /// Of each channel, the energy that a residual keeps and the degrees of freedom that it has there: both are equal on the whole
    /// where noise and calibration are enough.
    pub fn kept(&self, residual: &Projected) -> Vec<(f64, f64)> {
        let (left, price) = self.left(residual);
        let part = residual.with_prior(self.part(&left));
        let apart = self.one_apart(&left, &part);
        let energies = left.iter().zip(&apart).zip(price);
        energies
            .map(|(((channel, values), (_, apart)), price)| (values.dot(apart) + price, self.motion.free(*channel)))
            .collect()
    }
}

/// Root mean square of what channels keep ([`Space::kept`]), over degrees of freedom.
pub fn gap(kept: &[(f64, f64)]) -> f64 {
    let (energy, free) = kept
        .iter()
        .fold((0.0, 0.0), |(energy, free), own| (energy + own.0, free + own.1));
    (energy / free.max(1.0)).max(0.0).sqrt()
}

/// `u'v`.
pub fn dot(one: &Entries, other: &Entries) -> f64 {
    let on = |channel: usize| other.iter().find(|(index, _)| *index == channel);
    let both = one
        .iter()
        .filter_map(|(channel, values)| Some(values.dot(&on(*channel)?.1)));
    both.sum()
}
