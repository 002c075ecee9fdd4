//! The colour of what a log leaves of a channel: how loud it is in each band, and when.
//!
//! In: what a model leaves of a channel, in units of noise; the instants of its samples; the slow errors of reference, field and zero as
//! declared, and what each sample sees of them. Out: [`Colour`], which makes any column of that channel white in the same sense, and takes
//! it back. Two filters, one after the other:
//!
//! 1. `e_i = y_i + sum_k a_k y_(i-k)`, the prediction error of an autoregression of [`ORDER`]. Its covariances are those of the measured spectrum
//!    (Welch 1967; the median of the pieces, for a blow or a step is in few of them), which below [`SLOW_HZ`] is held at the level above it; Levinson's recursion (Durbin 1960) gives every
//!    order, for the first samples after a gap have fewer before them, and a filter whose inverse does not grow.
//! 2. The innovations `u_i` of a Kalman filter of the slow errors ([`super::whitening`]) that sees `e_i`. What it sees of them goes through the first
//!    filter too, the errors taken for alike over its length. Its white variance is that of the autoregression times the local level of
//!    the innovations, over [`LEVEL_S`].
//!
//! What is slow is as declared and not as measured: a magnet that is brought makes the slow end of a spectrum loud, and would hide in it. What
//! is fast is as measured: beside a reference a real log is ten times quieter than described in one band, louder in another, and in some
//! seconds. An effect is told where it is quiet; a factor of the noise ([`super::misfit`]) knows one size for all bands.
//!
//! Channels are whitened one by one: what they share of a slow error each has for itself. Refuses nothing: a channel too short for a spectrum has
//! the level of its rest, and one that is all zero stays as it is.

use std::{f64::consts::TAU, fmt, ops::Range, sync::Arc};

use nalgebra::{DMatrix, DVector};

use crate::null::whitening::{Process, Sample, Whitening};

/// Numbers of the autoregression. A trial on nine recordings of BROAD needed four, and more for what these left; twelve were kept.
const ORDER: usize = 12;

/// \[Hz\] below which only the slow errors are, and up to which the level is taken that noise has there. The attitude of an optical system and
/// a field stay alike for 4 to 40 s; above 0.8 Hz BROAD's magnetometers are flat.
const SLOW_HZ: f64 = 0.5;
const SPLIT_HZ: f64 = 3.0 * SLOW_HZ;

/// Periods of [`SLOW_HZ`] in a piece of the spectrum: it then resolves a quarter of that.
const PERIODS: f64 = 4.0;

/// \[s\] over which a level is taken, and how many of its own samples the mean level counts for.
const LEVEL_S: f64 = 2.0;
const PSEUDO: f64 = 0.2;

/// Rounds of the level: the first innovations are of a filter that knows none.
const ROUNDS: usize = 2;

/// Steps between two samples that are a gap.
const GAP: f64 = 1.5;

/// What makes the columns of a channel white.
#[derive(Clone)]
pub struct Colour {
    autoregression: Autoregression,
    slow: Arc<Whitening>,
}

impl fmt::Debug for Colour {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        (out.debug_struct("Colour").field("autoregression", &self.autoregression)).finish_non_exhaustive()
    }
}

impl Colour {
    /// Of what is left of a channel whose samples are at these instants \[s\]; `sees` says which states of the processes each sees, and how
    /// much of them in units of noise.
    pub fn of(rest: &DVector<f64>, times_s: &[f64], processes: &[Process], sees: &[Vec<(usize, f64)>]) -> Self {
        let step_s = step_s(times_s);
        let autoregression = Autoregression::of(rest, step_s, stretches(times_s, GAP * step_s));
        let states = processes.iter().map(|process| process.states()).sum();
        let mut parts = DMatrix::zeros(rest.len(), states);
        for (sample, own) in sees.iter().enumerate() {
            own.iter().for_each(|(state, part)| parts[(sample, *state)] += part);
        }
        for mut column in parts.column_iter_mut() {
            let filtered = autoregression.errors(&column.clone_owned());
            column.copy_from(&filtered);
        }
        let variances = autoregression.variances();
        let whitening = |level: &[f64]| {
            let sample = |at: usize| Sample {
                t_s: times_s[at],
                sees: (0..states)
                    .map(|state| (state, parts[(at, state)]))
                    .filter(|(_, part)| *part != 0.0)
                    .collect(),
                variance: variances[at] * level[at],
            };
            let samples: Vec<Sample> = (0..rest.len()).map(sample).collect();
            Whitening::new(processes, &samples)
        };
        let errors = DMatrix::from_columns(&[autoregression.errors(rest)]);
        let near = (0.5 * LEVEL_S / step_s).round().max(1.0) as usize;
        let mut level = vec![1.0; rest.len()];
        for _ in 0..ROUNDS {
            let innovations = whitening(&level).whiten(&errors);
            let more = local(innovations.as_slice(), near);
            level.iter_mut().zip(more).for_each(|(level, more)| *level *= more);
        }
        Colour {
            slow: Arc::new(whitening(&level)),
            autoregression,
        }
    }

