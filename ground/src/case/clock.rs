//! One clock for a log and its reference: by how much the reference's differs, from the rates that both tell.
//!
//! Coarsely ([`coarse`]): the norm of the rate needs no frame and no mounting. The log's, row by row by least squares over the
//! gyros, is slid along the reference's, and the offset of the highest correlation is taken. Finely ([`error`]): along a case, the
//! twin says how every gyro's reading changes with the instant at which it is read, its slot and low-pass included, so that
//!
//! ```text
//! d = sum(y' r / s^2) / sum(y'^2 / s^2)        sigma = gap / sqrt(sum(y'^2 / s^2))
//! ```
//!
//! to which the sigma of the instants themselves comes, of parts that convert by clocks of their own;
//! with `r` the residual, `y'` that change, `s` the noise and `gap` the root mean square of `r / s`, at least 1. Positive: the log saw
//! what the reference tells of `d` later, so that `d` more is to be taken from the reference's times.
//!
//! Refused: a log that does not turn, and rates that are not alike anywhere.

use gap::{
    input::{case::Subject, log::Log},
    null::problem::Problem,
};
use nalgebra::{Matrix3, Vector3};
use twin::{
    motion::{Motion, Recorded},
    predict::{Kind, UnitDescription},
};

/// \[s\] step of the coarse search: a rate that turns within a second is alike over a tenth.
const STEP_S: f64 = 0.05;

/// Correlation below which two rates are not the same motion: of independent logs a hundred turns long it is 0.1.
const ALIKE: f64 = 0.7;

/// [rad/s] below which a log does not turn: ten times a gyro's noise.
const TURNS: f64 = 0.03;

/// Part of the log that must lie within the reference.
const OVERLAP: f64 = 0.5;

/// Why clocks cannot be told.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum ClockError {
    /// Nothing to see.
    #[error(
        "the log does not turn faster than {TURNS} rad/s: its clock cannot be found from the rates; give --offset-s"
    )]
    Still,
    /// Another motion.
    #[error(
        "log and reference are not alike at any offset (correlation {0:.2} at best, {ALIKE} is needed): are they of one run? Is the reference's unit of angle or time another?"
    )]
    Strange(f64),
}

/// An offset and how well it is known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Offset {
    /// \[s\] to be taken from the reference's times to have the log's.
    pub seconds: f64,
    /// \[s\] one standard deviation.
    pub sigma_s: f64,
}

/// Rates of a log in b, with their instants \[s\].
pub fn rates(log: &Log, unit: &UnitDescription) -> Vec<(f64, Vector3<f64>)> {
    let rows = log.start_s.len();
    let mut sums = vec![(Matrix3::zeros(), Vector3::zeros()); rows];
    let mut slots_s = (0.0, 0.0);
    for (channel, series) in unit
        .channels
        .iter()
        .zip(&log.channels)
        .filter(|(channel, _)| channel.sensor == Kind::Gyro)
    {
        slots_s = (slots_s.0 + channel.slot_s - channel.tau_s(), slots_s.1 + 1.0);
        for (row, value) in series.rows.iter().zip(&series.values) {
            let (matrix, pull) = &mut sums[*row as usize];
            *matrix += channel.axis_b * channel.axis_b.transpose();
            *pull += channel.axis_b * (value - channel.bias);
        }
    }
    let slot_s = slots_s.0 / f64::max(slots_s.1, 1.0);
    let rate = |(row, (matrix, pull)): (usize, (Matrix3<f64>, Vector3<f64>))| {
        // Three gyros that do not lie in a plane, at least.
        let is_whole = matrix.symmetric_eigenvalues().min() > 0.01;
        let inverse = is_whole.then(|| matrix.try_inverse()).flatten()?;
        Some((log.start_s[row] + slot_s, inverse * pull))
    };
    sums.into_iter().enumerate().filter_map(rate).collect()
}

