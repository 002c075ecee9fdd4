//! Which effects a log speaks for: forward search over the library, each candidate refitted exactly, and pruned back.
//!
//! In: the [`Problem`] and its [`Library`]. Out: an [`Attribution`]: the chosen effects with parameters and covariance, and
//! for each its rivals with their evidence, "nothing" among them.
//!
//! A screen of all hypotheses costs matrices only ([`Screen`]); the best few are then fitted by Gauss-Newton, because a
//! latency of 12 ms is not small for a gyro on a table that starts and stops. An effect is added when its evidence, after
//! the price of its prior odds, is above nothing by [`MARGIN`] nats; each chosen one is then tried against all rivals in its
//! place, and dropped if the rest can do without it.

use nalgebra::{DMatrix, DVector};

use crate::{
    evidence::{Estimate, Screen},
    gram::Normal,
    library::{Entries, Library},
    problem::{Component, Problem},
};

/// [nats] an effect must bring beyond its prior odds: three make a wrong addition one in twenty.
const MARGIN: f64 = 3.0;

/// Candidates of a screen that are fitted exactly.
const CANDIDATES: usize = 6;

/// Effects at once: beyond five no answer was ever right, and shares of the excess cost two to their number.
const MOST_EFFECTS: usize = 5;

/// Gauss-Newton steps: four suffice for the strongest effect tried; eight leave room.
const STEPS: usize = 8;

/// [nats] that are not worth another step.
const CONVERGED: f64 = 0.02;

/// A chosen effect.
#[derive(Clone, Debug)]
pub struct Chosen {
    /// Index of its hypothesis.
    pub hypothesis: usize,
    /// Its parameters.
    pub theta: DVector<f64>,
    /// Their covariance.
    pub covariance: DMatrix<f64>,
    /// [nats] over the model without it, prior odds included.
    pub gain: f64,
    /// Hypotheses that could stand in its place, itself first, with their gain in nats; best first.
    pub rivals: Vec<(usize, f64)>,
}

/// What a log speaks for.
#[derive(Clone, Debug)]
pub struct Attribution {
    /// Strongest first.
    pub chosen: Vec<Chosen>,
    /// Normal equations of the whole library about the chosen model.
    pub screen: Screen,
    /// Gains of every hypothesis on its own, over nothing, in nats with prior odds: what the first screen said.
    pub alone: Vec<f64>,
}

impl Attribution {
    /// The chosen effects as a model.
    pub fn model(&self, library: &Library) -> Vec<Component> {
        self.chosen.iter().map(|chosen| library.hypotheses[chosen.hypothesis].component(&chosen.theta)).collect()
    }
}

/// A set of hypotheses fitted exactly.
#[derive(Clone, Debug)]
struct Refined {
    thetas: Vec<DVector<f64>>,
    estimate: Estimate,
    /// [nats] relative to the same reference for every set.
    log_evidence: f64,
    slopes: Vec<Entries>,
}

/// Searches.
pub fn attribute(problem: &Problem, library: &mut Library, progress: &dyn Fn(f64)) -> Attribution {
    let mut set: Vec<usize> = Vec::new();
    let mut best = refine(problem, library, &set, &[]);
    let mut screen = screen(problem, library, &set, &best);
    let mut alone = Vec::new();
    for round in 0..MOST_EFFECTS {
        progress(round as f64 / MOST_EFFECTS as f64);
        let base = estimate_of(library, &screen, &set);
        let gains = gains(library, &screen, &set, base);
        if round == 0 {
            alone = gains.clone();
        }
        let mut found: Option<(f64, Vec<usize>, Refined)> = None;
        for candidate in leading(&gains, CANDIDATES) {
            let mut larger = set.clone();
            larger.push(candidate);
            let refined = refine(problem, library, &larger, &best.thetas);
            let gain = refined.log_evidence - best.log_evidence + library.hypotheses[candidate].log_prior;
            if is_physical(library, &larger, &refined) && found.as_ref().is_none_or(|(most, ..)| gain > *most) {
                found = Some((gain, larger, refined));
            }
        }
        match found {
            Some((gain, larger, refined)) if gain > MARGIN => {
                (set, best) = (larger, refined);
                (set, best) = prune(problem, library, set, best);
                screen = self::screen(problem, library, &set, &best);
            }
            _ => break,
        }
    }
    let mut chosen = Vec::new();
    for at in 0..set.len() {
        chosen.push(compare(problem, library, &screen, &set, &best, at));
    }
    // A rival that does better in the place of a chosen one takes it; the comparison is then made anew.
    for _ in 0..MOST_EFFECTS {
        let swap = chosen.iter().enumerate().find(|(at, chosen)| {
            chosen.rivals.first().is_some_and(|(rival, gain)| *rival != set[*at] && *gain > chosen.gain)
        });
        let Some((at, winner)) = swap.map(|(at, chosen)| (at, chosen.rivals[0].0)) else { break };
        set[at] = winner;
        let start: Vec<DVector<f64>> = set.iter().enumerate().map(|(i, h)| {
            if i == at { DVector::zeros(library.hypotheses[*h].parameters.len()) } else { best.thetas[i].clone() }
        }).collect();
        best = refine(problem, library, &set, &start);
        screen = self::screen(problem, library, &set, &best);
        chosen = (0..set.len()).map(|at| compare(problem, library, &screen, &set, &best, at)).collect();
    }
    chosen.sort_by(|one, other| other.gain.total_cmp(&one.gain));
    Attribution { chosen, screen, alone }
}

