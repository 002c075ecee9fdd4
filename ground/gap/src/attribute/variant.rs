//! What of the effect added last is no parameter of the fit: its onset, or a limit or corner, moved to where it explains most,
//! and the stretch after which it is gone.
//!
//! In: a set of hypotheses, refined. Out: the same set refined with another value, whose columns the library then has, or as
//! it was.

use twin::effect::onsets;

use crate::{
    library::{Hypothesis, Library},
    onset,
    problem::Problem,
    refine::{Refined, model_of, refine},
};

/// Times the distance between values tried is halved: an onset in a log of ten minutes to a cycle, a limit to a part in
/// ten thousand.
const HALVINGS: usize = 10;

/// [nats] that make another value a better one.
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

/// Moves the variant of the member added last to where it explains most, if values between its variants are possible: a step
/// that is seconds off, or a limit that is a percent off, leaves more than most effects make.
pub(super) fn sharpened(problem: &Problem, library: &mut Library, set: &[usize], best: Refined) -> Refined {
    let Some(last) = set.last().copied() else {
        return best;
    };
    let mut variant = library.hypotheses[last].cause.variant;
    let Some(mut step) = half_way(problem, &library.hypotheses[last]) else {
        return best;
    };
    let mut best = best;
    for _ in 0..HALVINGS {
        for tried in [variant - step, variant + step] {
            let refined = at_variant(problem, library, set, &best, tried);
            if refined.log_evidence > best.log_evidence + SHARPER {
                (variant, best) = (tried, refined);
                break;
            }
        }
        step *= 0.5;
    }
    at_variant(problem, library, set, &best, variant)
}

/// Half the way to the farther neighbour of a hypothesis' variant; `None` where there is nothing between.
fn half_way(problem: &Problem, hypothesis: &Hypothesis) -> Option<f64> {
    let starts_s = problem.twin.starts_s();
    let (effect, variant) = (hypothesis.cause.effect, hypothesis.cause.variant);
    let grid: Vec<f64> = if effect.has_values_between() {
        effect.variants(starts_s)
    } else if hypothesis.places.is_empty() {
        return None;
    } else {
        onsets(starts_s).collect()
    };
    let at = grid.iter().position(|value| *value == variant)?;
    let neighbours = [at.checked_sub(1), Some(at + 1)].into_iter().flatten();
    let distances = neighbours
        .filter_map(|index| grid.get(index))
        .map(|value| (value - variant).abs());
    Some(0.5 * distances.fold(0.0, f64::max))
}

/// A set refitted with another variant of its last member, whose columns are made anew.
fn at_variant(problem: &Problem, library: &mut Library, set: &[usize], best: &Refined, variant: f64) -> Refined {
    let last = set[set.len() - 1];
    library.hypotheses[last].cause.variant = variant;
    let model = model_of(library, set, &best.thetas);
    let renewed = problem.slopes(&model, set.len() - 1);
    for (place, column) in library.hypotheses[last].places.clone().into_iter().zip(renewed) {
        library.products.renew(problem, place, column);
    }
    refine(problem, library, set, &best.thetas)
}
