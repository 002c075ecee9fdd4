//! Which effects the evidence prefers, among those that can be seen.
//!
//! In: the [`Space`], the library, the residual. Out: every hypothesis as it is [`Seen`], and the [`Chosen`] ones. One effect is
//! taken at a time, the likeliest by evidence and prior odds; those taken before stay in the fit of the next.
//!
//! The evidence is that of [`crate::null::evidence`], with its sizes; an effect without parameters has `<d, r> - <d, d> / 2`, `d`
//! being what it does to the readings.

use std::{iter::once, ops::Range};

use nalgebra::{DMatrix, DVector};
use twin::{effect::Nature, predict::Memory};

use crate::{
    library::{
        hypotheses::{Hypothesis, Library},
        products::Entries,
    },
    null::{
        evidence::{Screen, probabilities},
        problem::{Component, Problem},
    },
    parity::{
        space::{Opened, Projected, Space, dot},
        visible::may_be_named,
        walk,
    },
    search::odds::{itself, oversize},
    thresholds::{DOUBT_STEP, DOUBTED, EFFECT_MARGIN, MOST_CAUSES, SAID, TEMPERATURE, UNTOLD},
};

/// A hypothesis in this log.
#[derive(Clone, Debug)]
pub struct Seen {
    /// Which.
    pub hypothesis: usize,
    /// Of its parameters, motion and calibration marginalised; of one without parameters, of what it does on the whole.
    information: DMatrix<f64>,
    score: DVector<f64>,
    /// Ratio at plausible size with the motion known, and by parity.
    pub with_reference: f64,
    /// By parity.
    pub snr: f64,
    /// \[nats\] of having looked when it is on.
    pub price: f64,
}

