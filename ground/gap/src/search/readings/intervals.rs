//! Effects that come and go: the stretch of time in which one is on.
//!
//! In: a set of hypotheses, refined. Out: for each hypothesis whose cause [passes](twin::effect::Page::passes) the stretch in
//! which it would explain most ([`once`]), and sets refined with a member that is on in a stretch only.

use std::sync::OnceLock;

use nalgebra::DVector;
use rayon::prelude::*;

use super::{
    columns::{always, renew},
    variant::sharpened,
};
use crate::{
    input::windows::Span,
    library::{
        column::Entries,
        hypotheses::{Hypothesis, Library},
    },
    null::{interval::Interval, problem::Problem},
    search::{
        gauss_newton::{Refined, model_of, refine},
        interval_sums::Residual,
        once::Tried,
        periodic::again,
    },
    thresholds::LEAST_PART,
};

/// Of each hypothesis that may be on in one stretch of time, what is the same for every set: its columns at the first instants tried. Those of
/// a member of the set are other ones, and no member is tried.
pub(super) struct Passing<'a> {
    pub(super) problem: &'a Problem<'a>,
    of: Vec<OnceLock<Tried<'a>>>,
}

impl<'a> Passing<'a> {
    pub(super) fn new(problem: &'a Problem<'a>, library: &Library) -> Self {
        let of = library.hypotheses.iter().map(|_| OnceLock::new());
        Passing {
            problem,
            of: of.collect(),
        }
    }

    fn of(&self, library: &Library, index: usize) -> &Tried<'a> {
        self.of[index].get_or_init(|| {
            let (slopes, sigmas) = columns(library, &library.hypotheses[index]);
            Tried::of(self.problem, &slopes, sigmas)
        })
    }
}

/// For each hypothesis that comes and goes the stretch of time in which it explains most of what a set leaves, if it is not
/// always there; its gain is then that of the stretch. One with variants has its onset among them.
pub(super) fn stretches(
    passing: &Passing,
    library: &Library,
    (set, best): (&[usize], &Refined),
    nothing: f64,
    gains: &mut [f64],
) -> Vec<Option<Interval>> {
    let problem = passing.problem;
    let residual = Residual::of(problem, &problem.residuals(&model_of(library, set, &best.thetas)));
    let least = LEAST_PART * (best.log_evidence - nothing);
    let starts_s = problem.twin.starts_s();
    let stretch = |(index, gain): (usize, &mut f64)| {
        let hypothesis = &library.hypotheses[index];
        let repeats = hypothesis.cause.effect.repeats(hypothesis.cause.variant);
        if !gain.is_finite() || !repeats && !is_once(hypothesis, starts_s) {
            return None;
        }
        let found = match repeats {
            true => {
                let (slopes, sigmas) = columns(library, hypothesis);
                again(problem, &residual, &slopes, &sigmas)
            }
            false => {
                let found = passing.of(library, index).stretch(problem, &residual);
                found.map(|(span, more)| (span.into(), more))
            }
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
    gains.par_iter_mut().enumerate().map(stretch).collect()
}

/// Lends the time in which a member is on, `when`, to each other hypothesis that comes and goes, has no stretch of its own and would gain by
/// it. A magnet that is brought and a current that is switched on are the same readings; only the searches for their instants differ.
pub(super) fn lent(
    passing: &Passing,
    library: &Library,
    (set, best): (&[usize], &Refined),
    when: Span,
    stretches: &mut [Option<Interval>],
    gains: &mut [f64],
) {
    let problem = passing.problem;
    let residual = Residual::of(problem, &problem.residuals(&model_of(library, set, &best.thetas)));
    let starts_s = problem.twin.starts_s();
    for (index, (gain, stretch)) in gains.iter_mut().zip(stretches).enumerate() {
        if !gain.is_finite() || stretch.is_some() || !is_once(&library.hypotheses[index], starts_s) {
            continue;
        }
        let more = passing.of(library, index).over_always(&residual, when);
        if let Some(more) = more.filter(|more| *more > 0.0) {
            *gain += more;
            *stretch = Some(when.into());
        }
    }
}

/// Whether a hypothesis may be on in one stretch of time. One with variants has its onset among them.
fn is_once(hypothesis: &Hypothesis, starts_s: &[f64]) -> bool {
    let effect = hypothesis.cause.effect;
    effect.page().passes && effect.variants(starts_s).len() <= 1
}

/// A hypothesis' columns and the prior sigmas of their parameters.
fn columns(library: &Library, hypothesis: &Hypothesis) -> (Vec<Entries>, Vec<f64>) {
    let places = hypothesis.places.iter();
    let sigmas = hypothesis.parameters.iter();
    (
        places.map(|place| library.products.column(*place)).collect(),
        sigmas.map(|parameter| parameter.prior_sigma).collect(),
    )
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
    let (_, sigmas) = columns(library, own);
    let residual = Residual::of(problem, &rest);
    let Some((span, _)) = Tried::of(problem, slopes, sigmas).stretch(problem, &residual) else {
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
