//! Calibration with controlled inputs (LMS EC): gyros on a rate table, accelerometers in many positions.
//!
//! In: an [`Experiment`]. Out: a [`Calibration`]: every channel's [`Response`], what was wrong with the table and the
//! wiring, and the error of each row predicted without it (and without its antagonist).
//!
//! One model serves both sources. Marinho (2017), Eqs 4.3 to 4.17, and Siqueira (2014), Eqs 7.5 to 7.12, subtract
//! antagonist runs to be rid of bias and Earth rate, solve for `K n` and average the rest into the bias. With a bias
//! column in the design the same numbers come out in one step, since antagonists are orthogonal to a constant; and then
//! runs need no antagonist, and bias and scale have a joint covariance. The Earth's rate is in the excitation where the
//! table's azimuth is known, and otherwise adds to the bias of runs about axes that are not horizontal east.

use nalgebra::Vector3;

use crate::{
    consensus::{self, Claim, Consensus},
    experiment::{Excitation, Experiment},
    response::{Observation, Orders, Response, ResponseError},
    wiring::{Wiring, wirings},
};

/// Excitations nearer than this share are one and the same.
const SAME: f64 = 1e-3;

/// What to do with rows that contradict the data.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum Contradicted {
    /// Fit without them.
    #[default]
    LeaveOut,
    /// Read them as the data say, where exchanged axes or turned signs explain them; leave out the rest.
    Correct,
    /// Fit with them as they stand.
    Keep,
}

/// How to calibrate.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// Degrees in temperature.
    pub orders: Orders,
    /// What to do with rows that contradict the data.
    pub contradicted: Contradicted,
    /// Nominal axes in b, one a channel, to tell exchanged and inverted channels by; empty for none.
    pub nominal_b: Vec<Vector3<f64>>,
}

/// A calibrated channel.
#[derive(Clone, Debug, PartialEq)]
pub struct Channel {
    /// Its name.
    pub name: String,
    /// Its response.
    pub response: Response,
    /// Rows it was fitted on.
    pub rows: Vec<usize>,
    /// Error of each of these rows when predicted without it and its antagonist \[counts\]; `NaN` where the rest does not
    /// determine the channel.
    pub held_out: Vec<f64>,
}

/// What came out of a campaign.
#[derive(Clone, Debug, PartialEq)]
pub struct Calibration {
    /// Every channel.
    pub channels: Vec<Channel>,
    /// The excitation of each row as it was used; `None` for rows left out.
    pub excitation_b: Vec<Option<Vector3<f64>>>,
    /// Rows that contradict the data.
    pub consensus: Consensus,
    /// Rows whose claimed excitation is not that of their angles.
    pub disagree: Vec<usize>,
    /// Rows that repeat an earlier row's excitation: `(row, earlier)`.
    pub repeated: Vec<(usize, usize)>,
    /// Antagonist runs: `(row, row)`.
    pub pairs: Vec<(usize, usize)>,
    /// How the channels may be connected; empty without nominal axes.
    pub wirings: Vec<Wiring>,
}

/// Why a channel could not be calibrated.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{file}, column {channel}: {why} ({rows} usable rows{})", without(*.left_out))]
pub struct CalibrationError {
    /// The file.
    pub file: String,
    /// The channel.
    pub channel: String,
    /// Usable rows.
    pub rows: usize,
    /// Rows without a usable value, most often at the end of the range.
    pub left_out: usize,
    /// What is not determined.
    pub why: ResponseError,
}

fn without(rows: usize) -> String {
    match rows {
        0 => String::new(),
        rows => format!("; {rows} have no value, or one at the end of the range: excite less, or say the right --unit"),
    }
}

/// Calibrates all channels of a campaign.
///
/// # Errors
/// When the usable rows leave something open.
pub fn calibrate(experiment: &Experiment, options: &Options) -> Result<Calibration, CalibrationError> {
    let trials = &experiment.trials;
    let disagree = (0..trials.len()).filter(|&row| {
        let trial = &trials[row];
        let apart = |claimed: Vector3<f64>| (claimed - trial.excitation_b).norm() > 0.02 * trial.excitation_b.norm();
        trial.claimed_b.is_some_and(apart)
    });
    let consensus = consensus(experiment);
    let mut excitation_b: Vec<Option<Vector3<f64>>> = trials.iter().map(|trial| Some(trial.excitation_b)).collect();
    for contradiction in &consensus.contradictions {
        let row = &mut excitation_b[contradiction.row];
        match options.contradicted {
            Contradicted::Keep => {}
            Contradicted::LeaveOut => *row = None,
            Contradicted::Correct => *row = contradiction.reading.and_then(|reading| row.map(|x| reading.of(&x))),
        }
    }
    let pairs = if experiment.kind == Excitation::Rate {
        antagonists(&excitation_b)
    } else {
        Vec::new()
    };
    let channel = |k: usize| fit(experiment, &excitation_b, &pairs, options.orders, k);
    let channels = (0..experiment.channels.len())
        .map(channel)
        .collect::<Result<Vec<_>, _>>()?;
    let found_b: Vec<_> = channels.iter().map(|channel| channel.response.axis_b()).collect();
    Ok(Calibration {
        disagree: disagree.collect(),
        repeated: repeated(experiment, &excitation_b),
        wirings: wirings(&found_b, &options.nominal_b),
        channels,
        excitation_b,
        consensus,
        pairs,
    })
}

