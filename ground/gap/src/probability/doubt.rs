//! How far a name is believed: from the odds of its evidence to a probability.
//!
//! In: causes with the probability that their evidence gives them among their rivals, and what they leave. Out: the same
//! causes, believed less where something the library does not have could be like them. Six things speak for that: what
//! is left over in a cause's own channels, few nats, a size far below the strongest cause's, blocks that do not confirm it when they are
//! left out, another strength on the held-out windows than on the fitted ones, and that the reference or the field may be off by as much.
//!
//! What is left over speaks against a name by its significance, not by whether it matters: a stand-in that explains a part `r^2` of the
//! energy of what is really there leaves `1 - r^2` of it, however small that is. So the probability that there is something else is
//! weighed with what is left over what the cause explained, in the channels of the cause: energy that stands out in some octave, or
//! that of the surest aspect of what is left, whichever is more. Whether it matters decides the alarm ([`super::outcome`]) and nothing here.

use twin::effect::Texture;

use crate::{
    holdout::{
        cross_validation::{self, Key},
        events::Events,
        fit_error::FitError,
        strength::{Claimed, Promise},
    },
    input::case::{SlowErrors, Subject},
    library::hypotheses::Library,
    null::{beyond::Beyond, model::Model, problem::Problem},
    probability::{
        cause::Cause,
        importance::{Course, Importance},
    },
    search::explanation::Explanation,
    thresholds::{DOUBT_STEP, DOUBTED, REMAINDER, SAID, STRENGTH_SHOWN, UNKNOWN_PRIOR, UNLIKE},
    unknown::adequacy::Leftover,
};

/// What is left over, and how much that says against names.
pub struct Belief<'a> {
    left: &'a Leftover,
    /// What is left beside what a reference that is not exact errs by; `None` where it is exact.
    importance: Option<&'a Importance>,
    /// Per channel, energy that stands out in some octave, in squares of noise.
    loud: &'a [f64],
    promises: &'a [Promised],
}

impl<'a> Belief<'a> {
    /// From what is left over, where it is loud, and promises: what an effect explained and does not explain on the held-out windows is
    /// left over too.
    pub fn of(
        left: &'a Leftover,
        importance: Option<&'a Importance>,
        loud: &'a [f64],
        promises: &'a [Promised],
    ) -> Self {
        Self {
            left,
            importance,
            loud,
            promises,
        }
    }

    /// Probability that every promise in some channels was kept, and the energy of those that were not. What an effect does not keep in
    /// the accelerometers says nothing of another in the gyros.
    fn kept(&self, channels: &[usize]) -> (f64, f64) {
        let is_there = |promised: &&Promised| promised.channels.iter().any(|channel| channels.contains(channel));
        let there = || self.promises.iter().filter(is_there);
        (
            there().map(|promised| 1.0 - promised.doubt()).product(),
            there().map(Promised::broken).sum(),
        )
    }

    /// Probability that something outside the library is needed.
    pub fn unknown(&self) -> f64 {
        let kept: f64 = self.promises.iter().map(|promised| 1.0 - promised.doubt()).product();
        1.0 - (1.0 - self.left.unknown(UNKNOWN_PRIOR)) * kept
    }

    /// Probability that an effect, which explains so much energy in these channels, is no stand-in for something else; of an explanation as
    /// a whole where none is given, whose effects answer for their own laws.
    pub fn trust(&self, effect: Option<&str>, channels: &[usize], explained: f64) -> f64 {
        let left = self.left.against(effect, channels);
        let loud: f64 = channels.iter().map(|channel| self.loud[*channel]).sum();
        let (kept, broken) = self.kept(channels);
        let unknown = 1.0 - (1.0 - left.unknown(UNKNOWN_PRIOR)) * kept;
        let energy = left.energy().max(loud) + broken;
        1.0 - unknown * against(energy, explained)
    }

