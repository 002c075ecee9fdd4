//! The causes of a verdict: what was chosen, put into an engineer's terms.
//!
//! In: an [`Attribution`] or a [`Scatter`]. Out: [`Cause`]s with the channels that hold their energy, when they show, their
//! parameters with sigmas, and their probability against everything that could stand in their place.

use twin::effect::{Parameter, Symbol};

use crate::{
    input::case::Subject,
    library::hypotheses::Library,
    null::problem::Problem,
    probability::regime,
    search::{
        odds::{itself, oversize, probability, probability_of_any},
        readings::{Attribution, Chosen},
        scatter::Scatter,
    },
    thresholds::{COUNTED_PART, STANDS_OUT, SUSPICIOUS, TEMPERATURE},
};

/// One parameter of a cause.
#[derive(Clone, Debug)]
pub struct Sized {
    /// Which.
    pub parameter: Parameter,
    /// Best value.
    pub value: f64,
    /// Standard deviation.
    pub sigma: f64,
}

/// An effect the log speaks for.
#[derive(Clone, Debug)]
pub struct Cause {
    /// Name in the library.
    pub effect: &'static str,
    /// Where it is.
    pub locality: String,
    /// Channels that hold its energy, most first.
    pub channels: Vec<usize>,
    /// Probability of this effect here against all others and nothing.
    pub probability: f64,
    /// Its part of the probability that it or any that could stand in its place is there.
    pub of_any: f64,
    /// \[nats\] over the model without it.
    pub gain: f64,
    /// Energy that it explains, in squares of noise, against which what is left is held.
    pub explained: f64,
    /// Its parameters.
    pub parameters: Vec<Sized>,
    /// Its share of the excess that the causes explain.
    pub share: f64,
    /// When it shows.
    pub when: String,
    /// Which of what the effect may be, where its parameters do not say.
    pub which: Option<String>,
    /// How to be sure.
    pub confirm_by: &'static str,
    /// What it is physically.
    pub physics: &'static str,
    /// It is so large that it may stand for something else.
    pub is_suspicious: bool,
}

impl Cause {
    /// Probability that it or any that could stand in its place is there.
    pub fn any(&self) -> f64 {
        self.probability / self.of_any.max(f64::MIN_POSITIVE)
    }
}

/// The chosen effects as causes; their shares are still energies.
pub fn causes_of(problem: &Problem, library: &Library, found: &Attribution) -> Vec<Cause> {
    let feels = problem.twin.feels(0);
    let model = found.model(library);
    let cause = |(index, chosen): (usize, &Chosen)| {
        let hypothesis = &library.hypotheses[chosen.hypothesis];
        let page = hypothesis.cause.effect.page();
        let mut energy = vec![0.0; feels.len()];
        let mut by_channel = Vec::new();
        for (channel, added) in problem.contribution(&model, &[index]) {
            let rows = &problem.frames[channel].series.rows;
            (rows.iter().zip(added.iter())).for_each(|(row, value)| energy[*row as usize] += value * value);
            by_channel.push((channel, added.norm_squared()));
        }
        by_channel.sort_by(|one, other| other.1.total_cmp(&one.1));
        let total: f64 = by_channel.iter().map(|(_, energy)| energy).sum();
        let own = hypothesis.effect();
        let sized = |(index, parameter): (usize, &Parameter)| Sized {
            parameter: parameter.clone(),
            value: chosen.theta[index],
            sigma: chosen.covariance[(index, index)].max(0.0).sqrt(),
        };
        let parameters: Vec<Sized> = hypothesis.parameters.iter().enumerate().map(sized).collect();
        Cause {
            effect: own,
            locality: hypothesis.cause.locality.to_string(),
            channels: by_channel
                .iter()
                .filter(|(_, energy)| *energy >= (COUNTED_PART * total).min(STANDS_OUT.powi(2)))
                .map(|(channel, _)| *channel)
                .collect(),
            probability: probability(library, chosen),
            of_any: probability(library, chosen) / probability_of_any(library, chosen).max(f64::MIN_POSITIVE),
            gain: chosen.gain,
            explained: 2.0 * chosen.gain,
            is_suspicious: oversize(page, &chosen.theta, &hypothesis.parameters) > SUSPICIOUS,
            parameters,
            share: total,
            when: match hypothesis.span {
                Some(on) => on.to_string(),
                None => regime::when(&feels, &energy),
            },
            which: hypothesis.cause.effect.told(hypothesis.cause.variant),
            confirm_by: page.confirm_by,
            physics: page.physics,
        }
    };
    found.chosen.iter().enumerate().map(cause).collect()
}

/// An effect on the scatter, whose parameters have these sigmas, as a cause; its share is still an energy.
pub fn cause_of_scatter(subject: &Subject, scatter: &Scatter, sigmas: &[Vec<f64>]) -> Cause {
    let page = scatter.effect.page();
    let unit = subject.twin.unit();
    let mut parameters = Vec::new();
    for (channel, (theta, sigmas)) in (scatter.channels.iter()).zip(scatter.thetas.iter().zip(sigmas)) {
        for (symbol, (value, sigma)) in page.parameters.iter().zip(theta.iter().zip(sigmas)) {
            parameters.push(Sized {
                parameter: parameter(symbol, format!("{}_{}", symbol.name, unit.channels[*channel].name)),
                value: *value,
                sigma: *sigma,
            });
        }
    }
    let gain = scatter.gain / TEMPERATURE;
    let sizes = parameters
        .iter()
        .map(|sized| sized.value.abs() / sized.parameter.prior_sigma);
    let excess = sizes.fold(0.0, f64::max) / page.largest;
    Cause {
        effect: page.name,
        locality: subject.names(scatter.channels.iter().copied()).join(" "),
        channels: scatter.channels.clone(),
        probability: named(gain, excess),
        of_any: 1.0,
        gain: scatter.gain,
        explained: 2.0 * scatter.gain,
        parameters,
        share: 2.0 * scatter.gain,
        when: "throughout".to_owned(),
        which: scatter.effect.told(scatter.variant),
        confirm_by: page.confirm_by,
        physics: page.physics,
        is_suspicious: excess > SUSPICIOUS,
    }
}

/// A parameter of an effect that is sized without its places in the library.
pub(super) fn parameter(symbol: &Symbol, name: String) -> Parameter {
    Parameter {
        name,
        unit: symbol.unit,
        prior_sigma: symbol.prior_sigma,
        signed: symbol.signed,
    }
}

/// Probability of an effect on the scatter with this evidence [nats, tempered] and so many times its largest size: beyond that it
/// stands for something else, as the others do.
pub(super) fn named(gain: f64, excess: f64) -> f64 {
    itself(excess) / (1.0 + (-gain).exp())
}

/// Energies to shares, most first.
pub fn share_out(causes: &mut [Cause]) {
    let total: f64 = causes.iter().map(|cause| cause.share).sum();
    causes
        .iter_mut()
        .for_each(|cause| cause.share = if total > 0.0 { cause.share / total } else { 0.0 });
    causes.sort_by(|one, other| other.share.total_cmp(&one.share));
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A missing saturation gave a walk of the zero 170 times its usual size, with all the evidence there can be.
    #[test]
    fn a_scatter_far_beyond_its_size_has_no_name_whatever_its_evidence() {
        assert!(named(1e4, 170.0 / 20.0) < 1e-3);
        assert!(named(1e4, 0.3) > 0.99 && named(-5.0, 0.3) < 0.01);
    }
}
