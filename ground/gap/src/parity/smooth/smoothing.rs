//! The motion as one smooth course, eliminated: what a column or a residual keeps that no such course makes.
//!
//! In: the problem along a trajectory, its knots, and how far the course may bend. Out: [`Smoothing`]. With the rows `A` of
//! [`crate::parity::smooth::rows`] and the prior rows `P`, `N = A'A + P'P = L L'` is banded, and `<u, v> = u'v - (L^-1 A'u)'(L^-1 A'v)`
//! is what is left of a product once the motion is marginalised. This is a smoother in information form, with the same gains
//! for residual, calibration and every effect (Rosenberg 1973, de Jong 1991).
//!
//! The prior rows are those of [`crate::parity::smooth::prior`]. A track is tied to it beside ([`crate::parity::smooth::tied`]).
//!
//! The temperature of a row is free, as it is in [`crate::parity::packet`].

use std::{array::from_fn, sync::OnceLock};

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use twin::predict::{Feel, Kind};

use crate::{
    library::column::Entries,
    null::problem::Problem,
    parity::smooth::{
        banded::{Banded, Factor, Inverse, LANES, Panel},
        basis::Knots,
        prior::{Prior, priors},
        rows::{Rows, UNKNOWNS, width},
        tied::Tie,
        trajectory::Trajectory,
    },
    parity::{
        course::{Course, Start},
        known::track::{Aligned, Fix},
        space::Elimination,
    },
};

/// Rows of a panel that are filled and emptied before others: what the first of a processor's caches holds.
const TOGETHER: usize = 64;

/// Which slopes of the prior rows are in the normal matrix.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Slopes {
    /// Their own: with these steps settle.
    OfSteps,
    /// Those that have the curvature of their energies: what is known in the end.
    Known,
}

/// A motion that is eliminated.
pub struct Smoothing {
    /// Where its knots are.
    pub knots: Knots,
    rows: Vec<Rows>,
    factor: Factor,
    inverse: OnceLock<Inverse>,
    priors: Vec<Prior>,
    tie: Option<(Tie, DVector<f64>)>,
    /// Rows of the log, and of each thermometer the row of every sample and its part of the temperature.
    log_rows: usize,
    warm: Vec<Vec<(usize, f64)>>,
    /// Degrees of freedom of each channel, made when first asked for.
    free: Vec<OnceLock<f64>>,
}

impl Smoothing {
    /// About a trajectory; `rests` are the spans \[s\] in which the unit does not move from its place, with the standard deviation of its
    /// acceleration there; `beside` are further rows. A motion of [`Slopes::Known`] is asked for covariances alone.
    pub fn of(
        problem: &Problem,
        trajectory: &Trajectory,
        course: (&Course, &Start),
        knots: Knots,
        rests: &[((f64, f64), f64)],
        beside: Vec<Prior>,
        slopes: Slopes,
    ) -> Self {
        let scene = trajectory.scene();
        let feel = |t_s: f64| -> Feel { scene.feel(t_s) };
        let width = width(problem, &knots);
        let channels = 0..problem.frames.len();
        let rows: Vec<Rows> = channels
            .map(|channel| Rows::along(problem, channel, &knots, &feel))
            .collect();
        let size = UNKNOWNS * (knots.coefficients() + width / UNKNOWNS);
        let mut normal = Banded::zeros(size, width);
        let mut whole = vec![0.0; width];
        for own in &rows {
            for sample in 0..own.first.len() {
                normal.add(UNKNOWNS * own.first[sample], own.whole(sample, &mut whole));
            }
        }
        let priors = priors(problem.twin.starts_s(), trajectory, course, &knots, rests);
        let priors: Vec<Prior> = priors.chain(beside).collect();
        for prior in &priors {
            match slopes {
                Slopes::OfSteps => normal.add(prior.first, &prior.slopes),
                Slopes::Known => normal.add(prior.first, &prior.known()),
            }
        }
        Self {
            knots,
            rows,
            inverse: OnceLock::new(),
            factor: normal.factor(),
            priors,
            tie: None,
            log_rows: problem.twin.starts_s().len(),
            warm: warm(problem),
            free: vec![OnceLock::new(); problem.frames.len()],
        }
    }

