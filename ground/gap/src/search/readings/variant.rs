//! What of an effect is no parameter of the fit: its onset, or a limit or corner, moved to where it explains most.
//!
//! In: a set of hypotheses, refined. Out: the same set refined with another value, whose columns the library then has, or as
//! it was.

use nalgebra::DVector;

use super::columns::renew;
use crate::{
    library::hypotheses::Library,
    null::problem::Problem,
    search::{
        between::{climbed, half_ways},
        gauss_newton::{Refined, refine},
    },
};

/// Values tried by which two of an effect with values between them are apart at least: either may move some way to the other.
const APART: usize = 5;

/// Moves the variant of the member added last to where it explains most, if values between its variants are possible: a step
/// that is seconds off, or a limit that is a percent off, leaves more than most effects make.
pub(super) fn sharpened(problem: &Problem, library: &mut Library, set: &[usize], best: Refined) -> Refined {
    let Some(last) = set.last().copied() else {
        return best;
    };
    let Some(steps) = half_ways(&library.hypotheses[last], problem.twin.starts_s()) else {
        return best;
    };
    let variant = library.hypotheses[last].cause.variant;
    let (variant, best) = climbed(
        (variant, best),
        steps,
        |best| best.log_evidence,
        |tried, best| at_variant(problem, library, set, best, tried),
    );
    at_variant(problem, library, set, &best, variant)
}

/// Whether two hypotheses are one with values between the variants tried: a warm-up of 80 s and one of 160 s are both one of
/// 120 s, in two halves that the prior takes for smaller; and so are one of a gyro and one of all gyros.
fn is_same(problem: &Problem, library: &Library, member: usize, candidate: usize) -> bool {
    let [member, candidate] = [member, candidate].map(|index| &library.hypotheses[index].cause);
    let effect = member.effect;
    if !effect.has_values_between() || effect.page().name != candidate.effect.page().name {
        return false;
    }
    let unit = problem.twin.unit();
    let own = member.channels(unit);
    if candidate.channels(unit).iter().all(|channel| !own.contains(channel)) {
        return false;
    }
    let mut grid = effect.variants(problem.twin.starts_s());
    grid.sort_by(f64::total_cmp);
    let place = |variant: f64| grid.partition_point(|value| *value <= variant);
    place(member.variant).abs_diff(place(candidate.variant)) < APART
}

/// Whether a hypothesis is one of these.
pub(super) fn is_any_same(problem: &Problem, library: &Library, members: &[usize], candidate: usize) -> bool {
    members
        .iter()
        .any(|member| is_same(problem, library, *member, candidate))
}

/// A set refitted with the same course of its last member and without its physics, if the effect has such a one.
pub(super) fn without_its_physics(
    problem: &Problem,
    library: &mut Library,
    set: &[usize],
    thetas: &[DVector<f64>],
) -> Option<Refined> {
    let last = *set.last()?;
    let cause = &mut library.hypotheses[last].cause;
    let variant = cause.variant;
    cause.variant = cause.effect.without_its_physics(variant)?;
    renew(problem, library, set, thetas);
    let refined = refine(problem, library, set, thetas);
    library.hypotheses[last].cause.variant = variant;
    renew(problem, library, set, thetas);
    Some(refined)
}

/// A set refitted with another variant of its last member, whose columns are made anew.
fn at_variant(problem: &Problem, library: &mut Library, set: &[usize], best: &Refined, variant: f64) -> Refined {
    let last = set[set.len() - 1];
    library.hypotheses[last].cause.variant = variant;
    renew(problem, library, set, &best.thetas);
    refine(problem, library, set, &best.thetas)
}
