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
        model::Model,
        problem::{Component, Problem},
    },
    unknown::remainder::{Remainder, Setting, remainder},
};

/// Judges all samples, or only those that were fitted.
pub fn of_log(subject: &Subject, components: &[Component], setting: &Setting, only_fitted: bool) -> Remainder {
    let pairs = subject.fit.channels.iter().zip(subject.held.samples());
    let all = Fit {
        channels: pairs
            .map(|(fit, held)| if only_fitted { fit.clone() } else { merged(fit, held) })
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
