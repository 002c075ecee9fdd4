//! The search where the reference is not exact: in the colour of what is left, which is found with it.
//!
//! In: the problem, its library, how reference and field err slowly, and what a search beside white noise chose. Out: what the log speaks for in
//! the colour of what that choice leaves ([`crate::null::tint`]), and again in the colour of what this one leaves, until both are
//! the same effects, each as large as it likeliest is. The frames are then as they were.

use std::collections::BTreeSet;

use nalgebra::DVector;

use crate::{
    input::case::SlowErrors,
    library::hypotheses::Library,
    null::{
        model::Model,
        problem::{Frame, Problem},
        tint::tinted,
    },
    search::{
        gauss_newton::at_likeliest_size,
        readings::{Attribution, attribute},
    },
};

/// Searches: a colour that still held an effect is one without it in the second.
const SEARCHES: usize = 2;

/// Searches in colour, after `found` was chosen.
pub fn attribute_in_colour(
    problem: &mut Problem,
    library: &mut Library,
    errors: &SlowErrors,
    mut found: Attribution,
    progress: &dyn Fn(f64),
) -> Attribution {
    let frames = problem.frames.clone();
    for _ in 0..SEARCHES {
        let model = Model::around(problem, found.model(library));
        let in_colour = tinted(problem, &model, errors);
        reframe(problem, library, in_colour);
        let mut again = attribute(problem, library, progress);
        resize(problem, library, &mut again);
        reframe(problem, library, frames.clone());
        let is_same = effects(&again) == effects(&found);
        found = again;
        if is_same {
            break;
        }
    }
    found
}

/// Gives the chosen effects the parameters of their likeliest sizes.
fn resize(problem: &Problem, library: &Library, found: &mut Attribution) {
    let set: Vec<usize> = found.chosen.iter().map(|chosen| chosen.hypothesis).collect();
    let start: Vec<DVector<f64>> = found.chosen.iter().map(|chosen| chosen.theta.clone()).collect();
    let refined = at_likeliest_size(problem, library, &set, &start);
    let mut from = library.reference;
    for (chosen, theta) in found.chosen.iter_mut().zip(refined.thetas) {
        let width = theta.len();
        let own = refined.estimate.covariance.view((from, from), (width, width));
        (chosen.covariance, chosen.theta) = (own.into_owned(), theta);
        from += width;
    }
}

/// Takes other frames for the problem's.
pub fn reframe(problem: &mut Problem, library: &mut Library, frames: Vec<Frame>) {
    let before = problem.frames.clone();
    problem.reframe(frames);
    library.products.reframe(problem, &before);
}

fn effects(found: &Attribution) -> BTreeSet<usize> {
    found.chosen.iter().map(|chosen| chosen.hypothesis).collect()
}
