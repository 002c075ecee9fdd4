//! A record on a uniform grid of time, with its gaps.
//!
//! In: times \[s\] and values of one column. Out: [`Series`], a value for every step of the grid and the ranges of steps
//! that were not measured. A step of time within [`JITTER`] of a whole number of sampling intervals is that many
//! intervals; more than one of them is a gap.
//!
//! Refuses time that stands still or runs backwards, time that is not on a grid at all, and records that are mostly gap.
//! Sampling that is not uniform has no Allan variance: resampling it would invent the fast noise.

use std::ops::Range;

/// How far a step of time may be from a whole number of sampling intervals, in intervals. Loggers on a general-purpose
/// computer jitter by a few per cent; beyond a quarter the number of intervals in a gap becomes a guess.
const JITTER: f64 = 0.25;

/// A grid may have this many times as many steps as there are values: beyond it the record is mostly gap, and a single
/// wrong time stamp could ask for any amount of memory.
const MOSTLY_GAP: usize = 4;

/// Fewer values than this have no Allan variance worth a bound.
pub const LEAST_VALUES: usize = 16;

/// Values on a uniform grid; inside `gaps` they were not measured and mean nothing.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    /// Sampling interval \[s\].
    pub step_s: f64,
    /// One value a step.
    pub values: Vec<f64>,
    /// Steps without a measurement, ascending and apart.
    pub gaps: Vec<Range<usize>>,
}

/// Why a record has no uniform grid. Rows count from zero at the first value.
#[derive(Debug, PartialEq, thiserror::Error)]
pub enum GridError {
    /// Not enough to estimate anything.
    #[error("{0} values; at least {LEAST_VALUES} are needed")]
    TooFew(usize),
    /// A value or a time that is not a finite number.
    #[error("row {0}: not a finite number")]
    NotFinite(usize),
    /// Time must go forward.
    #[error("row {row}: time goes from {before} s to {after} s; sort the rows or remove repeated ones")]
    Backwards {
        /// Row of the later time.
        row: usize,
        /// Time of the row before \[s\].
        before: f64,
        /// Its own time \[s\].
        after: f64,
    },
    /// A step between two samples of the grid.
    #[error(
        "row {row}: {step_s} s after the row before is not a multiple of the sampling interval {interval_s} s; \
             the Allan variance needs uniform sampling"
    )]
    NotUniform {
        /// Row of the later time.
        row: usize,
        /// Time since the row before \[s\].
        step_s: f64,
        /// Median interval \[s\].
        interval_s: f64,
    },
    /// More gap than record.
    #[error("row {row}: after it the record has more gaps than samples; analyse its parts one by one")]
    MostlyGap {
        /// Row at which the grid became too long.
        row: usize,
    },
    /// A sampling interval that is not a positive time.
    #[error("the sampling interval must be a positive time, not {0} s")]
    BadInterval(f64),
}

impl Series {
    /// A record without time stamps, sampled every `step_s` without a gap.
    pub fn complete(step_s: f64, values: Vec<f64>) -> Result<Self, GridError> {
        if !(step_s.is_finite() && step_s > 0.0) {
            return Err(GridError::BadInterval(step_s));
        }
        check_finite(&values)?;
        Ok(Self {
            step_s,
            values,
            gaps: Vec::new(),
        })
    }

    /// A record with a time stamp \[s\] for every value.
    pub fn stamped(times_s: &[f64], values: &[f64]) -> Result<Self, GridError> {
        check_finite(times_s)?;
        check_finite(values)?;
        let interval_s = median_interval(times_s)?;
        let (mut grid, mut gaps) = (vec![values[0]], Vec::new());
        for (row, (pair, value)) in times_s.windows(2).zip(&values[1..]).enumerate() {
            let (row, step_s) = (row + 1, pair[1] - pair[0]);
            let steps = (step_s / interval_s).round();
            if steps < 1.0 || (step_s / interval_s - steps).abs() > JITTER {
                return Err(GridError::NotUniform {
                    row,
                    step_s,
                    interval_s,
                });
            }
            if steps > (MOSTLY_GAP * values.len() - grid.len()) as f64 {
                return Err(GridError::MostlyGap { row });
            }
            let missing = steps as usize - 1;
            if missing > 0 {
                gaps.push(grid.len()..grid.len() + missing);
                grid.resize(grid.len() + missing, 0.0);
            }
            grid.push(*value);
        }
        // The whole record dates the grid better than one interval, whose resolution is that of the file's decimals.
        let step_s = (times_s[times_s.len() - 1] - times_s[0]) / (grid.len() - 1) as f64;
        Ok(Self {
            step_s,
            values: grid,
            gaps,
        })
    }

