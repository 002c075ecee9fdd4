//! The held-out samples, and how far a finished model shrinks their gap.
//!
//! In: finished predictions of every row, made without these samples. Out: [`Shrink`], the gap before, after
//! recalibration alone, and after effect and recalibration, in total and per channel, in sigma and in physical units,
//! with an interval.
//!
//! The gap is the root mean square of the residual over the twin's own sigma; the shrink is `100 (before - after) / (before
//! - floor)`. Its interval is the moving-block bootstrap's (Kuensch 1989) over stretches of [`BLOCK_S`], because residuals
//! of a wrong twin are not independent from row to row. The floor of the gap is what a perfect twin would leave
//! ([`crate::holdout::floor`]), little more than 1; its ceiling, what the true effect would shrink with its parameters
//! fitted on as much data, is [`super::shrink::ceiling_percent`].
//!
//! What happens at random happens here at instants of its own ([`super::recurrences`]).

use rand_distr::Distribution;
use rand_xoshiro::{Xoshiro256PlusPlus, rand_core::SeedableRng};

use super::{
    recurrences::Said,
    shrink::{ChannelShrink, Shrink},
};
use crate::{holdout::events::Events, input::hold::Held, thresholds::GAP_KNOWN};

/// \[s\] a bootstrap block: longer than any motion of a hand or a table, and at least ten of them in a useful window.
pub const BLOCK_S: f64 = 10.0;

/// Bootstrap samples: the 2.5 % quantile then stands on 25 of them.
pub(super) const RESAMPLES: usize = 1000;

/// Fixed, so that one case gives one verdict.
pub(super) const SEED: u64 = 0x5eed_0004;

/// Predictions of every row of the log, channel by channel in physical units, made without the held-out samples.
#[derive(Clone, Copy, Debug)]
pub struct Finished<'a> {
    /// \[s\] start of each row.
    pub start_s: &'a [f64],
    /// Standard deviation of a sample as the nominal twin has it.
    pub sigmas: &'a [Vec<f64>],
    /// The same without the errors that the reference makes from sample to sample, one a channel: what a filter is fed with.
    pub steady: &'a [f64],
    /// By the nominal twin.
    pub before: &'a [Vec<f64>],
    /// With the calibration refitted, no effect.
    pub recalibrated: &'a [Vec<f64>],
    /// With effect and calibration fitted.
    pub after: &'a [Vec<f64>],
    /// How much more a sample scatters with a noise-type effect in, one a channel.
    pub louder: &'a [f64],
    /// Mean square of a residual over its variance if the model is right.
    pub floor: &'a [Vec<f64>],
    /// What of the effect happens again at random.
    pub events: Option<&'a Events>,
}

impl<'a> Finished<'a> {
    pub(super) fn said(&self) -> Said<'a> {
        Said {
            after: self.after,
            sigmas: self.sigmas,
            louder: self.louder,
            events: self.events,
        }
    }
}

#[derive(Clone, Copy, Default)]
struct Sums {
    samples: f64,
    before: f64,
    recalibrated: f64,
    after: f64,
    floor: f64,
}

impl Sums {
    fn add(&mut self, other: Sums) {
        self.samples += other.samples;
        self.before += other.before;
        self.recalibrated += other.recalibrated;
        self.after += other.after;
        self.floor += other.floor;
    }

    fn gap(self, energy: f64) -> f64 {
        if self.samples > 0.0 {
            (energy / self.samples).sqrt()
        } else {
            0.0
        }
    }

    /// `None` where there is no gap to shrink.
    fn percent(self) -> Option<f64> {
        let [before, after, floor] = [self.before, self.after, self.floor].map(|energy| self.gap(energy));
        (before - floor > GAP_KNOWN).then(|| 100.0 * (before - after) / (before - floor))
    }
}

impl Held {
    /// Judges finished predictions. Rows the reference did not see (a prediction that is not finite) are left out.
    pub fn judge(&self, finished: Finished) -> Shrink {
        let first_s = finished.start_s.first().copied().unwrap_or(0.0);
        let last_s = finished.start_s.last().copied().unwrap_or(0.0);
        let block_of = |row: usize| ((finished.start_s[row] - first_s) / BLOCK_S) as usize;
        let mut blocks = vec![Sums::default(); ((last_s - first_s) / BLOCK_S) as usize + 1];
        let course = self.course(finished.said());
        let mut channels = Vec::new();
        for (index, series) in self.samples().iter().enumerate() {
            let louder = finished.louder[index];
            let mut sums = Sums::default();
            let mut rms = [0.0; 2];
            for (row, value) in series.rows.iter().zip(&series.values) {
                let row = *row as usize;
                let errors = [&finished.before, &finished.recalibrated, &finished.after].map(|p| value - p[index][row]);
                if errors.iter().any(|error| !error.is_finite()) {
                    continue;
                }
                let sigma = finished.sigmas[index][row];
                let one = Sums {
                    samples: 1.0,
                    before: (errors[0] / sigma).powi(2),
                    recalibrated: (errors[1] / sigma).powi(2),
                    after: course.mean(index, row, |after| ((value - after) / sigma / louder).powi(2)),
                    floor: finished.floor[index][row],
                };
                sums.add(one);
                blocks[block_of(row)].add(one);
                rms[0] += errors[0] * errors[0];
                rms[1] += course.mean(index, row, |after| (value - after).powi(2));
            }
            channels.push(ChannelShrink {
                samples: sums.samples as usize,
                before: sums.gap(sums.before),
                recalibrated: sums.gap(sums.recalibrated),
                after: sums.gap(sums.after),
                before_rms: sums.gap(rms[0]),
                after_rms: sums.gap(rms[1]),
            });
        }
        for (row, surprise) in course.surprise.iter().enumerate() {
            blocks[block_of(row)].after += surprise;
        }
        blocks.retain(|block| block.samples > 0.0);
        let mut total = Sums::default();
        blocks.iter().for_each(|block| total.add(*block));
        let (interval_percent, beyond_recalibration) = bootstrap(&blocks);
        Shrink {
            before: total.gap(total.before),
            recalibrated: total.gap(total.recalibrated),
            after: total.gap(total.after),
            floor: total.gap(total.floor),
            percent: total.percent().unwrap_or(0.0),
            interval_percent,
            beyond_recalibration,
            channels,
        }
    }
}