    /// Columns in units of noise, white.
    pub fn applied(&self, mut columns: DMatrix<f64>) -> DMatrix<f64> {
        if columns.iter().all(|value| *value == 0.0) {
            return columns;
        }
        for mut column in columns.column_iter_mut() {
            let errors = self.autoregression.errors(&column.clone_owned());
            column.copy_from(&errors);
        }
        self.slow.whiten(&columns)
    }

    /// `y'dual(u) = applied(y)'u` for every column `y`.
    pub fn dual(&self, white: &DVector<f64>) -> DVector<f64> {
        self.autoregression.dual(&self.slow.dual(white))
    }

    /// The columns that are these when they are white.
    pub fn taken_back(&self, white: DMatrix<f64>) -> DMatrix<f64> {
        if white.iter().all(|value| *value == 0.0) {
            return white;
        }
        let mut columns = self.slow.taken_back(&white);
        for mut column in columns.column_iter_mut() {
            let own = self.autoregression.taken_back(&column.clone_owned());
            column.copy_from(&own);
        }
        columns
    }
}

/// Prediction errors from the samples before, none over a gap.
#[derive(Clone, Debug)]
struct Autoregression {
    samples: usize,
    stretches: Vec<Range<usize>>,
    /// Of every order: its coefficients, of which the first is 1, and the variance of its errors.
    orders: Vec<(Vec<f64>, f64)>,
}

impl Autoregression {
    fn of(rest: &DVector<f64>, step_s: f64, stretches: Vec<Range<usize>>) -> Self {
        Autoregression {
            samples: rest.len(),
            orders: levinson(&covariances(rest, step_s, &stretches)),
            stretches,
        }
    }

    /// The highest order that so many samples before one allow.
    fn order(&self, before: usize) -> &(Vec<f64>, f64) {
        &self.orders[before.min(self.orders.len() - 1)]
    }

    fn errors(&self, column: &DVector<f64>) -> DVector<f64> {
        let mut errors = column.clone();
        let highest = self.orders.len() - 1;
        for stretch in &self.stretches {
            let all_before = (stretch.start + highest).min(stretch.end);
            for at in stretch.start..all_before {
                let parts = self.order(at - stretch.start).0.iter().enumerate();
                errors[at] = parts.map(|(back, part)| part * column[at - back]).sum();
            }
            if all_before == stretch.end {
                continue;
            }
            // Coefficient by coefficient: a sample's sum then waits for no other's.
            let own = &mut errors.as_mut_slice()[all_before..stretch.end];
            own.fill(0.0);
            for (back, part) in self.orders[highest].0.iter().enumerate() {
                let before = &column.as_slice()[all_before - back..stretch.end - back];
                (own.iter_mut().zip(before)).for_each(|(error, before)| *error += part * before);
            }
        }
        errors
    }

    fn dual(&self, errors: &DVector<f64>) -> DVector<f64> {
        let mut dual = DVector::zeros(errors.len());
        for stretch in &self.stretches {
            for at in stretch.clone() {
                let parts = self.order(at - stretch.start).0.iter().enumerate();
                parts.for_each(|(back, part)| dual[at - back] += part * errors[at]);
            }
        }
        dual
    }

    fn taken_back(&self, errors: &DVector<f64>) -> DVector<f64> {
        let mut column = errors.clone();
        for stretch in &self.stretches {
            for at in stretch.clone() {
                let parts = self.order(at - stretch.start).0.iter().enumerate().skip(1);
                let before: f64 = parts.map(|(back, part)| part * column[at - back]).sum();
                column[at] -= before;
            }
        }
        column
    }

    /// Of the error of each sample.
    fn variances(&self) -> Vec<f64> {
        let mut variances = vec![1.0; self.samples];
        for stretch in &self.stretches {
            (stretch.clone()).for_each(|at| variances[at] = self.order(at - stretch.start).1);
        }
        variances
    }
}

