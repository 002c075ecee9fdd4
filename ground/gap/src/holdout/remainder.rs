//! What is left of the whole log, held-out windows included.
//!
//! In: the case and a finished model's effects. Out: the [`Remainder`] beneath them. Calibration and the sizes of the effects are fitted
//! to all samples anew, within their sigmas, and say nothing but this: an effect that is another one on the held-out windows leaves there
//! what it does not explain. What happens at random happens there at other instants, so of that only the fit windows are judged.
//! Where an effect begins or ends between two fitted samples no fit can tell when, so nothing between these is judged.

use crate::{
    holdout::floor::floor,
    input::{case::Subject, log::Series, windows::Fit},
    null::{
        interval::begins_s,
        model::Model,
        problem::{Component, Problem},
    },
    unknown::remainder::{Remainder, Setting, remainder},
};

/// An onset within one part in so many of a held-out stretch from it may be in it: the few fitted rows between do not say. One at 118.7 s, in a
/// stretch from 100 to 120 s, was found two rows before 100 s. The number is a choice: an onset is known better than 1.25 s of 20 where an
/// effect is strong, and the price of taking it for worse known is one stretch that does not judge.
const BESIDE: u32 = 16;

/// Judges all samples, or only those that were fitted.
pub fn of_log(subject: &Subject, components: &[Component], setting: &Setting, only_fitted: bool) -> Remainder {
    let starts_s = subject.twin.starts_s();
    let begin_s = components
        .iter()
        .map(|component| begins_s(&component.active.cause, starts_s));
    let begin_s: Vec<Option<f64>> = begin_s.collect();
    let are_on = |row: u32| {
        let t_s = starts_s[row as usize];
        let own = components.iter().zip(&begin_s);
        own.map(move |(component, begin_s)| {
            component.span.is_none_or(|span| span.contains(t_s)) && begin_s.is_none_or(|begin_s| t_s >= begin_s)
        })
    };
    let pairs = subject.fit.channels.iter().zip(subject.held.samples());
    let all = Fit {
        channels: pairs
            .map(|(fit, held)| match only_fitted {
                true => fit.clone(),
                false => merged(fit, &told(fit, held, |before, after| are_on(before).eq(are_on(after)))),
            })
            .collect(),
    };
    let mut problem = Problem::new(&subject.twin, &all, &subject.reference);
    for component in components {
        problem.retell(&component.active.cause);
    }
    let model = Model::around(&problem, components.to_vec());
    let floor = floor(&problem, &model);
    remainder(&problem, &model, &floor, setting)
}

/// The held-out samples but for those between two fitted rows that are not `alike`, or near which others are not.
fn told(fit: &Series, held: &Series, are_alike: impl Fn(u32, u32) -> bool) -> Series {
    let mut told = Series::default();
    let mut latest: Option<(usize, bool)> = None;
    for (row, value) in held.rows.iter().zip(&held.values) {
        let after = fit.rows.partition_point(|fitted| fitted < row);
        let is_told = match latest {
            Some((place, is_told)) if place == after => is_told,
            _ if after == 0 || after == fit.rows.len() => true,
            _ => {
                let (from, to) = (fit.rows[after - 1], fit.rows[after]);
                let beside = (to - from) / BESIDE;
                let last = fit.rows[fit.rows.len() - 1];
                are_alike(from.saturating_sub(beside), (to + beside).min(last))
            }
        };
        latest = Some((after, is_told));
        if is_told {
            told.rows.push(*row);
            told.values.push(*value);
        }
    }
    told
}

/// Samples of two sets of windows, which share none, in the order of their rows.
fn merged(one: &Series, other: &Series) -> Series {
    let samples = |series: &Series| -> Vec<(u32, f64)> {
        series.rows.iter().copied().zip(series.values.iter().copied()).collect()
    };
    let mut all = samples(one);
    all.extend(samples(other));
    all.sort_by_key(|(row, _)| *row);
    let (rows, values) = all.into_iter().unzip();
    Series { rows, values }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn series(rows: &[u32]) -> Series {
        Series {
            rows: rows.to_vec(),
            values: rows.iter().map(|row| f64::from(*row)).collect(),
        }
    }

    #[test]
    fn between_fitted_rows_that_differ_nothing_is_told() {
        let (fit, held) = (series(&[10, 11, 20, 21, 30]), series(&[5, 12, 19, 22, 29, 31]));
        // On from row 15 on: nobody knows that it was not 12 or 20.
        assert_eq!(
            told(&fit, &held, |one, other| (one >= 15) == (other >= 15)),
            series(&[5, 22, 29, 31])
        );
        assert_eq!(told(&fit, &held, |_, _| true), held);
    }

    #[test]
    fn what_begins_just_before_may_begin_between() {
        let fit: Vec<u32> = (0..=160).chain(321..480).collect();
        let held: Vec<u32> = (161..=320).collect();
        let told_of = |onset: u32| {
            told(&series(&fit), &series(&held), |one, other| {
                (one >= onset) == (other >= onset)
            })
        };
        assert_eq!(told_of(158), Series::default());
        assert_eq!(told_of(325), Series::default());
        assert_eq!(told_of(140), series(&held));
        assert_eq!(told_of(340), series(&held));
    }
}