/// \[s\] to be taken from the reference's times, by the norm of the rates; and the correlation there.
///
/// # Errors
/// When it cannot be told.
pub fn coarse(rates: &[(f64, Vector3<f64>)], reference: &Recorded) -> Result<(f64, f64), ClockError> {
    if rates.iter().all(|(_, rate)| rate.norm() < TURNS) {
        return Err(ClockError::Still);
    }
    let (from_s, to_s) = reference.span_s();
    let count = ((to_s - from_s) / STEP_S) as usize + 1;
    let grid: Vec<f64> = (0..count)
        .map(|step| reference.at(from_s + STEP_S * step as f64).attitude.rate_nb_b.norm())
        .collect();
    let (first_s, last_s) = (
        rates.first().map_or(0.0, |rate| rate.0),
        rates.last().map_or(0.0, |rate| rate.0),
    );
    let least = ((last_s - first_s).min(to_s - from_s)) * OVERLAP;
    let (earliest, latest) = (from_s - last_s + least, to_s - first_s - least);
    let mut best = (0.0, f64::NEG_INFINITY);
    for step in 0..=((latest - earliest) / STEP_S) as usize {
        let offset_s = earliest + STEP_S * step as f64;
        let pair = |(t_s, rate): &(f64, Vector3<f64>)| {
            let place = (t_s + offset_s - from_s) / STEP_S;
            let at = (place >= 0.0).then_some(place as usize)?;
            let (one, next) = (grid.get(at)?, grid.get(at + 1)?);
            Some((rate.norm(), one + (next - one) * place.fract()))
        };
        let pairs: Vec<(f64, f64)> = rates.iter().filter_map(pair).collect();
        let alike = correlation(&pairs);
        if alike > best.1 {
            best = (offset_s, alike);
        }
    }
    match best {
        (_, alike) if alike < ALIKE || alike.is_nan() => Err(ClockError::Strange(alike)),
        found => Ok(found),
    }
}

fn correlation(pairs: &[(f64, f64)]) -> f64 {
    let count = pairs.len() as f64;
    if count < 20.0 {
        return f64::NEG_INFINITY;
    }
    let (x, y) = pairs
        .iter()
        .fold((0.0, 0.0), |sum, pair| (sum.0 + pair.0 / count, sum.1 + pair.1 / count));
    let moment = |of: &dyn Fn(&(f64, f64)) -> f64| pairs.iter().map(of).sum::<f64>();
    let both = moment(&|pair| (pair.0 - x) * (pair.1 - y));
    let scale = (moment(&|pair| (pair.0 - x).powi(2)) * moment(&|pair| (pair.1 - y).powi(2))).sqrt();
    if scale > 0.0 { both / scale } else { f64::NEG_INFINITY }
}

/// How far a case's reference is off the log's clock; `None` where no gyro turns.
pub fn error(subject: &Subject) -> Option<Offset> {
    let problem = Problem::new(&subject.twin, &subject.fit, &subject.reference);
    let (mut pull, mut weight, mut energy, mut count) = (0.0, 0.0, 0.0, 0.0);
    for (index, channel) in subject.twin.unit().channels.iter().enumerate() {
        if channel.sensor != Kind::Gyro {
            continue;
        }
        let (slopes, predicted) = (subject.twin.by_instant(index), subject.twin.channel(index, &[]));
        let series = &subject.fit.channels[index];
        let residuals = series
            .rows
            .iter()
            .zip(&series.values)
            .map(|(row, value)| value - predicted[*row as usize]);
        let residuals: Vec<f64> = residuals.collect();
        // Its bias is no clock.
        let mean = residuals.iter().sum::<f64>() / residuals.len().max(1) as f64;
        for (row, residual) in series.rows.iter().zip(&residuals) {
            let (row, sigma) = (*row as usize, problem.sigmas[index][*row as usize]);
            pull += slopes[row] * (residual - mean) / (sigma * sigma);
            weight += (slopes[row] / sigma).powi(2);
            energy += ((residual - mean) / sigma).powi(2);
            count += 1.0;
        }
    }
    let gyros = subject
        .twin
        .unit()
        .channels
        .iter()
        .filter(|channel| channel.sensor == Kind::Gyro);
    let instants: Vec<f64> = gyros.map(|channel| channel.instant_sigma_s.unwrap_or(0.0)).collect();
    // Of their mean.
    let instants = instants.iter().map(|sigma_s| sigma_s * sigma_s).sum::<f64>().sqrt() / instants.len().max(1) as f64;
    let noise = f64::max(1.0, energy / f64::max(count, 1.0)).sqrt() / weight.sqrt();
    (weight > 0.0).then(|| Offset {
        seconds: pull / weight,
        sigma_s: noise.hypot(instants),
    })
}
