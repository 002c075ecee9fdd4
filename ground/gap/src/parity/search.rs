//! Which effects the evidence prefers, among those that can be seen.
//!
//! In: the [`Space`], the library, the residual. Out: every hypothesis as it is [`Seen`], and the [`Chosen`] ones. One effect is
//! taken at a time, the likeliest by evidence and prior odds ([`Fit`]); those taken before stay in the fit of the next. Before that, what comes
//! near the likeliest is moved to where it explains most, between the values that were tried ([`between`]).
//!
//! The evidence is that of [`crate::null::evidence`], with its sizes; an effect without parameters has `<d, r> - <d, d> / 2`, `d`
//! being what it does to the readings.

mod between;
mod fit;

use nalgebra::{DMatrix, DVector};
use twin::{effect::Nature, predict::Memory};

use self::fit::{Round, likeliest};
pub use self::{
    between::told_anew,
    fit::{Fit, fit_alone, foremost},
};
use crate::{
    library::{
        column::{Column, Entries},
        hypotheses::{Hypothesis, Library},
    },
    null::problem::{Component, Problem},
    parity::{
        space::{Opened, Projected, Space, dot},
        visible::may_be_named,
        walk,
    },
    thresholds::{MOST_CAUSES, SAID},
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
pub struct Offered<'a> {
    /// Of the library.
    held: Vec<&'a Column>,
    /// Behind them, what those without parameters do.
    made: Vec<Column>,
    sets: Vec<Vec<usize>>,
}

impl<'a> Offered<'a> {
    /// Of a problem's library.
    pub fn of(problem: &Problem, library: &'a Library) -> Self {
        let own = 0..library.products.len();
        let mut offered = Self {
            held: own.map(|place| library.products.held(place)).collect(),
            made: Vec::new(),
            sets: Vec::new(),
        };
        let mut memory = Memory::default();
        for hypothesis in &library.hypotheses {
            if hypothesis.small().is_empty() {
                offered.sets.push(vec![offered.held.len() + offered.made.len()]);
                let made = on_the_whole(problem, hypothesis, &mut memory);
                offered.made.push(Column::of(made));
            } else {
                offered.sets.push(hypothesis.small().to_vec());
            }
        }
        offered
    }

    /// All columns.
    pub fn columns(&self) -> Vec<&Column> {
        self.held.iter().copied().chain(&self.made).collect()
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
    let columns = offered.columns();
    let all = space.within(&columns, opened, &offered.sets, progress);
    (all.into_iter().zip(&offered.sets).enumerate())
        .map(|(at, (information, set))| {
            let columns: Vec<&Column> = set.iter().map(|place| columns[*place]).collect();
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
    fn of(library: &Library, at: usize, columns: &[&Column], information: DMatrix<f64>, rest: &Entries) -> Self {
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
            None => columns[index].dot(columns[index]),
        };
        Self {
            hypothesis: at,
            score: DVector::from_fn(width, |row, _| columns[row].dot_entries(rest)),
            with_reference: ratio(&alone),
            snr: ratio(&|index| information[(index, index)]),
            information,
            price: 0.0,
        }
    }
}

/// Sees hypotheses about another residual, of which motion and calibration leave this; those without columns stay as they are.
pub fn rescore(seen: &mut [Seen], library: &Library, rest: &Entries) {
    for one in seen {
        for (row, place) in library.hypotheses[one.hypothesis].small().iter().enumerate() {
            one.score[row] = library.products.held(*place).dot_entries(rest);
        }
    }
}

/// Information and score of columns, motion and calibration marginalised, beside a residual of which these leave `left`.
pub fn seen_of(space: &Space, columns: &[Entries], left: &Entries) -> (DMatrix<f64>, DVector<f64>) {
    let rests = space.rests(columns);
    let of = |row: usize, column: usize| dot(&columns[row], &rests[column]);
    let score = columns.iter().map(|column| dot(column, left));
    (
        DMatrix::from_fn(columns.len(), columns.len(), of),
        DVector::from_iterator(columns.len(), score),
    )
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
    library: &mut Library,
    residual: &Projected,
    seen: &mut [Seen],
    first: First,
    progress: &dyn Fn(f64),
) -> Vec<Chosen> {
    let rest = space.rest(residual);
    let mut chosen: Vec<Chosen> = Vec::new();
    let mut products = vec![Vec::new(); library.products.len()];
    let First { effects, mut taken } = first;
    while effects.len() + chosen.len() < MOST_CAUSES {
        progress(chosen.len() as f64 / MOST_CAUSES as f64);
        let Some(mut round) = Round::of(&taken, &rest, &mut products) else {
            break;
        };
        let is_offered = |one: &Seen, library: &Library| {
            let hypothesis = &library.hypotheses[one.hypothesis];
            let known = chosen.iter().map(|own| library.hypotheses[own.hypothesis].effect());
            let is_other = effects
                .iter()
                .copied()
                .chain(known)
                .all(|own| own != hypothesis.effect());
            // A law that is too small to be named is there all the same, and what has a shape must not be named in its place.
            let is_eligible = may_be_named(hypothesis, one.snr) || walk::is_law(hypothesis);
            is_eligible && is_other && (taken.is_empty() || !library.is_discrete(one.hypothesis))
        };
        let mut fits: Vec<(usize, Fit)> = (seen.iter())
            .filter(|one| is_offered(one, library))
            .filter_map(|one| Some((one.hypothesis, round.fit(library, one)?)))
            .collect();
        between::move_near(space, library, &rest, &mut round, seen, &mut fits);
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
