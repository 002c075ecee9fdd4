//! Which effects the evidence prefers, among those that can be seen.
//!
//! In: the [`Space`], the library, the residual. Out: every hypothesis as it is [`Seen`], and the [`Chosen`] ones. One effect is
//! taken at a time, the likeliest by evidence and prior odds; those taken before stay in the fit of the next.
//!
//! The evidence is that of [`crate::null::evidence`], with its sizes; an effect without parameters has `<d, r> - <d, d> / 2`, `d`
//! being what it does to the readings.

use std::iter::once;

use nalgebra::{DMatrix, DVector};
use twin::effect::Nature;

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
        space::{Projected, Space},
        visible::may_be_named,
    },
    search::odds::{itself, oversize},
    thresholds::{DOUBT_STEP, DOUBTED, EFFECT_MARGIN, MOST_CAUSES, SAID, TEMPERATURE},
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

/// Every hypothesis, alone. `progress` is told how far it is.
pub fn look(space: &Space, library: &Library, residual: &Projected, progress: &dyn Fn(f64)) -> Vec<Seen> {
    let all: Vec<usize> = (0..library.hypotheses.len()).collect();
    let mut seen = Vec::new();
    each(space, library, &all, &mut |at, columns| {
        let hypothesis = &library.hypotheses[at];
        seen.push(seen_as(space, library, hypothesis, at, columns, residual));
        progress((at + 1) as f64 / library.hypotheses.len() as f64);
    });
    seen
}

fn seen_as(
    space: &Space,
    library: &Library,
    hypothesis: &Hypothesis,
    at: usize,
    columns: &[&Projected],
    residual: &Projected,
) -> Seen {
    let width = columns.len();
    let mut information = DMatrix::zeros(width, width);
    for row in 0..width {
        (0..=row).for_each(|column| information[(row, column)] = space.inner(columns[row], columns[column]));
    }
    information.fill_upper_triangle_with_lower_triangle();
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
        None => columns[index]
            .column
            .iter()
            .map(|(_, values)| values.norm_squared())
            .sum(),
    };
    Seen {
        hypothesis: at,
        score: DVector::from_fn(width, |row, _| space.inner(columns[row], residual)),
        with_reference: ratio(&alone),
        snr: ratio(&|index| information[(index, index)]),
        information,
    }
}

/// Gives every hypothesis its projected columns, an effect at a time: they are too many to be kept.
fn each(space: &Space, library: &Library, wanted: &[usize], with: &mut dyn FnMut(usize, &[&Projected])) {
    let mut wanted = wanted.iter().copied().peekable();
    while let Some(first) = wanted.peek().copied() {
        let effect = library.hypotheses[first].effect();
        let mut own = Vec::new();
        while let Some(next) = wanted.next_if(|at| library.hypotheses[*at].effect() == effect) {
            own.push(next);
        }
        let mut places: Vec<usize> = own
            .iter()
            .flat_map(|at| library.hypotheses[*at].small().to_vec())
            .collect();
        places.sort_unstable();
        places.dedup();
        let projected = space.project(
            places
                .iter()
                .map(|place| library.products.column(*place).clone())
                .collect(),
        );
        for at in own {
            let hypothesis = &library.hypotheses[at];
            if hypothesis.small().is_empty() {
                let whole = space.project(vec![on_the_whole(space, hypothesis)]);
                with(at, &whole.iter().collect::<Vec<_>>());
                continue;
            }
            let find = |place: &usize| places.binary_search(place).ok().map(|at| &projected[at]);
            let columns: Vec<&Projected> = hypothesis.small().iter().filter_map(find).collect();
            with(at, &columns);
        }
    }
}

/// What an effect that is there or not does to the readings.
fn on_the_whole(space: &Space, hypothesis: &Hypothesis) -> Entries {
    let model = [Component {
        active: hypothesis.active(&DVector::zeros(hypothesis.parameters.len())),
        span: None,
    }];
    space.problem.contribution(&model, 0)
}

