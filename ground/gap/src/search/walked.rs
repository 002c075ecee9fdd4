//! A walk of gyros' zeros against the effects that a search found without one.
//!
//! In: the problem, its library, and what a search chose. Out: [`Walked`], a walk and what there is besides once it is open, both searched
//! until they stay what they are; where the reference is not exact in the colour of what that choice leaves, and then [`Contest`]. A supply that
//! sags or a part that warms up has the course of many a walk: what is nearly as likely as the other is not to be told from it by this log,
//! and has its part of the probability. A walk that is large enough takes in whatever is slow, so effects are held against it with the
//! smaller walk that they leave.

use nalgebra::DVector;

use crate::{
    input::case::SlowErrors,
    library::hypotheses::Library,
    null::{
        misfit::{self, weighed},
        model::Model,
        problem::{Frame, Problem},
        tint::tinted,
    },
    search::{
        bias_walk::Walk,
        gauss_newton::refine,
        in_colour::reframe,
        readings::{Attribution, Chosen, attribute, total_gain},
        scatter::Scatter,
    },
    thresholds::TEMPERATURE,
};

/// Searches beside a walk until it stays what it is.
const WALKS: usize = 4;

/// A walk and what else there is.
pub struct Walked {
    /// The walk.
    pub walk: Walk,
    /// What was found once it is open.
    pub found: Attribution,
    /// The library as that search left it.
    pub library: Library,
}

impl Walked {
    /// \[nats\] of all of it.
    pub fn gain(&self) -> f64 {
        self.walk.gain + total_gain(&self.found.chosen)
    }
}

/// A walk against effects on readings.
pub struct Contest {
    /// \[nats\] by which the walk, with what there is besides, is likelier.
    pub odds: f64,
    /// Hypotheses that are there beside the walk too.
    shared: Vec<usize>,
}

impl Contest {
    /// Probability that it is the walk.
    pub fn walk(&self) -> f64 {
        1.0 / (1.0 + (-self.odds / TEMPERATURE).exp())
    }

    /// Probability that a hypothesis is there as far as the walk does not take its place.
    pub fn share(&self, hypothesis: usize) -> f64 {
        if self.shared.contains(&hypothesis) {
            1.0
        } else {
            1.0 - self.walk()
        }
    }
}

/// Of noise that is white, louder by what `first` leaves of channels that do not walk; `None` where there is no walk.
pub fn walked(
    problem: &mut Problem,
    library: &Library,
    first: &Model,
    withheld: &[String],
    progress: &dyn Fn(f64),
) -> Option<Walked> {
    let described = problem.frames.clone();
    let misfits = misfit::factors(&first.fitted.rest);
    let beside = |walk: &Walk| {
        let walking = walk.places();
        let factors = misfits.iter().enumerate();
        let factors: Vec<f64> = factors
            .map(|(channel, misfit)| if walking.contains(&channel) { 1.0 } else { *misfit })
            .collect();
        weighed(described.clone(), &factors)
    };
    settled(problem, library, withheld, &beside, progress)
}

/// In the colour of what was found without it, on readings and on the scatter, and against that.
pub fn walked_in_colour(
    problem: &mut Problem,
    library: &Library,
    errors: &SlowErrors,
    found: &Attribution,
    scatter: Option<&Scatter>,
    withheld: &[String],
    progress: &dyn Fn(f64),
) -> Option<(Walked, Contest)> {
    let plain = problem.frames.clone();
    let model = Model::around(problem, found.model(library));
    let in_colour = tinted(problem, &model, errors);
    let mut library = library.clone();
    reframe(problem, &mut library, in_colour.clone());
    let walked = settled(problem, &library, withheld, &|_| in_colour.clone(), progress);
    let Some(mut walked) = walked else {
        problem.reframe(plain);
        return None;
    };
    let smaller = Walk::beside(problem, &found.model(&library), withheld).map_or(0.0, |walk| walk.gain);
    let on_scatter = scatter.map_or(0.0, |scatter| scatter.gain);
    // What was found beside the walk may be there without it too, and have escaped the search.
    let effects = evidence(problem, &library, &found.chosen) + smaller + on_scatter;
    let without = effects.max(evidence(problem, &library, &walked.found.chosen) + on_scatter);
    let alone = walked.walk.alone(problem);
    let open = walked.walk.open(problem, in_colour.clone());
    reframe(problem, &mut walked.library, open);
    let beside = evidence(problem, &walked.library, &walked.found.chosen);
    reframe(problem, &mut walked.library, plain);
    let contest = Contest {
        odds: alone + beside - without,
        shared: (walked.found.chosen.iter()).map(|chosen| chosen.hypothesis).collect(),
    };
    Some((walked, contest))
}

/// \[nats\] of effects together in the problem's frames, over none of them.
fn evidence(problem: &Problem, library: &Library, chosen: &[Chosen]) -> f64 {
    let set: Vec<usize> = chosen.iter().map(|chosen| chosen.hypothesis).collect();
    let start: Vec<DVector<f64>> = chosen.iter().map(|chosen| chosen.theta.clone()).collect();
    let prior: f64 = set
        .iter()
        .map(|hypothesis| library.hypotheses[*hypothesis].log_prior)
        .sum();
    let [with, without] = [(&set[..], &start[..]), (&[], &[])].map(|(set, start)| refine(problem, library, set, start));
    with.log_evidence - without.log_evidence + prior
}

/// A walk, and what is found with it open in such frames, until both stay what they are.
fn settled(
    problem: &mut Problem,
    library: &Library,
    withheld: &[String],
    beside: &dyn Fn(&Walk) -> Vec<Frame>,
    progress: &dyn Fn(f64),
) -> Option<Walked> {
    let mut walk = Walk::beside(problem, &[], withheld)?;
    let mut library = library.clone();
    let described = problem.frames.clone();
    for _ in 0..WALKS {
        let frames = walk.open(problem, beside(&walk));
        reframe(problem, &mut library, frames);
        let found = attribute(problem, &mut library, progress);
        reframe(problem, &mut library, described.clone());
        let again = Walk::beside(problem, &found.model(&library), withheld)?;
        let is_same = again.is_near(&walk);
        walk = again;
        if is_same {
            return (walk.is_one(problem, &found.model(&library))).then_some(Walked { walk, found, library });
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_as_likely_as_a_walk_has_half_and_what_is_there_beside_it_all() {
        let contest = |odds: f64| Contest { odds, shared: vec![3] };
        assert!((contest(0.0).share(7) - 0.5).abs() < 1e-12);
        assert!(contest(20.0).share(7) < 0.01 && contest(20.0).walk() > 0.99);
        assert!(contest(-20.0).share(7) > 0.99 && contest(-20.0).walk() < 0.01);
        assert!((contest(20.0).share(3) - 1.0).abs() < 1e-12);
    }
}
