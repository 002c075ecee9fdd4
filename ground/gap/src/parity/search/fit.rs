//! How well hypotheses explain a log by parity, and which of them is the likeliest.
//!
//! In: hypotheses as they are [`Seen`], and those that are taken already. Out: each one's [`Fit`], alone or beside those, and the [`Chosen`] one: of the
//! effect that is likeliest over all its places and variants the best hypothesis, if it is likelier than nothing by the margin of a name.
//!
//! The evidence is that of [`crate::null::evidence`], less the price of having looked when it is on.

use std::{iter::once, ops::Range};

use nalgebra::{DMatrix, DVector};

use super::{Chosen, Seen, Taken};
use crate::{
    library::{column::Entries, hypotheses::Library},
    null::evidence::{Screen, probabilities},
    parity::{
        space::{dot, screen},
        visible::may_be_named,
        walk,
    },
    search::odds::{itself, oversize},
    thresholds::{DOUBT_STEP, DOUBTED, SAID, TEMPERATURE, effect_margin},
};

/// A hypothesis fitted.
pub struct Fit {
    /// \[nats\] over the model without it.
    pub gain: f64,
    /// Its parameters.
    pub theta: DVector<f64>,
    /// Their covariance.
    pub covariance: DMatrix<f64>,
    energy: f64,
}

/// The likeliest of hypotheses alone, if it is likelier than nothing by the margin of a name.
pub fn foremost(library: &Library, seen: &[Seen]) -> Option<Chosen> {
    let fits = seen
        .iter()
        .filter_map(|one| Some((one.hypothesis, fit_alone(library, one)?)));
    likeliest(library, seen, &fits.collect::<Vec<_>>())
}

/// A hypothesis alone.
pub fn fit_alone(library: &Library, seen: &Seen) -> Option<Fit> {
    let hypothesis = &library.hypotheses[seen.hypothesis];
    if hypothesis.small().is_empty() {
        let width = hypothesis.parameters.len();
        return Some(Fit {
            gain: seen.score.sum() - 0.5 * seen.information.sum(),
            theta: DVector::zeros(width),
            covariance: DMatrix::zeros(width, width),
            energy: seen.information.sum(),
        });
    }
    let mut screen = Screen::zeros(
        hypothesis
            .small()
            .iter()
            .map(|place| library.prior_sigmas[*place])
            .collect(),
    );
    screen.information.copy_from(&seen.information);
    screen.score.copy_from(&seen.score);
    let width = hypothesis.small().len();
    let gain = screen.of_any_size(once(0..width))? - seen.price;
    screen.settle(once(0..width));
    let estimate = screen.estimate(&(0..width).collect::<Vec<_>>())?;
    Some(Fit {
        gain,
        energy: estimate.parameters.dot(&(&seen.information * &estimate.parameters)),
        theta: estimate.parameters,
        covariance: estimate.covariance,
    })
}

/// One round of the search: what was taken before, and how columns of the library lie to that.
pub(super) struct Round<'a> {
    /// None in the first.
    beside: Option<Beside<'a>>,
    /// Of each column, by its place, products with those that are taken, as far as they are known: many hypotheses have a column in common.
    products: &'a mut Vec<Vec<f64>>,
}

impl<'a> Round<'a> {
    /// None where those that are taken say nothing together.
    pub(super) fn of(taken: &'a [Taken], rest: &Entries, products: &'a mut Vec<Vec<f64>>) -> Option<Self> {
        let beside = match taken {
            [] => None,
            _ => Some(Beside::of(taken, rest)?),
        };
        Some(Self { beside, products })
    }

    /// A hypothesis, alone or beside those.
    pub(super) fn fit(&mut self, library: &Library, seen: &Seen) -> Option<Fit> {
        match &self.beside {
            Some(beside) => beside.fit(library, seen, self.products),
            None => fit_alone(library, seen),
        }
    }

    /// These columns are made anew.
    pub(super) fn forget(&mut self, places: &[usize]) {
        for place in places {
            self.products.resize_with(self.products.len().max(place + 1), Vec::new);
            self.products[*place].clear();
        }
    }
}

