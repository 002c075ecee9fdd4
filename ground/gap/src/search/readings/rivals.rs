//! A chosen effect against all that could stand in its place.
//!
//! In: a refined set and one of its members. Out: the member as [`Chosen`], with its [`Rival`]s.

use super::{
    chosen::{Chosen, Rival},
    intervals::{Passing, fitted, lent, stretches},
    screen::{CANDIDATES, gains, is_physical, leading},
    variant::{is_any_same, without_its_physics},
};
use crate::{
    library::hypotheses::Library,
    search::gauss_newton::{Refined, refine},
};

/// \[nats\] behind the chosen effect from which a rival is not worth an exact fit, where the screen is right.
const FAR: f64 = 50.0;

/// One member against all that could stand in its place; `nothing` is the evidence of a set without members.
pub(super) fn compare(
    passing: &Passing,
    library: &mut Library,
    scores: &[f64],
    set: &[usize],
    best: &Refined,
    nothing: f64,
    at: usize,
) -> Chosen {
    let problem = passing.problem;
    let (mut others, mut thetas) = (set.to_vec(), best.thetas.clone());
    let own = others.remove(at);
    thetas.remove(at);
    let without = refine(problem, library, &others, &thetas);
    let own_gain = best.log_evidence - without.log_evidence + library.hypotheses[own].log_prior;
    let mut rivals = vec![Rival {
        hypothesis: own,
        gain: own_gain,
        span: library.hypotheses[own].span,
        is_named: true,
    }];
    let last = [others.as_slice(), &[own]].concat();
    let about = [thetas.as_slice(), &best.thetas[at..=at]].concat();
    if let Some(refined) = without_its_physics(problem, library, &last, &about) {
        let gain = refined.log_evidence - without.log_evidence + library.hypotheses[own].log_prior;
        rivals.push(Rival {
            gain,
            is_named: false,
            ..rivals[0]
        });
    }
    let mut linear = gains(problem, library, scores, &others);
    let by_screen = std::mem::replace(&mut linear[own], f64::NEG_INFINITY);
    // The screen takes effects for linear: of accelerometers that were 1.55 ms late it had 3,065 of the 3,276 nats of `read-skew`, and 3,013 of
    // those of `accel-latency`, as many. So a rival may gain twice what the chosen effect gains by its exact fit. Of an effect that is there or not
    // the screen says nothing.
    let error = Some((own_gain - by_screen).abs()).filter(|error| error.is_finite());
    let far = own_gain - FAR - 2.0 * error.unwrap_or(0.0);
    let mut stretches = stretches(passing, library, (&others, &without), nothing, &mut linear);
    if let Some(when) = library.hypotheses[own].once(problem.twin.starts_s()) {
        lent(passing, library, (&others, &without), when, &mut stretches, &mut linear);
    }
    let is_contested = library.hypotheses[own].span.is_some() || stretches.iter().any(Option::is_some);
    let candidates = leading(&linear, CANDIDATES);
    for (number, rival) in candidates.iter().copied().enumerate() {
        let with_gain = |gain: f64| Rival {
            hypothesis: rival,
            gain,
            span: stretches[rival],
            is_named: true,
        };
        // Of values with others between them one that is as good as it gets is enough.
        let is_moved = is_contested && !is_any_same(problem, library, &candidates[..number], rival);
        // A step some seconds off its instant explains less than half of what it would.
        let is_settled = !is_moved
            || library.hypotheses[rival]
                .values_between(problem.twin.starts_s())
                .is_none();
        if is_settled && linear[rival] < far {
            rivals.push(with_gain(linear[rival]));
            continue;
        }
        let mut tried = others.clone();
        tried.push(rival);
        let refined = fitted(problem, library, &tried, &thetas, stretches[rival], is_moved);
        if is_physical(library, &tried, &refined) {
            let gain = refined.log_evidence - without.log_evidence + library.hypotheses[rival].log_prior;
            rivals.push(with_gain(gain));
        }
    }
    rivals.sort_by(|one, other| other.gain.total_cmp(&one.gain));
    let from = library.reference
        + set[..at]
            .iter()
            .map(|h| library.hypotheses[*h].parameters.len())
            .sum::<usize>();
    let width = best.thetas[at].len();
    Chosen {
        hypothesis: own,
        theta: best.thetas[at].clone(),
        covariance: best.estimate.covariance.view((from, from), (width, width)).into_owned(),
        gain: own_gain,
        rivals,
    }
}