/// Indices of the largest values, largest first.
fn leading(values: &[f64], count: usize) -> Vec<usize> {
    let mut order: Vec<usize> = (0..values.len()).filter(|index| values[*index].is_finite()).collect();
    order.sort_by(|one, other| values[*other].total_cmp(&values[*one]));
    order.truncate(count);
    order
}

/// Columns of a set in the library, the reference's first, and no column twice.
fn places(library: &Library, set: &[usize]) -> Vec<usize> {
    let mut places: Vec<usize> = (0..library.reference).collect();
    for hypothesis in set {
        places.extend(&library.hypotheses[*hypothesis].places);
    }
    places.sort_unstable();
    places.dedup();
    places
}

fn estimate_of(library: &Library, screen: &Screen, set: &[usize]) -> f64 {
    screen.estimate(&places(library, set)).map_or(f64::NEG_INFINITY, |estimate| estimate.log_evidence)
}

/// Gain of adding each hypothesis to a set, prior odds included; one that adds no column gains nothing.
fn gains(library: &Library, screen: &Screen, set: &[usize], base: f64) -> Vec<f64> {
    let known = places(library, set);
    let gain = |(index, hypothesis): (usize, &crate::library::Hypothesis)| {
        let is_new = hypothesis.places.iter().all(|place| !known.contains(place));
        if !is_new || set.contains(&index) {
            return f64::NEG_INFINITY;
        }
        let mut larger = set.to_vec();
        larger.push(index);
        estimate_of(library, screen, &larger) - base + hypothesis.log_prior
    };
    library.hypotheses.iter().enumerate().map(gain).collect()
}

/// Whether parameters that cannot be negative are not, beyond twice their sigma.
fn is_physical(library: &Library, set: &[usize], refined: &Refined) -> bool {
    let mut at = library.reference;
    set.iter().zip(&refined.thetas).all(|(hypothesis, theta)| {
        library.hypotheses[*hypothesis].parameters.iter().zip(theta.iter()).all(|(parameter, value)| {
            let sigma = refined.estimate.covariance[(at, at)].sqrt();
            at += 1;
            parameter.signed || *value > -2.0 * sigma
        })
    })
}

