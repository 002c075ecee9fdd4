//! The normal equations of slow courses, set by set of channels that share a state.
//!
//! In: what each channel has ([`Seen`]), what is open beside the courses ([`Open`]). Out: [`Sums`], to which each set adds what its own
//! pass of [`crate::null::whitening`] says.

use nalgebra::{DMatrix, DVector};
use twin::predict::Kind;

use super::{Open, Seen, Slow, courses, design};
use crate::{
    input::case::SlowErrors,
    null::{
        problem::Problem,
        wander::{of_states, processes, sees},
        whitening::{Process, Sample, Whitening, places},
    },
};

/// [unit/sqrt(s)] by which zeros walk where their description says less: accelerometers, gyros, magnetometers (nine recordings of BROAD).
const WALKS: [f64; 3] = [3e-4, 1e-6, 2e-3];

/// States that a set of several channels shares: three axes of the attitude, three of the field.
const SHARED: usize = 6;

/// The normal equations of the discrepancies beside what is open.
pub(super) struct Sums {
    /// Of what is open, with itself and with the residual.
    pub open: DMatrix<f64>,
    pub pull: DVector<f64>,
    /// Of each discrepancy: with itself, with what is open, with the residual.
    pub own: Vec<(DMatrix<f64>, DMatrix<f64>, DVector<f64>)>,
}

impl Sums {
    /// Nothing but the prior of what is open.
    pub fn none(open: usize, found: &[Slow], count: usize) -> Self {
        let of_slow = |slow: &Slow| {
            let width = count * slow.place.components();
            (
                DMatrix::zeros(width, width),
                DMatrix::zeros(open, width),
                DVector::zeros(width),
            )
        };
        Sums {
            open: DMatrix::identity(open, open),
            pull: DVector::zeros(open),
            own: found.iter().map(of_slow).collect(),
        }
    }
}

/// What all sets have in common.
pub(super) struct Pass<'a> {
    pub problem: &'a Problem<'a>,
    pub errors: &'a SlowErrors,
    pub seen: &'a [Seen],
    pub open: &'a Open,
    pub found: &'a [Slow],
    /// Of each stretch of the log, how far the courses have run there, 0 to 1.
    pub phases: &'a [f64],
    /// How many courses.
    pub count: usize,
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
    /// Adds the normal equations of one set of channels.
    pub fn add(&self, set: &[usize], sums: &mut Sums) {
        let means = self.means(set);
        let (processes, shared) = self.processes(set);
        let whitening = Whitening::new(&processes, &self.samples(set, &means, &processes, shared));
        let touching: Vec<usize> = (0..self.open.len())
            .filter(|at| self.open[*at].iter().any(|(channel, _)| set.contains(channel)))
            .collect();
        let white = whitening.whiten(&self.beside(set, &means, &touching));
        let (white_open, white_residual) = (white.columns(0, touching.len()), white.column(touching.len()));
        let (own, pull) = (white_open.tr_mul(&white_open), white_open.tr_mul(&white_residual));
        for (row, one) in touching.iter().enumerate() {
            sums.pull[*one] += pull[row];
            (touching.iter().enumerate()).for_each(|(column, other)| sums.open[(*one, *other)] += own[(row, column)]);
        }
        for (slow, (own, with_open, pull)) in self.found.iter().zip(&mut sums.own) {
            if !set.iter().any(|channel| slow.channels.contains(channel)) {
                continue;
            }
            let white = whitening.whiten(&self.of_slow(slow, set, &means));
            *own += white.tr_mul(&white);
            *pull += white.tr_mul(&white_residual);
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
        let walk = |channel: &usize| {
            let own = &self.problem.twin.unit().channels[*channel];
            let least = match own.sensor {
                Kind::Accelerometer => WALKS[0],
                Kind::Gyro => WALKS[1],
                Kind::Magnetometer => WALKS[2],
                Kind::Thermometer => 0.0,
            };
            Process::Walk {
                per_root_s: own.drift_sigma.max(least),
            }
        };
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

    /// The columns of what is open and touches the set, and the residual as the last.
    fn beside(&self, set: &[usize], means: &[Mean], touching: &[usize]) -> DMatrix<f64> {
        let mut columns = DMatrix::zeros(means.len(), touching.len() + 1);
        for (column, at) in touching.iter().enumerate() {
            let of_place: Vec<Option<&Vec<f64>>> = (set.iter())
                .map(|channel| {
                    self.open[*at]
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
            columns[(row, touching.len())] = self.seen[set[mean.place]].residual[mean.own];
        }
        columns
    }

    /// The columns of a discrepancy: its components, each with all courses.
    fn of_slow(&self, slow: &Slow, set: &[usize], means: &[Mean]) -> DMatrix<f64> {
        let (course, scales) = courses(self.count);
        let components = slow.place.components();
        let share = (components as f64).sqrt().recip();
        let mut columns = DMatrix::zeros(means.len(), self.count * components);
        let theirs = |(_, channel): &(usize, &usize)| slow.channels.contains(channel);
        for (place, channel) in set.iter().enumerate().filter(theirs) {
            let seen = &self.seen[*channel];
            let of_component = |component: usize| {
                let of = |sample: usize| design(self.problem, seen, *channel, slow.place, sample)[component];
                seen.binned.means(of)
            };
            let designs: Vec<Vec<f64>> = (0..components).map(of_component).collect();
            for (row, mean) in means.iter().enumerate().filter(|(_, mean)| mean.place == place) {
                for (component, designs) in designs.iter().enumerate() {
                    for (k, scale) in scales.iter().enumerate() {
                        columns[(row, component * self.count + k)] =
                            share * scale * course(k, self.phases[mean.bin]) * designs[mean.own];
                    }
                }
            }
        }
        columns
    }
}

/// Channels that share a state, together; the others by themselves.
pub(super) fn sets(problem: &Problem, errors: &SlowErrors) -> Vec<Vec<usize>> {
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
