//! Effects that come and go: the stretch of time in which one is on.
//!
//! In: a set of hypotheses, refined. Out: for each hypothesis whose cause [passes](twin::effect::Page::passes) the stretch in
//! which it would explain most ([`once`]), and sets refined with a member that is on in a stretch only.

use nalgebra::DVector;
use rayon::prelude::*;

use super::{
    columns::{always, renew},
    variant::sharpened,
};
use crate::{
    library::{
        hypotheses::{Hypothesis, Library},
        products::Entries,
    },
    null::{interval::Interval, problem::Problem},
    search::{
        gauss_newton::{Refined, model_of, refine},
        once,
        periodic::again,
    },
    thresholds::LEAST_PART,
};

/// For each hypothesis that comes and goes the stretch of time in which it explains most of what a set leaves, if it is not
/// always there; its gain is then that of the stretch. One with variants has its onset among them.
pub(super) fn stretches(
    problem: &Problem,
    library: &Library,
    set: &[usize],
    best: &Refined,
    nothing: f64,
    gains: &mut [f64],
) -> Vec<Option<Interval>> {
    let model = model_of(library, set, &best.thetas);
    let least = LEAST_PART * (best.log_evidence - nothing);
    let rest = problem.residuals(&model);
    let starts_s = problem.twin.starts_s();
    let stretch = |(hypothesis, gain): (&Hypothesis, &mut f64)| {
        let effect = hypothesis.cause.effect;
        let repeats = effect.repeats(hypothesis.cause.variant);
        if !gain.is_finite() || !effect.page().passes || !repeats && effect.variants(starts_s).len() > 1 {
            return None;
        }
        let places = hypothesis.places.iter();
        let slopes: Vec<Entries> = places.map(|place| library.products.column(*place)).collect();
        let sigmas: Vec<f64> = (hypothesis.parameters.iter())
            .map(|parameter| parameter.prior_sigma)
            .collect();
        let found = match repeats {
            true => again(problem, &rest, &slopes, &sigmas),
            false => once::stretch(problem, &rest, &slopes, &sigmas).map(|(span, more)| (span.into(), more)),
        };
        let found = found.filter(|(_, more)| *gain + more > least);
        *gain = match found {
            Some((_, more)) => *gain + more,
            // What is on always is another effect.
            None if repeats => f64::NEG_INFINITY,
            None => *gain,
        };
        found.map(|(span, _)| span)
    };
    library.hypotheses.par_iter().zip(gains).map(stretch).collect()
}

/// A set whose last member was added, refined: on in a stretch of time if it has one, with the onset that suits it best. The
/// library has its columns from then on.
pub(super) fn taken(
    problem: &Problem,
    library: &mut Library,
    set: &[usize],
    start: &[DVector<f64>],
    span: Option<Interval>,
) -> Refined {
    let refined = match span {
        Some(span) => passing(problem, library, set, start, span),
        None => refine(problem, library, set, start),
    };
    sharpened(problem, library, set, refined)
}

/// The same of one that is only tried, and sharpened only where it `is_contested` by one with a stretch. The library is left as
/// it was.
pub(super) fn fitted(
    problem: &Problem,
    library: &mut Library,
    set: &[usize],
    start: &[DVector<f64>],
    span: Option<Interval>,
    is_contested: bool,
) -> Refined {
    match (span, set.last()) {
        (Some(span), Some(last)) => {
            let refined = passing(problem, library, set, start, span);
            always(problem, library, *last);
            refined
        }
        (None, Some(last)) if is_contested => {
            let variant = library.hypotheses[*last].cause.variant;
            let refined = sharpened(problem, library, set, refine(problem, library, set, start));
            if library.hypotheses[*last].cause.variant != variant {
                library.hypotheses[*last].cause.variant = variant;
                always(problem, library, *last);
            }
            refined
        }
        _ => refine(problem, library, set, start),
    }
}

/// A set with its last member on in a stretch of time only, refined. The library has its columns for that stretch from then
/// on; [`always`] gives it back those it had.
fn passing(problem: &Problem, library: &mut Library, set: &[usize], start: &[DVector<f64>], span: Interval) -> Refined {
    let last = set[set.len() - 1];
    library.hypotheses[last].span = Some(span);
    let mut thetas = start.to_vec();
    thetas.resize_with(set.len(), || DVector::zeros(library.hypotheses[last].parameters.len()));
    renew(problem, library, set, &thetas);
    refine(problem, library, set, start)
}

/// Gives the member added last, whose onset is a variant, the end that it may have.
pub(super) fn bounded(problem: &Problem, library: &mut Library, set: &[usize], best: Refined) -> Refined {
    let Some((last, others)) = set.split_last() else {
        return best;
    };
    let own = &library.hypotheses[*last];
    if own.places.is_empty() || own.span.is_some() || !own.cause.effect.page().passes {
        return best;
    }
    let model = model_of(library, others, &best.thetas[..others.len()]);
    let rest = problem.residuals(&model);
    let slopes = &best.slopes[best.slopes.len() - own.places.len()..];
    let sigmas: Vec<f64> = own.parameters.iter().map(|parameter| parameter.prior_sigma).collect();
    let Some((span, _)) = once::stretch(problem, &rest, slopes, &sigmas) else {
        return best;
    };
    let refined = passing(problem, library, set, &best.thetas, span.into());
    if refined.log_evidence > best.log_evidence {
        return refined;
    }
    library.hypotheses[*last].span = None;
    renew(problem, library, set, &best.thetas);
    best
}
