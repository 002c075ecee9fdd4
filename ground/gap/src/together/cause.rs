//! An effect that the logs name together, and what each of them says of it.
//!
//! In: what the logs say of a hypothesis ([`Heard`]), and the choice. Out: [`Cause`]: its size by all, by each, and whether they agree. What a
//! log says by itself is fitted as if it were the only one, with the calibration marginalised there.

use crate::{
    holdout::strength::Promise,
    library::hypotheses::Library,
    parity::{
        name::{By, Fitted},
        search::{self, Chosen, Seen},
    },
    probability::cause::Sized,
    together::{
        heard::{Heard, Look, key},
        joint::{Apart, Joint},
        log::Logged,
    },
};

/// What one log says of an effect.
#[derive(Clone, Debug)]
pub struct Share {
    /// \[nats\] over the model without it.
    pub gain: f64,
    /// Ratio at usual size.
    pub snr: f64,
    /// Its parameters.
    pub parameters: Vec<Sized>,
}

/// An effect that the logs name together.
#[derive(Clone, Debug)]
pub struct Cause {
    /// Which, where and how large.
    pub fitted: Fitted,
    /// In the library.
    pub effect: &'static str,
    /// Where, in words.
    pub locality: String,
    /// Other places that the logs do not tell from this one.
    pub or_at: Vec<String>,
    /// Channels it touches.
    pub channels: Vec<String>,
    /// By which look.
    pub by: By,
    /// Against all others and nothing.
    pub probability: f64,
    /// What all logs say.
    pub all: Share,
    /// What each says.
    pub each: Vec<Share>,
    /// Whether they agree; none where fewer than two show it.
    pub apart: Option<Apart>,
    /// The pair of logs that differs most, where there are more than two.
    pub pair: Option<(usize, usize, Apart)>,
    /// What the held-out windows of the logs without a reference say.
    pub promise: Option<Promise>,
    /// Its name among what logs say.
    pub key: String,
}

impl Share {
    /// What some logs say of a hypothesis.
    fn of(library: &Library, hypothesis: usize, heard: &[&Heard]) -> Self {
        let own = &library.hypotheses[hypothesis];
        let products = Joint::of(heard.iter().copied()).products(&key(own));
        let seen = products.map(|(information, score)| Seen::summed(library, hypothesis, information, score));
        let fit = seen.as_ref().and_then(|seen| search::fit_alone(library, seen));
        let sized = |fit: &search::Fit, index: usize| Sized {
            parameter: own.parameters[index].clone(),
            value: fit.theta[index],
            sigma: fit.covariance[(index, index)].max(0.0).sqrt(),
        };
        Self {
            gain: fit.as_ref().map_or(0.0, |fit| fit.gain),
            snr: seen.map_or(0.0, |seen| seen.snr),
            parameters: fit.map_or_else(Vec::new, |fit| {
                (0..own.parameters.len()).map(|index| sized(&fit, index)).collect()
            }),
        }
    }
}

impl Cause {
    /// Whether the logs contradict each other about it, all of them or a pair.
    pub fn is_contradicted(&self) -> bool {
        let logs = self.each.len();
        let is_pair = |(_, _, apart): (usize, usize, Apart)| apart.is_contradiction(logs * (logs - 1) / 2 + 1);
        self.apart.is_some_and(|apart| apart.is_contradiction(2)) || self.pair.is_some_and(is_pair)
    }

    /// Of a choice of a look.
    pub fn of(logs: &[Logged], library: &Library, heard: &[Heard], chosen: &Chosen, look: Look) -> Self {
        let hypothesis = &library.hypotheses[chosen.hypothesis];
        let sigmas: Vec<f64> = hypothesis
            .small()
            .iter()
            .map(|place| library.prior_sigmas[*place])
            .collect();
        let key = key(hypothesis);
        let apart = |of: &[&Heard]| match sigmas.is_empty() {
            true => None,
            false => Joint::of(of.iter().copied()).apart(&key, &sigmas),
        };
        let every: Vec<&Heard> = heard.iter().collect();
        let pairs = (0..heard.len()).flat_map(|one| (one + 1..heard.len()).map(move |other| (one, other)));
        let pair = pairs
            .filter_map(|(one, other)| Some((one, other, apart(&[&heard[one], &heard[other]])?)))
            .filter(|_| heard.len() > 2)
            .min_by(|one, other| one.2.chance.total_cmp(&other.2.chance));
        let unit_channels = logs.first().map(|log| log.touched(hypothesis)).unwrap_or_default();
        Self {
            fitted: (hypothesis.component(&chosen.theta), chosen.covariance.clone()),
            effect: hypothesis.effect(),
            locality: hypothesis.cause.locality.to_string(),
            or_at: (chosen.elsewhere.iter())
                .map(|at| library.hypotheses[*at].cause.locality.to_string())
                .collect(),
            channels: unit_channels,
            by: match look {
                Look::First => By::Parity,
                Look::Second => By::Smoothing,
            },
            probability: chosen.probability,
            all: Share::of(library, chosen.hypothesis, &every),
            each: heard
                .iter()
                .map(|own| Share::of(library, chosen.hypothesis, &[own]))
                .collect(),
            apart: apart(&every),
            pair,
            promise: None,
            key,
        }
    }
}
