//! Which effects a log speaks for: forward search over the library, each candidate refitted exactly, and pruned back.
//!
//! In: the [`Problem`] and its [`Library`]. Out: an [`Attribution`]: the chosen effects with parameters and covariance, and
//! for each its rivals with their evidence, "nothing" among them.
//!
//! A screen of all hypotheses costs matrices only ([`crate::null::evidence`]); the best few are then fitted by Gauss-Newton,
//! because a latency of 12 ms is not small for a gyro on a table that starts and stops. An effect is added when its
//! evidence, after the price of its prior odds, is above nothing by [`effect_margin`] nats; each chosen one is then tried against
//! all rivals in its place, and dropped if the rest can do without it. An effect that comes and goes is screened with the
//! stretch of time in which it explains most (`intervals`): one that is on for a quarter of the log looks like a step of
//! another if it has to be on throughout.

mod alike;
mod chosen;
mod columns;
mod intervals;
mod rivals;
mod screen;
mod variant;

use nalgebra::{DMatrix, DVector};
use twin::predict::Memory;

pub use self::{
    chosen::{Chosen, Rival, total_gain},
    screen::are_physical,
};
use self::{
    columns::{always, renew},
    intervals::{Passing, bounded, fitted, stretches, taken},
    rivals::{Found, compare},
    screen::{CANDIDATES, gains, is_physical, leading},
    variant::is_any_same,
};
use crate::{
    library::hypotheses::Library,
    null::problem::{Component, Problem},
    search::gauss_newton::{Refined, model_of, refine},
    thresholds::{MOST_EFFECTS, effect_margin},
};

/// Rounds in which effects without parameters (signs, orders, ranges) are tried: they are gross, so they come first.
const DISCRETE_ROUNDS: usize = 2;

/// What a log speaks for.
#[derive(Clone, Debug)]
pub struct Attribution {
    /// Strongest first.
    pub chosen: Vec<Chosen>,
    /// Scores of the whole library's columns about the chosen model.
    pub scores: Vec<f64>,
    /// Gains of every hypothesis on its own, over nothing, in nats with prior odds: what the first screen said.
    pub alone: Vec<f64>,
}

impl Attribution {
    /// The chosen effects as a model.
    pub fn model(&self, library: &Library) -> Vec<Component> {
        self.chosen
            .iter()
            .map(|chosen| library.hypotheses[chosen.hypothesis].component(&chosen.theta))
            .collect()
    }
}

/// Searches.
pub fn attribute(problem: &Problem, library: &mut Library, progress: &dyn Fn(f64)) -> Attribution {
    // A search before this one may have left stretches of time behind.
    for hypothesis in 0..library.hypotheses.len() {
        if library.hypotheses[hypothesis].span.is_some() {
            always(problem, library, hypothesis);
        }
    }
    let passing = Passing::new(problem, library);
    let mut set: Vec<usize> = Vec::new();
    let mut best = refine(problem, library, &set, &[]);
    let nothing = best.log_evidence;
    let mut scores = renewed_scores(problem, library, &set, &best);
    let mut alone = Vec::new();
    for round in 0..MOST_EFFECTS {
        progress(round as f64 / MOST_EFFECTS as f64);
        let mut gains = gains(problem, library, &scores, &set);
        let stretches = stretches(&passing, library, (&set, &best), nothing, &mut gains);
        if round < DISCRETE_ROUNDS {
            add_discrete(problem, library, &set, &best, &mut gains);
        }
        if round == 0 {
            alone = gains.clone();
        }
        let is_contested = stretches.iter().any(Option::is_some);
        let mut found: Option<(f64, Vec<usize>)> = None;
        let candidates = leading(&gains, CANDIDATES);
        for (at, candidate) in candidates.iter().copied().enumerate() {
            let mut larger = set.clone();
            larger.push(candidate);
            let refined = fitted(
                problem,
                library,
                &larger,
                &best.thetas,
                stretches[candidate],
                is_contested && !is_any_same(problem, library, &candidates[..at], candidate),
            );
            let gain = refined.log_evidence - best.log_evidence + library.hypotheses[candidate].log_prior;
            if is_physical(library, &larger, &refined) && found.as_ref().is_none_or(|(most, _)| gain > *most) {
                found = Some((gain, larger));
            }
        }
        match found {
            Some((gain, larger)) if gain > effect_margin() => {
                let span = larger.last().and_then(|added| stretches[*added]);
                best = taken(problem, library, &larger, &best.thetas, span);
                set = larger;
                best = bounded(problem, library, &set, best);
                (set, best) = prune(problem, library, set, best);
                scores = renewed_scores(problem, library, &set, &best);
            }
            _ => break,
        }
    }
    let compared = |library: &mut Library, scores: &[f64], set: &[usize], best: &Refined| -> Vec<Chosen> {
        let beside = gains(problem, library, scores, set);
        let found = Found {
            set,
            best,
            scores,
            beside: &beside,
            nothing,
        };
        (0..set.len())
            .map(|at| compare(&passing, library, &found, at))
            .collect()
    };
    let mut chosen = compared(library, &scores, &set, &best);
    // A rival that does better in the place of a chosen one takes it; the comparison is then made anew.
    for _ in 0..MOST_EFFECTS {
        let swap = chosen.iter().enumerate().find(|(at, chosen)| {
            chosen
                .rivals
                .first()
                .is_some_and(|rival| rival.hypothesis != set[*at] && rival.gain > chosen.gain)
        });
        let Some((at, winner)) = swap.map(|(at, chosen)| (at, chosen.rivals[0].clone())) else {
            break;
        };
        always(problem, library, set.remove(at));
        set.push(winner.hypothesis);
        let mut start = best.thetas.clone();
        start.remove(at);
        // A fit of a large effect that begins at zero may end beside the best: this one begins where the comparison ended.
        if winner.span.is_none() && !winner.theta.is_empty() {
            start.push(winner.theta);
            renew(problem, library, &set, &start);
        }
        best = taken(problem, library, &set, &start, winner.span);
        scores = renewed_scores(problem, library, &set, &best);
        chosen = compared(library, &scores, &set, &best);
    }
    chosen.sort_by(|one, other| other.gain.total_cmp(&one.gain));
    Attribution { chosen, scores, alone }
}

