//! What the leftover test looks at of each channel: its place in time, what the unit does at each sample, when its part
//! converts, and what a small rotation would add to it: `d(n.v) = (v x n).delta` for the vector `v` (force, rate or field) a
//! sensor along `n` feels.

use nalgebra::{DMatrix, DVector};
use twin::predict::{Channel, Feel, Kind};

use crate::{
    null::{
        calibration::conversion_period_s,
        model::Model,
        problem::{Frame, Problem},
        wander::felt_b,
    },
    unknown::adequacy::{Clock, Codes, Instrument, LEVELS, Open, Suspect, View},
};

/// Quantities of the motion: rate, force and field in b, temperature.
const QUANTITIES: usize = 10;

/// [standard deviations of the reference's errors] to which what the unit does is rounded before residuals are sorted by it. At
/// rest a reference sees nothing but its errors, and these are minus the residual: a factor of -1 in every sensor.
pub(super) const PLAIN: f64 = 10.0;

/// The views of every channel; `read` is what each sensor reads by itself at every row, by the model whose leftover is looked at.
pub fn views(problem: &Problem, read: &[Vec<f64>]) -> Vec<View> {
    let twin = problem.twin;
    let kinds = [Kind::Gyro, Kind::Accelerometer, Kind::Magnetometer, Kind::Thermometer];
    let steps = kinds.map(|kind| PLAIN * reference_sigma(problem, kind));
    let plain = |kind: Kind, value: f64| {
        let own = kinds.iter().position(|own| *own == kind);
        let step = own.map_or(0.0, |own| steps[own]);
        if step > 0.0 {
            (value / step).round() * step
        } else {
            value
        }
    };
    let mut feels = problem.true_twin().feels(0);
    for feel in &mut feels {
        feel.rate_b.apply(|value| *value = plain(Kind::Gyro, *value));
        feel.force_b.apply(|value| *value = plain(Kind::Accelerometer, *value));
    }
    let states = standardised(&feels);
    let starts_s = twin.starts_s();
    let fitted = problem
        .frames
        .iter()
        .flat_map(|frame| &frame.series.rows)
        .map(|row| starts_s[*row as usize]);
    let (from_s, to_s) = fitted.fold((f64::INFINITY, f64::NEG_INFINITY), |(from, to), t| {
        (from.min(t), to.max(t))
    });
    let view = |(index, frame): (usize, &Frame)| {
        let channel = &problem.true_twin().unit().channels[index];
        let own = problem.predict(index, &[]);
        let felt_b = |row: usize| felt_b(channel.sensor, &feels[frame.series.rows[row] as usize]);
        let at = |quantity: &dyn Fn(usize) -> f64| {
            let values: Vec<f64> = frame.series.rows.iter().map(|row| quantity(*row as usize)).collect();
            levels(&values)
        };
        View {
            name: channel.name.clone(),
            kind: match channel.sensor {
                Kind::Accelerometer => 0,
                Kind::Gyro => 1,
                Kind::Magnetometer => 2,
                Kind::Thermometer => 3,
            },
            part: part(problem, index),
            group: group(problem, index),
            axis_b: channel.axis_b,
            phase: frame
                .series
                .rows
                .iter()
                .map(|row| (starts_s[*row as usize] - from_s) / (to_s - from_s).max(f64::EPSILON))
                .collect(),
            motion: DMatrix::from_fn(frame.series.rows.len(), QUANTITIES, |row, column| {
                states[(frame.series.rows[row] as usize, column)]
            }),
            turned: DMatrix::from_fn(frame.series.rows.len(), 3, |row, axis| {
                felt_b(row).cross(&channel.axis_b)[axis] / frame.weights[row]
            }),
            felt: DVector::from_fn(frame.series.rows.len(), |row, _| {
                felt_b(row).dot(&channel.axis_b) / frame.weights[row]
            }),
            predicted: DVector::from_fn(frame.series.rows.len(), |row, _| {
                own[frame.series.rows[row] as usize] / frame.weights[row]
            }),
            open: frame
                .nuisance_names
                .iter()
                .map(|(open, sigma)| Open::new(kind_of(open, &channel.name), *sigma, channel.axis_b, channel.across()))
                .collect(),
            codes: codes(problem, index, &read[index]),
            clock: clock(problem, index, &read[index], &frame.weights)
                .map(|(clock, left)| clock.as_shown(left.into_iter())),
            instrument: instrument(problem, index),
            is_limited: problem.is_limited(index),
            levels: vec![
                at(&|row| plain(channel.sensor, own[row])),
                at(&|row| feels[row].rate_b.norm()),
                at(&|row| feels[row].force_b.norm()),
                at(&|row| feels[row].temperature_c),
            ],
        }
    };
    problem.frames.iter().enumerate().map(view).collect()
}

/// What each of a model's effects adds to the fitted samples.
pub fn suspects(problem: &Problem, model: &Model) -> Vec<Suspect> {
    let suspect = |index: usize| Suspect {
        name: model.components[index].active.cause.effect.page().name.to_owned(),
        entries: problem.contribution(&model.components, &[index]),
    };
    (0..model.components.len()).map(suspect).collect()
}

