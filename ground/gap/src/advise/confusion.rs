//! What can be mistaken for what on this log, and how small an effect it would still show.
//!
//! In: the library and what was chosen. Out: sets of effects this motion cannot tell apart, and detection limits. Of the
//! energy `|h_i|^2` that effect `i` as found puts into the log, effect `j` can imitate a share `rho^2` (calibration
//! marginalised), so that the two differ by `m = 1/2 |h_i|^2 (1 - rho^2)` nats at best (Eriksson, Frisk and Krysander 2013);
//! deciding between them then errs with probability `Q(sqrt(m/2))`: 11 nats, 1 %; 3 nats, 11 %.

use statrs::function::erf::erfc;

use crate::{
    library::hypotheses::Library,
    search::{
        odds::by_effect,
        readings::{Attribution, Chosen},
    },
    thresholds::{CHANCE, SEEN_SNR},
};

/// How small an effect this log would show.
#[derive(Clone, Debug, PartialEq)]
pub struct Limit {
    /// Name.
    pub effect: &'static str,
    /// Place where it would be seen least.
    pub locality: String,
    /// Parameter.
    pub parameter: String,
    /// Its unit.
    pub unit: &'static str,
    /// Size with a marginal signal-to-noise ratio of [`SEEN_SNR`].
    pub size: f64,
    /// The size over its prior sigma: above one, the log says nothing about usual sizes.
    pub priors: f64,
}

/// Two hypotheses worth telling apart.
#[derive(Clone, Debug)]
pub struct Pair {
    /// The chosen one, its parameters.
    pub own: (twin::effect::Cause, Vec<f64>),
    /// Its rival.
    pub rival: twin::effect::Cause,
    /// \[nats\] they differ by on this log.
    pub nats: f64,
}

/// Sets of effects that evidence or motion cannot separate, each beginning with a cause.
pub fn sets(library: &Library, found: &Attribution) -> Vec<Vec<&'static str>> {
    let mut sets = Vec::new();
    for chosen in &found.chosen {
        let own = library.hypotheses[chosen.hypothesis].effect();
        let likely = by_effect(library, &chosen.rivals);
        let mut set = vec![own];
        for rival in chosen.rivals.iter().map(|rival| rival.hypothesis) {
            let name = library.hypotheses[rival].effect();
            let is_likely = likely.iter().any(|(known, share)| *known == name && *share > CHANCE);
            let is_near = nats_apart(library, chosen, rival).is_some_and(are_confused);
            if !set.contains(&name) && (is_likely || is_near) {
                set.push(name);
            }
        }
        if set.len() > 1 {
            sets.push(set);
        }
    }
    sets
}

/// Probability of deciding wrongly between two hypotheses so many nats apart: `Q(sqrt(m/2))`.
pub fn error(nats: f64) -> f64 {
    let x = (nats.max(0.0) / 2.0).sqrt();
    0.5 * erfc(x / std::f64::consts::SQRT_2)
}

/// Whether a decision between two that are so many nats apart errs by more than [`CHANCE`].
fn are_confused(nats: f64) -> bool {
    error(nats) > CHANCE
}

/// The pair most worth telling apart: the likeliest rival of the strongest cause, of those that are `said`.
pub fn pair(library: &Library, found: &Attribution, said: &[&str]) -> Option<Pair> {
    let other = |chosen: &Chosen| {
        let own = library.hypotheses[chosen.hypothesis].effect();
        (chosen.rivals.iter())
            .filter(|rival| library.hypotheses[rival.hypothesis].effect() != own)
            .map(|rival| (rival.hypothesis, chosen.gain - rival.in_its_place()))
            .min_by(|one, other| one.1.total_cmp(&other.1))
    };
    let is_said = |chosen: &&Chosen| said.contains(&library.hypotheses[chosen.hypothesis].effect());
    let pairs = (found.chosen.iter().filter(is_said))
        .filter_map(|chosen| other(chosen).map(|(rival, gap)| (chosen, rival, gap)));
    let (chosen, rival, gap) = pairs.min_by(|one, other| one.2.total_cmp(&other.2))?;
    // The chosen effect has its columns where it is, its rival at zero. Where the effect is large they differ, though the exact fits may not.
    let by_columns = nats_apart(library, chosen, rival)?;
    let nats = if are_confused(gap) {
        by_columns.min(gap.max(0.0))
    } else {
        by_columns
    };
    Some(Pair {
        own: (
            library.hypotheses[chosen.hypothesis].cause.clone(),
            chosen.theta.iter().copied().collect(),
        ),
        rival: library.hypotheses[rival].cause.clone(),
        nats,
    })
}

fn nats_apart(library: &Library, chosen: &Chosen, rival: usize) -> Option<f64> {
    let own = library.hypotheses[chosen.hypothesis].small();
    let others = library.hypotheses[rival].small();
    if own.is_empty() || others.is_empty() {
        return None;
    }
    let mut places = own.to_vec();
    places.extend(others);
    let scores = vec![0.0; library.products.len()];
    let screen = library.screen(&places, &scores);
    let (first, second): (Vec<usize>, Vec<usize>) = ((0..own.len()).collect(), (own.len()..places.len()).collect());
    let (share, energy) = screen.imitation(&first, &chosen.theta, &second)?;
    Some(0.5 * energy * (1.0 - share))
}

/// For each effect with parameters, the place and parameter where it would be seen least at its usual size.
pub fn limits(library: &Library) -> Vec<Limit> {
    let mut limits: Vec<Limit> = Vec::new();
    let seen = |place: usize| {
        let snr_per_unit = library.products.product(place, place).max(0.0).sqrt();
        if snr_per_unit > 0.0 {
            SEEN_SNR / snr_per_unit
        } else {
            f64::INFINITY
        }
    };
    for hypothesis in &library.hypotheses {
        let name = hypothesis.effect();
        for (place, parameter) in hypothesis.small().iter().zip(&hypothesis.parameters) {
            let size = seen(*place);
            let limit = Limit {
                effect: name,
                locality: hypothesis.cause.locality.to_string(),
                parameter: parameter.name.clone(),
                unit: parameter.unit,
                size,
                priors: size / parameter.prior_sigma,
            };
            match limits.iter_mut().find(|known| known.effect == name) {
                Some(known) if limit.priors > known.priors => *known = limit,
                Some(_) => {}
                None => limits.push(limit),
            }
        }
    }
    limits.sort_by(|one, other| other.priors.total_cmp(&one.priors));
    limits
}
