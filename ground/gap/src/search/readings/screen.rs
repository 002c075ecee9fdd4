//! The screen of all hypotheses: what each would add to a set, by matrices only.
//!
//! In: the library with its columns and their scores about a refined set. Out: gains in nats, and the hypotheses that lead.

use std::{iter::once, ops::Range};

use rayon::prelude::*;
use twin::effect::Parameter;

use super::variant::is_any_same;
use crate::{
    library::hypotheses::{Hypothesis, Library},
    null::problem::Problem,
    search::gauss_newton::Refined,
};

/// Candidates of a screen that are fitted exactly.
pub(super) const CANDIDATES: usize = 4;

/// Indices of the largest values, largest first.
pub(super) fn leading(values: &[f64], count: usize) -> Vec<usize> {
    let mut order: Vec<usize> = (0..values.len()).filter(|index| values[*index].is_finite()).collect();
    order.sort_by(|one, other| values[*other].total_cmp(&values[*one]));
    order.truncate(count);
    order
}

/// Columns of a set in the library, the reference's first, and no column twice; and which of them are each member's.
fn places(library: &Library, set: &[usize]) -> (Vec<usize>, Vec<Range<usize>>) {
    let mut places: Vec<usize> = (0..library.reference).collect();
    let part = |hypothesis: &usize| {
        let from = places.len();
        for place in &library.hypotheses[*hypothesis].places {
            if !places.contains(place) {
                places.push(*place);
            }
        }
        from..places.len()
    };
    let parts = set.iter().map(part).collect();
    (places, parts)
}

/// Gain of adding each hypothesis to a set, prior odds included; one that adds no column, or that the set has with another
/// value, gains nothing.
pub(super) fn gains(problem: &Problem, library: &Library, scores: &[f64], set: &[usize]) -> Vec<f64> {
    let (known, parts) = places(library, set);
    let mut base = library.screen(&known, scores);
    base.settle(parts);
    let before = base.log_evidence().unwrap_or(f64::NEG_INFINITY);
    let gain = |(index, hypothesis): (usize, &Hypothesis)| {
        let own = hypothesis.small();
        let is_new = !own.is_empty() && own.iter().all(|place| !known.contains(place));
        if !is_new || set.contains(&index) || is_any_same(problem, library, set, index) {
            return f64::NEG_INFINITY;
        }
        let all: Vec<usize> = known.iter().chain(own).copied().collect();
        let mut larger = library.screen(&all, scores);
        larger.prior_sigmas[..known.len()].copy_from_slice(&base.prior_sigmas);
        let of_other_sizes = larger.settle(once(known.len()..all.len()));
        let after = larger.log_evidence().unwrap_or(f64::NEG_INFINITY);
        after + of_other_sizes - before + hypothesis.log_prior
    };
    library.hypotheses.par_iter().enumerate().map(gain).collect()
}

/// Whether parameters of a set that cannot be negative are not.
pub(super) fn is_physical(library: &Library, set: &[usize], refined: &Refined) -> bool {
    let sigmas = refined.estimate.covariance.diagonal().map(f64::sqrt);
    let mut sigmas = sigmas.iter().skip(library.reference);
    set.iter().zip(&refined.thetas).all(|(hypothesis, theta)| {
        are_physical(
            &library.hypotheses[*hypothesis].parameters,
            theta.iter().zip(&mut sigmas),
        )
    })
}

/// Whether parameters that cannot be negative are not, beyond twice their sigma: of values and sigmas.
pub fn are_physical<'a>(parameters: &[Parameter], found: impl Iterator<Item = (&'a f64, &'a f64)>) -> bool {
    let mut found = parameters.iter().zip(found);
    found.all(|(parameter, (value, sigma))| parameter.signed || *value > -2.0 * sigma)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_has_one_sign_is_not_of_the_other_beyond_its_error() {
        let of = |signed: bool, value: f64| {
            let parameter = Parameter {
                name: "tau".to_owned(),
                unit: "s",
                prior_sigma: 0.02,
                signed,
            };
            are_physical(&[parameter], once((&value, &1e-3)))
        };
        assert!(of(false, 1.0) && of(false, -1.9e-3) && !of(false, -2.1e-3));
        assert!(of(true, -1.0));
    }
}
