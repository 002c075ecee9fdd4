//! An explanation reconsidered beside what a reference that is not exact, and a field, err by slowly.
//!
//! In: what the search found. Out: the explanation without what is not there ([`prune`]), with what does better in the place of another
//! ([`compare`]) and with what was not seen ([`recognise`]). With a reference that is exact it stays what it is.
//!
//! The search takes the slow errors of a reference for white noise of their whole variance: it finds little of what moves faster than they do,
//! and takes much of what is coloured for an effect. Its names are proposals here. Each must be worth [`EFFECT_MARGIN`] in
//! [`Beside`], where the errors have the colour that they have and the noise is what neighbours differ by; what is too quick for the means of that
//! is left to the search.

use nalgebra::DVector;

use super::{recognised::recognised, remainder::Setting, slow::Beside};
use crate::{
    input::case::Subject,
    library::hypotheses::Library,
    null::{interval::Interval, model::Model, problem::Problem},
    search::{
        explanation::Explanation,
        readings::{Chosen, always, timed},
    },
    thresholds::{EFFECT_MARGIN, MOST_EFFECTS},
};

/// Takes out, one after the other, what is worth nothing there, and moves the others to where they are there.
pub fn prune(problem: &Problem, library: &mut Library, explanation: &mut Explanation, subject: &Subject) {
    if subject.slow.attitude_sigma_rad <= 0.0 {
        return;
    }
    while let Some(beside) = beside(problem, explanation, subject) {
        // Of what is too quick for the means, they say nothing: but they may not speak against it.
        let asked = |effect: usize| {
            if beside.sees(effect) {
                EFFECT_MARGIN
            } else {
                -EFFECT_MARGIN
            }
        };
        let least = (0..explanation.found.chosen.len())
            .map(|effect| (effect, beside.worth(effect) - asked(effect)))
            .min_by(|one, other| one.1.total_cmp(&other.1));
        match least {
            Some((effect, nats)) if nats < 0.0 => drop_one(problem, library, explanation, effect),
            _ => return,
        }
        settle(problem, library, explanation, subject);
    }
}

/// Tries each effect against all others in its place, at any time. What takes it must be worth more with its prior odds than that is
/// without.
pub fn compare(
    problem: &Problem,
    library: &mut Library,
    explanation: &mut Explanation,
    subject: &Subject,
    quiet: &Model,
) {
    if subject.slow.attitude_sigma_rad <= 0.0 {
        return;
    }
    for at in 0..explanation.found.chosen.len() {
        let Some(worth) = beside(problem, explanation, subject).map(|beside| beside.worth(at)) else {
            return;
        };
        let (mut others, mut own_library) = (explanation.clone(), library.clone());
        drop_one(problem, &mut own_library, &mut others, at);
        let Some((found, span)) = found(problem, &own_library, &others, subject, quiet) else {
            continue;
        };
        if found.gain <= worth {
            continue;
        }
        let own = explanation.found.chosen[at].hypothesis;
        if library.hypotheses[own].span.is_some() {
            always(problem, library, own);
        }
        timed(problem, library, found.hypothesis, span);
        explanation.replace(problem, library, at, found);
        settle(problem, library, explanation, subject);
    }
    prune(problem, library, explanation, subject);
}

/// Takes in what is recognised beneath what an explanation leaves; whether anything was.
pub fn recognise(
    problem: &Problem,
    library: &mut Library,
    explanation: &mut Explanation,
    subject: &Subject,
    quiet: &Model,
) -> bool {
    if subject.slow.attitude_sigma_rad <= 0.0 {
        return false;
    }
    let before = explanation.found.chosen.len();
    while explanation.found.chosen.len() < MOST_EFFECTS {
        let Some((found, span)) = found(problem, library, explanation, subject, quiet) else {
            break;
        };
        timed(problem, library, found.hypothesis, span);
        explanation.add(problem, library, found);
        settle(problem, library, explanation, subject);
    }
    let is_more = explanation.found.chosen.len() > before;
    if is_more {
        prune(problem, library, explanation, subject);
    }
    is_more
}

/// What is recognised beneath an explanation.
fn found(
    problem: &Problem,
    library: &Library,
    explanation: &Explanation,
    subject: &Subject,
    quiet: &Model,
) -> Option<(Chosen, Option<Interval>)> {
    let excluded: Vec<usize> = explanation
        .found
        .chosen
        .iter()
        .map(|chosen| chosen.hypothesis)
        .collect();
    let model = if excluded.is_empty() { quiet } else { &explanation.model };
    let mut steady = library.clone();
    for hypothesis in 0..steady.hypotheses.len() {
        if steady.hypotheses[hypothesis].span.is_some() {
            always(problem, &mut steady, hypothesis);
        }
    }
    let setting = Setting::of(subject, explanation.scatter.as_ref(), &explanation.louder);
    recognised(problem, &steady, model, &excluded, &setting)
}

fn drop_one(problem: &Problem, library: &mut Library, explanation: &mut Explanation, at: usize) {
    let hypothesis = explanation.found.chosen[at].hypothesis;
    explanation.remove(problem, library, at);
    if library.hypotheses[hypothesis].span.is_some() {
        always(problem, library, hypothesis);
    }
}

/// Moves the effects' parameters to where they are beside all that is open, if that leaves less.
fn settle(problem: &Problem, library: &Library, explanation: &mut Explanation, subject: &Subject) {
    let Some(before) = beside(problem, explanation, subject) else {
        return;
    };
    let Some(moves) = before.moves(problem, &explanation.model) else {
        return;
    };
    explanation.shift(problem, library, &moves);
    let after = beside(problem, explanation, subject);
    if after.is_none_or(|after| after.energy() > before.energy()) {
        let back: Vec<DVector<f64>> = moves.iter().map(|by| -by).collect();
        explanation.shift(problem, library, &back);
    }
}

fn beside(problem: &Problem, explanation: &Explanation, subject: &Subject) -> Option<Beside> {
    if explanation.found.chosen.is_empty() {
        return None;
    }
    let setting = Setting::of(subject, explanation.scatter.as_ref(), &explanation.louder);
    Beside::of(problem, &explanation.model, &setting)
}
