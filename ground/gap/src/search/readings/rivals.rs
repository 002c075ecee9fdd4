//! A chosen effect against all that could stand in its place.
//!
//! In: a refined set and one of its members. Out: the member as [`Chosen`], with its [`Rival`]s.

use nalgebra::DVector;

use super::{
    alike::{at_zero, most_alike},
    chosen::{Chosen, Rival},
    columns::{always, renew},
    intervals::{Passing, fitted, lent, stretches},
    screen::{CANDIDATES, gains, is_physical, leading},
    variant::{is_any_same, without_its_physics},
};
use crate::{
    library::hypotheses::Library,
    null::problem::Problem,
    search::gauss_newton::{Refined, refine},
};

/// \[nats\] behind the chosen effect from which a rival is not worth an exact fit, where the screen is right.
const FAR: f64 = 50.0;

/// \[nats\] within which two effects explain a log alike, by convention: odds of 1.6, and less than the nat for which a fit takes new slopes
/// ([`crate::search::gauss_newton`]).
const SAME: f64 = 0.5;

/// A set, and what is known about it.
pub(super) struct Found<'a> {
    /// Its hypotheses.
    pub set: &'a [usize],
    /// It, refined.
    pub best: &'a Refined,
    /// Scores of all columns about it.
    pub scores: &'a [f64],
    /// \[nats\] that each hypothesis would gain beside all of it, by the screen.
    pub beside: &'a [f64],
    /// Evidence of a set without members.
    pub nothing: f64,
}

/// One member against all that could stand in its place.
pub(super) fn compare(passing: &Passing, library: &mut Library, found: &Found, at: usize) -> Chosen {
    let problem = passing.problem;
    let Found {
        set,
        best,
        scores,
        beside,
        nothing,
    } = *found;
    let (mut others, mut thetas) = (set.to_vec(), best.thetas.clone());
    let own = others.remove(at);
    thetas.remove(at);
    let without = refine(problem, library, &others, &thetas);
    let own_gain = best.log_evidence - without.log_evidence + library.hypotheses[own].log_prior;
    let mut rivals = vec![Rival {
        hypothesis: own,
        theta: best.thetas[at].clone(),
        gain: own_gain,
        beside: f64::NEG_INFINITY,
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
            ..rivals[0].clone()
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
    let mut candidates = leading(&linear, CANDIDATES);
    let mut begins = vec![None; candidates.len()];
    if let Some(small) = at_zero(problem, library, &last, best, &about, FAR) {
        let is_new = |index: usize| linear[index].is_finite() && !candidates.contains(&index);
        for (alike, begin) in most_alike(library, small, &best.thetas[at], is_new, CANDIDATES) {
            candidates.push(alike);
            begins.push(Some(begin));
        }
    }
    for (number, (rival, begin)) in candidates.iter().copied().zip(begins).enumerate() {
        let with = |theta: DVector<f64>, gain: f64| Rival {
            hypothesis: rival,
            theta,
            gain,
            beside: beside[rival],
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
        if begin.is_none() && is_settled && linear[rival] < far {
            rivals.push(with(DVector::zeros(0), linear[rival]));
            continue;
        }
        let mut tried = others.clone();
        tried.push(rival);
        let refined = match begin {
            Some(begin) => begun(problem, library, &tried, &[thetas.as_slice(), &[begin]].concat()),
            None => fitted(problem, library, &tried, &thetas, stretches[rival], is_moved),
        };
        if is_physical(library, &tried, &refined) {
            // Prior odds count the places where an effect may be. They decide nothing between two effects that explain the log alike.
            let is_same = (refined.log_evidence - best.log_evidence).abs() < SAME;
            let prior = library.hypotheses[if is_same { own } else { rival }].log_prior;
            let theta = refined.thetas[others.len()].clone();
            rivals.push(with(theta, refined.log_evidence - without.log_evidence + prior));
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

/// A set fitted from `start`, with the columns that its last member has there. The library is left as it was.
fn begun(problem: &Problem, library: &mut Library, set: &[usize], start: &[DVector<f64>]) -> Refined {
    renew(problem, library, set, start);
    let refined = refine(problem, library, set, start);
    always(problem, library, set[set.len() - 1]);
    refined
}
