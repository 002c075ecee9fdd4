//! The angle that the deviations are taken of, from rate or angle, gaps bridged and remembered.
//!
//! In: a [`Series`] of rates or of angles. Out: [`Phase`], the angle at every step of the grid. With rate it has one
//! point more than the series, starting at zero; its mean rate is taken out, which no deviation sees and which keeps
//! the digits. (Eqs. 5.5 and 5.8 of the tetrahedron thesis, with all `N - 2n + 1` terms.)
//!
//! A gap in rate is bridged by a straight line between the means of as many samples on either side as the gap is long:
//! about the noise that white rate noise would have had there. A gap in angle is bridged by a straight line in angle,
//! which loses nothing at long times. The deviations leave out windows of which more than [`MOST_MISSING`] was bridged.

use std::{borrow::Cow, ops::Range};

use super::series::Series;

/// A window may have this share of its samples bridged: its variance is then wrong by at most about as much, less than
/// the width of its bounds where gaps matter.
pub const MOST_MISSING: f64 = 0.1;

/// What a column of a record holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Input {
    /// Angular rate, or anything else whose mean over time is meant.
    Rate,
    /// Angle, or the sum of a rate so far.
    Angle,
}

/// The angle on a uniform grid [input unit, times seconds if it was a rate].
pub struct Phase {
    /// Sampling interval \[s\].
    pub step_s: f64,
    /// Angle at every step.
    pub angle: Vec<f64>,
    /// How many intervals before each point were bridged; empty if none was.
    bridged_before: Vec<u32>,
}

impl Phase {
    /// The angle of a record.
    pub fn new(series: &Series, input: Input) -> Self {
        match input {
            Input::Rate => Self::from_rate(series),
            Input::Angle => Self::from_angle(series),
        }
    }

    fn from_rate(series: &Series) -> Self {
        let mut rate = Cow::Borrowed(&series.values);
        for gap in &series.gaps {
            bridge_rate(rate.to_mut(), gap, series);
        }
        let mean = rate.iter().sum::<f64>() / rate.len() as f64;
        let mut angle = Vec::with_capacity(rate.len() + 1);
        // Two-sum (Knuth): 10^7 steps of a plain sum would leave noise of their own at the shortest times.
        let (mut sum, mut lost) = (0.0_f64, 0.0_f64);
        angle.push(0.0);
        for value in rate.iter() {
            let term = (value - mean) * series.step_s;
            let next = sum + term;
            let taken = next - sum;
            lost += (sum - (next - taken)) + (term - taken);
            sum = next;
            angle.push(sum + lost);
        }
        Self {
            step_s: series.step_s,
            angle,
            bridged_before: count_before(rate.len(), &series.gaps),
        }
    }

    fn from_angle(series: &Series) -> Self {
        let mut angle = series.values.clone();
        for gap in &series.gaps {
            let (from, to) = (angle[gap.start - 1], angle[gap.end]);
            let steps = (gap.len() + 1) as f64;
            for (k, value) in angle[gap.clone()].iter_mut().enumerate() {
                *value = from + (to - from) * (k + 1) as f64 / steps;
            }
        }
        Self {
            step_s: series.step_s,
            bridged_before: count_before(angle.len() - 1, &series.gaps),
            angle,
        }
    }

    /// Whether nothing was bridged.
    pub fn is_complete(&self) -> bool {
        self.bridged_before.is_empty()
    }

    /// Whether the window of `span` intervals from `start` was measured well enough to be used.
    pub fn is_measured(&self, start: usize, span: usize) -> bool {
        let bridged = self.bridged_before[start + span] - self.bridged_before[start];
        f64::from(bridged) <= MOST_MISSING * span as f64
    }
}

/// For each of `intervals + 1` points how many of the intervals before it lie in gaps.
fn count_before(intervals: usize, gaps: &[Range<usize>]) -> Vec<u32> {
    if gaps.is_empty() {
        return Vec::new();
    }
    let mut is_bridged = vec![0_u32; intervals];
    for gap in gaps {
        is_bridged[gap.start.min(intervals)..gap.end.min(intervals)].fill(1);
    }
    let mut before = 0;
    std::iter::once(0)
        .chain(is_bridged.into_iter().map(|bridged| {
            before += bridged;
            before
        }))
        .collect()
}

/// Bridges one gap; the ones before it are bridged already, the ones after it are not, so it looks back over anything
/// and forward to the next gap only.
fn bridge_rate(rate: &mut [f64], gap: &Range<usize>, series: &Series) {
    let next = series.gaps.partition_point(|other| other.start < gap.end);
    let measured_until = series.gaps.get(next).map_or(rate.len(), |other| other.start);
    let before = mean(&rate[gap.start.saturating_sub(gap.len())..gap.start]);
    let after = mean(&rate[gap.end..measured_until.min(gap.end + gap.len())]);
    let (Some(from), Some(to)) = (before.or(after), after.or(before)) else {
        return;
    };
    let steps = (gap.len() + 1) as f64;
    for (k, value) in rate[gap.clone()].iter_mut().enumerate() {
        *value = from + (to - from) * (k + 1) as f64 / steps;
    }
}

fn mean(values: &[f64]) -> Option<f64> {
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn series(values: &[f64], gaps: &[Range<usize>]) -> Series {
        Series {
            step_s: 0.5,
            values: values.to_vec(),
            gaps: gaps.to_vec(),
        }
    }

    #[test]
    fn the_angle_is_the_sum_of_the_rate_without_its_mean() {
        let phase = Phase::new(&series(&[1.0, 3.0, 2.0, 2.0], &[]), Input::Rate);
        assert_eq!(phase.angle, [0.0, -0.5, 0.0, 0.0, 0.0]);
        assert!(phase.is_complete());
    }

    #[test]
    fn a_gap_in_rate_is_bridged_from_the_means_around_it() {
        let gap = 2..4;
        let phase = Phase::new(
            &series(&[1.0, 3.0, 99.0, 99.0, 1.0, 3.0], std::slice::from_ref(&gap)),
            Input::Rate,
        );
        let rate: Vec<f64> = phase.angle.windows(2).map(|pair| (pair[1] - pair[0]) / 0.5).collect();
        assert_eq!(rate, [-1.0, 1.0, 0.0, 0.0, -1.0, 1.0]);
    }

    #[test]
    fn a_gap_in_angle_keeps_the_angle_on_both_sides() {
        let gap = 1..3;
        let phase = Phase::new(
            &series(&[0.0, 99.0, 99.0, 6.0, 7.0], std::slice::from_ref(&gap)),
            Input::Angle,
        );
        assert_eq!(phase.angle, [0.0, 2.0, 4.0, 6.0, 7.0]);
    }

    #[test]
    fn a_window_is_left_out_when_more_than_a_tenth_of_it_was_bridged() {
        let gap = 10..12;
        let phase = Phase::new(&series(&[0.0; 40], std::slice::from_ref(&gap)), Input::Rate);
        assert!(phase.is_measured(0, 10) && phase.is_measured(0, 20) && phase.is_measured(12, 10));
        assert!(!phase.is_measured(0, 19) && !phase.is_measured(10, 2));
    }
}
