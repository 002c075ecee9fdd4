//! How often an event happened again on the held-out windows, as far as each row and those before it tell.
//!
//! In: what the fit learned of such events. Out: a [`Course`], for the files of this folder and nobody else: weights of "not
//! again", "once more", "twice more" at every row, by the forward recursion of a hidden Markov chain (Rabiner 1989, eq. 19 to
//! 21) whose every cycle has one more event with the fitted rate. A row of the fit windows begins the count anew: what
//! happened up to there is in the model.
//!
//! No instant is fitted. A row's score is `-2 ln p(y_t | y_<t)`, averaged over whether an event happened (prequential, Dawid
//! 1984): one that is claimed costs what its rarity costs, and a rate that is there for nothing costs too.

use crate::{holdout::events::Events, input::hold::Held};

/// What a finished model says of every row, and how far samples may be from it.
#[derive(Clone, Copy)]
pub(super) struct Said<'a> {
    pub after: &'a [Vec<f64>],
    pub sigmas: &'a [Vec<f64>],
    pub louder: &'a [f64],
    pub events: Option<&'a Events>,
}

/// By row, how often it has happened again.
pub(super) struct Course<'a> {
    /// Predictions by how often it has happened again, from never on.
    numbers: Vec<&'a [Vec<f64>]>,
    /// By row, the probability of each.
    weights: Vec<Vec<f64>>,
    /// By row, what its score is above the mean energy under these weights: twice how far they had to move to it (the relative
    /// entropy of after and before).
    pub surprise: Vec<f64>,
}

impl Course<'_> {
    /// The mean of something of the prediction of a channel at a row.
    pub fn mean(&self, channel: usize, row: usize, of: impl Fn(f64) -> f64) -> f64 {
        let weighed = self.numbers.iter().zip(&self.weights[row]);
        weighed
            .filter(|(_, weight)| **weight > 0.0)
            .map(|(predicted, weight)| weight * of(predicted[channel][row]))
            .sum()
    }

    /// Mean predictions of every row, channel by channel.
    pub fn predicted(&self) -> Vec<Vec<f64>> {
        let rows = 0..self.weights.len();
        let of = |channel| {
            rows.clone()
                .map(|row| self.mean(channel, row, |predicted| predicted))
                .collect()
        };
        (0..self.numbers[0].len()).map(of).collect()
    }
}

