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
    library::products::Entries,
    null::problem::Problem,
    parity::smooth::{
        banded::{Banded, Factor, Inverse, LANES},
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

    /// Covariance of the turn at an instant \[rad2\] with the calibration known.
    pub fn covariance(&self, t_s: f64) -> [[f64; 3]; 3] {
        let (first, own) = self.turn_rows(t_s);
        from_fn(|one| from_fn(|other| self.between(UNKNOWNS * first, &own[one], &own[other])))
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
    /// `A'u`, and behind it what a column is along the temperatures.
    fn seen(&self, column: &Entries) -> Vec<f64> {
        let size = self.factor.size();
        let mut seen = vec![0.0; size + self.log_rows];
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
        seen
    }
}

impl Elimination for Smoothing {
    fn parts(&self, columns: &[&Entries]) -> DMatrix<f64> {
        let size = self.factor.size();
        let mut parts = DMatrix::zeros(size + self.log_rows, columns.len());
        let rows = size + self.log_rows;
        let blocks = parts.as_mut_slice().par_chunks_mut(LANES * rows);
        blocks.zip(columns.par_chunks(LANES)).for_each(|(parts, columns)| {
            let mut panel = vec![[0.0; LANES]; size];
            for (lane, (column, part)) in columns.iter().zip(parts.chunks_exact_mut(rows)).enumerate() {
                let seen = self.seen(column);
                panel.iter_mut().zip(&seen).for_each(|(row, own)| row[lane] = *own);
                part[size..].copy_from_slice(&seen[size..]);
            }
            self.factor.forward(&mut panel);
            for (lane, part) in parts.chunks_exact_mut(rows).enumerate() {
                part.iter_mut().zip(&panel).for_each(|(own, row)| *own = row[lane]);
            }
        });
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
        let mut panel = vec![[0.0; LANES]; size];
        for block in 0..parts.ncols().div_ceil(LANES) {
            let lanes = LANES * block..parts.ncols().min(LANES * (block + 1));
            for (lane, at) in lanes.clone().enumerate() {
                let part = parts.column(at);
                panel
                    .iter_mut()
                    .zip(part.as_slice())
                    .for_each(|(row, own)| row[lane] = *own);
            }
            self.factor.backward(&mut panel);
            let channels = self.rows.par_iter().zip(&self.warm).zip(&mut *from);
            channels.for_each(|((own, warm), from)| {
                for (sample, (row, share)) in warm.iter().enumerate() {
                    (lanes.clone()).for_each(|at| from[(sample, at)] -= share * parts[(size + row, at)]);
                }
                for (sample, first) in own.first.iter().enumerate() {
                    let values = own.of(sample, &panel[UNKNOWNS * first..]);
                    (lanes.clone().zip(values)).for_each(|(at, value)| from[(sample, at)] -= value);
                }
            });
        }
    }

    fn free(&self, channel: usize) -> f64 {
        if !self.warm[channel].is_empty() {
            let taken: f64 = self.warm[channel].iter().map(|(_, share)| share * share).sum();
            return self.warm[channel].len() as f64 - taken;
        }
        let own = &self.rows[channel];
        let mut whole = vec![0.0; own.knots * UNKNOWNS];
        let taken: f64 = (0..own.first.len())
            .map(|sample| {
                let slopes = own.whole(sample, &mut whole);
                self.between(UNKNOWNS * own.first[sample], slopes, slopes)
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
