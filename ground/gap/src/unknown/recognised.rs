//! What is left, recognised: an effect of the library that a slow course which matters turns out to be.
//!
//! In: a model and what it leaves beside reference, field and calibration. Out: [`recognised`], an effect that is likelier there than
//! any free course, or none.
//!
//! The search takes what a reference errs by for white noise, and finds little of what is slow. Here effects and unknown courses
//! compete in one evidence, of the same samples, beside the same (Kennedy and O'Hagan 2001): an effect with three
//! numbers wins over a course with a hundred where it says as much, and loses where it only resembles what is there. Only what matters is
//! looked at: a real unit is off by a little everywhere.

use std::iter::once;

use nalgebra::DVector;

use super::{
    remainder::{Setting, courses, judged},
    slow::{Beside, Slow},
};
use crate::{
    library::hypotheses::Library,
    null::{model::Model, problem::Problem},
    search::{
        odds::by_effect,
        readings::{Chosen, Rival, are_physical},
    },
    thresholds::{SAID, effect_margin},
};

/// The effect that what a model of those chosen leaves most likely is, with its rivals; free courses stand among them without a name.
pub fn recognised(
    problem: &Problem,
    library: &Library,
    model: &Model,
    chosen: &[Chosen],
    setting: &Setting,
) -> Option<Chosen> {
    let beside = Beside::of(problem, model, setting, Some(library))?;
    let slow = courses(problem, &beside, setting, None);
    let unit = problem.twin.unit();
    let matters: Vec<usize> = (slow.iter())
        .filter(|one| judged(problem, one, setting, slow.len())[1] >= SAID)
        .flat_map(|one| one.channels.clone())
        .collect();
    if matters.is_empty() {
        return None;
    }
    let is_there = |hypothesis: usize| {
        let cause = &library.hypotheses[hypothesis].cause;
        let is_new = chosen.iter().all(|chosen| chosen.hypothesis != hypothesis);
        is_new && cause.channels(unit).iter().any(|channel| matters.contains(channel))
    };
    let mut best: Option<Chosen> = None;
    let mut rivals: Vec<Rival> = Vec::new();
    for (hypothesis, mut screen) in beside.effects(library) {
        if !is_there(hypothesis) {
            continue;
        }
        let width = screen.prior_sigmas.len();
        let of_other_sizes = screen.settle(once(0..width));
        let all: Vec<usize> = (0..width).collect();
        let Some((evidence, estimate)) = screen.log_evidence().zip(screen.estimate(&all)) else {
            continue;
        };
        let own = &library.hypotheses[hypothesis];
        let sigmas = estimate.covariance.diagonal().map(f64::sqrt);
        if !are_physical(&own.parameters, estimate.parameters.iter().zip(sigmas.iter())) {
            continue;
        }
        let gain = evidence + of_other_sizes + own.log_prior;
        rivals.push(Rival {
            hypothesis,
            theta: estimate.parameters.clone(),
            gain,
            beside: f64::NEG_INFINITY,
            span: own.span,
            is_named: true,
        });
        if best.as_ref().is_none_or(|best| gain > best.gain) {
            best = Some(Chosen {
                hypothesis,
                theta: estimate.parameters,
                covariance: estimate.covariance,
                gain,
                rivals: Vec::new(),
            });
        }
    }
    let best = best.filter(|best| best.gain > effect_margin())?;
    let own = library.hypotheses[best.hypothesis].cause.channels(unit);
    let is_rival = |one: &&Slow| one.channels.iter().any(|channel| own.contains(channel));
    let several = (slow.len() as f64).ln();
    rivals.extend(slow.iter().filter(is_rival).map(|one| Rival {
        hypothesis: best.hypothesis,
        theta: DVector::zeros(0),
        gain: one.posterior.log_bayes_factor - several,
        beside: f64::NEG_INFINITY,
        span: None,
        is_named: false,
    }));
    rivals.sort_by(|one, other| other.gain.total_cmp(&one.gain));
    let effect = library.hypotheses[best.hypothesis].effect();
    let is_likely = by_effect(library, &rivals)
        .iter()
        .any(|(name, probability)| *name == effect && *probability >= SAID);
    is_likely.then_some(Chosen { rivals, ..best })
}
