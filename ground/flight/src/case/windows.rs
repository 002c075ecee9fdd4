//! Windows of a case: which parts of a log are fitted, and which only judge.
//!
//! In: a motion and its span on the log's clock. Out: `fit` and `hold`, each half of the time, chosen so that both hold the same
//! kinds of motion: what is excited in one only cannot be checked in the other.
//!
//! The span is cut into [`BLOCKS`] equal parts. What a part holds is its features: mean squares of the rates and the
//! accelerations by axis of b, mean and spread of where down is in b, mean and slope of the temperature. Of all ways to take
//! half of the parts, the one is chosen whose halves differ least, each feature in units of its spread over the parts; of two that
//! are within a hundredth, the one with fewer edges, because filters begin anew at each.
//!
//! Refused: a span too short for [`BLOCKS`] parts of [`SHORTEST_S`].

use nalgebra::Vector3;
use twin::motion::Motion;

/// Parts of the span. Eight can be halved in 35 ways.
const BLOCKS: usize = 8;

/// \[s\] of a part at least: ten packets.
const SHORTEST_S: f64 = 2.0;

/// \[s\] between looks at the motion: five a second, as often as the unit's packets.
const LOOK_S: f64 = 0.2;

/// Part of the difference that an edge may cost.
const EDGE: f64 = 0.01;

/// From and to, in seconds.
pub type Spans = Vec<[f64; 2]>;

/// A log that cannot be parted.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("{0:.1} s are too short to be parted into windows; {least} s are the least", least = BLOCKS as f64 * SHORTEST_S)]
pub struct TooShort(pub f64);

/// Windows to fit on and to judge on.
#[derive(Clone, Debug, PartialEq)]
pub struct Parted {
    /// Fitted.
    pub fit: Spans,
    /// Judged.
    pub hold: Spans,
}

/// Parts a span of a motion; `motion_s` takes the log's clock to the motion's.
///
/// # Errors
/// When the span is too short.
pub fn parted(
    motion: &dyn Motion,
    motion_s: impl Fn(f64) -> f64,
    [from_s, to_s]: [f64; 2],
) -> Result<Parted, TooShort> {
    let length_s = (to_s - from_s) / BLOCKS as f64;
    if length_s.is_nan() || length_s < SHORTEST_S {
        return Err(TooShort(to_s - from_s));
    }
    let edge = |block: usize| from_s + length_s * block as f64;
    let features: Vec<Features> = (0..BLOCKS)
        .map(|block| features(motion, motion_s(edge(block)), length_s))
        .collect();
    let scales = spreads(&features);
    // The first part is fitted: the other half is the same choice with the names exchanged.
    let halves = (0u32..1 << BLOCKS).filter(|mask| mask & 1 == 1 && mask.count_ones() as usize == BLOCKS / 2);
    let rated: Vec<(f64, u32)> = halves
        .map(|mask| (difference(&features, &scales, mask), mask))
        .collect();
    let least = rated
        .iter()
        .map(|(difference, _)| *difference)
        .fold(f64::INFINITY, f64::min);
    let near = rated.iter().filter(|(difference, _)| *difference <= least + EDGE);
    let chosen = near
        .min_by_key(|(_, mask)| (mask ^ (mask >> 1)).count_ones())
        .map_or(0b0110_1001, |(_, mask)| *mask);
    let spans = |wanted: bool| {
        let mut spans = Spans::new();
        for block in (0..BLOCKS).filter(|block| ((chosen >> block) & 1 == 1) == wanted) {
            let (from, to) = (rounded(edge(block)), rounded(edge(block + 1)));
            match spans.last_mut() {
                Some(last) if last[1] == from => last[1] = to,
                _ => spans.push([from, to]),
            }
        }
        spans
    };
    Ok(Parted {
        fit: spans(true),
        hold: spans(false),
    })
}

/// To a millisecond: windows are read by people.
fn rounded(t_s: f64) -> f64 {
    (t_s * 1e3).round() / 1e3
}

/// What a part holds.
type Features = [f64; 14];