    /// How many steps were measured.
    pub fn measured(&self) -> usize {
        self.values.len() - self.gaps.iter().map(Range::len).sum::<usize>()
    }

    /// The measured stretches between the gaps.
    pub fn stretches(&self) -> impl Iterator<Item = Range<usize>> {
        let starts = std::iter::once(0).chain(self.gaps.iter().map(|gap| gap.end));
        let ends = self
            .gaps
            .iter()
            .map(|gap| gap.start)
            .chain(std::iter::once(self.values.len()));
        starts
            .zip(ends)
            .map(|(start, end)| start..end)
            .filter(|stretch| !stretch.is_empty())
    }
}

fn check_finite(values: &[f64]) -> Result<(), GridError> {
    if values.len() < LEAST_VALUES {
        return Err(GridError::TooFew(values.len()));
    }
    match values.iter().position(|value| !value.is_finite()) {
        Some(row) => Err(GridError::NotFinite(row)),
        None => Ok(()),
    }
}

fn median_interval(times_s: &[f64]) -> Result<f64, GridError> {
    let mut steps = Vec::with_capacity(times_s.len());
    for (row, pair) in times_s.windows(2).enumerate() {
        if pair[1] <= pair[0] {
            return Err(GridError::Backwards {
                row: row + 1,
                before: pair[0],
                after: pair[1],
            });
        }
        steps.push(pair[1] - pair[0]);
    }
    let middle = steps.len() / 2;
    Ok(*steps.select_nth_unstable_by(middle, f64::total_cmp).1)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn times(steps: &[f64]) -> Vec<f64> {
        let mut t = 0.0;
        let start = (0..20).map(|k| f64::from(k) * 0.1);
        let more: Vec<f64> = steps
            .iter()
            .map(|step| {
                t += step;
                1.9 + t
            })
            .collect();
        start.chain(more).collect()
    }

    fn stamped(steps: &[f64]) -> Result<Series, GridError> {
        let times = times(steps);
        Series::stamped(&times, &vec![1.0; times.len()])
    }

    #[test]
    fn a_missing_stretch_is_a_gap_of_whole_steps() {
        let series = stamped(&[0.1, 0.4, 0.1]).expect("uniform");
        assert_eq!(series.gaps, std::iter::once(21..24).collect::<Vec<_>>());
        assert_eq!((series.values.len(), series.measured()), (26, 23));
        assert_eq!(series.stretches().collect::<Vec<_>>(), [0..21, 24..26]);
    }

    #[test]
    fn a_little_jitter_is_still_a_grid() {
        let series = stamped(&[0.11, 0.09, 0.105, 0.095]).expect("uniform");
        assert!(series.gaps.is_empty());
        assert!((series.step_s - 0.1).abs() < 1e-12);
    }

    #[test]
    fn sampling_that_is_not_uniform_is_refused_with_its_row() {
        assert!(matches!(
            stamped(&[0.1, 0.15]),
            Err(GridError::NotUniform { row: 21, .. })
        ));
    }

    #[test]
    fn time_that_stands_still_is_refused_with_its_row() {
        assert!(matches!(
            stamped(&[0.1, 0.0]),
            Err(GridError::Backwards { row: 21, .. })
        ));
    }

    #[test]
    fn one_wrong_time_stamp_cannot_ask_for_the_whole_memory() {
        assert_eq!(stamped(&[1e15]), Err(GridError::MostlyGap { row: 20 }));
    }

    #[test]
    fn a_value_that_is_no_number_is_refused_with_its_row() {
        let mut values = vec![0.0; 20];
        values[7] = f64::NAN;
        assert_eq!(Series::complete(0.1, values), Err(GridError::NotFinite(7)));
    }
}
