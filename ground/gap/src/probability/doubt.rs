//! How far a name is believed: from the odds of its evidence to a probability.
//!
//! In: causes with the probability that their evidence gives them among their rivals, and what they leave. Out: the same
//! causes, believed less where something the library does not have could be like them. Five things speak for that: what
//! is left over, few nats, a size far below the strongest cause's, blocks that do not confirm it when they are left out, and
//! another strength on the held-out windows than on the fitted ones.

use crate::{
    holdout::{
        cross_validation::{self, Key},
        events::Events,
        fit_error::FitError,
        strength::{Claimed, Promise},
    },
    input::hold::Held,
    library::hypotheses::Library,
    null::{model::Model, problem::Problem},
    probability::cause::Cause,
    search::explanation::Explanation,
    thresholds::{DOUBT_STEP, DOUBTED, REMAINDER, UNKNOWN_PRIOR, UNLIKE, UNTOLD},
    unknown::adequacy::Leftover,
};

/// What is left over, and how much that says against names.
pub struct Belief {
    /// Probability that something outside the library is needed.
    pub unknown: f64,
    /// Probability that a name is not a stand-in for it.
    pub trust: f64,
}

impl Belief {
    /// From what is left over, the energy that was explained in squares of noise, and promises: what an effect explained
    /// and does not explain on the held-out windows is left over too.
    pub fn of(left: &Leftover, explained: f64, promises: &[Promised]) -> Self {
        let kept: f64 = promises.iter().map(|promised| 1.0 - promised.doubt()).product();
        let broken: f64 = promises.iter().map(Promised::broken).sum();
        let unknown = 1.0 - (1.0 - left.unknown(UNKNOWN_PRIOR)) * kept;
        let energy = left.energy() + broken;
        let unlike = energy / (energy + UNLIKE * explained).max(f64::MIN_POSITIVE);
        Self {
            unknown,
            trust: 1.0 - unknown * unlike,
        }
    }

    /// Weighs the probabilities of causes.
    pub fn weigh(&self, causes: &mut [Cause]) {
        let strongest = causes.iter().map(|cause| cause.gain).fold(0.0, f64::max);
        for cause in causes {
            let is_no_chance = 1.0 / (1.0 + ((DOUBTED - cause.gain) / DOUBT_STEP).exp());
            let is_no_remainder = if cause.gain < strongest {
                cause.gain / (cause.gain + REMAINDER * strongest)
            } else {
                1.0
            };
            cause.probability *= self.trust * is_no_chance * is_no_remainder;
        }
    }
}

/// What cross-validation says of the model's effects; the causes, which are those in their order, are believed no more.
pub fn second_keys(
    problem: &Problem,
    library: &Library,
    model: &Model,
    causes: &mut [Cause],
) -> Vec<(&'static str, Key)> {
    if causes.len() != model.components.len() {
        // They were withdrawn.
        return Vec::new();
    }
    let keys = cross_validation::keys(problem, library, model).into_iter();
    let said = keys.zip(causes).filter_map(|(key, cause)| {
        let key = key?;
        cause.probability = cause.probability.min(key.confidence());
        Some((cause.effect, key))
    });
    said.collect()
}

/// What the held-out windows say of an effect's strength.
#[derive(Clone, Debug)]
pub struct Promised {
    /// Its name.
    pub effect: &'static str,
    /// How strong it is there; `None` where it is not there at all.
    pub promise: Option<Promise>,
    /// How far that is what it promised on the fit windows, 0 to 1.
    pub confidence: f64,
    /// How far it was believed before.
    believed: f64,
    /// [nats] what it explained there.
    gain: f64,
}

impl Promised {
    /// Probability that something else was taken for it; an effect that was not believed was taken for nothing.
    fn doubt(&self) -> f64 {
        self.believed * (1.0 - self.confidence)
    }

    /// Energy that it explained and does not explain, in squares of noise. What is not there breaks no promise.
    fn broken(&self) -> f64 {
        match self.promise {
            Some(_) => 2.0 * self.gain.max(0.0) * self.doubt(),
            None => 0.0,
        }
    }
}

/// What the held-out windows say of each cause, which are the model's effects in their order; one that does not keep there
/// what it promised on the fit windows is believed less.
pub fn promises(
    held: &Held,
    problem: &Problem,
    library: &Library,
    explanation: &Explanation,
    events: Option<&Events>,
    causes: &mut [Cause],
) -> Vec<Promised> {
    let (model, chosen) = (&explanation.model, &explanation.found.chosen);
    if causes.len() != model.components.len() || chosen.len() != causes.len() {
        // They were withdrawn.
        return Vec::new();
    }
    let error = FitError::of(problem, model);
    let promised = |(index, cause): (usize, &mut Cause)| {
        let added = problem.added(&model.components, index);
        let open: Vec<_> = added.iter().map(|(channel, _)| problem.still_open(*channel)).collect();
        let hypothesis = &library.hypotheses[chosen[index].hypothesis];
        let promise = held.promise(Claimed {
            added: &added,
            open: &open,
            error: &error.with_value(problem, model, index, hypothesis),
            after: &model.predicted,
            sigmas: &problem.sigmas,
            louder: &explanation.louder,
            events,
        });
        let confidence = promise.map_or(UNTOLD, |promise| promise.confidence());
        let believed = cause.probability;
        cause.probability *= confidence;
        Promised {
            effect: cause.effect,
            promise,
            confidence,
            believed,
            gain: cause.gain,
        }
    };
    causes.iter_mut().enumerate().map(promised).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn left(p: f64) -> Leftover {
        Leftover {
            p,
            log_tail: p.ln(),
            aspects: Vec::new(),
            again: None,
            scale: [1.0, 1.0],
        }
    }

    #[test]
    fn a_small_misfit_of_a_large_effect_is_its_own_and_a_large_one_another_effect() {
        let of_a_large_effect = Belief::of(&left(1e-9), 1e6, &[]);
        let of_a_small_one = Belief::of(&left(1e-9), 3e2, &[]);
        assert!(of_a_large_effect.unknown > 0.99 && of_a_small_one.unknown > 0.99);
        assert!(of_a_large_effect.trust > 0.99, "{}", of_a_large_effect.trust);
        assert!(of_a_small_one.trust < 0.4, "{}", of_a_small_one.trust);
        assert!(Belief::of(&left(0.5), 1e3, &[]).trust > 0.94);
    }

    #[test]
    fn a_promise_that_one_cause_breaks_is_doubt_of_all() {
        let promised = |factor: f64| {
            let promise = Promise { factor, sigma: 0.05 };
            Promised {
                effect: "gyro-scale",
                promise: Some(promise),
                confidence: promise.confidence(),
                believed: 1.0,
                gain: 60.0,
            }
        };
        let kept = Belief::of(&left(0.5), 300.0, &[promised(1.1)]);
        assert!(
            kept.unknown < 0.06 && kept.trust > 0.94,
            "{} {}",
            kept.unknown,
            kept.trust
        );
        let hardly_believed = Promised {
            believed: 0.1,
            ..promised(-0.2)
        };
        let beside = Belief::of(&left(0.5), 300.0, &[promised(1.0), hardly_believed]);
        assert!(
            beside.unknown < 0.2 && beside.trust > 0.85,
            "{} {}",
            beside.unknown,
            beside.trust
        );
        let broken = Belief::of(&left(0.5), 300.0, &[promised(1.0), promised(-0.2)]);
        assert!(
            broken.unknown > 0.99 && broken.trust < 0.15,
            "{} {}",
            broken.unknown,
            broken.trust
        );
    }
}