impl Held {
    /// Follows an event that may happen again.
    pub(super) fn course<'a>(&self, said: Said<'a>) -> Course<'a> {
        let rows = said.after.iter().map(Vec::len).max().unwrap_or(0);
        let mut numbers = vec![said.after];
        numbers.extend(
            said.events
                .into_iter()
                .flat_map(|events| events.more.iter().map(Vec::as_slice)),
        );
        let mut never = vec![0.0; numbers.len()];
        never[0] = 1.0;
        let (mut weights, mut surprise) = (vec![never.clone(); rows], vec![0.0; rows]);
        let Some(events) = said.events else {
            return Course {
                numbers,
                weights,
                surprise,
            };
        };
        let energies = self.energies(said, &numbers, rows);
        let mut now = never.clone();
        let first = events.is_fitted.iter().position(|is_fitted| *is_fitted).unwrap_or(rows);
        for row in first..rows {
            if events.is_fitted[row] {
                now.clone_from(&never);
                continue;
            }
            for more in (1..now.len()).rev() {
                let moved = events.rate * now[more - 1];
                now[more] += moved;
                now[more - 1] -= moved;
            }
            // Of the least energy, so that not all of them vanish.
            let least = energies[row].iter().copied().fold(f64::INFINITY, f64::min);
            let mut after: Vec<f64> = (now.iter().zip(&energies[row]))
                .map(|(weight, energy)| weight * (0.5 * (least - energy)).exp().max(f64::MIN_POSITIVE))
                .collect();
            let sum: f64 = after.iter().sum();
            after.iter_mut().for_each(|weight| *weight /= sum);
            let score = least - 2.0 * sum.ln();
            let mean: f64 = after
                .iter()
                .zip(&energies[row])
                .map(|(weight, energy)| weight * energy)
                .sum();
            surprise[row] = score - mean;
            weights[row].clone_from(&after);
            now = after;
        }
        Course {
            numbers,
            weights,
            surprise,
        }
    }

    /// Energy of each row in squares of sigma, by how often the event has happened again.
    fn energies(&self, said: Said, numbers: &[&[Vec<f64>]], rows: usize) -> Vec<Vec<f64>> {
        let mut energies = vec![vec![0.0; numbers.len()]; rows];
        for (channel, series) in self.samples().iter().enumerate() {
            for (row, value) in series.rows.iter().zip(&series.values) {
                let row = *row as usize;
                let sigma = said.sigmas[channel][row] * said.louder[channel];
                let own = numbers
                    .iter()
                    .map(|number| ((value - number[channel][row]) / sigma).powi(2));
                // Where the reference did not see one of them nothing compares them.
                if own.clone().all(f64::is_finite) {
                    energies[row].iter_mut().zip(own).for_each(|(sum, own)| *sum += own);
                }
            }
        }
        energies
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        holdout::{judge::Finished, shrink::Shrink},
        input::log::Series,
    };

    /// \[s\]
    const CYCLE_S: f64 = 0.2;

    const ROWS: usize = 1000;

    /// Rows that were fitted.
    const FITTED: usize = 500;

    /// Chance of an event in a cycle.
    const RATE: f64 = 1.5 / FITTED as f64;

    /// Readings step by two at each event, and residuals of a perfect twin are one or minus one.
    const STEP: f64 = 2.0;

    fn residual(row: usize) -> f64 {
        if row.is_multiple_of(2) { 1.0 } else { -1.0 }
    }

    fn events(rows: usize, fitted: usize, more: usize) -> Events {
        Events {
            rate: RATE,
            more: (1..=more).map(|more| vec![vec![STEP * more as f64; rows]]).collect(),
            is_fitted: (0..rows).map(|row| row < fitted).collect(),
        }
    }

    /// Judges a twin that says zero of samples which are `value` of their row, and what happens again.
    fn judged(value: impl Fn(usize) -> f64, events: Option<&Events>) -> Shrink {
        let held = Held::new(vec![Series {
            rows: (FITTED as u32..ROWS as u32).collect(),
            values: (FITTED..ROWS).map(value).collect(),
        }]);
        let start_s: Vec<f64> = (0..ROWS).map(|row| row as f64 * CYCLE_S).collect();
        let level = |value: f64| vec![vec![value; ROWS]];
        held.judge(Finished {
            start_s: &start_s,
            sigmas: &level(1.0),
            steady: &[1.0],
            before: &level(-3.0),
            recalibrated: &level(-3.0),
            after: &level(0.0),
            louder: &[1.0],
            floor: &level(1.0),
            events,
        })
    }

    fn twice(size: f64) -> impl Fn(usize) -> f64 {
        move |row| size * (usize::from(row >= 600) + usize::from(row >= 811)) as f64 + residual(row)
    }

    #[test]
    fn what_happens_again_leaves_no_gap_and_what_only_looks_like_it_does() {
        let events = events(ROWS, FITTED, 8);
        let unknown = judged(twice(STEP), None).after;
        assert!(unknown > 2.0, "{unknown}");
        let known = judged(twice(STEP), Some(&events)).after;
        assert!((1.0..1.05).contains(&known), "{known}");
        // Steps of half the size are none of these events, nor is one that goes back.
        let half = judged(twice(0.5 * STEP), Some(&events)).after;
        assert!(half > 1.1, "{half}");
        let back = judged(|row| STEP * f64::from(row < 600) + residual(row), Some(&events));
        assert!(back.after > 1.3, "{}", back.after);
    }

    #[test]
    fn a_rate_that_is_there_for_nothing_costs_what_it_is_in_energy() {
        let events = events(ROWS, FITTED, 8);
        let (without, with) = (judged(residual, None).after, judged(residual, Some(&events)).after);
        let cost = (with * with - without * without) * (ROWS - FITTED) as f64;
        // 2 ln(1 - rate) a row, and nothing else.
        let expected = -2.0 * (-RATE).ln_1p() * (ROWS - FITTED) as f64;
        assert!(
            cost > 0.0 && (cost - expected).abs() < 0.2 * expected,
            "{cost} {expected}"
        );
    }

    #[test]
    fn a_score_is_the_probability_averaged_over_every_instant_at_which_it_may_have_happened() {
        // Five rows after one that was fitted, and one event at most: six courses, each as likely as its law says.
        let values = [0.3, -0.4, 1.7, 2.2, 1.1];
        let held = Held::new(vec![Series {
            rows: (1..6).collect(),
            values: values.to_vec(),
        }]);
        let (after, sigmas) = (vec![vec![0.0; 6]], vec![vec![0.8; 6]]);
        let events = events(6, 1, 1);
        let course = held.course(Said {
            after: &after,
            sigmas: &sigmas,
            louder: &[1.0],
            events: Some(&events),
        });
        let energy = |row: usize, predicted: f64| ((values[row - 1] - predicted) / 0.8).powi(2);
        let score: f64 = (1..6)
            .map(|row| course.mean(0, row, |predicted| energy(row, predicted)) + course.surprise[row])
            .sum();
        let of_onset = |onset: usize| {
            let law = (1.0 - RATE).powi(onset as i32 - 1) * if onset < 6 { RATE } else { 1.0 };
            let energies = (1..6).map(|row| energy(row, if row >= onset { STEP } else { 0.0 }));
            law * (-0.5 * energies.sum::<f64>()).exp()
        };
        let expected = -2.0 * (1..=6).map(of_onset).sum::<f64>().ln();
        assert!((score - expected).abs() < 1e-9, "{score} {expected}");
    }

    #[test]
    fn rows_that_were_fitted_begin_the_count_anew() {
        let mut events = events(ROWS, FITTED, 8);
        // What happened at the 600th row is in the model from the 700th on.
        let value = |row: usize| STEP * f64::from((600..700).contains(&row)) + residual(row);
        let held = Held::new(vec![Series {
            rows: (FITTED as u32..700).chain(750..ROWS as u32).collect(),
            values: (FITTED..700).chain(750..ROWS).map(value).collect(),
        }]);
        events.is_fitted[700..750].fill(true);
        let (after, sigmas) = (vec![vec![0.0; ROWS]], vec![vec![1.0; ROWS]]);
        let said = Said {
            after: &after,
            sigmas: &sigmas,
            louder: &[1.0],
            events: Some(&events),
        };
        let course = held.course(said);
        let more = |row: usize| course.mean(0, row, |predicted| predicted / STEP);
        assert!((more(699) - 1.0).abs() < 1e-3, "{}", more(699));
        // A new event or two, of which a row of either sign tells little by itself.
        assert!(more(760) < 3.0 * RATE, "{}", more(760));
    }
}