/// Exact gains of the effects that are there or not, into a screen's; a little less than a fit of their parameters gives.
fn add_discrete(problem: &Problem, library: &Library, set: &[usize], best: &Refined, gains: &mut [f64]) {
    let model = model_of(library, set, &best.thetas);
    let unit = problem.twin.unit();
    let energy = |channel: usize, model: &[Component], memory: &mut Memory| {
        let residual = problem.residual_with(channel, model, memory);
        problem.frames[channel]
            .normal(&DMatrix::zeros(residual.len(), 0), &residual)
            .energy
    };
    let mut memory = Memory::default();
    let before: Vec<f64> = (0..unit.channels.len())
        .map(|channel| energy(channel, &model, &mut memory))
        .collect();
    let is_tried = |index: &usize| library.is_discrete(*index) && !set.contains(index);
    let mut tried: Vec<usize> = (0..library.hypotheses.len()).filter(is_tried).collect();
    // One value of all places after the other: what sensors feel through a filter that has been left on is then filtered once, and kept
    // no longer than it is needed.
    let variant = |index: &usize| library.hypotheses[*index].cause.variant;
    tried.sort_by(|one, other| variant(one).total_cmp(&variant(other)));
    let mut latest = f64::NAN;
    for index in tried {
        let hypothesis = &library.hypotheses[index];
        if variant(&index) != latest {
            (memory, latest) = (Memory::default(), variant(&index));
        }
        let mut with = model.clone();
        with.push(hypothesis.component(&DVector::zeros(hypothesis.parameters.len())));
        let touched = hypothesis.cause.channels(unit);
        // No effect takes off more than there is above the noise: of a gross one that is not there the first channel says so.
        let above = |channel: usize| before[channel] - problem.frames[channel].series.rows.len() as f64;
        let mut possible: f64 = touched.iter().map(|channel| above(*channel)).sum();
        let mut fall = 0.0;
        let mut channels = touched.into_iter();
        while 0.5 * possible + hypothesis.log_prior >= 0.0
            && let Some(channel) = channels.next()
        {
            let own = before[channel] - energy(channel, &with, &mut memory);
            possible += own - above(channel);
            fall += own;
        }
        if 0.5 * possible + hypothesis.log_prior < 0.0 {
            continue;
        }
        gains[index] = 0.5 * fall + hypothesis.log_prior;
    }
}

/// Scores of every column about a refined set, whose own columns are renewed in place; its parameters count from zero.
fn renewed_scores(problem: &Problem, library: &mut Library, set: &[usize], refined: &Refined) -> Vec<f64> {
    let model = model_of(library, set, &refined.thetas);
    let mut residuals = problem.residuals(&model);
    let mut slopes = refined.slopes.iter().skip(library.reference);
    for (hypothesis, theta) in set.iter().zip(&refined.thetas) {
        for (place, value) in library.hypotheses[*hypothesis].places.iter().zip(theta.iter()) {
            let Some(slope) = slopes.next() else { continue };
            slope
                .iter()
                .for_each(|(channel, values)| residuals[*channel].axpy(*value, values, 1.0));
            library.products.renew(problem, *place, slope.clone());
        }
    }
    library.products.scores(problem, &residuals)
}

/// Drops members the others can do without.
fn prune(problem: &Problem, library: &mut Library, set: Vec<usize>, best: Refined) -> (Vec<usize>, Refined) {
    let (mut set, mut best) = (set, best);
    let mut at = 0;
    while at < set.len() && set.len() > 1 {
        let (mut smaller, mut thetas) = (set.clone(), best.thetas.clone());
        let dropped = smaller.remove(at);
        thetas.remove(at);
        let refined = refine(problem, library, &smaller, &thetas);
        if best.log_evidence - refined.log_evidence + library.hypotheses[dropped].log_prior < 0.0 {
            always(problem, library, dropped);
            (set, best) = (smaller, refined);
            at = 0;
        } else {
            at += 1;
        }
    }
    (set, best)
}