/// Fits a set by Gauss-Newton from `start` (zeros where it is short), the prior about zero.
///
/// The slopes of the library serve until the effect turns out not to be linear: most are, and slopes cost more than all
/// the rest.
fn refine(problem: &Problem, library: &Library, set: &[usize], start: &[DVector<f64>]) -> Refined {
    let width_of = |hypothesis: &usize| library.hypotheses[*hypothesis].parameters.len();
    let begin = |(index, hypothesis): (usize, &usize)| {
        let width = width_of(hypothesis);
        start.get(index).filter(|theta| theta.len() == width).cloned().unwrap_or_else(|| DVector::zeros(width))
    };
    let mut thetas: Vec<DVector<f64>> = set.iter().enumerate().map(begin).collect();
    let mut slopes: Vec<Entries> = library.columns[..library.reference].to_vec();
    slopes.extend(set.iter().flat_map(|h| &library.hypotheses[*h].places).map(|place| library.columns[*place].clone()));
    let mut best: Option<Refined> = None;
    for step in 0..STEPS {
        let point = Point::at(problem, library, set, &thetas, &slopes);
        if best.as_ref().is_some_and(|best| point.log_evidence < best.log_evidence - CONVERGED && step > 2) {
            // Too long a step: half way back.
            let old = best.as_ref().map(|best| best.thetas.clone()).unwrap_or_default();
            thetas = thetas.iter().zip(&old).map(|(new, old)| (new + old) * 0.5).collect();
            continue;
        }
        let is_done = point.to_gain < CONVERGED;
        let mut next = Vec::new();
        let mut from = library.reference;
        for hypothesis in set {
            next.push(point.estimate.parameters.rows(from, width_of(hypothesis)).into_owned());
            from += width_of(hypothesis);
        }
        if best.as_ref().is_none_or(|best| point.log_evidence > best.log_evidence) {
            best = Some(Refined {
                thetas: thetas.clone(),
                estimate: point.estimate,
                log_evidence: point.log_evidence,
                slopes: slopes.clone(),
            });
        }
        if is_done {
            break;
        }
        if step > 0 {
            slopes.truncate(library.reference);
            let model = model_of(library, set, &thetas);
            slopes.extend((0..set.len()).flat_map(|index| problem.slopes(&model, index)));
            let anew = Point::at(problem, library, set, &thetas, &slopes);
            from = library.reference;
            next.clear();
            for hypothesis in set {
                next.push(anew.estimate.parameters.rows(from, width_of(hypothesis)).into_owned());
                from += width_of(hypothesis);
            }
        }
        thetas = next;
    }
    best.unwrap_or_else(|| Refined {
        estimate: nothing(slopes.len()),
        thetas,
        log_evidence: f64::NEG_INFINITY,
        slopes,
    })
}

fn model_of(library: &Library, set: &[usize], thetas: &[DVector<f64>]) -> Vec<Component> {
    set.iter().zip(thetas).map(|(hypothesis, theta)| library.hypotheses[*hypothesis].component(theta)).collect()
}

/// The problem made linear at some parameters.
struct Point {
    estimate: Estimate,
    /// [nats] the evidence of a prior about zero, were these parameters the best.
    log_evidence: f64,
    /// [nats] what the linear problem's optimum promises beyond these parameters.
    to_gain: f64,
}

impl Point {
    fn at(problem: &Problem, library: &Library, set: &[usize], thetas: &[DVector<f64>], slopes: &[Entries]) -> Self {
        let model = model_of(library, set, thetas);
        let mut values = vec![0.0; library.reference];
        let mut sigmas = library.prior_sigmas[..library.reference].to_vec();
        for (hypothesis, theta) in set.iter().zip(thetas) {
            values.extend(theta.iter());
            sigmas.extend(library.hypotheses[*hypothesis].parameters.iter().map(|parameter| parameter.prior_sigma));
        }
        let mut screen = Screen::zeros(sigmas.clone());
        let mut energy = 0.0;
        for (channel, frame) in problem.frames.iter().enumerate() {
            let entries = slopes.iter().enumerate().filter_map(|(place, entries)| {
                entries.iter().find(|(index, _)| *index == channel).map(|(_, values)| (place, values))
            });
            let (places, columns): (Vec<usize>, Vec<&DVector<f64>>) = entries.unzip();
            if places.is_empty() {
                energy += frame.quiet_energy;
                continue;
            }
            let mut about_zero = problem.residual(channel, &model);
            let mut effects = DMatrix::zeros(about_zero.len(), places.len());
            for (index, (place, column)) in places.iter().zip(columns).enumerate() {
                effects.set_column(index, column);
                about_zero.axpy(values[*place], column, 1.0);
            }
            let normal = frame.normal(&effects, &about_zero);
            energy += normal.energy;
            screen.add(&places, &normal);
        }
        let all: Vec<usize> = (0..values.len()).collect();
        let Some(estimate) = screen.estimate(&all) else {
            return Point { estimate: nothing(values.len()), log_evidence: f64::NEG_INFINITY, to_gain: 0.0 };
        };
        let away = DVector::from_fn(values.len(), |index, _| {
            if index < library.reference { 0.0 } else { estimate.parameters[index] - values[index] }
        });
        let prior: f64 = away.iter().zip(&sigmas).map(|(away, sigma)| (away / sigma).powi(2)).sum();
        let to_gain = 0.5 * (away.dot(&(&screen.information * &away)) + prior);
        Point {
            log_evidence: estimate.log_evidence - 0.5 * energy - to_gain,
            to_gain,
            estimate,
        }
    }
}

