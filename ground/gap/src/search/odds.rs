//! How likely a chosen effect is among all that could stand in its place, by evidence alone.
//!
//! In: an [`Attribution`]. Out: probabilities of effects, and of "one of those that cannot be told apart". What the held-out
//! windows and what is left over say comes later, in [`crate::probability::doubt`].

use nalgebra::DVector;
use twin::effect::{Page, Parameter};

use crate::{
    library::hypotheses::Library,
    null::evidence::probabilities,
    search::readings::{Attribution, Chosen, Rival},
    thresholds::{LISTED, TEMPERATURE},
};

/// Largest parameter over the size beyond which it more likely stands for something else.
pub fn oversize(page: &Page, theta: &DVector<f64>, parameters: &[Parameter]) -> f64 {
    let sizes = theta
        .iter()
        .zip(parameters)
        .map(|(value, parameter)| value.abs() / parameter.prior_sigma);
    sizes.fold(0.0, f64::max) / page.largest
}

/// Probability of a chosen effect at any place, against all others and nothing. Beyond its largest size it is a
/// proxy for something else: evidence cannot tell, for the effect that is meant is in no list.
pub fn probability(library: &Library, chosen: &Chosen) -> f64 {
    let hypothesis = &library.hypotheses[chosen.hypothesis];
    let own: f64 = by_effect(library, &chosen.rivals)
        .into_iter()
        .filter(|(name, _)| *name == hypothesis.effect())
        .map(|(_, p)| p)
        .sum();
    own * itself(oversize(
        hypothesis.cause.effect.page(),
        &chosen.theta,
        &hypothesis.parameters,
    ))
}

/// Probability that a chosen effect or one of those it cannot be told from is there, whichever it is.
pub fn probability_of_any(library: &Library, chosen: &Chosen) -> f64 {
    let hypothesis = &library.hypotheses[chosen.hypothesis];
    let any: f64 = by_effect(library, &chosen.rivals).into_iter().map(|(_, p)| p).sum();
    any * itself(oversize(
        hypothesis.cause.effect.page(),
        &chosen.theta,
        &hypothesis.parameters,
    ))
}

/// Probability that an effect of so many times its largest size is itself and no proxy: at odds that fall with the fourth power,
/// for evidence has a price for sizes well below the largest. Of 14 names with a quarter to two thirds of it 13 were right, on
/// trials that were looked at (docs/gap/trials.md).
pub fn itself(excess: f64) -> f64 {
    1.0 / (1.0 + excess.powi(4))
}

/// Probabilities of the effects among rivals, places added up; what is missing from one is "nothing", or has no name.
pub fn by_effect(library: &Library, rivals: &[Rival]) -> Vec<(&'static str, f64)> {
    let mut gains: Vec<f64> = rivals.iter().map(Rival::in_its_place).collect();
    gains.push(0.0);
    let shares = probabilities(&gains, &vec![0.0; gains.len()], TEMPERATURE);
    let mut sums: Vec<(&'static str, f64)> = Vec::new();
    for (rival, share) in rivals.iter().zip(shares).filter(|(rival, _)| rival.is_named) {
        let name = library.hypotheses[rival.hypothesis].effect();
        match sums.iter_mut().find(|(known, _)| *known == name) {
            Some((_, sum)) => *sum += share,
            None => sums.push((name, share)),
        }
    }
    sums
}

/// Effects that are not causes, with the probability that one of the causes is really they, or, of a refused one, that it
/// is there after all.
pub fn alternatives(library: &Library, found: &Attribution, refused: &[Chosen]) -> Vec<(&'static str, f64)> {
    let name = |chosen: &Chosen| library.hypotheses[chosen.hypothesis].effect();
    let causes: Vec<&str> = found.chosen.iter().map(name).collect();
    let own = refused
        .iter()
        .map(|refused| (name(refused), probability(library, refused)));
    let rivals = found.chosen.iter().chain(refused).flat_map(|chosen| {
        let mut rivals = by_effect(library, &chosen.rivals);
        rivals.retain(|(rival, _)| *rival != name(chosen));
        rivals
    });
    let mut sums: Vec<(&'static str, f64)> = Vec::new();
    for (name, share) in own.chain(rivals) {
        if causes.contains(&name) || share < LISTED {
            continue;
        }
        match sums.iter_mut().find(|(known, _)| *known == name) {
            Some((_, most)) => *most = most.max(share),
            None => sums.push((name, share)),
        }
    }
    sums.sort_by(|one, other| other.1.total_cmp(&one.1));
    sums
}

/// What each effect gained alone at its best place, best first.
pub fn alone(library: &Library, found: &Attribution) -> Vec<(String, f64)> {
    let mut best: Vec<(String, f64)> = Vec::new();
    for (hypothesis, gain) in library.hypotheses.iter().zip(&found.alone) {
        if !gain.is_finite() {
            continue;
        }
        match best.iter_mut().find(|(name, _)| name == hypothesis.effect()) {
            Some((_, most)) => *most = most.max(*gain),
            None => best.push((hypothesis.effect().to_owned(), *gain)),
        }
    }
    best.sort_by(|one, other| other.1.total_cmp(&one.1));
    best
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 40 uT is what fields at two places of the Earth differ by.
    #[test]
    fn a_field_of_another_site_is_itself() {
        let effect = twin::effect::by_name("field-model").expect("in the library");
        let cause = twin::effect::Cause {
            effect,
            locality: twin::effect::Locality::Unit,
            variant: 0.0,
        };
        let parameters = cause.parameters(&twin::predict::emems(|_| 0.0));
        let size = oversize(effect.page(), &DVector::from_vec(vec![40.0, 0.0, 0.0]), &parameters);
        assert!(itself(size) > 0.8, "{size}");
    }

    #[test]
    fn what_is_beyond_its_largest_size_is_never_named() {
        assert!(itself(0.1) > 0.98);
        assert!(itself(1.02) < 0.5);
        assert!(itself(10.0) < 0.01);
    }
}
