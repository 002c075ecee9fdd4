//! What is left, recognised: an effect of the library that a slow course turns out to be.
//!
//! In: a model and what it leaves beside reference, field and calibration. Out: [`recognised`], an effect that is likelier there than
//! any free course, or none.
//!
//! The search takes what a reference errs by for white noise, and finds little of what is slow. Here effects and unknown courses
//! compete in one evidence, of the same samples, beside the same (Kennedy and O'Hagan 2001): an effect with three
//! numbers wins over a course with a hundred where it says as much, and loses where it only resembles what is there. One that comes and goes
//! is tried in each stretch of time too, and the likeliest is looked at more closely. Whether it matters is asked of a name later
//! ([`crate::probability::importance`]).

use std::iter::once;

use super::{
    remainder::{Setting, courses},
    slow::{Beside, Look, Slow},
};
use crate::{
    library::hypotheses::Library,
    null::{evidence::Screen, interval::Interval, model::Model, problem::Problem},
    search::{
        odds::by_effect,
        readings::{Chosen, Rival},
    },
    thresholds::{EFFECT_MARGIN, SAID, STRETCH_MARGIN},
};

/// The effect that what a model leaves most likely is, and when it is on, with its rivals; free courses stand among them without a name.
/// None of those that are `excluded`. The library has all effects on always.
pub fn recognised(
    problem: &Problem,
    library: &Library,
    model: &Model,
    excluded: &[usize],
    setting: &Setting,
) -> Option<(Chosen, Option<Interval>)> {
    let starts_s = problem.twin.starts_s();
    let repeats = |hypothesis: usize| {
        let cause = &library.hypotheses[hypothesis].cause;
        cause.effect.repeats(cause.variant) && cause.effect.variants(starts_s).len() > 1
    };
    let beside = Beside::with(problem, model, setting, library, &Look::default())?;
    let slow = courses(problem, &beside, setting, None);
    let mut tried: Vec<Tried> = Vec::new();
    for (hypothesis, screen) in beside.effects(library) {
        // What comes again and again and is on always is another effect.
        if !excluded.contains(&hypothesis) && !repeats(hypothesis) {
            tried.extend(Tried::of(library, hypothesis, None, screen, 0.0));
        }
    }
    let mut looked: Vec<(usize, [f64; 3])> = Vec::new();
    for (hypothesis, span, screen, price, at) in beside.stretches(library, None) {
        let always = tried.iter().find(|tried| tried.hypothesis == hypothesis);
        let always = always.map_or(0.0, |tried| tried.gain);
        let own = Tried::of(library, hypothesis, Some(span), screen, price);
        let own = own.filter(|own| own.gain > always + STRETCH_MARGIN && !excluded.contains(&hypothesis));
        looked.extend(own.iter().map(|_| (hypothesis, at)));
        tried.extend(own);
    }
    tried.sort_by(|one, other| other.gain.total_cmp(&one.gain));
    if let Some(first) = tried.first_mut()
        && first.span.is_some()
        && let Some((hypothesis, near)) = looked.iter().find(|(hypothesis, _)| *hypothesis == first.hypothesis)
    {
        let look = Look {
            only: Some(*hypothesis),
        };
        let closer = Beside::with(problem, model, setting, library, &look)?;
        for (hypothesis, span, screen, price, _) in closer.stretches(library, Some(*near)) {
            let own = Tried::of(library, hypothesis, Some(span), screen, price);
            if let Some(own) = own.filter(|own| own.gain > first.gain) {
                *first = own;
            }
        }
    }
    let best = tried.first().filter(|best| best.gain > EFFECT_MARGIN)?;
    let own = library.hypotheses[best.hypothesis].cause.channels(problem.twin.unit());
    let is_rival = |one: &&Slow| one.channels.iter().any(|channel| own.contains(channel));
    let several = (slow.len() as f64).ln();
    let unnamed = slow.iter().filter(is_rival).map(|one| Rival {
        hypothesis: best.hypothesis,
        gain: one.posterior.log_bayes_factor - several,
        span: None,
        is_named: false,
    });
    let named = tried.iter().map(|one| Rival {
        hypothesis: one.hypothesis,
        gain: one.gain,
        span: one.span,
        is_named: true,
    });
    let mut rivals: Vec<Rival> = named.chain(unnamed).collect();
    rivals.sort_by(|one, other| other.gain.total_cmp(&one.gain));
    let effect = library.hypotheses[best.hypothesis].effect();
    let is_likely = by_effect(library, &rivals)
        .iter()
        .any(|(name, probability)| *name == effect && *probability >= SAID);
    let width = best.screen.prior_sigmas.len();
    let mut screen = best.screen.clone();
    screen.settle(once(0..width));
    let estimate = screen.estimate(&(0..width).collect::<Vec<_>>())?;
    let chosen = Chosen {
        hypothesis: best.hypothesis,
        theta: estimate.parameters,
        covariance: estimate.covariance,
        gain: best.gain,
        rivals,
    };
    is_likely.then_some((chosen, best.span))
}

/// An effect with its evidence.
struct Tried {
    hypothesis: usize,
    span: Option<Interval>,
    screen: Screen,
    /// \[nats\] over nothing, with its prior odds.
    gain: f64,
}

impl Tried {
    fn of(library: &Library, hypothesis: usize, span: Option<Interval>, screen: Screen, price: f64) -> Option<Self> {
        let evidence = screen.of_any_size(once(0..screen.prior_sigmas.len()))?;
        Some(Tried {
            hypothesis,
            span,
            gain: evidence + library.hypotheses[hypothesis].log_prior - price,
            screen,
        })
    }
}
