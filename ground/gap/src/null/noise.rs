//! What a log says of its noise, kind by kind of sensor: louder or quieter than declared, coloured, samples that were sent twice.
//!
//! In: what is measured less what the finished model predicts at the fitted samples; the sigmas declared; the parts that repeat. Out: one
//! [`Noise`] a kind. It is a statement of its own and no effect: the weights of the search and the size of what is left have their own
//! ways with noise that is not as declared.
//!
//! The level is half the mean square by which a channel changes over [`LAG`] samples, `D(k) = mean (r(i+k) - r(i))^2 / 2 = s^2 (1 - rho_k)`
//! (von Neumann 1941 for one sample): what is slower leaves it alone, and noise that is alike over a few samples has lost that by then. The
//! colour is `1 - D(1)/D(k)`, which is the correlation of neighbours once `rho_k` is none: 0 of white noise, less of noise that
//! alternates. Both are medians over stretches of [`STRETCH`] samples, for blows and what a model does not follow are in few of them; and of
//! a kind the median of its channels, for an effect is in some of them.
//!
//! What the reference errs by stands beside it: what it puts in from sample to sample and what of its slow errors changes over the lag. Louder
//! is what is louder than both together, quieter what is quieter than the sensor alone. Where the reference changes more than [`MISFIT_CALM`]
//! allows, the level seen is the most that the sensor may have, and the colour is the reference's. Chance is left [`STANDS_OUT`] of
//! the level's standard deviation, `sqrt(3/n)` of a mean of overlapping differences and `pi/2` times the variance of its median.
//!
//! Says nothing of a kind with less than one stretch, such as a table's, whose rows are means.

use std::f64::consts::PI;

use twin::predict::Kind;

use crate::{
    input::repeats::Repeats,
    null::problem::Problem,
    thresholds::{COLOURED, MISFIT_CALM, STANDS_OUT},
};

/// Samples over which a level is taken: in a packet's log 1.6 s, at 285 Hz 28 ms. Of noise whose neighbours are alike by 0.7 a
/// twentieth is left by then.
const LAG: usize = 8;

/// Samples of a stretch, as for what repeats ([`crate::input::repeats`]).
const STRETCH: usize = 64;

/// Noise of the sensors of one kind, as declared and as the log has it.
#[derive(Clone, Debug, PartialEq)]
pub struct Noise {
    /// Which sensors.
    pub kind: Kind,
    /// [physical unit] root mean square of the standard deviations declared of a logged sample.
    pub declared: f64,
    /// [physical unit] what the log has, with what the reference puts in.
    pub seen: f64,
    /// [physical unit] what the reference puts in of that.
    pub by_reference: f64,
    /// Least and most of seen over declared among the channels.
    pub range: [f64; 2],
    /// Correlation of neighbouring samples.
    pub colour: f64,
    /// Part of the samples that a part of this kind sent twice, of the part that did so most.
    pub repeated: f64,
    /// Relative standard deviation of the square of `seen`, by chance.
    chance: f64,
}

impl Noise {
    /// Whether the reference errs so much that the sensors' own level is at most what is seen, and their colour not known.
    pub fn is_at_most(&self) -> bool {
        self.by_reference.powi(2) > (MISFIT_CALM - 1.0) * self.declared.powi(2)
    }

    /// What is not as declared, in the words of the verdict: quieter or louder, coloured, repeated.
    pub fn words(&self) -> Vec<&'static str> {
        let calm = MISFIT_CALM + STANDS_OUT * self.chance;
        let (own, seen) = (self.declared.powi(2), self.seen.powi(2));
        let said = [
            ("quieter", seen * calm < own),
            ("louder", seen > calm * (own + self.by_reference.powi(2))),
            (
                "coloured",
                !self.is_at_most() && self.colour.abs() > COLOURED + STANDS_OUT * self.chance,
            ),
            ("repeated", self.repeated > 0.0),
        ];
        (said.into_iter())
            .filter_map(|(word, is_so)| is_so.then_some(word))
            .collect()
    }
}

/// The noise of every kind of sensor that has a stretch. `predicted` is what the model has of each channel at every row; `repeats` are
/// the parts of the whole log that sent samples twice.
pub fn noise(problem: &Problem, predicted: &[Vec<f64>], repeats: &[Repeats]) -> Vec<Noise> {
    let kinds = [Kind::Accelerometer, Kind::Gyro, Kind::Magnetometer, Kind::Thermometer];
    kinds
        .into_iter()
        .filter_map(|kind| of_kind(problem, predicted, repeats, kind))
        .collect()
}

/// One channel: squares of its levels over that declared.
struct Level {
    /// Standard deviation declared.
    sigma: f64,
    seen: f64,
    by_reference: f64,
    colour: f64,
    samples: usize,
}