fn nothing(width: usize) -> Estimate {
    Estimate {
        parameters: DVector::zeros(width),
        covariance: DMatrix::zeros(width, width),
        log_evidence: f64::NEG_INFINITY,
        energy_explained: 0.0,
    }
}

/// Normal equations of the whole library about a refined set, whose own columns are renewed in place.
fn screen(problem: &Problem, library: &mut Library, set: &[usize], refined: &Refined) -> Screen {
    let mut slopes = refined.slopes.iter().skip(library.reference);
    for hypothesis in set {
        for place in library.hypotheses[*hypothesis].places.clone() {
            if let Some(slope) = slopes.next() {
                library.columns[place] = slope.clone();
            }
        }
    }
    let model = model_of(library, set, &refined.thetas);
    let mut screen = Screen::zeros(library.prior_sigmas.clone());
    for (channel, normal) in normals(problem, library, set, &refined.thetas, &model) {
        screen.add(&channel, &normal);
    }
    screen
}

/// Each channel's normal equations over the library columns that touch it, the set's parameters counted from zero.
fn normals(problem: &Problem, library: &Library, set: &[usize], thetas: &[DVector<f64>], model: &[Component]) -> Vec<(Vec<usize>, Normal)> {
    let mut value_of = vec![0.0; library.columns.len()];
    for (hypothesis, theta) in set.iter().zip(thetas) {
        for (place, value) in library.hypotheses[*hypothesis].places.iter().zip(theta.iter()) {
            value_of[*place] = *value;
        }
    }
    let mut normals = Vec::new();
    for (channel, frame) in problem.frames.iter().enumerate() {
        let (places, columns) = library.of_channel(channel);
        let mut residual = problem.residual(channel, model);
        let mut effects = DMatrix::zeros(frame.series.rows.len(), places.len());
        for (index, (place, values)) in places.iter().zip(columns).enumerate() {
            effects.set_column(index, values);
            residual.axpy(value_of[*place], values, 1.0);
        }
        normals.push((places, frame.normal(&effects, &residual)));
    }
    normals
}

/// Drops members the others can do without.
fn prune(problem: &Problem, library: &Library, set: Vec<usize>, best: Refined) -> (Vec<usize>, Refined) {
    let (mut set, mut best) = (set, best);
    let mut at = 0;
    while at < set.len() && set.len() > 1 {
        let (mut smaller, mut thetas) = (set.clone(), best.thetas.clone());
        let dropped = smaller.remove(at);
        thetas.remove(at);
        let refined = refine(problem, library, &smaller, &thetas);
        if best.log_evidence - refined.log_evidence + library.hypotheses[dropped].log_prior < 0.0 {
            (set, best) = (smaller, refined);
            at = 0;
        } else {
            at += 1;
        }
    }
    (set, best)
}

/// One member against all that could stand in its place.
fn compare(problem: &Problem, library: &Library, screen: &Screen, set: &[usize], best: &Refined, at: usize) -> Chosen {
    let (mut others, mut thetas) = (set.to_vec(), best.thetas.clone());
    let own = others.remove(at);
    thetas.remove(at);
    let without = refine(problem, library, &others, &thetas);
    let base = estimate_of(library, screen, &others);
    let mut rivals = vec![(own, best.log_evidence - without.log_evidence + library.hypotheses[own].log_prior)];
    let mut linear = gains(library, screen, &others, base);
    linear[own] = f64::NEG_INFINITY;
    for rival in leading(&linear, CANDIDATES) {
        let mut tried = others.clone();
        tried.push(rival);
        let refined = refine(problem, library, &tried, &thetas);
        if is_physical(library, &tried, &refined) {
            rivals.push((rival, refined.log_evidence - without.log_evidence + library.hypotheses[rival].log_prior));
        }
    }
    rivals.sort_by(|one, other| other.1.total_cmp(&one.1));
    let from = library.reference + set[..at].iter().map(|h| library.hypotheses[*h].parameters.len()).sum::<usize>();
    let width = best.thetas[at].len();
    Chosen {
        hypothesis: own,
        theta: best.thetas[at].clone(),
        covariance: best.estimate.covariance.view((from, from), (width, width)).into_owned(),
        gain: best.log_evidence - without.log_evidence + library.hypotheses[own].log_prior,
        rivals,
    }
}