/// Effects that are in the residual's model before anything is sought: their slopes there, free in every fit.
#[derive(Default)]
pub struct First {
    effects: Vec<&'static str>,
    taken: Vec<(Vec<Projected>, Vec<f64>)>,
}

impl First {
    /// These.
    pub fn of(space: &Space, model: &[Component]) -> Self {
        let unit = space.problem.twin.unit();
        let slopes = |(at, component): (usize, &Component)| {
            let cause = &component.active.cause;
            if cause.effect.page().nature == Nature::Discrete {
                return (Vec::new(), Vec::new());
            }
            let sigmas = cause.parameters(unit).iter().map(|own| own.prior_sigma).collect();
            (space.project(space.problem.slopes(model, at)), sigmas)
        };
        Self {
            effects: model.iter().map(|own| own.active.cause.effect.page().name).collect(),
            taken: model.iter().enumerate().map(slopes).collect(),
        }
    }
}

/// Takes effects while the evidence asks for one, beside those that are in already.
pub fn choose(
    space: &Space,
    library: &Library,
    residual: &Projected,
    seen: &[Seen],
    first: &First,
    progress: &dyn Fn(f64),
) -> Vec<Chosen> {
    let eligible: Vec<usize> = (seen.iter())
        .filter(|one| may_be_named(&library.hypotheses[one.hypothesis], one.snr))
        .map(|one| one.hypothesis)
        .collect();
    let mut chosen: Vec<Chosen> = Vec::new();
    let mut taken = first.taken.clone();
    while first.effects.len() + chosen.len() < MOST_CAUSES {
        progress(chosen.len() as f64 / MOST_CAUSES as f64);
        let mut fits: Vec<(usize, Fit)> = Vec::new();
        if chosen.is_empty() && taken.is_empty() {
            for one in seen.iter().filter(|one| eligible.contains(&one.hypothesis)) {
                fits.extend(fit_alone(library, one).map(|fit| (one.hypothesis, fit)));
            }
        } else {
            let is_other = |at: &usize| {
                let mut known = chosen.iter().map(|own| library.hypotheses[own.hypothesis].effect());
                let effect = library.hypotheses[*at].effect();
                known.all(|own| own != effect) && !first.effects.contains(&effect)
            };
            let others: Vec<usize> = eligible
                .iter()
                .copied()
                .filter(is_other)
                .filter(|at| !library.is_discrete(*at))
                .collect();
            each(space, library, &others, &mut |at, columns| {
                let sigmas: Vec<f64> = library.hypotheses[at]
                    .small()
                    .iter()
                    .map(|place| library.prior_sigmas[*place])
                    .collect();
                fits.extend(fit_beside(space, &taken, columns, sigmas, residual).map(|fit| (at, fit)));
            });
        }
        let Some(next) = likeliest(library, seen, &fits) else {
            break;
        };
        if library.is_discrete(next.hypothesis) {
            // What it does is no small change; nothing is linear beside it.
            chosen.push(next);
            break;
        }
        let hypothesis = &library.hypotheses[next.hypothesis];
        let columns = hypothesis
            .small()
            .iter()
            .map(|place| library.products.column(*place).clone())
            .collect();
        let sigmas = hypothesis
            .small()
            .iter()
            .map(|place| library.prior_sigmas[*place])
            .collect();
        taken.push((space.project(columns), sigmas));
        chosen.push(next);
    }
    chosen
}

struct Fit {
    gain: f64,
    theta: DVector<f64>,
    covariance: DMatrix<f64>,
    energy: f64,
}

fn fit_alone(library: &Library, seen: &Seen) -> Option<Fit> {
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
    let gain = screen.of_any_size(once(0..width))?;
    screen.settle(once(0..width));
    let estimate = screen.estimate(&(0..width).collect::<Vec<_>>())?;
    Some(Fit {
        gain,
        energy: estimate.parameters.dot(&(&seen.information * &estimate.parameters)),
        theta: estimate.parameters,
        covariance: estimate.covariance,
    })
}

