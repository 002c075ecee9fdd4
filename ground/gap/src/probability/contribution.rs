//! What each of several effects contributes, where they overlap: shares of the excess that add up.
//!
//! In: the chosen effects. Out: an energy for each, the Shapley value ([`crate::unknown::shapley`]) of what every set of
//! them takes off the excess when it is fitted alone with the calibration. They add up to what all take off together.

use crate::{
    library::hypotheses::Library,
    null::{
        model::Model,
        problem::{Component, Problem},
    },
    probability::cause::Cause,
    search::{
        gauss_newton::{model_of, refine},
        readings::{Attribution, Chosen},
    },
    thresholds::LEAST_PART,
    unknown::shapley,
};

/// Effects for which every set is fitted: 32 fits.
const MOST: usize = 5;

/// Replaces the causes' energies by their contributions. The causes are the chosen effects, in their order; one alone keeps
/// its own.
pub fn settle(problem: &Problem, library: &Library, found: &Attribution, causes: &mut [Cause]) {
    let chosen = &found.chosen;
    if chosen.len() < 2 || chosen.len() > MOST || causes.len() != chosen.len() {
        return;
    }
    let left = |set: u32| {
        let members: Vec<&Chosen> = (0..chosen.len())
            .filter(|at| set >> at & 1 == 1)
            .map(|at| &chosen[at])
            .collect();
        let hypotheses: Vec<usize> = members.iter().map(|chosen| chosen.hypothesis).collect();
        let start: Vec<_> = members.iter().map(|chosen| chosen.theta.clone()).collect();
        let refined = refine(problem, library, &hypotheses, &start);
        Model::around(problem, model_of(library, &hypotheses, &refined.thetas)).left()
    };
    let energies = shapley::shares(chosen.len(), |set| -left(set));
    causes
        .iter_mut()
        .zip(energies)
        .for_each(|(cause, energy)| cause.share = energy.max(0.0));
}

/// Per effect of a model, in squares of noise: the energy that it takes off the residual of the unit as described, if its evidence is
/// how far it strains the calibration; 0 if its evidence is a course that no calibration has.
///
/// Evidence counts only what the calibration cannot take up at its sigmas: ten sigmas of a zero are worth fifty nats. But an unknown effect
/// for which the iron stood in would be in the readings as a whole. So what is left is held against the whole that the iron explains,
/// which may be a thousand times more. That does not go for an effect that is known by its course. An unknown course has a mean too, and
/// any zero takes that up. So what is left of the course is held against the course alone.
pub fn imitated(problem: &Problem, model: &Model) -> Vec<f64> {
    let nominal = |components: &[Component]| -> f64 {
        let residuals = problem.residuals(components);
        residuals.iter().map(|residual| residual.norm_squared()).sum()
    };
    let calibrated = |model: &Model| -> [f64; 2] {
        let course = model.energies().into_iter().sum();
        [course, model.left() - course]
    };
    let (whole, [course, strain]) = (nominal(&model.components), calibrated(model));
    let of = |index: usize| {
        let mut others = model.components.clone();
        others.remove(index);
        let fall = nominal(&others) - whole;
        let [of_course, of_strain] = calibrated(&Model::around(problem, others));
        let is_imitated = of_course - course < LEAST_PART * fall && of_course - course < of_strain - strain;
        if is_imitated { fall } else { 0.0 }
    };
    (0..model.components.len()).map(of).collect()
}