/// Effects that were taken, whose parameters are free in the fit of another.
struct Beside<'a> {
    columns: Vec<&'a Entries>,
    rests: Vec<&'a Entries>,
    parts: Vec<Range<usize>>,
    screen: Screen,
    /// \[nats\] of theirs alone.
    log_evidence: f64,
}

impl<'a> Beside<'a> {
    fn of(taken: &'a [Taken], rest: &Entries) -> Option<Self> {
        let columns: Vec<&Entries> = taken.iter().flat_map(|one| &one.columns).collect();
        let rests: Vec<&Entries> = taken.iter().flat_map(|one| &one.rests).collect();
        let mut parts = Vec::new();
        let mut from = 0;
        for one in taken {
            parts.push(from..from + one.columns.len());
            from += one.columns.len();
        }
        let sigmas = taken.iter().flat_map(|one| one.sigmas.clone()).collect();
        let screen = screen(&columns, &rests, sigmas, rest);
        Some(Self {
            log_evidence: screen.of_any_size(parts.clone())?,
            columns,
            rests,
            parts,
            screen,
        })
    }

    /// A hypothesis beside them. `products` are those of each column of the library with theirs, as far as they are known.
    fn fit(&self, library: &Library, seen: &Seen, products: &mut [Vec<f64>]) -> Option<Fit> {
        let places = library.hypotheses[seen.hypothesis].small();
        let (from, width) = (self.columns.len(), places.len());
        let sigmas = places.iter().map(|place| library.prior_sigmas[*place]);
        let mut both = Screen::zeros(self.screen.prior_sigmas.iter().copied().chain(sigmas).collect());
        both.score.rows_mut(0, from).copy_from(&self.screen.score);
        both.score.rows_mut(from, width).copy_from(&seen.score);
        both.information
            .view_mut((0, 0), (from, from))
            .copy_from(&self.screen.information);
        both.information
            .view_mut((from, from), (width, width))
            .copy_from(&seen.information);
        for (row, place) in places.iter().enumerate() {
            let known = &mut products[*place];
            if known.len() < from {
                let own = library.products.column(*place);
                known.extend(self.rests[known.len()..].iter().map(|rest| dot(&own, rest)));
            }
            for (column, product) in known.iter().enumerate() {
                both.information[(from + row, column)] = *product;
                both.information[(column, from + row)] = *product;
            }
        }
        let mut parts = self.parts.clone();
        parts.push(from..from + width);
        let of_other_sizes = both.settle(parts);
        let gain = both.log_evidence()? + of_other_sizes - self.log_evidence - seen.price;
        let estimate = both.estimate(&(0..from + width).collect::<Vec<_>>())?;
        let theta = estimate.parameters.rows(from, width).into_owned();
        Some(Fit {
            gain,
            energy: theta.dot(&(&seen.information * &theta)),
            covariance: estimate.covariance.view((from, from), (width, width)).into_owned(),
            theta,
        })
    }
}