    /// The same, tied to a track along the trajectory that it was made about.
    pub fn tied(mut self, fixes: &[Fix], aligned: &Aligned, trajectory: &Trajectory) -> Self {
        let tie = Tie::of(fixes, aligned, trajectory, &self.knots, &self.factor);
        self.tie = Some((tie, aligned.off.clone()));
        self
    }

    /// \[s\] one sigma of the offset of the track's clock; none without a track, and where the log does not tell it.
    pub fn offset_sigma_s(&self) -> Option<f64> {
        self.tie.as_ref()?.0.offset_sigma_s
    }

    /// `L^-1 P'r` of the prior rows, with what they are off by along the trajectory that they were made about.
    pub fn prior(&self) -> DVector<f64> {
        let track = self.tie.as_ref().map(|(_, off)| off.clone());
        self.prior_of(self.priors.iter().map(|prior| prior.off), track.as_ref())
    }

    /// The same with what they, and the rows of the track, are off by along another.
    pub fn prior_of(&self, off: impl Iterator<Item = f64>, track: Option<&DVector<f64>>) -> DVector<f64> {
        let mut right = vec![0.0; self.factor.size()];
        for (prior, off) in self.priors.iter().zip(off) {
            let own = right[prior.first..].iter_mut().zip(&prior.slopes);
            own.for_each(|(sum, slope)| *sum += slope * off);
        }
        self.factor.forward(right.as_chunks_mut::<1>().0);
        let mut right = DVector::from_vec(right);
        if let (Some((tie, _)), Some(track)) = (&self.tie, track) {
            right += tie.prior(track);
            let size = right.len();
            tie.apply(&mut right.view_mut((0, 0), (size, 1)));
        }
        right
    }

    fn inverse(&self) -> &Inverse {
        self.inverse.get_or_init(|| self.factor.inverse())
    }

    /// The correction that a part comes to: coefficients of turn and force, knot by knot.
    pub fn correction(&self, part: &DVector<f64>) -> Vec<f64> {
        let mut solved = part.rows(0, self.factor.size()).into_owned();
        if let Some((tie, _)) = &self.tie {
            tie.apply(&mut solved.view_mut((0, 0), (self.factor.size(), 1)));
        }
        let mut solved = solved.as_slice().to_vec();
        self.factor.backward(solved.as_chunks_mut::<1>().0);
        solved
    }

    /// What the turn in b at instants \[s\] comes to with parts: a row a part, three columns an instant.
    pub fn turned(&self, mut parts: DMatrix<f64>, instants_s: &[f64]) -> DMatrix<f64> {
        let (size, count) = (self.factor.size(), parts.ncols());
        if let Some((tie, _)) = &self.tie {
            tie.apply(&mut parts.view_mut((0, 0), (size, count)));
        }
        let places: Vec<_> = instants_s.iter().map(|t_s| self.knots.weights(*t_s, 0)).collect();
        let mut turned = DMatrix::zeros(count, 3 * instants_s.len());
        self.each_correction::<LANES>(&parts, &mut |from, panel| {
            for (instant, (first, weights)) in places.iter().enumerate() {
                for axis in 0..3 {
                    let mut sums = [0.0; LANES];
                    for (at, weight) in weights.iter().enumerate() {
                        let own = &panel[UNKNOWNS * (first + at) + axis];
                        sums.iter_mut().zip(own).for_each(|(sum, own)| *sum += own * weight);
                    }
                    let mut column = turned.column_mut(3 * instant + axis);
                    let rows = column.iter_mut().skip(from).zip(sums);
                    rows.for_each(|(turned, sum)| *turned = sum);
                }
            }
        });
        turned
    }

    /// Covariance of the turn at an instant \[rad2\] with the calibration known.
    pub fn covariance(&self, t_s: f64) -> [[f64; 3]; 3] {
        let (first, own) = self.turn_rows(t_s);
        from_fn(|one| from_fn(|other| self.between(UNKNOWNS * first, &own[one], &own[other])))
    }

    /// `own' N^-1 own` with everything in `N`.
    fn around(&self, first: usize, own: &[f64]) -> f64 {
        let less = self.tie.as_ref().map_or(0.0, |(tie, _)| tie.less(first, own, own));
        self.inverse().around(first, own) - less
    }

