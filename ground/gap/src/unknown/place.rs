//! Where the gap is: channels, plates, regimes of the motion, bands, stretches of time, and which of these stand out.
//!
//! In: the fit windows' residual with the calibration refitted and no effect in ([`Model`]), and what the unit does at each
//! row. Out: a [`Place`]: shares of the excess (energy above noise and calibration) by channel, plate and octave, each
//! adding up to one; by regime as LMG shares of the energy from row to row ([`crate::unknown::shapley`]); the cells that stand out
//! ([`cells`]); and when the gap is there ([`passage`]). What an effect strains the calibration by counts as its channel's.
//!
//! What noise and calibration leave is simulated on the case's own motion and holes, so a share is of what is above that.

pub mod cells;
pub mod passage;
pub mod regimes;

use nalgebra::DVector;
use rand_xoshiro::{Xoshiro256PlusPlus, rand_core::SeedableRng};

use self::{cells::Cell, passage::Passage};
use crate::{
    null::{joint::Fitted, model::Model, problem::Problem},
    unknown::{
        adequacy::{View, simulate},
        octaves::{self, Octave},
    },
};

/// Logs simulated: their mean is known to a tenth of the spread, and their spread to a fourteenth.
const SIMULATIONS: usize = 100;

/// Numbers drawn in all, so that a long log takes bounded time; at least [`LEAST_SIMULATIONS`] logs are.
const DRAWS: usize = 6_000_000;

const LEAST_SIMULATIONS: usize = 20;

/// Fixed, so that one case gives one verdict.
const SEED: u64 = 0x5eed_0007;

/// Where the gap is.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Place {
    /// Share of each channel, most first.
    pub channels: Vec<(String, f64)>,
    /// Share of each plate or group, most first.
    pub groups: Vec<(String, f64)>,
    /// Share of each octave of frequency, highest first.
    pub octaves: Vec<(String, f64)>,
    /// LMG share of what each quantity of the motion explains of the energy from row to row, most first, and the rest.
    pub regimes: Vec<(String, f64)>,
    /// Cells that stand out at a false discovery rate of [`crate::thresholds::CHANCE`], strongest first.
    pub cells: Vec<Cell>,
    /// When the gap is there, if it is not always.
    pub passage: Option<Passage>,
}

/// What is looked at of the residuals of one log, real or simulated: sums of squares.
pub(crate) struct Sums {
    /// By channel, with the strain of its calibration: that is where an effect shows which the calibration takes up.
    channels: Vec<f64>,
    /// By channel and octave.
    octaves: Vec<Vec<f64>>,
    /// By cell.
    cells: Vec<f64>,
}

