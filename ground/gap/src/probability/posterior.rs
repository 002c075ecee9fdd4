//! What is believed of an explanation: which of its effects are said to be causes, and what else may be there.
//!
//! In: an [`Explanation`] and what it leaves. Out: [`Believed`]: every effect weighed by evidence, cross-validation, the held-out
//! windows and what is left over, in this order ([`crate::probability::doubt`]).

use nalgebra::DVector;
use twin::effect::{Nature, Texture};

use crate::{
    holdout::{cross_validation::Key, events::Events},
    input::case::Subject,
    library::hypotheses::Library,
    null::{model::Model, problem::Problem},
    probability::{
        cause::{Cause, cause_of_scatter, causes_of},
        contribution,
        doubt::{Belief, Promised, against, beyond_reference, promises, second_keys},
        importance::Importance,
    },
    search::{explanation::Explanation, odds::alternatives, scatter::Scatter},
    thresholds::{NOISE_TAILS, SAID},
    unknown::{adequacy::Leftover, alike, octaves, remainder::Remainder},
};

/// An explanation with its probabilities.
pub struct Believed {
    /// Effects that are there, themselves or another of a set that cannot be told apart, likelier than not.
    pub causes: Vec<Cause>,
    /// Those that are less likely.
    pub unnamed: Vec<Cause>,
    /// What cross-validation says of the effects on readings.
    pub keys: Vec<(&'static str, Key)>,
    /// How strong they are on the held-out windows.
    pub promises: Vec<Promised>,
    /// Probability that a name that was not said is not a stand-in for it.
    trust: f64,
}

impl Believed {
    /// Weighs an explanation that leaves `left`; `quiet` is the model without effects, `floor` what a perfect one would leave.
    #[allow(clippy::too_many_arguments, reason = "everything that was found is weighed")]
    pub fn of(
        subject: &Subject,
        problem: &Problem,
        library: &Library,
        explanation: &Explanation,
        quiet: &Model,
        events: Option<&Events>,
        left: &Leftover,
        floor: &[Vec<f64>],
    ) -> Self {
        let mut causes = causes_of(problem, library, &explanation.found);
        contribution::settle(problem, library, &explanation.found, &mut causes);
        let mut imitated = contribution::imitated(problem, &explanation.model);
        imitated.truncate(causes.len());
        let is_any = !causes.is_empty() || explanation.is_followed();
        let importance = is_any.then(|| Importance::of(subject, problem, explanation, floor));
        let importance = importance.flatten();
        let beyond = beyond_reference(problem, &subject.slow, explanation, importance.as_ref(), &mut causes);
        let keys = second_keys(problem, library, &explanation.model, &mut causes);
        let promises = promises(subject, problem, library, explanation, events, &mut causes);
        let loud = loud(problem, explanation, floor);
        if let Some(importance) = &importance {
            (causes.iter_mut().zip(&importance.effects))
                .for_each(|(cause, weight)| cause.probability *= weight.counts());
        }
        let belief = Belief::of(left, importance.as_ref(), &loud, &promises);
        let (of_effects, of_walk) = explanation.share_with_walk();
        (causes.iter_mut().zip(of_effects)).for_each(|(cause, share)| cause.probability *= share);
        let scatter = explanation.scatter.as_ref();
        // A walk that is followed is a course, like an effect on readings.
        let beside_reference = causes.len() + usize::from(explanation.is_followed());
        causes.extend(scatter.map(|scatter| {
            let sigmas = scatter.sigmas(problem, &explanation.beneath);
            let mut cause = cause_of_scatter(subject, scatter, &sigmas);
            if is_of_the_description(subject, scatter) {
                cause.probability = 0.0;
            }
            cause
        }));
        if let (true, Some(walk)) = (explanation.is_followed(), causes.last_mut()) {
            let grows = importance.as_ref().is_some_and(|importance| importance.is_walk_seen);
            walk.probability *= if grows { of_walk } else { 0.0 };
        }
        // Of an effect on the scatter that takes in whatever is there its own gain is no sign of its law.
        let whole = explanation.energy(quiet);
        // What the effects on readings explain is no sign of another's either.
        let of_readings: f64 = causes.iter().take(imitated.len()).map(|cause| 2.0 * cause.gain).sum();
        let of_scatter = scatter.map(|scatter| match explanation.is_followed() {
            true => 2.0 * scatter.gain,
            false => (whole - of_readings).max(0.0),
        });
        let worth = beyond.into_iter().chain(std::iter::repeat(0.0));
        let explained = imitated.into_iter().zip(&causes).zip(worth);
        let explained = explained.map(|((whole, cause), nats)| whole.max(2.0 * cause.gain).max(2.0 * nats));
        let explained: Vec<f64> = explained.chain(of_scatter).collect();
        (causes.iter_mut().zip(&explained)).for_each(|(cause, explained)| cause.explained = *explained);
        belief.weigh(&mut causes, beside_reference);
        one_name(&mut causes);
        // One of a set that cannot be told apart is a cause with its own probability: that one of them is there is likelier
        // than not.
        let (causes, unnamed) = causes.into_iter().partition(|cause| cause.any() >= SAID);
        let trust = match explanation.found.chosen.is_empty() {
            true => 1.0 - belief.unknown(),
            false => belief.trust(None, &(0..problem.frames.len()).collect::<Vec<_>>(), whole),
        };
        Believed {
            causes,
            unnamed,
            keys,
            promises,
            trust,
        }
    }