/// [physical unit] root mean square of what the reference errs by from sample to sample, in the sensors of a kind.
fn reference_sigma(problem: &Problem, kind: Kind) -> f64 {
    let rows = problem.twin.starts_s().len();
    let channels = problem.twin.unit().channels.iter().enumerate();
    let of_kind: Vec<usize> = (channels.filter(|(_, channel)| channel.sensor == kind))
        .map(|(index, _)| index)
        .collect();
    let square = |row: usize| -> f64 {
        let channels = of_kind.iter();
        channels
            .map(|index| problem.instrument.fast_sigma(*index, row).powi(2))
            .sum()
    };
    let sum: f64 = (0..rows).map(square).sum();
    (sum / (rows * of_kind.len()).max(1) as f64).sqrt()
}

/// What is open by its name in all channels.
fn kind_of(open: &str, channel: &str) -> String {
    let own = open.strip_suffix(channel).and_then(|open| open.strip_suffix('_'));
    own.unwrap_or(open).to_owned()
}

/// The codes of a channel at the fitted samples, if it sends such.
fn codes(problem: &Problem, index: usize, read: &[f64]) -> Option<Codes> {
    let (channel, frame) = (&problem.twin.unit().channels[index], &problem.frames[index]);
    channel.bits?;
    let values = frame.series.values.iter();
    Some(Codes {
        lsb: channel.lsb,
        logged: values.map(|value| (value / channel.lsb).round() as i64).collect(),
        read: frame.series.rows.iter().map(|row| read[*row as usize]).collect(),
        noise: frame.weights.component_mul(&frame.own).as_slice().to_vec(),
    })
}

/// What the reference errs by in a channel at the fitted samples.
fn instrument(problem: &Problem, index: usize) -> Option<Instrument> {
    let (record, step_s) = problem.instrument.record(index)?;
    let rows = || problem.frames[index].series.rows.iter().map(|row| *row as usize);
    Some(Instrument {
        own: rows().map(|row| problem.own_part(index, row)).collect(),
        record,
        places: rows().map(|row| problem.twin.starts_s()[row] / step_s).collect(),
    })
}

/// The first channel of a channel's part: the sensors of one kind in a group that count alike are one. A gyro's thermometer and
/// that beside it are two.
fn part(problem: &Problem, index: usize) -> usize {
    let channels = &problem.twin.unit().channels;
    let own = &channels[index];
    let is_its = |other: &Channel| other.sensor == own.sensor && other.group == own.group && other.lsb == own.lsb;
    channels.iter().position(is_its).unwrap_or(index)
}

/// The first channel of what a channel is mounted with.
fn group(problem: &Problem, index: usize) -> usize {
    let channels = &problem.twin.unit().channels;
    let own = &channels[index].group;
    channels.iter().position(|other| other.group == *own).unwrap_or(index)
}

/// The clock of a channel's part at the fitted samples, and what is left of them about what the channel is to `read`, in units of
/// each one's `noise`.
pub fn clock(problem: &Problem, index: usize, read: &[f64], noise: &DVector<f64>) -> Option<(Clock, Vec<f64>)> {
    let (twin, frame) = (problem.twin, &problem.frames[index]);
    let period_s = conversion_period_s(&twin.unit().channels[index]);
    let at_rows = |values: &[f64]| -> Vec<f64> {
        let rows = frame.series.rows.iter();
        rows.map(|row| values[*row as usize]).collect()
    };
    let slopes = at_rows(&problem.true_twin().by_instant(index))
        .into_iter()
        .zip(noise.iter());
    let expected = at_rows(read).into_iter().zip(noise.iter());
    let left = expected.zip(&frame.series.values);
    (period_s > 0.0).then(|| {
        let clock = Clock {
            period_s,
            instants_s: at_rows(&twin.instants_s(index)),
            slopes: slopes.map(|(slope, weight)| slope / weight).collect(),
        };
        let left = left.map(|((expected, weight), value)| (value - expected) / weight);
        (clock, left.collect())
    })
}

/// The motion, each quantity about zero with unit spread; one that does not change is zero.
fn standardised(feels: &[Feel]) -> DMatrix<f64> {
    let mut states = DMatrix::from_fn(feels.len(), QUANTITIES, |row, column| {
        let feel = &feels[row];
        match column {
            0..3 => feel.rate_b[column],
            3..6 => feel.force_b[column - 3],
            6..9 => feel.field_b_ut[column - 6],
            _ => feel.temperature_c,
        }
    });
    for mut column in states.column_iter_mut() {
        let mean = column.mean();
        let spread = column.variance().sqrt();
        column
            .iter_mut()
            .for_each(|value| *value = if spread > 1e-9 { (*value - mean) / spread } else { 0.0 });
    }
    states
}

/// In which of [`LEVELS`] equally filled levels each value stands.
fn levels(values: &[f64]) -> Vec<u8> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let edges: Vec<f64> = (1..LEVELS)
        .filter_map(|level| sorted.get(level * sorted.len() / LEVELS).copied())
        .collect();
    let level = |value: &f64| edges.partition_point(|edge| edge <= value) as u8;
    values.iter().map(level).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_are_equally_filled() {
        let values: Vec<f64> = (0..80).map(|k| f64::from(k * 37 % 80)).collect();
        let levels = levels(&values);
        assert!((0..LEVELS as u8).all(|level| levels.iter().filter(|own| **own == level).count() == 10));
        assert_eq!((levels[0], levels[values.len() - 1]), (0, (values[79] / 10.0) as u8));
    }

    #[test]
    fn a_quantity_that_never_changes_has_one_level() {
        assert!(super::levels(&[2.5; 9]).iter().all(|level| *level == 7));
        assert!(super::levels(&[]).is_empty());
    }
}