    /// `one' N^-1 other` with everything in `N`.
    fn between(&self, first: usize, one: &[f64], other: &[f64]) -> f64 {
        let less = self.tie.as_ref().map_or(0.0, |(tie, _)| tie.less(first, one, other));
        self.inverse().between(first, one, other) - less
    }

    /// The first knot of a turn at an instant, and the weights of its three components from there on.
    pub fn turn_rows(&self, t_s: f64) -> (usize, [Vec<f64>; 3]) {
        let (first, weights) = self.knots.weights(t_s, 0);
        let component = |axis: usize| {
            let mut own = vec![0.0; UNKNOWNS * weights.len()];
            (weights.iter().enumerate()).for_each(|(at, weight)| own[UNKNOWNS * at + axis] = *weight);
            own
        };
        (first, [component(0), component(1), component(2)])
    }
}

impl Smoothing {
    /// Adds `A'u`, and behind it what a column is along the temperatures.
    fn see(&self, column: &Entries, seen: &mut [f64]) {
        let size = self.factor.size();
        for (channel, values) in column {
            let own = &self.rows[*channel];
            let samples = own.first.iter().zip(own.slopes.chunks_exact(own.width()));
            for ((first, slopes), value) in samples.zip(values.iter()).filter(|(_, value)| **value != 0.0) {
                let knots = seen[UNKNOWNS * first..size].chunks_exact_mut(UNKNOWNS);
                for (sum, slopes) in knots.zip(slopes.chunks_exact(own.unknowns)) {
                    sum.iter_mut()
                        .zip(slopes)
                        .for_each(|(sum, slope)| *sum += slope * value);
                }
            }
            for ((row, share), value) in self.warm[*channel].iter().zip(values.iter()) {
                seen[size + row] += share * value;
            }
        }
    }
}

impl Elimination for Smoothing {
    fn parts(&self, columns: &[&Entries]) -> DMatrix<f64> {
        let size = self.factor.size();
        let mut parts = DMatrix::zeros(size + self.log_rows, columns.len());
        match columns.len() {
            1 => self.parts_in::<1>(columns, &mut parts),
            _ => self.parts_in::<LANES>(columns, &mut parts),
        }
        if let Some((tie, _)) = &self.tie {
            tie.apply(&mut parts.view_mut((0, 0), (size, columns.len())));
        }
        parts
    }

    fn take(&self, parts: &DMatrix<f64>, from: &mut [DMatrix<f64>]) {
        let size = self.factor.size();
        let tied = self.tie.as_ref().map(|(tie, _)| {
            let mut own = parts.clone();
            tie.apply(&mut own.view_mut((0, 0), (size, parts.ncols())));
            own
        });
        let parts = tied.as_ref().unwrap_or(parts);
        match parts.ncols() {
            1 => self.take_in::<1>(parts, from),
            _ => self.take_in::<LANES>(parts, from),
        }
    }

    fn free(&self, channel: usize) -> f64 {
        *self.free[channel].get_or_init(|| self.free_of(channel))
    }
}

impl Smoothing {
    /// `L^-1 A'u` of columns, so many at a time, and what they are along the temperatures.
    fn parts_in<const N: usize>(&self, columns: &[&Entries], parts: &mut DMatrix<f64>) {
        let (size, rows) = (self.factor.size(), parts.nrows());
        let blocks = parts.as_mut_slice().par_chunks_mut(N * rows);
        blocks.zip(columns.par_chunks(N)).for_each(|(parts, columns)| {
            // What begins within the log is nothing before.
            let mut begun = size;
            for (column, part) in columns.iter().zip(parts.chunks_exact_mut(rows)) {
                self.see(column, part);
                begun = part[..begun].iter().position(|own| *own != 0.0).unwrap_or(begun);
            }
            let mut panel = vec![[0.0; N]; size];
            for (rows_of_panel, panel) in panel.chunks_mut(TOGETHER).enumerate() {
                for (lane, part) in parts.chunks_exact(rows).enumerate() {
                    let own = panel.iter_mut().zip(&part[TOGETHER * rows_of_panel..]);
                    own.for_each(|(row, own)| row[lane] = *own);
                }
            }
            self.factor.forward_from(begun, &mut panel);
            for (rows_of_panel, panel) in panel.chunks(TOGETHER).enumerate() {
                for (lane, part) in parts.chunks_exact_mut(rows).enumerate() {
                    let own = part[TOGETHER * rows_of_panel..].iter_mut().zip(panel);
                    own.for_each(|(own, row)| *own = row[lane]);
                }
            }
        });
    }

