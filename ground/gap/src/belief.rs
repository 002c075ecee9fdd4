//! How far a name is believed: from the odds of its evidence to a probability.
//!
//! In: causes with the probability that their evidence gives them among their rivals, and what they leave. Out: the same
//! causes, believed less where something the library does not have could be like them. Four things speak for that: what
//! is left over, few nats, a size far below the strongest cause's, and windows that do not confirm it.

use crate::{
    cause::Cause,
    crossval::{self, Key},
    leftover::Leftover,
    library::Library,
    model::Model,
    problem::Problem,
};

/// Prior probability that a unit has something the library does not.
const UNKNOWN_PRIOR: f64 = 0.05;

/// [nats] at which a name is as likely wrong as right, and the step that multiplies the odds by e: what no effect of the
/// library describes looks a little like one of them. The wrong names of the dealt cases (TRIALS.md) had 8 to 26 nats; an
/// effect of marginal signal-to-noise ratio 8 has 32 before its prior odds.
const DOUBTED: f64 = 20.0;
const DOUBT_STEP: f64 = 4.0;

/// Energy that is left over that explained at which a name is as likely wrong as right. An effect that differs a little
/// from its law leaves less than a part in a hundred; another effect's law, which happens to be like it, leaves more.
const UNLIKE: f64 = 0.02;

/// Gain over that of the strongest effect at which a second one is as likely what the first one's law leaves over.
const REMAINDER: f64 = 0.005;

/// What is left over, and how much that says against names.
pub struct Belief {
    /// Probability that something outside the library is needed.
    pub unknown: f64,
    /// Probability that a name is not a stand-in for it.
    pub trust: f64,
}

impl Belief {
    /// From what is left over, and the energy that was explained in squares of noise.
    pub fn of(left: &Leftover, explained: f64) -> Self {
        let unknown = left.unknown(UNKNOWN_PRIOR);
        let unlike = left.energy() / (left.energy() + UNLIKE * explained).max(f64::MIN_POSITIVE);
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
    let keys = crossval::keys(problem, library, model).into_iter();
    let said = keys.zip(causes).filter_map(|(key, cause)| {
        let key = key?;
        cause.probability = cause.probability.min(key.confidence());
        Some((cause.effect, key))
    });
    said.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn left(p: f64) -> Leftover {
        Leftover {
            p,
            log_tail: p.ln(),
            aspects: Vec::new(),
            scale: [1.0, 1.0],
        }
    }

    #[test]
    fn a_small_misfit_of_a_large_effect_is_its_own_and_a_large_one_another_effect() {
        let of_a_large_effect = Belief::of(&left(1e-9), 1e6);
        let of_a_small_one = Belief::of(&left(1e-9), 1e3);
        assert!(of_a_large_effect.unknown > 0.99 && of_a_small_one.unknown > 0.99);
        assert!(of_a_large_effect.trust > 0.99, "{}", of_a_large_effect.trust);
        assert!(of_a_small_one.trust < 0.4, "{}", of_a_small_one.trust);
        assert!(Belief::of(&left(0.5), 1e3).trust > 0.94);
    }
}
