//! An effect that is said, by whatever says it.
//!
//! In: what is known before there is a motion ([`crate::parity::beforehand`]), or what a search chose ([`crate::parity::search`]). Out: a [`Name`].

use nalgebra::{DMatrix, DVector};
use twin::effect::{Parameter, by_name};

use crate::{
    holdout::strength::Promise,
    library::hypotheses::{Hypothesis, Library},
    null::problem::{Component, Problem},
    parity::{codes::Finding, lost::Loss, phases::shown::Alone, search::Chosen, walk},
    probability::cause::Sized,
};

/// Probability of a name that codes alone give: chance is ruled out, the library's other effects on codes are not.
const BY_CODES: f64 = 0.99;

/// What an effect is said by.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum By {
    /// Codes, without a model.
    Codes,
    /// The readings as a whole: with other axes nothing is left.
    Axes,
    /// How far field and force turn from one packet to the next.
    Turns,
    /// Each packet by itself.
    Parity,
    /// All packets, about the smoothed motion.
    Smoothing,
}

/// A cause with the covariance of its parameters.
pub type Fitted = (Component, DMatrix<f64>);

/// An effect that is said.
#[derive(Clone, Debug)]
pub struct Name {
    /// In the library.
    pub effect: &'static str,
    /// By what.
    pub by: By,
    /// Where, in words.
    pub locality: String,
    /// Other places that the log does not tell from this one.
    pub or_at: Vec<String>,
    /// The same, nothing there.
    pub elsewhere: Vec<Component>,
    /// Channels it touches.
    pub channels: Vec<usize>,
    /// Against all others and nothing.
    pub probability: f64,
    /// \[nats\]; none of what codes say.
    pub gain: Option<f64>,
    /// Ratio by parity, at plausible size and at the size found; none of what codes say.
    pub snr: Option<[f64; 2]>,
    /// What the held-out windows say of its strength; none where they were not asked.
    pub promise: Option<Promise>,
    /// The phase it shows in alone; none of what codes say.
    pub alone: Option<Alone>,
    /// Its parameters.
    pub parameters: Vec<Sized>,
    /// Packets that nobody counted.
    pub losses: Vec<Loss>,
    /// What was seen, or which of what it may be.
    pub which: Option<String>,
    /// What it is.
    pub physics: &'static str,
    /// How to be sure.
    pub confirm_by: &'static str,
}

/// Their places, each once.
fn places<'a>(hypotheses: impl Iterator<Item = &'a Hypothesis>) -> Vec<String> {
    let mut places: Vec<String> = hypotheses
        .map(|hypothesis| hypothesis.cause.locality.to_string())
        .collect();
    places.sort_unstable();
    places.dedup();
    places
}

impl Name {
    /// Of what is known before there is a motion.
    pub fn beforehand(finding: &Finding) -> Self {
        let page = by_name(finding.effect).map(|effect| effect.page());
        let surest = finding.losses.iter().map(|loss| loss.probability).reduce(f64::max);
        Self {
            effect: finding.effect,
            by: match (finding.looks.as_slice(), finding.losses.as_slice()) {
                ([], []) => By::Codes,
                ([], _) => By::Turns,
                _ => By::Axes,
            },
            locality: String::new(),
            or_at: Vec::new(),
            elsewhere: Vec::new(),
            channels: finding.channels.clone(),
            probability: surest.map_or(BY_CODES, |surest| surest.min(BY_CODES)),
            gain: None,
            snr: None,
            promise: None,
            alone: None,
            parameters: Vec::new(),
            losses: finding.losses.clone(),
            which: Some(finding.what.clone()),
            physics: page.map_or("", |page| page.physics),
            confirm_by: page.map_or("", |page| page.confirm_by),
        }
    }

    /// Of an effect that a search chose, and as it was fitted.
    pub fn of(problem: &Problem, library: &Library, chosen: &Chosen, by: By) -> (Self, Fitted) {
        let hypothesis = &library.hypotheses[chosen.hypothesis];
        let page = hypothesis.cause.effect.page();
        let (theta, covariance) = match walk::is_law(hypothesis) {
            true => walk::in_parameters(library, hypothesis, &chosen.theta, &chosen.covariance),
            false => (chosen.theta.clone(), chosen.covariance.clone()),
        };
        let sized = |(index, parameter): (usize, &Parameter)| Sized {
            parameter: parameter.clone(),
            value: theta[index],
            sigma: covariance[(index, index)].max(0.0).sqrt(),
        };
        let name = Self {
            effect: hypothesis.effect(),
            by,
            locality: hypothesis.cause.locality.to_string(),
            or_at: places(chosen.elsewhere.iter().map(|at| &library.hypotheses[*at])),
            elsewhere: (chosen.elsewhere.iter())
                .map(|at| &library.hypotheses[*at])
                .map(|other| other.component(&DVector::zeros(other.parameters.len())))
                .collect(),
            channels: hypothesis.cause.channels(problem.twin.unit()),
            probability: chosen.probability,
            gain: Some(chosen.gain),
            snr: Some([chosen.snr, chosen.found_snr]),
            promise: None,
            alone: None,
            parameters: match walk::is_law(hypothesis) {
                // Terms that the log hardly shows are as large as was supposed, and its strength with them.
                true => Vec::new(),
                false => hypothesis.parameters.iter().enumerate().map(sized).collect(),
            },
            losses: Vec::new(),
            which: hypothesis.cause.effect.told(hypothesis.cause.variant),
            physics: page.physics,
            confirm_by: page.confirm_by,
        };
        (name, (hypothesis.component(&theta), covariance))
    }
}