/// At lags from none to [`ORDER`], of what is fast and of noise of the same density below [`SLOW_HZ`].
fn covariances(rest: &DVector<f64>, step_s: f64, stretches: &[Range<usize>]) -> Vec<f64> {
    let piece = ((PERIODS / SLOW_HZ / step_s).round() as usize).max(2 * ORDER) & !1;
    let (cosines, sines): (Vec<f64>, Vec<f64>) = (0..piece)
        .map(|at| (TAU * at as f64 / piece as f64).sin_cos())
        .map(|(sine, cosine)| (cosine, sine))
        .unzip();
    let bins = piece / 2;
    // Of every bin the density of each piece.
    let mut densities = vec![Vec::new(); bins + 1];
    for stretch in stretches.iter().filter(|stretch| stretch.len() >= piece / 2) {
        let length = stretch.len().min(piece);
        let hann: Vec<f64> = (0..length)
            .map(|at| 0.5 - 0.5 * (TAU * (at as f64 + 0.5) / length as f64).cos())
            .collect();
        let [sum, energy] = [1, 2].map(|power| hann.iter().map(|part| part.powi(power)).sum::<f64>());
        for from in (stretch.start..=stretch.end - length).step_by(length / 2) {
            let own = rest.rows(from, length);
            let mean = own.iter().zip(&hann).map(|(value, part)| value * part).sum::<f64>() / sum;
            let windowed: Vec<f64> = (own.iter().zip(&hann))
                .map(|(value, part)| (value - mean) * part)
                .collect();
            for (bin, densities) in densities.iter_mut().enumerate() {
                let along = |table: &[f64]| -> f64 {
                    let turned = windowed.iter().enumerate();
                    turned.map(|(at, value)| value * table[at * bin % piece]).sum()
                };
                densities.push((along(&cosines).powi(2) + along(&sines).powi(2)) / energy);
            }
        }
    }
    let mut density: Vec<f64> = densities.iter_mut().map(|own| median(own)).collect();
    if density.iter().sum::<f64>() <= 0.0 {
        let mut white = vec![0.0; ORDER + 1];
        white[0] = rest.norm_squared() / rest.len().max(1) as f64;
        return white;
    }
    let bin = |hz: f64| ((hz * piece as f64 * step_s).round() as usize).clamp(1, bins);
    let (slow, split) = (bin(SLOW_HZ), bin(SPLIT_HZ));
    let level = density[slow..=split].iter().sum::<f64>() / (split - slow + 1) as f64;
    density[..slow].fill(level);
    let covariance = |lag: usize| {
        let both: f64 = (1..bins).map(|bin| density[bin] * cosines[lag * bin % piece]).sum();
        let ends = density[0] + density[bins] * cosines[lag * bins % piece];
        (2.0 * both + ends) / piece as f64
    };
    (0..=ORDER).map(covariance).collect()
}

/// The middle of several, 0 of none.
fn median(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}

/// The coefficients of the prediction error of every order, and its variance (Durbin 1960).
fn levinson(covariances: &[f64]) -> Vec<(Vec<f64>, f64)> {
    // A rest of nothing has no colour.
    let none = if covariances[0] > 0.0 { covariances[0] } else { 1.0 };
    let mut orders = vec![(vec![1.0], none)];
    for order in 1..covariances.len() {
        let (last, variance) = &orders[order - 1];
        let told: f64 = last
            .iter()
            .enumerate()
            .map(|(back, part)| part * covariances[order - back])
            .sum();
        let reflection = -told / variance;
        let (ahead, behind) = (last.iter().chain([&0.0]), [&0.0].into_iter().chain(last.iter().rev()));
        let next = ahead.zip(behind).map(|(ahead, behind)| ahead + reflection * behind);
        let next = (next.collect(), variance * (1.0 - reflection * reflection));
        orders.push(next);
    }
    orders
}

/// \[s\] between two samples, the median.
fn step_s(times_s: &[f64]) -> f64 {
    let mut steps: Vec<f64> = times_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
    match median(&mut steps) {
        step_s if step_s > 0.0 => step_s,
        _ => 1.0,
    }
}

/// Samples without a gap between them.
fn stretches(times_s: &[f64], gap_s: f64) -> Vec<Range<usize>> {
    let breaks = (1..times_s.len()).filter(|at| times_s[*at] - times_s[at - 1] > gap_s);
    let mut ends: Vec<usize> = breaks.collect();
    ends.push(times_s.len());
    let starts = std::iter::once(0).chain(ends.clone());
    starts.zip(ends).map(|(from, to)| from..to).collect()
}

/// Mean square of so many errors to either side of each, and a little of the mean of all.
fn local(errors: &[f64], near: usize) -> Vec<f64> {
    let mut sums = vec![0.0];
    errors
        .iter()
        .for_each(|error| sums.push(sums[sums.len() - 1] + error * error));
    let all = match sums[errors.len()] / errors.len().max(1) as f64 {
        mean if mean > 0.0 && mean.is_finite() => mean,
        _ => 1.0,
    };
    let pseudo = PSEUDO * (2 * near + 1) as f64;
    let of = |at: usize| {
        let (from, to) = (at.saturating_sub(near), (at + near + 1).min(errors.len()));
        (sums[to] - sums[from] + pseudo * all) / ((to - from) as f64 + pseudo)
    };
    (0..errors.len()).map(of).collect()
}

#[cfg(test)]
mod tests;