    /// Holds the slow course that is left beneath the names alone, `left_beneath` them, against those in whose channels it is: effects that are
    /// too unlikely to be said took their part of it when the names were weighed, as the energy of any course was. A name that falls leaves
    /// more beneath the others, so until none does. Returns what is left then.
    pub fn held_against(&mut self, left_beneath: impl Fn(&[Cause]) -> Remainder) -> Remainder {
        let first: Vec<f64> = self.causes.iter().map(|cause| cause.probability).collect();
        let mut weighed: Vec<(Cause, f64)> = std::mem::take(&mut self.causes).into_iter().zip(first).collect();
        loop {
            let said: Vec<Cause> = weighed.iter().map(|(cause, _)| cause.clone()).collect();
            let left = left_beneath(&said);
            let on_readings = weighed.iter_mut().filter(|(cause, _)| !is_on_scatter(cause));
            for (cause, first) in on_readings {
                if left.is_slow && cause.channels.iter().any(|channel| left.channels.contains(channel)) {
                    let doubt = left.matters * against(2.0 * left.log_bayes_factor, cause.explained);
                    cause.probability = cause.probability.min(*first * (1.0 - doubt));
                }
            }
            let (kept, fallen): (Vec<_>, Vec<_>) = weighed.into_iter().partition(|(cause, _)| cause.any() >= SAID);
            weighed = kept;
            if fallen.is_empty() {
                self.causes = weighed.into_iter().map(|(cause, _)| cause).collect();
                return left;
            }
            self.unnamed.extend(fallen.into_iter().map(|(cause, _)| cause));
        }
    }

    /// Probability that none of those that are not likely enough to be said is there.
    pub fn none_is_there(&self) -> f64 {
        let is_not = |cause: &Cause| 1.0 - cause.any().min(1.0);
        self.unnamed.iter().map(is_not).product()
    }