/// The likeliest, if it is likelier than nothing by the margin of a name: of the effect that is likeliest over all its places and variants the
/// best one. An effect with five time constants shares its prior among them, so that the best single hypothesis may be of another.
pub(super) fn likeliest(library: &Library, seen: &[Seen], fits: &[(usize, Fit)]) -> Option<Chosen> {
    let prior = |at: usize| library.hypotheses[at].log_prior;
    let mut gains: Vec<f64> = fits.iter().map(|(_, fit)| fit.gain).collect();
    let mut priors: Vec<f64> = fits.iter().map(|(at, _)| prior(*at)).collect();
    // Nothing.
    gains.push(0.0);
    priors.push(0.0);
    let shares = probabilities(&gains, &priors, TEMPERATURE);
    let mut by_effect: Vec<(&'static str, f64)> = Vec::new();
    for ((at, _), share) in fits.iter().zip(&shares) {
        let effect = library.hypotheses[*at].effect();
        match by_effect.iter_mut().find(|(name, _)| *name == effect) {
            Some((_, sum)) => *sum += share,
            None => by_effect.push((effect, *share)),
        }
    }
    let (first, _) = by_effect.iter().max_by(|one, other| one.1.total_cmp(&other.1))?;
    let of_first = fits.iter().filter(|(at, _)| library.hypotheses[*at].effect() == *first);
    let (best, fit) = of_first.max_by(|one, other| {
        let score = |(at, fit): &(usize, Fit)| fit.gain / TEMPERATURE + prior(*at);
        score(one).total_cmp(&score(other))
    })?;
    if fit.gain + prior(*best) < effect_margin() {
        return None;
    }
    let hypothesis = &library.hypotheses[*best];
    let own = by_effect
        .iter()
        .find(|(name, _)| *name == hypothesis.effect())
        .map_or(0.0, |(_, sum)| *sum);
    by_effect.retain(|(name, _)| *name != hypothesis.effect());
    by_effect.sort_by(|one, other| other.1.total_cmp(&one.1));
    let sizes = match walk::is_law(hypothesis) {
        true => walk::in_parameters(library, hypothesis, &fit.theta, &fit.covariance).0,
        false => fit.theta.clone(),
    };
    let excess = oversize(hypothesis.cause.effect.page(), &sizes, &hypothesis.parameters);
    let doubt = 1.0 / (1.0 + ((DOUBTED - fit.gain) / DOUBT_STEP).exp());
    let is_as_good = |(at, other): &&(usize, Fit)| {
        let is_same = library.hypotheses[*at].effect() == hypothesis.effect();
        let is_elsewhere = library.hypotheses[*at].cause.locality != hypothesis.cause.locality;
        is_same && is_elsewhere && other.gain > fit.gain - effect_margin()
    };
    let snr = (seen.iter().find(|one| one.hypothesis == *best)).map_or(0.0, |one| one.snr);
    // Of others whoever offers them has asked: several logs, one of them with a reference, show more than parity.
    let is_shown = may_be_named(hypothesis, snr) || !walk::is_law(hypothesis);
    Some(Chosen {
        hypothesis: *best,
        elsewhere: fits.iter().filter(is_as_good).map(|(at, _)| *at).collect(),
        theta: fit.theta.clone(),
        covariance: fit.covariance.clone(),
        gain: fit.gain,
        snr,
        found_snr: fit.energy.max(0.0).sqrt(),
        // Beyond its largest size it stands for something else, as in the search with a reference.
        probability: own * doubt * itself(excess) * if is_shown { 1.0 } else { SAID },
        rivals: by_effect,
    })
}

#[cfg(test)]
mod tests {
    use twin::{
        effect::{Cause, Locality, by_name},
        predict::{emems, thesis_slot_s},
    };

    use super::*;
    use crate::library::hypotheses::Hypothesis;

    #[test]
    fn an_effect_of_many_variants_is_as_likely_as_all_of_them() {
        let unit = emems(thesis_slot_s);
        let mut library = Library::default();
        let mut offer = |effect: &str, variant: f64, log_prior: f64| {
            let cause = Cause {
                effect: by_name(effect).expect("in the library"),
                locality: Locality::All,
                variant,
            };
            library.hypotheses.push(Hypothesis {
                parameters: cause.parameters(&unit),
                cause,
                places: Vec::new(),
                log_prior,
                span: None,
            });
        };
        offer("gyro-supply", 0.0, -4.0);
        for variant in [20.0, 40.0, 80.0, 160.0] {
            offer("gyro-warm-up", variant, -4.0 - 4f64.ln());
        }
        // Each time constant explains as much as the supply does, but for one that explains a little more, and has a quarter of its prior odds.
        let fits: Vec<(usize, Fit)> = [20.0, 20.0, 21.5, 20.0, 20.0]
            .into_iter()
            .enumerate()
            .map(|(at, gain)| {
                let width = library.hypotheses[at].parameters.len();
                let fit = Fit {
                    gain,
                    theta: DVector::zeros(width),
                    covariance: DMatrix::zeros(width, width),
                    energy: 0.0,
                };
                (at, fit)
            })
            .collect();
        let chosen = likeliest(&library, &[], &fits).expect("likelier than nothing");
        assert_eq!(chosen.hypothesis, 2);
        assert_eq!(chosen.rivals[0].0, "gyro-supply");
        assert!(chosen.rivals[0].1 < 0.5, "{:?}", chosen.rivals);
    }
}
