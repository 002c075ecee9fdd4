//! What is believed of an explanation: which of its effects are said to be causes, and what else may be there.
//!
//! In: an [`Explanation`] and what it leaves. Out: [`Believed`]: every effect weighed by evidence, cross-validation, the held-out
//! windows and what is left over, in this order ([`crate::probability::doubt`]).

use nalgebra::DVector;
use twin::effect::Texture;

use crate::{
    holdout::{cross_validation::Key, events::Events},
    input::case::Subject,
    library::hypotheses::Library,
    null::{model::Model, problem::Problem},
    probability::{
        cause::{Cause, cause_of_scatter, causes_of},
        contribution,
        doubt::{Belief, Promised, promises, second_keys},
    },
    search::{explanation::Explanation, odds::alternatives},
    thresholds::{NOISE_TAILS, SAID},
    unknown::{adequacy::Leftover, octaves},
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
        let keys = second_keys(problem, library, &explanation.model, &mut causes);
        let promises = promises(&subject.held, problem, library, explanation, events, &mut causes);
        let loud = loud(problem, explanation, floor);
        let belief = Belief::of(left, &loud, &promises);
        let scatter = explanation.scatter.as_ref();
        causes.extend(scatter.map(|scatter| {
            let sigmas = scatter.sigmas(problem, &explanation.beneath);
            cause_of_scatter(subject, scatter, &sigmas)
        }));
        // Of an effect on the scatter that takes in whatever is there its own gain is no sign of its law.
        let whole = explanation.energy(quiet);
        let is_scatter = |cause: &Cause| scatter.is_some_and(|scatter| scatter.effect.page().name == cause.effect);
        belief.weigh(
            &mut causes,
            |cause| if is_scatter(cause) { whole } else { 2.0 * cause.gain },
        );
        // One of a set that cannot be told apart is a cause with its own probability: that one of them is there is likelier
        // than not.
        let (causes, unnamed) = causes.into_iter().partition(|cause| cause.any() >= SAID);
        Believed {
            causes,
            unnamed,
            keys,
            promises,
            trust: match explanation.found.chosen.is_empty() {
                true => 1.0 - belief.unknown(),
                false => belief.trust(None, &(0..problem.frames.len()).collect::<Vec<_>>(), whole),
            },
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