    /// The same of an effect on readings where the reference is not exact. Everything is significant there, for no real recording is
    /// without small errors of its own. So what speaks is a slow course that matters, by the evidence that says what the effect is worth; and
    /// what is left that is fast, of which no reference that errs slowly is the cause. That says nothing of the effect's law: the name has the
    /// part that it explains of both.
    fn trust_beside_reference(&self, importance: &Importance, channels: &[usize], explained: f64) -> f64 {
        let (kept, broken) = self.kept(channels);
        let is_there = |course: &&Course| course.channels.iter().any(|channel| channels.contains(channel));
        let fast: f64 = channels.iter().map(|channel| importance.fast[*channel]).sum();
        let of_both = 1.0 - fast / (explained + fast).max(f64::MIN_POSITIVE);
        let doubt = |matters: f64, nats: f64| {
            let unknown = 1.0 - (1.0 - matters) * kept;
            let energy = 2.0 * nats.max(0.0) + broken;
            unknown * against(energy, explained)
        };
        let doubts = importance
            .courses
            .iter()
            .filter(is_there)
            .map(|course| doubt(course.matters, course.nats));
        of_both * (1.0 - doubts.fold(doubt(0.0, 0.0), f64::max))
    }

    /// Weighs the probabilities of causes, of which the first `beside_reference` are effects on readings, or a walk that is followed as such.
    pub fn weigh(&self, causes: &mut [Cause], beside_reference: usize) {
        let strongest = causes.iter().map(|cause| cause.gain).fold(0.0, f64::max);
        let everywhere: Vec<usize> = (0..self.loud.len()).collect();
        for (index, cause) in causes.iter_mut().enumerate() {
            let explained = cause.explained;
            let trust = match self.importance.filter(|_| index < beside_reference) {
                Some(importance) => self.trust_beside_reference(importance, &cause.channels, explained),
                // What shakes some sensors shakes the unit, and answers for all of it.
                None if is_line(cause) => self.trust(Some(cause.effect), &everywhere, explained),
                None => self.trust(Some(cause.effect), &cause.channels, explained),
            };
            let is_no_chance = above_doubt(cause.gain);
            let is_no_remainder = if cause.gain < strongest {
                cause.gain / (cause.gain + REMAINDER * strongest)
            } else {
                1.0
            };
            cause.probability *= trust * is_no_chance * is_no_remainder;
        }
    }
}

/// Believes causes less, which are the model's effects in their order, that may be an error of the reference or the field. Returns what each
/// is worth \[nats\] beyond that, sample by sample or in means over short stretches, whichever shows more; none where the reference is
/// exact.
pub fn beyond_reference(
    problem: &Problem,
    errors: &SlowErrors,
    explanation: &Explanation,
    importance: Option<&Importance>,
    causes: &mut [Cause],
) -> Vec<f64> {
    let model = &explanation.model;
    if causes.is_empty() || causes.len() != model.components.len() {
        // They were withdrawn.
        return Vec::new();
    }
    let Some(beyond) = Beyond::of(problem, errors) else {
        return Vec::new();
    };
    let weighed = causes.iter_mut().enumerate().map(|(index, cause)| {
        let slow = importance.map_or(0.0, |importance| importance.effects[index].worth);
        let nats = beyond.nats(&model.components, index).max(slow);
        cause.probability *= above_doubt(nats);
        nats
    });
    weighed.collect()
}

/// How far energy that is left speaks against an effect that explains so much, 0 to 1: the odds of a stand-in to a law that is a little off.
pub fn against(left: f64, explained: f64) -> f64 {
    let left = left.max(0.0);
    left / (left + UNLIKE * explained).max(f64::MIN_POSITIVE)
}

/// Whether a cause is something that shakes.
fn is_line(cause: &Cause) -> bool {
    twin::effect::by_name(cause.effect).is_some_and(|effect| effect.page().texture == Texture::Line)
}

