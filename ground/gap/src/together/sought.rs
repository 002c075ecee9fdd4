//! Effects sought in all logs at once.
//!
//! In: logs, a look, what is named already. Out: [`Searched`]. One effect is taken at a time, the likeliest of all by the joint evidence; those
//! taken before are in the model of every log, their parameters free and shared. Probability is that of the search in one log
//! ([`crate::parity::search`]).

use crate::{
    input::case::CaseError,
    library::hypotheses::Library,
    null::problem::Component,
    parity::{
        nulls,
        search::{self, Chosen, Seen},
    },
    thresholds::{MOST_CAUSES, PARITY_SNR, SAID},
    together::{
        cause::Cause,
        heard::{Heard, Look, Looked, key},
        joint::Joint,
        log::Logged,
    },
};

/// What a look says.
pub struct Searched {
    /// What each log says before anything is in the model but what was named.
    pub quiet: Vec<Heard>,
    /// Its hypotheses, without columns.
    pub library: Library,
    /// Those that are likelier than not.
    pub causes: Vec<Cause>,
    /// Other effects with their probabilities.
    pub rivals: Vec<(&'static str, f64)>,
}

/// Takes effects while the evidence of all asks for one, beside those that are in already.
///
/// # Errors
/// When the unit's description names an effect there is not.
pub fn search(
    logs: &[Logged],
    look: Look,
    withheld: &[String],
    named: &[Component],
    progress: &dyn Fn(f64),
) -> Result<Searched, CaseError> {
    let mut model = named.to_vec();
    let mut quiet: Option<(Vec<Heard>, Library)> = None;
    let (mut causes, mut rivals) = (Vec::new(), Vec::new());
    loop {
        let looked = Looked {
            look,
            model: &model,
            are_free: true,
            withheld,
        };
        let mut heard: Vec<Heard> = Vec::new();
        let mut library: Option<Library> = None;
        for log in logs {
            let (own, light) = log.heard(&looked, progress)?;
            heard.push(own);
            library.get_or_insert(light);
        }
        let Some(library) = library else { break };
        let chosen = match model.len() < MOST_CAUSES {
            true => likeliest(logs, &library, &heard, &model),
            false => None,
        };
        if quiet.is_none() {
            quiet = Some((heard.clone(), library.clone()));
        }
        let Some(chosen) = chosen else { break };
        let effect = library.hypotheses[chosen.hypothesis].effect();
        rivals.extend(chosen.rivals.iter().copied());
        if chosen.probability < SAID {
            rivals.push((effect, chosen.probability));
            break;
        }
        let cause = Cause::of(logs, &library, &heard, &chosen, look);
        // Nothing is linear beside the one, and nothing believed beside the other.
        let is_last = library.is_discrete(chosen.hypothesis) || cause.is_contradicted();
        model.push(cause.fitted.0.clone());
        causes.push(cause);
        if is_last {
            break;
        }
    }
    let (quiet, library) = quiet.unwrap_or_default();
    Ok(Searched {
        quiet,
        library,
        causes,
        rivals,
    })
}

/// Whether a hypothesis may be named at all by these logs: what no redundancy shows, by those with a reference alone.
pub fn may_be_named(logs: &[Logged], library: &Library, hypothesis: usize, snr: f64) -> bool {
    let is_null = nulls::of(&library.hypotheses[hypothesis]).is_some();
    snr >= PARITY_SNR && (!is_null || logs.iter().any(Logged::has_reference))
}

/// Hypotheses as these logs see them together.
pub fn seen(library: &Library, heard: &[&Heard]) -> Vec<Seen> {
    let joint = Joint::of(heard.iter().copied());
    let all = library.hypotheses.iter().enumerate();
    all.filter_map(|(at, hypothesis)| {
        let (information, score) = joint.products(&key(hypothesis))?;
        Some(Seen::summed(library, at, information, score))
    })
    .collect()
}

fn likeliest(logs: &[Logged], library: &Library, heard: &[Heard], model: &[Component]) -> Option<Chosen> {
    let mut seen = seen(library, &heard.iter().collect::<Vec<_>>());
    seen.retain(|one| {
        let effect = library.hypotheses[one.hypothesis].effect();
        let is_in = model.iter().any(|own| own.active.cause.effect.page().name == effect);
        let is_linear = model.is_empty() || !library.is_discrete(one.hypothesis);
        may_be_named(logs, library, one.hypothesis, one.snr) && !is_in && is_linear
    });
    search::foremost(library, &seen)
}