    /// Effects that are not said, with their probabilities, most first.
    pub fn alternatives(&self, library: &Library, explanation: &Explanation) -> Vec<(&'static str, f64)> {
        let rivals = alternatives(library, &explanation.found, &explanation.refused).into_iter();
        let mut all: Vec<_> = rivals
            .map(|(name, probability)| (name, probability * self.trust))
            .chain(self.unnamed.iter().map(|cause| (cause.effect, cause.probability)))
            .collect();
        all.sort_by(|one, other| other.1.total_cmp(&one.1));
        all.dedup_by_key(|(name, _)| *name);
        all
    }
}

/// Whether a cause is on the scatter: it has no course of its own law that one that is left could belie.
fn is_on_scatter(cause: &Cause) -> bool {
    twin::effect::by_name(cause.effect).is_some_and(|effect| effect.page().nature == Nature::Spread)
}

/// Parts of one effect at several places with channels in common, such as what all plates share and what each has of its own, are
/// fitted together and mean nothing alone ([`Problem::parts`] says the same of a model): if one of them is likely enough to be said, all have its probability. One effect
/// twice at one place is two events, of which each is there or not.
fn one_name(causes: &mut [Cause]) {
    let said: Vec<Cause> = causes
        .iter()
        .filter(|cause| cause.probability >= SAID)
        .cloned()
        .collect();
    for cause in causes {
        let is_whole = |other: &&Cause| {
            let shares_channels = other.channels.iter().any(|channel| cause.channels.contains(channel));
            other.effect == cause.effect && other.locality != cause.locality && shares_channels
        };
        let whole = said.iter().filter(is_whole).map(|other| other.probability);
        cause.probability = whole.fold(cause.probability, f64::max);
    }
}

/// Per channel, energy that an explanation leaves standing out in some octave of a flat floor, in squares of noise; none where it says
/// how the scatter is coloured. Louder noise is as flat as noise.
fn loud(problem: &Problem, explanation: &Explanation, floor: &[Vec<f64>]) -> Vec<f64> {
    let scatter = explanation.scatter.as_ref();
    let coloured = scatter.filter(|scatter| scatter.effect.page().texture != Texture::Louder);
    let coloured = coloured.map_or(&[][..], |scatter| &scatter.channels);
    let of_channel = |(channel, rest): (usize, &DVector<f64>)| {
        let rows = &problem.frames[channel].series.rows;
        let mean = rows.iter().map(|row| floor[channel][*row as usize]).sum::<f64>() / rows.len().max(1) as f64;
        match coloured.contains(&channel) {
            true => 0.0,
            false => octaves::excess((rest / mean.sqrt()).as_slice(), 1.0, NOISE_TAILS).energy,
        }
    };
    let rests = explanation.model.fitted.rest.iter().enumerate();
    rests.map(of_channel).collect()
}

/// Whether it is noise that is described too quiet in all sensors of a kind, beside a reference that is not exact either.
fn is_of_the_description(subject: &Subject, scatter: &Scatter) -> bool {
    let louder = (scatter.channels.iter().zip(&scatter.thetas)).map(|(channel, theta)| (*channel, theta[0].exp()));
    subject.slow.attitude_sigma_rad > 0.0
        && scatter.effect.page().texture == Texture::Louder
        && alike::is_described_too_quiet(&subject.twin.unit().channels, &louder.collect::<Vec<_>>())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cause(effect: &'static str, locality: &str, channels: &[usize], probability: f64) -> Cause {
        Cause {
            effect,
            locality: locality.to_owned(),
            channels: channels.to_vec(),
            probability,
            of_any: 1.0,
            gain: 0.0,
            explained: 0.0,
            parameters: Vec::new(),
            share: 0.0,
            when: String::new(),
            which: None,
            confirm_by: "",
            physics: "",
            is_suspicious: false,
        }
    }

    #[test]
    fn parts_of_one_effect_have_one_probability_and_what_stands_for_itself_keeps_its_own() {
        let mut causes = [
            cause("hard-iron", "common", &[0, 1, 2, 3], 0.15),
            cause("hard-iron", "all", &[3, 4], 0.97),
            cause("hard-iron", "plate 4", &[8, 9], 0.2),
            cause("soft-iron", "common", &[3, 4], 0.3),
            // Two events, and two parts of which none is likely.
            cause("packet-loss", "unit", &[0, 1], 0.9),
            cause("packet-loss", "unit", &[0, 1], 0.4),
            cause("gyro-bias", "common", &[5, 6], 0.3),
            cause("gyro-bias", "all", &[5, 6], 0.4),
        ];
        one_name(&mut causes);
        let probabilities = causes.map(|cause| cause.probability);
        assert_eq!(probabilities, [0.97, 0.97, 0.2, 0.3, 0.9, 0.4, 0.3, 0.4]);
    }

    /// What is slow and left in a channel takes a name there, then what that leaves takes the next; one elsewhere and one on the scatter stay.
    #[test]
    fn what_is_left_beneath_the_names_takes_those_that_it_belies_one_by_one() {
        let explains = |effect, channels: &[usize], explained| Cause {
            explained,
            ..cause(effect, "all", channels, 0.9)
        };
        let believed = || Believed {
            causes: vec![
                explains("mag-set-reset", &[6], 200.0),
                explains("hard-iron", &[6, 7], 20_000.0),
                explains("gyro-bias", &[3], 200.0),
                explains("gyro-bias-walk", &[6], 200.0),
            ],
            unnamed: Vec::new(),
            keys: Vec::new(),
            promises: Vec::new(),
            trust: 1.0,
        };
        let left = |nats: f64, matters: f64, is_slow: bool| {
            let mut left = Remainder::default();
            (left.log_bayes_factor, left.matters, left.is_slow) = (nats, matters, is_slow);
            left.channels = vec![6];
            left
        };
        let names = |own: &[Cause]| own.iter().map(|cause| cause.effect).collect::<Vec<_>>();
        let held = |beneath: &dyn Fn(&[Cause]) -> Remainder| {
            let mut own = believed();
            own.held_against(beneath);
            (names(&own.causes), names(&own.unnamed))
        };
        let all = ["mag-set-reset", "hard-iron", "gyro-bias", "gyro-bias-walk"];
        assert_eq!(held(&|_| left(60.0, 1.0, true)), (all[1..].to_vec(), vec![all[0]]));
        let grows = |said: &[Cause]| left(if said.len() == 4 { 60.0 } else { 6000.0 }, 1.0, true);
        assert_eq!(held(&grows), (all[2..].to_vec(), all[..2].to_vec()));
        // Energy of any course belies no law, nor does what does not matter.
        assert_eq!(held(&|_| left(6000.0, 1.0, false)), (all.to_vec(), Vec::new()));
        assert_eq!(held(&|_| left(6000.0, 0.0, true)), (all.to_vec(), Vec::new()));
    }
}