/// How far so many nats are no chance.
fn above_doubt(nats: f64) -> f64 {
    1.0 / (1.0 + ((DOUBTED - nats) / DOUBT_STEP).exp())
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
    /// Where it is.
    channels: Vec<usize>,
    /// How strong it is there; `None` where it is not there at all.
    pub promise: Option<Promise>,
    /// How far that is what it promised on the fit windows, 0 to 1.
    pub confidence: f64,
    /// How far it was believed before.
    believed: f64,
    /// \[nats\] what it explained there.
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

/// \[s\] over which samples are averaged where the reference errs: its fastest errors, up to the 20 Hz that it is used for, have four periods in
/// it, and a hand's motion of 1 Hz keeps 94 % of its size (`sin(x)/x` at a fifth of a period).
const MEAN_S: f64 = 0.2;

/// What the held-out windows say of each cause, which are the model's effects in their order; one that does not keep there
/// what it promised on the fit windows is believed less.
///
/// What a reference errs by fast is in the law of a delay or a lever arm too, which are derivatives of its motion: noise in a regressor, by which a
/// true effect seems weaker the slower the windows are (Fuller 1987, section 1.1). So means over [`MEAN_S`] are compared where they show the effect.
pub fn promises(
    subject: &Subject,
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
    let starts_s = problem.twin.starts_s();
    let stretches: Vec<usize> = starts_s.iter().map(|t_s| (t_s / MEAN_S).max(0.0) as usize).collect();
    let is_inexact = subject.slow.attitude_sigma_rad > 0.0;
    let promised = |(index, cause): (usize, &mut Cause)| {
        let added = problem.added(&model.components, &[index]);
        let open: Vec<_> = added.iter().map(|(channel, _)| problem.still_open(*channel)).collect();
        let hypothesis = &library.hypotheses[chosen[index].hypothesis];
        let error = error.with_value(problem, model, index, hypothesis);
        let promise_in = |stretches: Option<&[usize]>| {
            subject.held.promise(Claimed {
                added: &added,
                open: &open,
                error: &error,
                after: &model.predicted,
                sigmas: &problem.sigmas,
                louder: &explanation.louder,
                events,
                stretches,
            })
        };
        let in_means = is_inexact.then(|| promise_in(Some(&stretches))).flatten();
        let is_shown = |promise: &Promise| promise.sigma <= STRENGTH_SHOWN;
        let promise = in_means.filter(is_shown).or_else(|| promise_in(None));
        let confidence = promise.map_or(SAID, |promise| promise.confidence());
        let believed = cause.probability;
        cause.probability *= confidence;
        Promised {
            effect: cause.effect,
            channels: cause.channels.clone(),
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
    use crate::unknown::adequacy::Aspect;

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
        let surely = left(1e-9);
        let belief = Belief::of(&surely, None, &[0.0; 2], &[]);
        assert!(belief.unknown() > 0.99);
        let of_a_large_effect = belief.trust(Some("gyro-scale"), &[0], 1e6);
        let of_a_small_one = belief.trust(Some("gyro-scale"), &[0], 3e2);
        assert!(of_a_large_effect > 0.99, "{of_a_large_effect}");
        assert!(of_a_small_one < 0.4, "{of_a_small_one}");
        let hardly = left(0.5);
        assert!(Belief::of(&hardly, None, &[0.0; 2], &[]).trust(Some("gyro-scale"), &[0], 1e3) > 0.94);
    }

    fn aspect(channels: &[usize], effect: Option<&str>, size: f64) -> Aspect {
        Aspect {
            what: String::new(),
            channels: channels.to_vec(),
            effect: effect.map(str::to_owned),
            size,
        }
    }

    #[test]
    fn what_is_left_speaks_against_an_effect_in_its_channels_and_of_its_law_only() {
        let surely = |aspects: Vec<Aspect>| Leftover {
            aspects,
            scale: [3.0, 0.4],
            ..left(1e-9)
        };
        let trust = |left: &Leftover, channel: usize| {
            Belief::of(left, None, &[0.0; 2], &[]).trust(Some("gyro-scale"), &[channel], 1e2)
        };
        let in_another = surely(vec![aspect(&[0], None, 12.0)]);
        assert!(trust(&in_another, 0) < 0.2 && trust(&in_another, 1) > 0.94);
        let of_another = surely(vec![aspect(&[0, 1], Some("lever-arm"), 12.0)]);
        assert!(trust(&of_another, 0) > 0.94);
        let of_its_law = surely(vec![aspect(&[0, 1], Some("gyro-scale"), 12.0)]);
        assert!(trust(&of_its_law, 0) < 0.2);
        let less = surely(vec![aspect(&[0], None, 12.0), aspect(&[1], None, 6.0)]);
        assert!(trust(&less, 0) < trust(&less, 1) && trust(&less, 1) < 0.5);
    }

    #[test]
    fn beside_a_reference_that_errs_slow_courses_speak_against_a_name_and_what_is_merely_significant_does_not() {
        let surely = left(1e-9);
        let trust = |channel: usize, matters: f64, fast: f64| {
            let importance = Importance {
                courses: vec![Course {
                    channels: vec![channel],
                    nats: 40.0,
                    matters,
                }],
                fast: vec![fast, 0.0],
                effects: Vec::new(),
                is_walk_seen: false,
            };
            Belief::of(&surely, Some(&importance), &[0.0; 2], &[]).trust_beside_reference(&importance, &[0], 100.0)
        };
        assert!(trust(0, 0.01, 0.0) > 0.99 && trust(1, 0.99, 0.0) > 0.99);
        assert!(trust(0, 0.99, 0.0) < 0.1, "{}", trust(0, 0.99, 0.0));
        // What is fast is of something else, however well a small effect is seen beside it.
        assert!(trust(1, 0.99, 900.0) < 0.11);
        let hardly = Belief::of(&surely, None, &[0.0; 2], &[]).trust(Some("gyro-scale"), &[0], 100.0);
        assert!(hardly < 0.15, "{hardly}");
    }

    #[test]
    fn a_stand_in_that_leaves_a_tenth_of_what_it_explains_is_not_believed_however_little_that_is() {
        let barely = Leftover {
            aspects: vec![aspect(&[0], None, 5.0)],
            ..left(1e-4)
        };
        let trust = |loud: f64| Belief::of(&barely, None, &[loud, 0.0], &[]).trust(Some("current-field"), &[0], 2e3);
        assert!(
            trust(0.0) > 0.8 && trust(200.0) < 0.4,
            "{} {}",
            trust(0.0),
            trust(200.0)
        );
    }

    #[test]
    fn a_promise_that_one_cause_breaks_is_doubt_of_all_in_its_channels() {
        let promised = |factor: f64| {
            let promise = Promise { factor, sigma: 0.05 };
            Promised {
                effect: "gyro-scale",
                channels: vec![0, 1],
                promise: Some(promise),
                confidence: promise.confidence(),
                believed: 1.0,
                gain: 60.0,
            }
        };
        let hardly = left(0.5);
        let judged = |promises: &[Promised]| {
            let belief = Belief::of(&hardly, None, &[0.0; 2], promises);
            (belief.unknown(), belief.trust(Some("gyro-scale"), &[0], 300.0))
        };
        let (unknown, trust) = judged(&[promised(1.1)]);
        assert!(unknown < 0.06 && trust > 0.94, "{unknown} {trust}");
        let hardly_believed = Promised {
            believed: 0.1,
            ..promised(-0.2)
        };
        let (unknown, trust) = judged(&[promised(1.0), hardly_believed]);
        assert!(unknown < 0.2 && trust > 0.85, "{unknown} {trust}");
        let (unknown, trust) = judged(&[promised(1.0), promised(-0.2)]);
        assert!(unknown > 0.99 && trust < 0.15, "{unknown} {trust}");
        let elsewhere = Promised {
            channels: vec![1],
            ..promised(-0.2)
        };
        let (unknown, trust) = judged(&[promised(1.0), elsewhere]);
        assert!(unknown > 0.99 && trust > 0.94, "{unknown} {trust}");
    }
}