/// 95 % intervals of the percentage and of what the effect takes off beyond recalibration.
fn bootstrap(blocks: &[Sums]) -> ([f64; 2], [f64; 2]) {
    let Ok(pick) = rand_distr::Uniform::new(0, blocks.len()) else {
        return ([0.0; 2], [0.0; 2]);
    };
    let mut random = Xoshiro256PlusPlus::seed_from_u64(SEED);
    let (mut percents, mut beyond) = (Vec::new(), Vec::new());
    for _ in 0..RESAMPLES {
        let mut sums = Sums::default();
        for _ in 0..blocks.len() {
            sums.add(blocks[pick.sample(&mut random)]);
        }
        // An effect that comes and goes is in some blocks only; a draw of others says nothing of how far it shrinks.
        percents.extend(sums.percent());
        beyond.push(sums.gap(sums.recalibrated) - sums.gap(sums.after));
    }
    (central_95(percents), central_95(beyond))
}

pub(super) fn central_95(mut values: Vec<f64>) -> [f64; 2] {
    if values.is_empty() {
        return [0.0; 2];
    }
    values.sort_by(f64::total_cmp);
    let at = |share: f64| values[((values.len() - 1) as f64 * share).round() as usize];
    [at(0.025), at(0.975)]
}

#[cfg(test)]
mod tests {
    use super::{super::shrink::ceiling_percent, *};
    use crate::input::log::Series;

    const ROWS: usize = 3000;

    /// \[s\]
    const CYCLE_S: f64 = 0.2;

    /// Rounding of sums over some thousand terms.
    const ROUNDING: f64 = 1e-9;

    fn judged(before: f64, recalibrated: f64, after: f64) -> Shrink {
        // Residuals of +-1 sigma around the perfect twin: its gap is exactly 1.
        let series = Series {
            rows: (0..ROWS as u32).collect(),
            values: (0..ROWS).map(|row| if row % 2 == 0 { 1.0 } else { -1.0 }).collect(),
        };
        let start_s: Vec<f64> = (0..ROWS).map(|row| row as f64 * CYCLE_S).collect();
        let level = |value: f64| vec![vec![value; ROWS]];
        Held::new(vec![series]).judge(Finished {
            start_s: &start_s,
            sigmas: &level(1.0),
            steady: &[1.0],
            before: &level(before),
            recalibrated: &level(recalibrated),
            after: &level(after),
            louder: &[1.0],
            floor: &level(1.0),
            events: None,
        })
    }

    #[test]
    fn a_shrink_that_recalibration_beats_does_not_support_its_effect() {
        assert!(judged(2.0, 1.0, 0.0).supports_the_effect());
        assert!(!judged(2.0, 0.5, 1.0).supports_the_effect());
        assert!(!judged(1.0, 1.0, 2.0).supports_the_effect());
    }

    #[test]
    fn the_ceiling_is_all_but_what_the_fit_loses() {
        assert!(ceiling_percent([2.0, 1.0], 1, 1e6) > 99.99);
        // Half of an excess energy of 3 is lost: sqrt(1 + 1.5) is left of 2.
        let half = ceiling_percent([2.0, 1.0], 2, 2.0);
        assert!((half - 100.0 * (2.0 - 2.5f64.sqrt())).abs() < ROUNDING, "{half}");
        assert_eq!(ceiling_percent([1.0, 1.0], 1, 10.0), 0.0);
        let above = ceiling_percent([2.0, 1.2], 1, 1e6);
        assert!((above - 100.0).abs() < 1e-3, "{above}");
    }

    #[test]
    fn a_perfect_model_removes_the_whole_excess() {
        let shrink = judged(2.0, 1.0, 0.0);
        assert!((shrink.before - 5f64.sqrt()).abs() < ROUNDING);
        assert!((shrink.percent - 100.0).abs() < ROUNDING, "{}", shrink.percent);
        assert!(shrink.beyond_recalibration[0] > 0.0);
    }

    #[test]
    fn a_model_that_makes_it_worse_says_so() {
        let shrink = judged(1.0, 1.0, 2.0);
        assert!(shrink.percent < 0.0 && shrink.interval_percent[1] < 0.0);
        assert!(shrink.channels[0].is_worse());
        assert!(shrink.beyond_recalibration[1] < 0.0);
    }

    #[test]
    fn rows_the_reference_did_not_see_are_left_out() {
        assert_eq!(judged(f64::NAN, 0.0, 0.0).channels[0].samples, 0);
    }
}