/// Beside effects that were taken, whose parameters are free in the same fit.
fn fit_beside(
    space: &Space,
    taken: &[(Vec<Projected>, Vec<f64>)],
    columns: &[&Projected],
    sigmas: Vec<f64>,
    residual: &Projected,
) -> Option<Fit> {
    let mut all: Vec<&Projected> = taken.iter().flat_map(|(columns, _)| columns).collect();
    let mut all_sigmas: Vec<f64> = taken.iter().flat_map(|(_, sigmas)| sigmas.clone()).collect();
    let mut parts = Vec::new();
    let mut from = 0;
    for (columns, _) in taken {
        parts.push(from..from + columns.len());
        from += columns.len();
    }
    let screen = |all: &[&Projected], sigmas: Vec<f64>| {
        let mut screen = Screen::zeros(sigmas);
        for (row, one) in all.iter().enumerate() {
            screen.score[row] = space.inner(one, residual);
            for (column, other) in all.iter().enumerate() {
                screen.information[(row, column)] = space.inner(one, other);
            }
        }
        screen
    };
    let before = screen(&all, all_sigmas.clone()).of_any_size(parts.clone())?;
    all.extend(columns);
    all_sigmas.extend(sigmas);
    parts.push(from..all.len());
    let mut both = screen(&all, all_sigmas);
    let gain = both.of_any_size(parts.clone())? - before;
    both.settle(parts);
    let estimate = both.estimate(&(0..all.len()).collect::<Vec<_>>())?;
    let width = all.len() - from;
    let theta = estimate.parameters.rows(from, width).into_owned();
    let own = both.information.view((from, from), (width, width));
    Some(Fit {
        gain,
        energy: theta.dot(&(own * &theta)),
        covariance: estimate.covariance.view((from, from), (width, width)).into_owned(),
        theta,
    })
}

/// The likeliest, if it is likelier than nothing by the margin of a name.
fn likeliest(library: &Library, seen: &[Seen], fits: &[(usize, Fit)]) -> Option<Chosen> {
    let prior = |at: usize| library.hypotheses[at].log_prior;
    let (best, fit) = (fits.iter()).max_by(|one, other| {
        let score = |(at, fit): &(usize, Fit)| fit.gain / TEMPERATURE + prior(*at);
        score(one).total_cmp(&score(other))
    })?;
    if fit.gain + prior(*best) < EFFECT_MARGIN {
        return None;
    }
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
    let hypothesis = &library.hypotheses[*best];
    let own = by_effect
        .iter()
        .find(|(name, _)| *name == hypothesis.effect())
        .map_or(0.0, |(_, sum)| *sum);
    by_effect.retain(|(name, _)| *name != hypothesis.effect());
    by_effect.sort_by(|one, other| other.1.total_cmp(&one.1));
    let excess = oversize(hypothesis.cause.effect.page(), &fit.theta, &hypothesis.parameters);
    let doubt = 1.0 / (1.0 + ((DOUBTED - fit.gain) / DOUBT_STEP).exp());
    let is_as_good = |(at, other): &&(usize, Fit)| {
        let is_same = library.hypotheses[*at].effect() == hypothesis.effect();
        let is_elsewhere = library.hypotheses[*at].cause.locality != hypothesis.cause.locality;
        is_same && is_elsewhere && other.gain > fit.gain - EFFECT_MARGIN
    };
    Some(Chosen {
        hypothesis: *best,
        elsewhere: fits.iter().filter(is_as_good).map(|(at, _)| *at).collect(),
        theta: fit.theta.clone(),
        covariance: fit.covariance.clone(),
        gain: fit.gain,
        snr: seen
            .iter()
            .find(|one| one.hypothesis == *best)
            .map_or(0.0, |one| one.snr),
        found_snr: fit.energy.max(0.0).sqrt(),
        // Beyond its largest size it stands for something else, as in the search with a reference.
        probability: own * doubt * itself(excess),
        rivals: by_effect,
    })
}
