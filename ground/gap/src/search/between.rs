//! Values between those that were tried, where an effect has such: when it begins, a frequency, a time constant.
//!
//! In: a hypothesis with the value that explained most of those tried, and how well another explains. Out: the value at which it explains most,
//! by steps that are halved.

use crate::library::hypotheses::Hypothesis;

/// Times the distance between values tried is halved: an onset in a log of ten minutes to a cycle, a limit to a part in
/// ten thousand.
const HALVINGS: usize = 10;

/// \[nats\] that make another value a better one; where both neighbours are as good but for less, no value between is.
const SHARPER: f64 = 0.1;

/// Half the ways down and up to the neighbours of a hypothesis' variant, in a log whose cycles begin at these instants \[s\]; where there is
/// none the way to the other, and `None` where there is nothing between.
pub fn half_ways(hypothesis: &Hypothesis, starts_s: &[f64]) -> Option<[f64; 2]> {
    let grid = hypothesis.values_between(starts_s)?;
    let variant = hypothesis.cause.variant;
    let at = grid.iter().position(|value| *value == variant)?;
    let below = at.checked_sub(1).map(|below| variant - grid[below]);
    let above = grid.get(at + 1).map(|above| above - variant);
    Some([below.or(above)?, above.or(below)?].map(|way| 0.5 * way))
}

/// The value that has most evidence, and its fit, by steps down and up that are halved. `at` fits another value, given the best fit so far; what it
/// gave last need not be the best.
pub fn climbed<T>(
    (mut variant, mut best): (f64, T),
    [mut down, mut up]: [f64; 2],
    log_evidence: impl Fn(&T) -> f64,
    mut at: impl FnMut(f64, &T) -> T,
) -> (f64, T) {
    for _ in 0..HALVINGS {
        let mut is_flat = true;
        for step in [-down, up] {
            let fitted = at(variant + step, &best);
            let more = log_evidence(&fitted) - log_evidence(&best);
            is_flat &= more.abs() < SHARPER;
            if more > SHARPER {
                (variant, best) = (variant + step, fitted);
                // As far to either side now as it was moved.
                (down, up) = (step.abs(), step.abs());
                break;
            }
        }
        if is_flat {
            break;
        }
        (down, up) = (0.5 * down, 0.5 * up);
    }
    (variant, best)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn top(steps: [f64; 2], nats: impl Fn(f64) -> f64) -> f64 {
        climbed((3.0, nats(3.0)), steps, |nats| *nats, |x, _| nats(x)).0
    }

    #[test]
    fn the_top_of_a_hill_is_found_to_a_thousandth_of_the_first_step() {
        for (peak, steps) in [(3.217, [0.5, 0.5]), (2.9, [0.5, 5.0]), (3.6, [0.5, 4.0])] {
            let found = top(steps, |x| -1e6 * (x - peak).powi(2));
            assert!((found - peak).abs() < 2e-3, "{found} for {peak}");
        }
    }

    #[test]
    fn where_all_values_are_alike_the_first_stays() {
        assert_eq!(top([0.5, 0.5], |_| 0.0), 3.0);
    }
}
