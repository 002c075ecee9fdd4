//! Which effects are named, and how far each is believed.
//!
//! In: logs. Out: [`Found`]. Effects are sought twice ([`crate::together::sought`]). A name is believed less
//! - where the held-out windows of the logs without a reference, summed, find it otherwise strong; one of the second look alone must be shown by them,
//!   and not be refuted by the first look;
//! - not at all where the logs contradict each other about its parameters: then it is no property of the unit, or one log has something else.

use nalgebra::DVector;

use crate::{
    holdout::strength::Promise,
    input::case::CaseError,
    null::problem::Component,
    parity::{
        findings::{confidence, is_unexplained},
        name::{By, Fitted},
        smoothed::Strength,
    },
    probability::outcome::Outcome,
    thresholds::{LISTED, SAID, UNKNOWN_PRIOR},
    together::{
        cause::Cause,
        heard::{Heard, Look, Looked},
        joint::Joint,
        log::Logged,
        shown::{Coded, Visible, coded, visible},
        sought::search,
    },
};

/// Everything that is said.
pub struct Found {
    /// Whether each log's motion is known or was followed.
    pub followed: Vec<bool>,
    /// \[sigma\] of each log, before and after.
    pub gaps: Vec<[f64; 2]>,
    /// What can be seen.
    pub visible: Vec<Visible>,
    /// By codes.
    pub coded: Vec<Coded>,
    /// Named, likeliest first.
    pub causes: Vec<Cause>,
    /// Those about which logs contradict each other.
    pub contradicted: Vec<Cause>,
    /// Other effects with their probabilities.
    pub alternatives: Vec<(&'static str, f64)>,
    /// Probability that something is there that is not named.
    pub none_of_these: f64,
    /// What it comes to.
    pub outcome: Outcome,
}

impl Found {
    /// Of logs of one unit.
    ///
    /// # Errors
    /// When the unit's description names an effect there is not.
    pub fn of(logs: &[Logged], withheld: &[String], progress: &dyn Fn(&'static str, f64)) -> Result<Self, CaseError> {
        let first = search(logs, Look::First, withheld, &[], &|share| progress("first", share))?;
        let mut followed = Vec::new();
        for log in logs {
            followed.push(log.is_followed(&|share| progress("motion", share))?);
        }
        let settles = |(log, is_followed): (&Logged, &bool)| !log.has_reference() && *is_followed;
        let named = model_of(&first.causes);
        let mut causes = first.causes.clone();
        let (mut rivals, mut second) = (first.rivals.clone(), None);
        // What is found beside something about which logs contradict each other was not found.
        if logs.iter().zip(&followed).any(settles) && !first.causes.iter().any(Cause::is_contradicted) {
            let about = search(logs, Look::Second, withheld, &named, &|share| progress("second", share))?;
            rivals.extend(about.rivals.iter().copied());
            causes.extend(about.causes.iter().cloned());
            second = Some(about);
        }
        let after = match causes.is_empty() {
            true => first.quiet.clone(),
            false => left_by(logs, withheld, &model_of(&causes), &|share| progress("left", share))?,
        };
        let doubts = weigh(logs, &first.quiet, &after, &mut causes, &|share| {
            progress("held out", share)
        })?;
        let (contradicted, mut causes): (Vec<Cause>, Vec<Cause>) = causes.into_iter().partition(Cause::is_contradicted);
        rivals.extend(causes.iter().map(|cause| (cause.effect, cause.probability)));
        let mut is_believed = true;
        causes.retain(|cause| {
            // What is found beside something that is not there was not found.
            is_believed &= cause.probability >= SAID;
            is_believed
        });
        let coded = coded(logs);
        let is_named =
            |name: &str| causes.iter().any(|own| own.effect == name) || coded.iter().any(|own| own.effect == name);
        rivals.retain(|(name, probability)| *probability >= LISTED && !is_named(name));
        rivals.sort_by(|one, other| other.1.total_cmp(&one.1));
        let mut alternatives: Vec<(&'static str, f64)> = Vec::new();
        for rival in rivals {
            if alternatives.iter().all(|(name, _)| *name != rival.0) {
                alternatives.push(rival);
            }
        }
        let is_left = !contradicted.is_empty() || after.iter().any(|heard| is_unexplained(&heard.left));
        let none_of_these = if is_left {
            1.0 - UNKNOWN_PRIOR
        } else {
            UNKNOWN_PRIOR.max(doubts.0)
        };
        let gaps = first.quiet.iter().zip(&after);
        Ok(Self {
            followed,
            gaps: gaps.map(|(before, after)| [before.left.gap, after.left.gap]).collect(),
            visible: visible(&first, second.as_ref(), logs),
            outcome: Outcome::of(
                causes.len() + coded.len(),
                none_of_these.max(doubts.1),
                none_of_these,
                false,
            ),
            coded,
            causes,
            contradicted,
            alternatives,
            none_of_these,
        })
    }
}

fn model_of(causes: &[Cause]) -> Vec<Component> {
    causes.iter().map(|cause| cause.fitted.0.clone()).collect()
}

/// What each log keeps by the first look once a model is in.
fn left_by(
    logs: &[Logged],
    withheld: &[String],
    model: &[Component],
    progress: &dyn Fn(f64),
) -> Result<Vec<Heard>, CaseError> {
    let looked = Looked {
        look: Look::First,
        model,
        are_free: false,
        withheld,
    };
    logs.iter().map(|log| Ok(log.heard(&looked, progress)?.0)).collect()
}

/// Believes causes as far as the held-out windows, and of those of the second look the first look too, keep what they promise. Says how likely one of the
/// first look is refuted, and how likely one would be that nobody refutes and no held-out window shows.
fn weigh(
    logs: &[Logged],
    quiet: &[Heard],
    after: &[Heard],
    causes: &mut [Cause],
    progress: &dyn Fn(f64),
) -> Result<(f64, f64), CaseError> {
    if causes.is_empty() {
        return Ok((0.0, 0.0));
    }
    let fitted: Vec<Fitted> = causes.iter().map(|cause| cause.fitted.clone()).collect();
    let mut held: Vec<Option<Strength>> = vec![None; causes.len()];
    for log in logs {
        for (sum, own) in held
            .iter_mut()
            .zip(log.held_out(&fitted, progress)?.into_iter().flatten())
        {
            *sum = Some(match sum.take() {
                Some(known) => known.with(&own),
                None => own,
            });
        }
    }
    let (mut kept, mut untold) = (1.0, None);
    for (cause, held) in causes.iter_mut().zip(held) {
        let believed = cause.probability;
        cause.promise = held.and_then(|held| held.promise(&cause.fitted.1));
        let by_first = by_first(quiet, after, cause);
        cause.probability *= confidence(cause.by, cause.promise, by_first);
        if cause.by == By::Parity {
            kept *= 1.0 - (believed - cause.probability);
        } else if cause.probability < SAID && cause.promise.is_none_or(|held| held.confidence() >= 1.0) {
            untold = untold.or(Some(believed));
        }
    }
    Ok((1.0 - kept, untold.unwrap_or(0.0)))
}

/// How strong a cause of the second look is by the first: with its parameters `t`, `1 + t'b / t'G t`, `b` about the model with it in.
fn by_first(quiet: &[Heard], after: &[Heard], cause: &Cause) -> Option<Promise> {
    let theta = DVector::from_vec(cause.fitted.0.active.theta.clone());
    let (information, _) = Joint::of(quiet).products(&cause.key)?;
    let (_, score) = Joint::of(after).products(&cause.key)?;
    if information.nrows() != theta.len() {
        return None;
    }
    let by_parameter = information * &theta;
    let strength = Strength {
        energy: theta.dot(&by_parameter),
        along: theta.dot(&score),
        by_parameter,
    };
    strength.promise(&cause.fitted.1)
}
