//! Events that happen again: how often, and what one more of them would do to every row.
//!
//! In: the problem and a model that is fitted. Out: [`Events`], of an effect whose occurrences are random ([`Effect::happened`]):
//! when they are on the fit windows is fitted, but how often they are and how large is all of it that other windows share.
//! Nothing held out is asked; [`crate::holdout::judge`] counts there what happened since.
//!
//! `n` events in `N` cycles are taken for a rate of `(n + 1/2) / N` a cycle (the mean of Jeffreys' posterior of a Poisson rate).

#[cfg(doc)]
use twin::effect::Effect;
use twin::effect::{Active, Cause};

use crate::{
    null::{
        model::Model,
        problem::{Component, Problem},
    },
    thresholds::RARE,
};

/// What the fit learned of events that happen again.
#[derive(Clone, Debug)]
pub struct Events {
    /// Chance of one in a cycle.
    pub rate: f64,
    /// Predictions of every row, channel by channel, had it happened once more before it, had it twice, and so on.
    pub more: Vec<Vec<Vec<f64>>>,
    /// Whether the fit has seen a row: what happened up to there is in the model.
    pub is_fitted: Vec<bool>,
}

impl Events {
    /// Of the model's first effect that happens again; the next one is as large as it is on the average.
    pub fn of(problem: &Problem, model: &Model) -> Option<Self> {
        let happened = |component: &Component| component.active.cause.effect.happened();
        let first = model
            .components
            .iter()
            .find(|component| happened(component).is_some())?;
        let cause = Cause {
            variant: happened(first)?,
            ..first.active.cause.clone()
        };
        let is_of_it = |component: &&Component| {
            let own = &component.active.cause;
            own.effect.page().name == cause.effect.page().name && own.locality == cause.locality
        };
        let thetas: Vec<&[f64]> = (model.components.iter().filter(is_of_it))
            .map(|component| component.active.theta.as_slice())
            .collect();
        let mean = |index: usize| thetas.iter().map(|theta| theta[index]).sum::<f64>() / thetas.len() as f64;
        let one = Component {
            active: Active {
                cause: cause.clone(),
                theta: (0..thetas[0].len()).map(mean).collect(),
            },
            span: None,
        };
        let mut is_fitted = vec![false; problem.twin.starts_s().len()];
        let fitted = problem.frames.iter().flat_map(|frame| &frame.series.rows);
        fitted.for_each(|row| is_fitted[*row as usize] = true);
        let seen = is_fitted.iter().filter(|is_fitted| **is_fitted).count();
        let rate = ((thetas.len() as f64 + 0.5) / seen.max(1) as f64).min(0.5);
        let count = most(rate * (is_fitted.len() - seen) as f64);
        let with = |more: usize| {
            let mut components = model.components.clone();
            components.extend(std::iter::repeat_n(one.clone(), more));
            let reading = |(channel, predicted): (usize, &Vec<f64>)| {
                let pairs = (problem.predict(channel, &components).into_iter())
                    .zip(problem.predict(channel, &model.components));
                let added = predicted.iter().zip(pairs);
                added
                    .map(|(predicted, (more, plain))| predicted + more - plain)
                    .collect()
            };
            model.predicted.iter().enumerate().map(reading).collect()
        };
        Some(Self {
            rate,
            more: (1..=count).map(with).collect(),
            is_fitted,
        })
    }
}

/// The number that a Poisson variable of this mean exceeds with a probability of no more than [`RARE`].
fn most(mean: f64) -> usize {
    let (mut term, mut count) = ((-mean).exp(), 0);
    let mut left = 1.0 - term;
    while left > RARE {
        count += 1;
        term *= mean / count as f64;
        left -= term;
    }
    count
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn as_many_events_are_looked_for_as_there_may_be() {
        // Poisson's law of mean 1.5: P(N > 7) = 1.7e-4, P(N > 8) = 2.8e-5.
        assert_eq!((most(0.0), most(1.5)), (0, 8));
    }
}