fn features(motion: &dyn Motion, from_s: f64, length_s: f64) -> Features {
    let looks = (length_s / LOOK_S).max(1.0) as usize;
    let poses: Vec<_> = (0..looks)
        .map(|look| motion.at(from_s + LOOK_S * look as f64))
        .collect();
    let mean = |of: &dyn Fn(usize) -> f64| (0..looks).map(of).sum::<f64>() / looks as f64;
    let down = |k: usize| poses[k].attitude.q_nb.inverse() * Vector3::z();
    let warm = |k: usize| poses[k].temperature_c.unwrap_or(0.0);
    let mut all = [0.0; 14];
    for axis in 0..3 {
        all[axis] = mean(&|k| poses[k].attitude.rate_nb_b[axis].powi(2)).sqrt();
        all[3 + axis] = mean(&|k| poses[k].acc_n[axis].powi(2)).sqrt();
        all[6 + axis] = mean(&|k| down(k)[axis]);
        all[9 + axis] = mean(&|k| down(k)[axis].powi(2));
    }
    all[12] = mean(&warm);
    all[13] = warm(looks - 1) - warm(0);
    all
}

/// Spread of each feature over the parts; none of one that is the same in all.
fn spreads(features: &[Features]) -> Features {
    let count = features.len() as f64;
    std::array::from_fn(|at| {
        let mean = features.iter().map(|one| one[at]).sum::<f64>() / count;
        (features.iter().map(|one| (one[at] - mean).powi(2)).sum::<f64>() / count).sqrt()
    })
}

/// Root mean square over the features of what the halves differ by, in spreads.
fn difference(features: &[Features], spreads: &Features, mask: u32) -> f64 {
    let of_feature = |(at, spread): (usize, &f64)| {
        let side = |block: usize| if (mask >> block) & 1 == 1 { 1.0 } else { -1.0 };
        let sum: f64 = features
            .iter()
            .enumerate()
            .map(|(block, one)| side(block) * one[at])
            .sum();
        sum / (BLOCKS as f64 / 2.0) / spread
    };
    let told: Vec<f64> = (spreads.iter().enumerate())
        .filter(|(_, spread)| **spread > 1e-9)
        .map(of_feature)
        .collect();
    (told.iter().map(|one| one * one).sum::<f64>() / told.len().max(1) as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use twin::motion::{RotationTest, Still, Tumble};

    use super::*;

    fn seconds(spans: &[[f64; 2]]) -> f64 {
        spans.iter().map(|[from, to]| to - from).sum()
    }

    #[test]
    fn both_have_half_of_the_time_and_share_no_instant() {
        let parts = parted(&Tumble::new(), |t| t, [0.0, 100.0]).expect("parted");
        assert!((seconds(&parts.fit) - 50.0).abs() < 0.01 && (seconds(&parts.hold) - 50.0).abs() < 0.01);
        let mut all: Spans = [parts.fit, parts.hold].concat();
        all.sort_by(|one, other| one[0].total_cmp(&other[0]));
        assert!(all.windows(2).all(|pair| pair[0][1] == pair[1][0]), "{all:?}");
    }

    #[test]
    fn an_axis_that_is_turned_for_a_while_is_turned_in_both() {
        // Rotation test 1 turns each axis on its own: the plain halves hold different axes.
        let motion = RotationTest::first();
        let end_s = motion.duration_s().expect("it ends");
        let parts = parted(&motion, |t| t, [0.0, end_s]).expect("parted");
        let most = |spans: &Spans, axis: usize| {
            let looks = spans
                .iter()
                .flat_map(|[from, to]| (0..((to - from) / 0.1) as u32).map(move |k| from + 0.1 * f64::from(k)));
            looks
                .map(|t_s| motion.at(t_s).attitude.rate_nb_b[axis].abs())
                .fold(0.0, f64::max)
        };
        for axis in 0..3 {
            let [fit, hold] = [&parts.fit, &parts.hold].map(|spans| most(spans, axis));
            assert!(fit > 0.1 && hold > 0.1, "axis {axis}: {fit} {hold}, {parts:?}");
        }
    }

    #[test]
    fn what_never_changes_is_parted_with_few_edges_and_a_short_log_not_at_all() {
        let parts = parted(&Still::level(), |t| t, [0.0, 60.0]).expect("parted");
        assert_eq!((parts.fit, parts.hold), (vec![[0.0, 30.0]], vec![[30.0, 60.0]]));
        let short = parted(&Still::level(), |t| t, [0.0, 5.0]).expect_err("short");
        assert!(short.to_string().starts_with("5.0 s are too short"), "{short}");
    }
}
