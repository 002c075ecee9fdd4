//! When the effect added last is on: its onset moved to where it explains most, and the stretch after which it is gone.
//!
//! In: a set of hypotheses, refined. Out: the same set refined with another time, whose columns the library then has, or as
//! it was.

use twin::effect::onsets;

use crate::{
    library::Library,
    onset,
    problem::Problem,
    refine::{Refined, model_of, refine},
};

/// Times the distance between onsets tried is halved: of a log of ten minutes, to a cycle.
const HALVINGS: usize = 8;

/// [nats] that make another onset a better one.
const SHARPER: f64 = 0.5;

/// Gives the member added last the stretch of time in which it is on, if it is not always.
pub(super) fn bounded(
    problem: &Problem,
    library: &mut Library,
    set: Vec<usize>,
    best: Refined,
) -> (Vec<usize>, Refined) {
    let Some(last) = set
        .last()
        .copied()
        .filter(|last| !library.hypotheses[*last].places.is_empty())
        .filter(|last| library.hypotheses[*last].cause.effect.page().passes)
    else {
        return (set, best);
    };
    let others = model_of(library, &set[..set.len() - 1], &best.thetas[..set.len() - 1]);
    let own = &library.hypotheses[last];
    let slopes = &best.slopes[best.slopes.len() - own.places.len()..];
    let sigmas: Vec<f64> = own.parameters.iter().map(|parameter| parameter.prior_sigma).collect();
    let Some(span) = onset::stretch(problem, &others, slopes, &sigmas) else {
        return (set, best);
    };
    let model = model_of(library, &set, &best.thetas);
    library.hypotheses[last].span = Some(span);
    let mut model = model;
    model[set.len() - 1].span = Some(span);
    let renewed = problem.slopes(&model, set.len() - 1);
    for (place, column) in library.hypotheses[last].places.clone().into_iter().zip(renewed) {
        library.products.renew(problem, place, column);
    }
    let refined = refine(problem, library, &set, &best.thetas);
    if refined.log_evidence > best.log_evidence {
        return (set, refined);
    }
    library.hypotheses[last].span = None;
    (set, best)
}

/// Moves the onset of the member added last to where it explains most: it is free, and a step that is seconds off leaves
/// more than most effects make.
pub(super) fn sharpened(problem: &Problem, library: &mut Library, set: &[usize], best: Refined) -> Refined {
    let Some(last) = set.last().copied() else {
        return best;
    };
    let all: Vec<f64> = onsets(problem.twin.starts_s()).collect();
    let mut onset_s = library.hypotheses[last].cause.variant;
    if library.hypotheses[last].places.is_empty() || !all.contains(&onset_s) {
        return best;
    }
    let mut best = best;
    let mut step_s = 0.5 * (all[1] - all[0]);
    for _ in 0..HALVINGS {
        for tried_s in [onset_s - step_s, onset_s + step_s] {
            let refined = from_onset(problem, library, set, &best, tried_s);
            if refined.log_evidence > best.log_evidence + SHARPER {
                (onset_s, best) = (tried_s, refined);
                break;
            }
        }
        step_s *= 0.5;
    }
    from_onset(problem, library, set, &best, onset_s)
}

/// A set refitted with another onset of its last member, whose columns are made anew.
fn from_onset(problem: &Problem, library: &mut Library, set: &[usize], best: &Refined, onset_s: f64) -> Refined {
    let last = set[set.len() - 1];
    library.hypotheses[last].cause.variant = onset_s;
    let model = model_of(library, set, &best.thetas);
    let renewed = problem.slopes(&model, set.len() - 1);
    for (place, column) in library.hypotheses[last].places.clone().into_iter().zip(renewed) {
        library.products.renew(problem, place, column);
    }
    refine(problem, library, set, &best.thetas)
}
