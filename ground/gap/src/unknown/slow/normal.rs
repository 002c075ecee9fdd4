//! The normal equations of columns that are tried, set by set of channels that share a state.
//!
//! In: what each channel has ([`Seen`]), what is open beside them ([`Open`]), and what is [`Tried`]. Out: [`Sums`], to which each set adds
//! what its own pass of [`crate::null::whitening`] says, and of these the information and the score of what is tried with all else
//! marginalised.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use twin::predict::Kind;

use super::{Seen, open::Open};
use crate::{
    input::case::SlowErrors,
    null::{
        problem::Problem,
        wander::{of_states, processes, sees, zero_walk},
        whitening::{Process, Sample, Whitening, places},
    },
};

/// States that a set of several channels shares: three axes of the attitude, three of the field.
const SHARED: usize = 6;

/// Columns that are tried beside what is open.
pub(super) struct Tried<'a> {
    /// Where they are not zero.
    pub channels: Vec<usize>,
    /// How many.
    pub width: usize,
    /// At the means of one of those channels, a mean a row.
    pub of_channel: Box<dyn Fn(usize) -> DMatrix<f64> + 'a>,
}

/// The normal equations of what is tried beside what is open, for several residuals.
pub(super) struct Sums {
    /// Of what is open, with itself and with the residuals.
    open: DMatrix<f64>,
    pull: DMatrix<f64>,
    /// Energy of each residual.
    energies: Vec<f64>,
    /// Of what is tried, one after the other: with itself, with what is open, with the residuals.
    own: Vec<(DMatrix<f64>, DMatrix<f64>, DMatrix<f64>)>,
}

impl Sums {
    /// Nothing but the prior of what is open.
    fn none(open: usize, residuals: usize, tried: &[Tried]) -> Self {
        let of_tried = |tried: &Tried| {
            (
                DMatrix::zeros(tried.width, tried.width),
                DMatrix::zeros(open, tried.width),
                DMatrix::zeros(tried.width, residuals),
            )
        };
        Sums {
            open: DMatrix::identity(open, open),
            pull: DMatrix::zeros(open, residuals),
            energies: vec![0.0; residuals],
            own: tried.iter().map(of_tried).collect(),
        }
    }

    /// What is open, factored, but for some of it that is not there.
    pub fn without(&self, dropped: &[usize]) -> Option<Marginal<'_>> {
        let kept: Vec<usize> = (0..self.open.nrows()).filter(|at| !dropped.contains(at)).collect();
        let open = self.open.select_rows(&kept).select_columns(&kept);
        Some(Marginal {
            sums: self,
            factor: Cholesky::new(open)?,
            kept,
        })
    }
}

/// Normal equations with what is open marginalised.
pub(super) struct Marginal<'a> {
    sums: &'a Sums,
    kept: Vec<usize>,
    factor: Cholesky<f64, Dyn>,
}

impl Marginal<'_> {
    /// Energy of a residual, in squares of noise.
    pub fn energy(&self, residual: usize) -> f64 {
        let pull = self.sums.pull.select_rows(&self.kept).column(residual).into_owned();
        self.sums.energies[residual] - pull.dot(&self.factor.solve(&pull))
    }

    /// ln of the determinant of what is open.
    pub fn log_determinant(&self) -> f64 {
        self.factor.ln_determinant()
    }

    /// Information and score of one that was tried, against one residual.
    pub fn of(&self, tried: usize, residual: usize) -> (DMatrix<f64>, DVector<f64>) {
        let (own, with_open, pull) = &self.sums.own[tried];
        let with_open = with_open.select_rows(&self.kept);
        let open_pull = self.sums.pull.select_rows(&self.kept);
        let solved = self.factor.solve(&with_open);
        let information = own - with_open.tr_mul(&solved);
        let score = pull.column(residual) - solved.tr_mul(&open_pull.column(residual));
        (0.5 * (&information + information.transpose()), score)
    }
}

/// What all sets have in common.
pub(super) struct Pass<'a> {
    pub problem: &'a Problem<'a>,
    pub errors: &'a SlowErrors,
    pub seen: &'a [Seen],
    pub open: &'a Open,
    pub tried: &'a [Tried<'a>],
    /// \[s\] a stretch.
    pub step_s: f64,
}

/// A mean of a channel: which stretch of the log it is, which channel of the set, which of that channel's means.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Mean {
    bin: usize,
    place: usize,
    own: usize,
}

