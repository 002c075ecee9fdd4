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

pub use self::within::{Asked, Opened};
use crate::{
    library::column::Entries,
    null::{evidence::Screen, problem::Problem},
};

/// Columns that are taken through the motion, and rows that are solved for, at once: what a processor's cache holds.
const AT_ONCE: usize = 64;

/// Steps of conjugate gradients at most: so many cost half of a new factor.
const MOST_NEAR: usize = 20;

/// Steps after which it is seen whether so many will do.
const TRIED: usize = 3;

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
        let mut space = Self::open_still(problem, motion, nulls);
        space.marginalise();
        space
    }

    /// One in which only the motion is marginalised yet.
    pub fn open_still(problem: &'a Problem<'a>, motion: &'a dyn Elimination, nulls: Vec<Entries>) -> Self {
        let mut space = Self::known(problem, motion, DMatrix::zeros(0, 0));
        space.nulls = nulls;
        space
    }

    /// Marginalises calibration and nulls, and gives what the motion can imitate of each of their columns.
    pub fn marginalise(&mut self) -> DMatrix<f64> {
        let (inner, parts) = self.inner();
        self.set(inner);
        parts
    }

    /// What marginalises calibration and nulls, where it is known.
    pub fn factor(&self) -> Option<&Cholesky<f64, Dyn>> {
        self.factor.as_ref()
    }

    /// The same, and what calibration and nulls take of columns that are to be asked for.
    pub fn among<A: Asked>(
        problem: &'a Problem<'a>,
        motion: &'a dyn Elimination,
        nulls: Vec<Entries>,
        columns: &[&A],
    ) -> (Self, Opened) {
        let mut space = Self::open_still(problem, motion, nulls);
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
    pub fn motion_only<A: Asked>(
        problem: &'a Problem<'a>,
        motion: &'a dyn Elimination,
        nulls: Vec<Entries>,
        columns: &[&A],
    ) -> (Self, DMatrix<f64>, DMatrix<f64>) {
        let space = Self::open_still(problem, motion, nulls);
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

    /// Part of the energy of columns, each for a standard deviation, that the motion cannot imitate.
    pub fn kept_by_motion(&self, columns: &[Entries], sigmas: &[f64]) -> f64 {
        let parts = self.motion.parts(&columns.iter().collect::<Vec<_>>());
        let sum = |own: &dyn Fn(usize) -> f64| -> f64 {
            let all = sigmas.iter().enumerate();
            all.map(|(at, sigma)| sigma * sigma * own(at)).sum()
        };
        let whole = sum(&|at| dot(&columns[at], &columns[at]));
        let imitated = sum(&|at| parts.column(at).norm_squared());
        if whole > 0.0 { 1.0 - imitated / whole } else { 0.0 }
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

    /// The same of many columns.
    pub fn rests(&self, columns: &[Entries]) -> Vec<Entries> {
        columns.chunks(AT_ONCE).flat_map(|own| self.rests_of(own)).collect()
    }

    fn rests_of(&self, columns: &[Entries]) -> Vec<Entries> {
        let own: Vec<&Entries> = columns.iter().collect();
        let apart = self.entries(&own, &self.motion.parts(&own));
        let left: Vec<Entries> = (columns.iter().zip(&apart))
            .map(|(column, apart)| {
                let mut open = self.plain(apart);
                if let Some(factor) = &self.factor {
                    factor.solve_mut(&mut open);
                }
                self.without(column, &open)
            })
            .collect();
        let left: Vec<&Entries> = left.iter().collect();
        self.entries(&left, &self.motion.parts(&left))
    }

    /// Columns without what the motion imitates of them, of which these are the parts.
    fn entries(&self, columns: &[&Entries], parts: &DMatrix<f64>) -> Vec<Entries> {
        let apart = self.apart(columns, parts);
        let own = |at: usize| -> Entries {
            let values = apart.iter().map(|values| values.column(at).into_owned());
            values.enumerate().collect()
        };
        (0..columns.len()).map(own).collect()
    }

    /// The motion's part of what calibration and nulls leave of a residual, by conjugate gradients with the factor of a space about a motion
    /// nearby, until what is left is this share of the whole; none where that motion is not near enough. `M c = b` with
    /// `M = I + C'(I - Q Q')C` costs a pass through the motion a step, and `M` itself one for each of its columns (Golub and Van Loan, Matrix
    /// Computations, 11.5).
    pub fn motion_part_near(
        &self,
        residual: &Entries,
        prior: &DVector<f64>,
        near: &Cholesky<f64, Dyn>,
        enough: f64,
    ) -> Option<DVector<f64>> {
        let mut left = self.part(residual);
        left.rows_mut(0, prior.len()).add_assign(prior);
        let mut rest = self.plain(&self.one_apart(residual, &left));
        if rest.len() != near.l_dirty().nrows() {
            return None;
        }
        let mut steep = near.solve(&rest);
        let mut along = steep.clone();
        let whole = rest.dot(&steep);
        let mut size = whole;
        for step in 1..=MOST_NEAR {
            let column = self.without(&Entries::new(), &-&along);
            let part = self.part(&column);
            let moved = &along + self.plain(&self.one_apart(&column, &part));
            let share = size / along.dot(&moved);
            left.axpy(-share, &part, 1.0);
            rest.axpy(-share, &moved, 1.0);
            steep = near.solve(&rest);
            let before = std::mem::replace(&mut size, rest.dot(&steep));
            let share = (size / whole).max(0.0).sqrt();
            if size <= 0.0 || share <= enough {
                return Some(left);
            }
            if step >= TRIED && share.powf(MOST_NEAR as f64 / step as f64) > enough {
                return None;
            }
            along = &steep + along * (size / before);
        }
        None
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
        let Some(factor) = &self.factor else {
            return;
        };
        let (lower, size) = (factor.l_dirty(), right.nrows());
        for first in (0..size).step_by(AT_ONCE) {
            let next = size.min(first + AT_ONCE);
            let (known, mut own) = right.rows_range_pair_mut(..first, first..next);
            if first > 0 {
                own.gemm(-1.0, &lower.view((first, 0), (next - first, first)), &known, 1.0);
            }
            let corner = lower.view((first, first), (next - first, next - first));
            corner.solve_lower_triangular_mut(&mut own);
        }
    }

    /// What the motion can imitate of each column of calibration and nulls.
    pub fn open_parts(&self) -> DMatrix<f64> {
        self.motion.parts(&self.columns().iter().collect::<Vec<_>>())
    }

    /// What calibration and nulls leave of a residual, and what of each channel's calibration that costs: the energy of how far it
    /// must be off, in its own sigmas. Without it a calibration could explain anything at no price.
    fn left(&self, residual: &Projected) -> (Entries, Vec<f64>) {
        let found = match self.factor {
            Some(_) => self.open(residual),
            None => DVector::zeros(self.size()),
        };
        let mut next = 0;
        let price = self.problem.frames.iter().map(|frame| {
            let own = found.rows(next, frame.nuisance.ncols());
            next += frame.nuisance.ncols();
            own.norm_squared()
        });
        (self.without(&residual.column, &found), price.collect())
    }

    /// Calibration and nulls there are.
    fn size(&self) -> usize {
        let calibration = self.problem.frames.iter().map(|frame| frame.nuisance.ncols());
        calibration.sum::<usize>() + self.nulls.len()
    }

    /// A column in all channels, without what calibration and nulls of these sizes are.
    fn without(&self, column: &Entries, found: &DVector<f64>) -> Entries {
        let nothing = (self.problem.frames.iter()).map(|frame| DVector::zeros(frame.weights.len()));
        let mut left: Entries = nothing.enumerate().collect();
        for (channel, values) in column {
            left[*channel].1.copy_from(values);
        }
        let mut next = 0;
        for (channel, frame) in self.problem.frames.iter().enumerate() {
            let own = found.rows(next, frame.nuisance.ncols());
            next += frame.nuisance.ncols();
            left[channel].1.gemv(-1.0, &frame.nuisance, &own, 1.0);
        }
        for (null, size) in self.nulls.iter().zip(found.iter().skip(next)) {
            for (channel, values) in null {
                left[*channel].1.axpy(-size, values, 1.0);
            }
        }
        left
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

/// Normal equations of columns whose rests these are, beside a residual of which motion and calibration leave `left`.
pub fn screen(columns: &[&Entries], rests: &[&Entries], prior_sigmas: Vec<f64>, left: &Entries) -> Screen {
    let mut screen = Screen::zeros(prior_sigmas);
    for (row, column) in columns.iter().enumerate() {
        screen.score[row] = dot(column, left);
        for (other, rest) in rests.iter().enumerate() {
            screen.information[(row, other)] = dot(column, rest);
        }
    }
    screen
}