fn of_kind(problem: &Problem, predicted: &[Vec<f64>], repeats: &[Repeats], kind: Kind) -> Option<Noise> {
    let channels = &problem.twin.unit().channels;
    let own: Vec<usize> = (0..channels.len())
        .filter(|channel| channels[*channel].sensor == kind)
        .collect();
    let levels: Vec<Level> = (own.iter())
        .filter_map(|channel| level(problem, &predicted[*channel], *channel))
        .collect();
    let middle = |of: &dyn Fn(&Level) -> f64| median(levels.iter().map(of).collect());
    let seen = middle(&|level| level.seen)?;
    let mean_square = levels.iter().map(|level| level.sigma.powi(2)).sum::<f64>() / levels.len() as f64;
    let declared = mean_square.sqrt();
    let samples: usize = levels.iter().map(|level| level.samples).sum();
    let ends = levels.iter().fold([f64::INFINITY, 0.0], |[least, most], level| {
        [f64::min(least, level.seen), f64::max(most, level.seen)]
    });
    let is_own = |part: &&Repeats| part.channels.iter().all(|channel| own.contains(channel));
    Some(Noise {
        kind,
        declared,
        seen: declared * seen.sqrt(),
        by_reference: declared * middle(&|level| level.by_reference)?.sqrt(),
        range: ends.map(f64::sqrt),
        colour: middle(&|level| level.colour)?,
        repeated: (repeats.iter().filter(is_own)).fold(0.0, |most, part| f64::max(most, part.share)),
        chance: (3.0 * PI / 2.0 / samples as f64).sqrt(),
    })
}

/// `None` of a channel without a stretch, or with no noise declared.
fn level(problem: &Problem, predicted: &[f64], channel: usize) -> Option<Level> {
    let series = &problem.frames[channel].series;
    let sigma = problem.twin.unit().channels[channel].sigma();
    let rows: Vec<usize> = series.rows.iter().map(|row| *row as usize).collect();
    let left: Vec<f64> = (rows.iter().zip(&series.values))
        .map(|(row, value)| (value - predicted[*row]) / sigma)
        .collect();
    let steps = |lag: usize| -> Option<f64> {
        let of_stretch = |from: usize| {
            let pairs = (from..from + STRETCH).filter(|at| rows[at + lag] - rows[*at] == lag);
            let squares: Vec<f64> = pairs.map(|at| 0.5 * (left[at + lag] - left[at]).powi(2)).collect();
            // A stretch with a gap has fewer.
            (2 * squares.len() > STRETCH).then(|| squares.iter().sum::<f64>() / squares.len() as f64)
        };
        let stretches = (0..rows.len().saturating_sub(STRETCH + LAG - 1)).step_by(STRETCH);
        median(stretches.filter_map(of_stretch).collect())
    };
    let (one, seen) = (steps(1)?, steps(LAG)?);
    let starts_s = problem.twin.starts_s();
    let over_s = median(
        (rows
            .windows(LAG + 1)
            .map(|rows| starts_s[rows[LAG]] - starts_s[rows[0]]))
        .collect(),
    )?;
    let fast: f64 = rows
        .iter()
        .map(|row| problem.instrument.fast_sigma(channel, *row).powi(2))
        .sum();
    let by_reference = fast / rows.len() as f64 + problem.slow_change(channel, over_s);
    let level = Level {
        sigma,
        seen,
        by_reference: by_reference / sigma.powi(2),
        // Of readings that never change.
        colour: if seen > 0.0 { 1.0 - one / seen } else { 0.0 },
        samples: rows.len(),
    };
    (level.seen.is_finite() && level.colour.is_finite()).then_some(level)
}

/// `None` of none.
fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of gyros declared with 1, a level and what the reference puts in, both in that.
    fn gyros(seen: f64, by_reference: f64) -> Noise {
        Noise {
            kind: Kind::Gyro,
            declared: 1.0,
            seen,
            by_reference,
            range: [seen; 2],
            colour: 0.0,
            repeated: 0.0,
            chance: 0.0,
        }
    }

    #[test]
    fn a_reference_that_errs_more_hides_all_but_what_is_beyond_both_or_beneath_the_sensor() {
        assert_eq!(gyros(30.0, 30.0).words(), [""; 0]);
        assert!(gyros(30.0, 30.0).is_at_most() && !gyros(1.0, 0.1).is_at_most());
        assert_eq!(gyros(40.0, 30.0).words(), ["louder"]);
        assert_eq!(gyros(0.7, 30.0).words(), ["quieter"]);
        let coloured = |by_reference: f64| Noise {
            colour: -0.5,
            ..gyros(1.0, by_reference)
        };
        assert_eq!(coloured(0.1).words(), ["coloured"]);
        assert_eq!(coloured(30.0).words(), [""; 0]);
    }

    #[test]
    fn what_chance_may_do_is_as_declared() {
        let few = Noise {
            chance: 0.5,
            ..gyros(1.5, 0.0)
        };
        assert_eq!(few.words(), [""; 0]);
        assert_eq!(gyros(1.5, 0.0).words(), ["louder"]);
    }

    #[test]
    fn samples_that_were_sent_twice_are_said_beside_the_level() {
        let repeated = Noise {
            repeated: 0.25,
            ..gyros(1.5, 0.0)
        };
        assert_eq!(repeated.words(), ["louder", "repeated"]);
    }
}