impl Pass<'_> {
    /// The normal equations of all sets of channels.
    pub fn sums(&self) -> Sums {
        let residuals = self.seen.first().map_or(0, |seen| seen.residuals.len());
        let mut sums = Sums::none(self.open.columns.len(), residuals, self.tried);
        for set in sets(self.problem, self.errors) {
            self.add(&set, &mut sums);
        }
        sums
    }

    /// Adds those of one set.
    fn add(&self, set: &[usize], sums: &mut Sums) {
        let means = self.means(set);
        let (processes, shared) = self.processes(set);
        let whitening = Whitening::new(&processes, &self.samples(set, &means, &processes, shared));
        let touching: Vec<usize> = (0..self.open.columns.len())
            .filter(|at| self.open.columns[*at].iter().any(|(channel, _)| set.contains(channel)))
            .collect();
        let white = whitening.whiten(&self.beside(set, &means, &touching));
        let white_open = white.columns(0, touching.len());
        let white_residuals = white.columns(touching.len(), sums.pull.ncols());
        let (own, pull) = (white_open.tr_mul(&white_open), white_open.tr_mul(&white_residuals));
        (sums.energies.iter_mut().zip(white_residuals.column_iter())).for_each(|(sum, own)| *sum += own.norm_squared());
        for (row, one) in touching.iter().enumerate() {
            let mut sum = sums.pull.row_mut(*one);
            sum += pull.row(row);
            (touching.iter().enumerate()).for_each(|(column, other)| sums.open[(*one, *other)] += own[(row, column)]);
        }
        for (tried, (own, with_open, pull)) in self.tried.iter().zip(&mut sums.own) {
            if !set.iter().any(|channel| tried.channels.contains(channel)) {
                continue;
            }
            let white = whitening.whiten(&of_set(tried, set, &means));
            *own += white.tr_mul(&white);
            *pull += white.tr_mul(&white_residuals);
            let cross = white_open.tr_mul(&white);
            for (row, at) in touching.iter().enumerate() {
                let mut sum = with_open.row_mut(*at);
                sum += cross.row(row);
            }
        }
    }

    /// All means of the set, in the order of time.
    fn means(&self, set: &[usize]) -> Vec<Mean> {
        let mut means = Vec::new();
        for (place, channel) in set.iter().enumerate() {
            let bins = self.seen[*channel].binned.bins.iter().enumerate();
            means.extend(bins.map(|(own, bin)| Mean { bin: *bin, place, own }));
        }
        means.sort_unstable();
        means
    }

    /// What errs slowly, and how many of these the channels share: a channel alone has nothing but its zero.
    fn processes(&self, set: &[usize]) -> (Vec<Process>, usize) {
        let errors = self.errors;
        let walk = |channel: &usize| zero_walk(&self.problem.twin.unit().channels[*channel]);
        let shared = if set.len() > 1 { SHARED } else { 0 };
        let processes = processes(errors).into_iter().take(shared).chain(set.iter().map(walk));
        (processes.collect(), shared)
    }

    fn samples(&self, set: &[usize], means: &[Mean], processes: &[Process], shared: usize) -> Vec<Sample> {
        let (at, _) = places(processes);
        let rows: Vec<Vec<Vec<f64>>> = (set.iter())
            .map(|channel| match shared {
                0 => Vec::new(),
                _ => seen_states(self.problem, &self.seen[*channel], *channel),
            })
            .collect();
        let sample = |mean: &Mean| {
            let mut seen = [0.0; 9];
            (seen.iter_mut().zip(&rows[mean.place])).for_each(|(seen, part)| *seen = part[mean.own]);
            let mut sees = vec![(at[shared + mean.place], 1.0)];
            sees.extend(of_states(&seen, &at));
            Sample {
                t_s: mean.bin as f64 * self.step_s,
                sees,
                variance: self.seen[set[mean.place]].binned.variances[mean.own],
            }
        };
        means.iter().map(sample).collect()
    }

    /// The columns of what is open and touches the set, and the residuals after them.
    fn beside(&self, set: &[usize], means: &[Mean], touching: &[usize]) -> DMatrix<f64> {
        let residuals = self.seen[set[0]].residuals.len();
        let mut columns = DMatrix::zeros(means.len(), touching.len() + residuals);
        for (column, at) in touching.iter().enumerate() {
            let of_place: Vec<Option<&Vec<f64>>> = (set.iter())
                .map(|channel| {
                    self.open.columns[*at]
                        .iter()
                        .find(|(own, _)| own == channel)
                        .map(|(_, means)| means)
                })
                .collect();
            for (row, mean) in means.iter().enumerate() {
                columns[(row, column)] = of_place[mean.place].map_or(0.0, |means| means[mean.own]);
            }
        }
        for (row, mean) in means.iter().enumerate() {
            for (at, residual) in self.seen[set[mean.place]].residuals.iter().enumerate() {
                columns[(row, touching.len() + at)] = residual[mean.own];
            }
        }
        columns
    }
}

/// The columns of what is tried at the means of a set.
fn of_set(tried: &Tried, set: &[usize], means: &[Mean]) -> DMatrix<f64> {
    let of_place = |channel: &usize| tried.channels.contains(channel).then(|| (tried.of_channel)(*channel));
    let of_place: Vec<Option<DMatrix<f64>>> = set.iter().map(of_place).collect();
    let mut columns = DMatrix::zeros(means.len(), tried.width);
    for (row, mean) in means.iter().enumerate() {
        if let Some(own) = &of_place[mean.place] {
            columns.row_mut(row).copy_from(&own.row(mean.own));
        }
    }
    columns
}

/// Channels that share a state, together; the others by themselves.
fn sets(problem: &Problem, errors: &SlowErrors) -> Vec<Vec<usize>> {
    let (mut together, mut sets) = (Vec::new(), Vec::new());
    for (channel, own) in problem.twin.unit().channels.iter().enumerate() {
        let is_shared = match own.sensor {
            Kind::Thermometer => false,
            Kind::Magnetometer => errors.attitude_sigma_rad > 0.0 || errors.field_wander_sigma_ut > 0.0,
            Kind::Accelerometer | Kind::Gyro => errors.attitude_sigma_rad > 0.0,
        };
        match is_shared {
            true => together.push(channel),
            false => sets.push(vec![channel]),
        }
    }
    sets.push(together);
    sets.retain(|set| !set.is_empty());
    sets
}

/// Of a channel what it sees of an attitude error about the axes of n, of its rate, and of a field error along them, averaged.
fn seen_states(problem: &Problem, seen: &Seen, channel: usize) -> Vec<Vec<f64>> {
    let own = &problem.twin.unit().channels[channel];
    let states: Vec<[f64; 9]> = seen.feels.iter().map(|feel| sees(own, feel)).collect();
    (0..9)
        .map(|of| seen.binned.means(|sample| states[sample][of]))
        .collect()
}