/// Rows that have all channels, judged together.
fn consensus(experiment: &Experiment) -> Consensus {
    let whole = |row: &usize| experiment.trials[*row].values.iter().all(Option::is_some);
    let rows: Vec<usize> = (0..experiment.trials.len()).filter(whole).collect();
    let claim = |&row: &usize| Claim {
        excitation_b: experiment.trials[row].excitation_b,
        values: experiment.trials[row].values.iter().flatten().copied().collect(),
    };
    let mut found = consensus::contradictions(&rows.iter().map(claim).collect::<Vec<_>>());
    for one in &mut found.contradictions {
        one.row = rows[one.row];
    }
    for row in found.alternatives.iter_mut().flatten() {
        *row = rows[*row];
    }
    found
}

fn fit(
    experiment: &Experiment,
    excitation_b: &[Option<Vector3<f64>>],
    pairs: &[(usize, usize)],
    orders: Orders,
    channel: usize,
) -> Result<Channel, CalibrationError> {
    let observation = |row: usize| {
        let trial = &experiment.trials[row];
        // Without a thermometer all rows are taken to be equally warm.
        let temperature_c = if trial.temperature_c.is_finite() {
            trial.temperature_c
        } else {
            0.0
        };
        Some((
            row,
            Observation {
                excitation_b: excitation_b[row]?,
                temperature_c,
                value: trial.values[channel]?,
            },
        ))
    };
    let (rows, observations): (Vec<usize>, Vec<Observation>) =
        (0..experiment.trials.len()).filter_map(observation).unzip();
    let mut response = Response::fit(&observations, orders).map_err(|why| CalibrationError {
        file: experiment.file.display().to_string(),
        channel: experiment.channels[channel].clone(),
        rows: rows.len(),
        left_out: experiment
            .trials
            .iter()
            .filter(|trial| trial.values[channel].is_none())
            .count(),
        why,
    })?;
    if experiment.trials.iter().all(|trial| trial.temperature_c.is_nan()) {
        response.reference_c = f64::NAN;
        response.valid_c = f64::NAN..=f64::NAN;
    }
    let with = |row: usize| {
        let pair = pairs.iter().find(|&&(a, b)| a == row || b == row);
        pair.map_or([row, row], |&(a, b)| [a, b])
    };
    let held_out = rows.iter().zip(&observations).map(|(&row, one)| {
        let without = with(row);
        let rest = rows.iter().zip(&observations).filter(|(row, _)| !without.contains(row));
        let rest: Vec<Observation> = rest.map(|(_, one)| *one).collect();
        let predicted = Response::fit(&rest, orders).map(|fit| fit.predict(&one.excitation_b, one.temperature_c));
        predicted.map_or(f64::NAN, |predicted| one.value - predicted)
    });
    Ok(Channel {
        name: experiment.channels[channel].clone(),
        held_out: held_out.collect(),
        response,
        rows,
    })
}

/// Runs whose excitations are opposite, each with the next such run after it.
pub fn antagonists(excitation_b: &[Option<Vector3<f64>>]) -> Vec<(usize, usize)> {
    let mut free: Vec<usize> = (0..excitation_b.len())
        .filter(|&row| excitation_b[row].is_some())
        .collect();
    let mut pairs = Vec::new();
    while let Some(row) = (!free.is_empty()).then(|| free.remove(0)) {
        let Some(x) = excitation_b[row] else { continue };
        let opposite = |other: &usize| excitation_b[*other].is_some_and(|y| (x + y).norm() < SAME * x.norm());
        if let Some(at) = free.iter().position(opposite) {
            pairs.push((row, free.remove(at)));
        }
    }
    pairs
}

/// Rows whose excitation, as it is used, an earlier row had, at the same angles where these are known.
fn repeated(experiment: &Experiment, excitation_b: &[Option<Vector3<f64>>]) -> Vec<(usize, usize)> {
    let trials = &experiment.trials;
    let same = |a: usize, b: usize| {
        let (Some(x), Some(y)) = (excitation_b[a], excitation_b[b]) else {
            return false;
        };
        let as_warm = (trials[a].temperature_c - trials[b].temperature_c).abs() <= 1.0;
        let warmth_unknown = trials[a].temperature_c.is_nan();
        (x - y).norm() < SAME * x.norm() && trials[a].pose == trials[b].pose && (as_warm || warmth_unknown)
    };
    let earlier = |row: usize| (0..row).find(|&before| same(before, row)).map(|before| (row, before));
    (0..trials.len()).filter_map(earlier).collect()
}

impl Calibration {
    /// Root mean square of the held-out errors of a channel \[counts\].
    pub fn held_out_rms(channel: &Channel) -> f64 {
        (channel.held_out.iter().map(|error| error * error).sum::<f64>() / channel.held_out.len() as f64).sqrt()
    }
}

#[cfg(test)]
mod tests;