    /// `L^-T` of parts, so many at a time, with the panel of each and the first of its columns.
    pub fn each_correction<const N: usize>(&self, parts: &DMatrix<f64>, with: &mut dyn FnMut(usize, &Panel<N>)) {
        let size = self.factor.size();
        let mut panel = vec![[0.0; N]; size];
        for first in (0..parts.ncols()).step_by(N) {
            let own = parts.columns_range(first..parts.ncols().min(first + N));
            for (rows_of_panel, panel) in panel.chunks_mut(TOGETHER).enumerate() {
                for (lane, part) in own.column_iter().enumerate() {
                    let own = panel.iter_mut().zip(&part.as_slice()[TOGETHER * rows_of_panel..]);
                    own.for_each(|(row, own)| row[lane] = *own);
                }
            }
            self.factor.backward(&mut panel);
            with(first, &panel);
        }
    }

    fn take_in<const N: usize>(&self, parts: &DMatrix<f64>, from: &mut [DMatrix<f64>]) {
        let size = self.factor.size();
        self.each_correction::<N>(parts, &mut |first, panel| {
            let channels = self.rows.par_iter().zip(&self.warm).zip(&mut *from);
            channels.for_each(|((own, warm), from)| {
                let samples = from.nrows().max(1);
                let values: Vec<[f64; N]> = (own.first.iter().enumerate())
                    .map(|(sample, first)| own.of(sample, &panel[UNKNOWNS * first..]))
                    .collect();
                let columns = from.as_mut_slice().chunks_exact_mut(samples);
                for (lane, (column, part)) in columns.zip(parts.column_iter()).skip(first).take(N).enumerate() {
                    let warm = column.iter_mut().zip(warm);
                    warm.for_each(|(value, (row, share))| *value -= share * part[size + row]);
                    let moved = column.iter_mut().zip(&values);
                    moved.for_each(|(value, moved)| *value -= moved[lane]);
                }
            });
        });
    }

    fn free_of(&self, channel: usize) -> f64 {
        if !self.warm[channel].is_empty() {
            let taken: f64 = self.warm[channel].iter().map(|(_, share)| share * share).sum();
            return self.warm[channel].len() as f64 - taken;
        }
        let own = &self.rows[channel];
        let mut whole = vec![0.0; own.knots * UNKNOWNS];
        let taken: f64 = (0..own.first.len())
            .map(|sample| {
                let slopes = own.whole(sample, &mut whole);
                self.around(UNKNOWNS * own.first[sample], slopes)
            })
            .sum();
        own.first.len() as f64 - taken
    }
}

/// Of each thermometer, the row of every sample and its part of a unit vector along the temperature of that row.
fn warm(problem: &Problem) -> Vec<Vec<(usize, f64)>> {
    let channels = &problem.twin.unit().channels;
    let is_warm = |channel: usize| channels[channel].sensor == Kind::Thermometer;
    let mut squares = vec![0.0; problem.twin.starts_s().len()];
    for (channel, frame) in problem.frames.iter().enumerate() {
        if !is_warm(channel) {
            continue;
        }
        let samples = frame.series.rows.iter().zip(frame.weights.iter());
        samples.for_each(|(row, weight)| squares[*row as usize] += 1.0 / (weight * weight));
    }
    let of = |(channel, frame): (usize, &crate::null::problem::Frame)| -> Vec<(usize, f64)> {
        if !is_warm(channel) {
            return Vec::new();
        }
        let samples = frame.series.rows.iter().zip(frame.weights.iter());
        samples
            .map(|(row, weight)| (*row as usize, 1.0 / (weight * squares[*row as usize].sqrt())))
            .collect()
    };
    problem.frames.iter().enumerate().map(of).collect()
}