/// Where the gap of the fit windows is.
pub fn locate(problem: &Problem, views: &[View], quiet: &Model) -> Place {
    let unit = problem.twin.unit();
    let layout = cells::Layout::new(problem);
    let scales: Vec<f64> = (problem.frames.iter().enumerate())
        .map(|(channel, frame)| {
            let samples = frame.series.rows.len();
            let ones = DVector::from_element(samples, 1.0);
            problem.in_sigmas(channel, &ones).norm() / (samples.max(1) as f64).sqrt()
        })
        .collect();
    let sums = |fitted: &Fitted| Sums {
        channels: (fitted.rest.iter().zip(&fitted.nuisance))
            .map(|(rest, open)| rest.norm_squared() + open.norm_squared())
            .collect(),
        octaves: fitted
            .rest
            .iter()
            .map(|rest| octaves::energies(rest.as_slice()))
            .collect(),
        cells: layout.sums(&fitted.rest),
    };
    let observed = sums(&quiet.fitted);
    let samples: usize = problem.frames.iter().map(|frame| frame.series.rows.len()).sum();
    let count = (DRAWS / samples.max(1)).clamp(LEAST_SIMULATIONS, SIMULATIONS);
    let mut random = Xoshiro256PlusPlus::seed_from_u64(SEED);
    let simulated: Vec<Sums> = (0..count)
        .map(|_| {
            sums(
                &quiet
                    .joint
                    .fit(&simulate(views, &quiet.joint, &quiet.fitted.parameters, None, &mut random).residuals),
            )
        })
        .collect();
    let mean = |of: &dyn Fn(&Sums) -> f64| simulated.iter().map(of).sum::<f64>() / count as f64;
    let excess: Vec<f64> = (observed.channels.iter().enumerate())
        .map(|(channel, energy)| (energy - mean(&|sums| sums.channels[channel])) * scales[channel].powi(2))
        .collect();
    let names = || unit.channels.iter().map(|channel| channel.name.clone());
    let grouped = unit.groups().into_iter().map(|group| {
        let own = unit
            .channels
            .iter()
            .zip(&excess)
            .filter(|(channel, _)| channel.group == group);
        // A sensor that is quieter than described takes nothing off its neighbour.
        (group.to_owned(), own.map(|(_, excess)| excess.max(0.0)).sum::<f64>())
    });
    let mut energy = vec![0.0; problem.twin.starts_s().len()];
    for (frame, rest) in problem.frames.iter().zip(&quiet.fitted.rest) {
        for (row, value) in frame.series.rows.iter().zip(rest.iter()) {
            energy[*row as usize] += value * value;
        }
    }
    let rows = problem.fitted_rows();
    Place {
        channels: sorted(shared(names().zip(excess.iter().copied()).collect())),
        groups: sorted(shared(grouped.collect())),
        octaves: shared(by_octave(&observed, &simulated, problem)),
        regimes: regimes::shares(&problem.twin.feels(0), &rows, &energy),
        cells: layout.standing_out(
            unit,
            &observed.cells,
            &simulated.iter().map(|sums| sums.cells.as_slice()).collect::<Vec<_>>(),
        ),
        passage: passage::find(problem, &quiet.fitted.rest, &excess),
    }
}

/// Excess of each octave over all channels, and below the last.
fn by_octave(observed: &Sums, simulated: &[Sums], problem: &Problem) -> Vec<(String, f64)> {
    let deepest = observed.octaves.iter().map(Vec::len).max().unwrap_or(0);
    let at = |sums: &Sums, octave: usize| -> f64 {
        let own = sums.octaves.iter().filter_map(|energies| energies.get(octave));
        own.sum()
    };
    let excess = |octave: usize| {
        let expected: f64 = simulated.iter().map(|sums| at(sums, octave)).sum::<f64>() / simulated.len() as f64;
        at(observed, octave) - expected
    };
    let step_s = median_step_s(problem.twin.starts_s());
    (0..deepest)
        .map(|octave| (Octave::new(octave, deepest, step_s).to_string(), excess(octave)))
        .collect()
}

fn median_step_s(starts_s: &[f64]) -> f64 {
    let mut steps: Vec<f64> = starts_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
    steps.sort_by(f64::total_cmp);
    steps.get(steps.len() / 2).copied().unwrap_or(1.0)
}

/// Excesses as shares of what is above zero: what is below is noise about none.
fn shared(mut parts: Vec<(String, f64)>) -> Vec<(String, f64)> {
    parts.iter_mut().for_each(|(_, part)| *part = part.max(0.0));
    let total: f64 = parts.iter().map(|(_, part)| part).sum();
    if total > 0.0 {
        parts.iter_mut().for_each(|(_, part)| *part /= total);
    }
    parts
}

fn sorted(mut parts: Vec<(String, f64)>) -> Vec<(String, f64)> {
    parts.sort_by(|one, other| other.1.total_cmp(&one.1));
    parts
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_of_the_excess_add_up() {
        let found = shared(vec![("a".into(), 3.0), ("b".into(), -0.5), ("c".into(), 1.0)]);
        assert_eq!(found[1].1, 0.0);
        assert_eq!(found.iter().map(|(_, share)| share).sum::<f64>(), 1.0);
    }

    #[test]
    fn without_an_excess_there_are_no_shares() {
        assert_eq!(shared(vec![("a".into(), -1.0)]), [("a".to_owned(), 0.0)]);
    }
}