/// An effect that was taken.
#[derive(Clone, Debug)]
pub struct Chosen {
    /// Which.
    pub hypothesis: usize,
    /// Its parameters and their covariance; none of an effect without.
    pub theta: DVector<f64>,
    /// Theirs.
    pub covariance: DMatrix<f64>,
    /// \[nats\] over the model without it.
    pub gain: f64,
    /// Ratio at plausible size by parity.
    pub snr: f64,
    /// Ratio at the size found.
    pub found_snr: f64,
    /// Probability of its effect, at any place, against all others and nothing.
    pub probability: f64,
    /// Other hypotheses of the same effect that the evidence does not tell from it.
    pub elsewhere: Vec<usize>,
    /// Other effects with theirs, most first.
    pub rivals: Vec<(&'static str, f64)>,
}

/// Those that are said: the first ones that are likelier than not.
pub fn said(chosen: &[Chosen]) -> Vec<&Chosen> {
    chosen.iter().take_while(|one| one.probability >= SAID).collect()
}

/// Effects that may be there instead of those that are said, and what was taken next and is not said.
pub fn rivals(library: &Library, chosen: &[Chosen]) -> Vec<(&'static str, f64)> {
    let said = said(chosen);
    let mut rivals: Vec<(&'static str, f64)> = said.iter().flat_map(|one| one.rivals.clone()).collect();
    if let Some(one) = chosen.get(said.len()) {
        rivals.push((library.hypotheses[one.hypothesis].effect(), one.probability));
        rivals.extend(one.rivals.iter().copied());
    }
    rivals
}

/// What a model leaves of a problem.
pub fn residual_of(problem: &Problem, model: &[Component]) -> Entries {
    problem.residuals(model).into_iter().enumerate().collect()
}

/// The columns of a library, and which of them are each hypothesis': of one that is there or not, what it does on the whole.
pub struct Offered {
    columns: Vec<Entries>,
    sets: Vec<Vec<usize>>,
}

impl Offered {
    /// Of a problem's library.
    pub fn of(problem: &Problem, library: &Library) -> Self {
        let own = 0..library.products.len();
        let mut offered = Self {
            columns: own.map(|place| library.products.column(place)).collect(),
            sets: Vec::new(),
        };
        let mut memory = Memory::default();
        for hypothesis in &library.hypotheses {
            if hypothesis.small().is_empty() {
                offered.sets.push(vec![offered.columns.len()]);
                offered.columns.push(on_the_whole(problem, hypothesis, &mut memory));
            } else {
                offered.sets.push(hypothesis.small().to_vec());
            }
        }
        offered
    }

    /// All columns.
    pub fn columns(&self) -> Vec<&Entries> {
        self.columns.iter().collect()
    }

    /// Of each hypothesis, the places of its columns.
    pub fn sets(&self) -> &[Vec<usize>] {
        &self.sets
    }
}

/// Every hypothesis, alone. `progress` is told how far it is.
pub fn look(
    space: &Space,
    library: &Library,
    (offered, opened): (&Offered, &Opened),
    residual: &Projected,
    progress: &dyn Fn(f64),
) -> Vec<Seen> {
    let rest = space.rest(residual);
    let all = space.within(&offered.columns(), opened, &offered.sets, progress);
    (all.into_iter().zip(&offered.sets).enumerate())
        .map(|(at, (information, set))| {
            let columns: Vec<&Entries> = set.iter().map(|place| &offered.columns[*place]).collect();
            Seen::of(library, at, &columns, information, &rest)
        })
        .collect()
}

impl Seen {
    /// Of a hypothesis whose normal equations are known.
    pub fn summed(library: &Library, hypothesis: usize, information: DMatrix<f64>, score: DVector<f64>) -> Self {
        let small = library.hypotheses[hypothesis].small();
        let sigma = |index: usize| small.get(index).map_or(1.0, |place| library.prior_sigmas[*place]);
        let energy: f64 = (0..score.len())
            .map(|index| sigma(index).powi(2) * information[(index, index)])
            .sum();
        let snr = energy.max(0.0).sqrt();
        Self {
            hypothesis,
            information,
            score,
            with_reference: snr,
            snr,
            price: 0.0,
        }
    }

    /// Of a hypothesis with these columns, and of what motion and calibration leave of the residual.
    fn of(library: &Library, at: usize, columns: &[&Entries], information: DMatrix<f64>, rest: &Entries) -> Self {
        let hypothesis = &library.hypotheses[at];
        let width = columns.len();
        let sigma = |index: usize| {
            hypothesis
                .small()
                .get(index)
                .map_or(1.0, |place| library.prior_sigmas[*place])
        };
        let ratio = |own: &dyn Fn(usize) -> f64| {
            (0..width)
                .map(|index| sigma(index).powi(2) * own(index))
                .sum::<f64>()
                .max(0.0)
                .sqrt()
        };
        let alone = |index: usize| match hypothesis.small().get(index) {
            Some(place) => library.products.product(*place, *place),
            None => dot(columns[index], columns[index]),
        };
        Self {
            hypothesis: at,
            score: DVector::from_fn(width, |row, _| dot(columns[row], rest)),
            with_reference: ratio(&alone),
            snr: ratio(&|index| information[(index, index)]),
            information,
            price: 0.0,
        }
    }
}

/// What an effect that is there or not does to the readings, in units of noise.
fn on_the_whole(problem: &Problem, hypothesis: &Hypothesis, memory: &mut Memory) -> Entries {
    let twin = problem.twin;
    let model = [hypothesis.active(&DVector::zeros(hypothesis.parameters.len()))];
    let mut on = |channel: usize| {
        let frame = &problem.frames[channel];
        let without = twin.channel_with(channel, &[], memory).into_owned();
        let with = twin.channel_with(channel, &model, memory);
        let rows = frame.series.rows.iter().zip(frame.weights.iter());
        let values = rows.map(|(row, weight)| (with[*row as usize] - without[*row as usize]) / weight);
        (channel, DVector::from_iterator(frame.weights.len(), values))
    };
    let touched = hypothesis.cause.channels(twin.unit());
    touched.into_iter().map(&mut on).collect()
}

/// Effects that are in the residual's model before anything is sought: their slopes there, free in every fit.
#[derive(Default)]
pub struct First {
    effects: Vec<&'static str>,
    taken: Vec<Taken>,
}

/// An effect whose parameters are free in every fit.
struct Taken {
    columns: Vec<Entries>,
    /// What motion and calibration leave of each.
    rests: Vec<Entries>,
    sigmas: Vec<f64>,
}

impl Taken {
    fn of(space: &Space, columns: Vec<Entries>, sigmas: Vec<f64>) -> Self {
        Self {
            rests: space.rests(&columns),
            columns,
            sigmas,
        }
    }
}

impl First {
    /// These.
    pub fn of(space: &Space, model: &[Component]) -> Self {
        let taken = |at: usize| {
            let (columns, sigmas) = free(space.problem, model, at).into_iter().unzip();
            Taken::of(space, columns, sigmas)
        };
        Self {
            effects: model.iter().map(|own| own.active.cause.effect.page().name).collect(),
            taken: (0..model.len()).map(taken).collect(),
        }
    }
}

/// Columns of what is free of one component of a model, with their sigmas: its slopes there, or those of its law; none of one that is there or not.
fn free(problem: &Problem, model: &[Component], at: usize) -> Vec<(Entries, f64)> {
    let cause = &model[at].active.cause;
    match cause.effect.page().nature {
        Nature::Discrete => Vec::new(),
        Nature::Spread => walk::columns(problem, cause),
        Nature::Smooth => {
            let parameters = cause.parameters(problem.twin.unit());
            let sigmas = parameters.iter().map(|own| own.prior_sigma);
            problem.slopes(model, at).into_iter().zip(sigmas).collect()
        }
    }
}

/// An effect that is free, at one of the places where it may be.
#[derive(Clone, Debug)]
pub struct Free {
    /// It.
    pub component: Component,
    /// What its parameters came to where they were fitted: they may be as large here.
    pub sizes: DVector<f64>,
}

impl Free {
    /// One that was fitted, at its place; where the log does not tell that from others, at none and all of them.
    pub fn at_all(fitted: &Component, elsewhere: &[Component]) -> Vec<Self> {
        let sizes = DVector::from_iterator(
            fitted.active.theta.len(),
            fitted.active.theta.iter().map(|own| own.abs()),
        );
        let free = |component: Component| Self {
            component,
            sizes: sizes.clone(),
        };
        if elsewhere.is_empty() {
            return vec![free(fitted.clone())];
        }
        let mut own = fitted.clone();
        own.active.theta.fill(0.0);
        std::iter::once(own)
            .chain(elsewhere.iter().cloned())
            .map(free)
            .collect()
    }
}

/// Columns of all that is free, each for what it is supposed to be or came to, whichever is more.
pub fn opened(problem: &Problem, all: &[Free]) -> Vec<Entries> {
    let model: Vec<Component> = all.iter().map(|own| own.component.clone()).collect();
    let of = |(at, own): (usize, &Free)| -> Vec<Entries> {
        let parameters = own.component.active.cause.parameters(problem.twin.unit());
        let larger = |index: usize| {
            let usual = parameters.get(index).map_or(1.0, |parameter| parameter.prior_sigma);
            let size = own.sizes.get(index).copied().unwrap_or(0.0);
            if usual > 0.0 { (size / usual).max(1.0) } else { 1.0 }
        };
        let is_law = own.component.active.cause.effect.page().nature == Nature::Spread;
        let columns = free(problem, &model, at).into_iter().enumerate();
        columns
            .map(|(index, (column, sigma))| {
                let size = sigma * larger(if is_law { 0 } else { index });
                let scaled = column.into_iter().map(|(channel, values)| (channel, values * size));
                scaled.collect()
            })
            .collect()
    };
    all.iter().enumerate().flat_map(of).collect()
}

/// Takes effects while the evidence asks for one, beside those that are in already.
pub fn choose(
    space: &Space,
    library: &Library,
    residual: &Projected,
    seen: &[Seen],
    first: First,
    progress: &dyn Fn(f64),
) -> Vec<Chosen> {
    let eligible: Vec<&Seen> = (seen.iter())
        .filter(|one| {
            let hypothesis = &library.hypotheses[one.hypothesis];
            // A law that is too small to be named is there all the same, and what has a shape must not be named in its place.
            may_be_named(hypothesis, one.snr) || walk::is_law(hypothesis)
        })
        .collect();
    let rest = space.rest(residual);
    let mut chosen: Vec<Chosen> = Vec::new();
    let mut products = vec![Vec::new(); library.products.len()];
    let First { effects, mut taken } = first;
    while effects.len() + chosen.len() < MOST_CAUSES {
        progress(chosen.len() as f64 / MOST_CAUSES as f64);
        let fit = |one: &&Seen, fit: Option<Fit>| fit.map(|fit| (one.hypothesis, fit));
        let fits: Vec<(usize, Fit)> = if chosen.is_empty() && taken.is_empty() {
            let alone = |one: &&Seen| fit(one, fit_alone(library, one));
            eligible.iter().filter_map(alone).collect()
        } else {
            let is_other = |one: &&&Seen| {
                let mut known = chosen.iter().map(|own| library.hypotheses[own.hypothesis].effect());
                let effect = library.hypotheses[one.hypothesis].effect();
                known.all(|own| own != effect) && !effects.contains(&effect) && !library.is_discrete(one.hypothesis)
            };
            let others: Vec<&Seen> = eligible.iter().filter(is_other).copied().collect();
            let Some(beside) = Beside::of(&taken, &rest) else {
                break;
            };
            let beside = |one: &&Seen| fit(one, beside.fit(library, one, &mut products));
            others.iter().filter_map(beside).collect()
        };
        let Some(next) = likeliest(library, seen, &fits) else {
            break;
        };
        if library.is_discrete(next.hypothesis) {
            // What it does is no small change; nothing is linear beside it.
            chosen.push(next);
            break;
        }
        let places = library.hypotheses[next.hypothesis].small().iter();
        let columns = places.clone().map(|place| library.products.column(*place));
        let sigmas = places.map(|place| library.prior_sigmas[*place]);
        taken.push(Taken::of(space, columns.collect(), sigmas.collect()));
        chosen.push(next);
    }
    chosen
}

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
        let mut screen = Screen::zeros(taken.iter().flat_map(|one| one.sigmas.clone()).collect());
        for (row, column) in columns.iter().enumerate() {
            screen.score[row] = dot(column, rest);
            for (other, rest) in rests.iter().enumerate() {
                screen.information[(row, other)] = dot(column, rest);
            }
        }
        Some(Self {
            log_evidence: screen.of_any_size(parts.clone())?,
            columns,
            rests,
            parts,
            screen,
        })
    }

    /// A hypothesis beside them. `products` are those of each column of the library with theirs, as far as they are known: many hypotheses
    /// have a column in common.
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
fn likeliest(library: &Library, seen: &[Seen], fits: &[(usize, Fit)]) -> Option<Chosen> {
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
    if fit.gain + prior(*best) < EFFECT_MARGIN {
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
        is_same && is_elsewhere && other.gain > fit.gain - EFFECT_MARGIN
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
        probability: own * doubt * itself(excess) * if is_shown { 1.0 } else { UNTOLD },
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
