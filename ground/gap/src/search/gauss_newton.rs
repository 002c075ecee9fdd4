//! Exact fits of a few hypotheses together, by Gauss-Newton with the prior about zero, and their evidence.
//!
//! In: the [`Problem`], the [`Library`] and a set of its hypotheses. Out: [`Refined`], whose evidence can be compared with that
//! of any other set on the same problem: `-1/2 (r'Pr + theta' D^-2 theta) - 1/2 ln det(I + D I D)` at the best parameters,
//! the residual exact there, the curvature that of its linearisation (Laplace), and effects of any of their sizes counted in.
//! Parameters and covariance are those of the usual size, which data that say anything outweigh; so what is sought further does not lean on
//! a patch that is as large as it needs to be. Of a set that is settled [`at_likeliest_size`] gives those of the size that suits each effect best.

use nalgebra::{DMatrix, DVector};
use twin::predict::Memory;

use crate::{
    library::{column::Entries, hypotheses::Library},
    null::{
        evidence::{Estimate, Screen},
        problem::{Component, Problem},
    },
};

/// Gauss-Newton steps: four suffice for the strongest effect tried; eight leave room.
const STEPS: usize = 8;

/// \[nats\] that are not worth another step.
const CONVERGED: f64 = 0.05;

/// \[nats\] above which the slopes are worth renewing.
const CURVED: f64 = 1.0;

/// Part of what a set explains that is not worth a step, or new slopes: where effects explain a hundred thousand nats, no
/// model is right to one.
const NEGLIGIBLE: [f64; 2] = [1e-5, 1e-4];

/// A set of hypotheses fitted exactly.
#[derive(Clone, Debug)]
pub struct Refined {
    /// Parameters of each.
    pub thetas: Vec<DVector<f64>>,
    /// Of the linear problem there: parameters in the order of the reference's columns, then the set's.
    pub estimate: Estimate,
    /// \[nats\] relative to the same reference for every set.
    pub log_evidence: f64,
    /// Columns there, in the same order.
    pub slopes: Vec<Entries>,
}

/// Fits a set by Gauss-Newton from `start` (zeros where it is short), the prior about zero.
///
/// The slopes of the library serve until the effect turns out not to be linear: most are, and slopes cost more than all
/// the rest.
pub fn refine(problem: &Problem, library: &Library, set: &[usize], start: &[DVector<f64>]) -> Refined {
    refine_at(problem, library, set, start, Size::Usual)
}

/// The same with the size for each effect that suits it best. At the usual one an effect that is large is drawn to zero wherever the calibration
/// can take its place at a lower price: of a field that was 13 uT wrong 3 uT were left, and the calibration did the rest on the fitted windows.
pub fn at_likeliest_size(problem: &Problem, library: &Library, set: &[usize], start: &[DVector<f64>]) -> Refined {
    refine_at(problem, library, set, start, Size::Likeliest)
}

/// For which size of each effect the parameters are the most probable ones.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Size {
    Usual,
    Likeliest,
}

fn refine_at(problem: &Problem, library: &Library, set: &[usize], start: &[DVector<f64>], size: Size) -> Refined {
    let width_of = |hypothesis: &usize| library.hypotheses[*hypothesis].parameters.len();
    let begin = |(index, hypothesis): (usize, &usize)| {
        let width = width_of(hypothesis);
        start
            .get(index)
            .filter(|theta| theta.len() == width)
            .cloned()
            .unwrap_or_else(|| DVector::zeros(width))
    };
    let mut thetas: Vec<DVector<f64>> = set.iter().enumerate().map(begin).collect();
    let own = set
        .iter()
        .flat_map(|hypothesis| library.hypotheses[*hypothesis].places.iter().copied());
    let mut slopes: Vec<Entries> = (0..library.reference)
        .chain(own)
        .map(|place| library.products.column(place))
        .collect();
    let mut best: Option<Refined> = None;
    for step in 0..STEPS {
        let point = Point::at(problem, library, set, &thetas, &slopes, size);
        if best
            .as_ref()
            .is_some_and(|best| point.log_evidence < best.log_evidence - CONVERGED && step > 2)
        {
            // Too long a step: half way back.
            let old = best.as_ref().map(|best| best.thetas.clone()).unwrap_or_default();
            thetas = thetas.iter().zip(&old).map(|(new, old)| (new + old) * 0.5).collect();
            continue;
        }
        let explained = 0.5 * point.estimate.energy_explained;
        // A parameter that does nothing while others are zero has its slope only where they are not.
        let is_silent = step < 2 && slopes.iter().skip(library.reference).any(is_zero);
        let is_done = !is_silent && point.to_gain < CONVERGED + NEGLIGIBLE[0] * explained;
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
        if step > 0 && (is_silent || point.to_gain > CURVED + NEGLIGIBLE[1] * explained) {
            slopes.truncate(library.reference);
            let model = model_of(library, set, &thetas);
            slopes.extend((0..set.len()).flat_map(|index| problem.slopes(&model, index)));
            let anew = Point::at(problem, library, set, &thetas, &slopes, size);
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

/// Evidence that a set would have at its best parameters if it were linear about these, with the library's columns and, for its last member,
/// those of `last`.
pub fn promised(problem: &Problem, library: &Library, set: &[usize], thetas: &[DVector<f64>], last: &[Entries]) -> f64 {
    let others = set.iter().rev().skip(1).rev();
    let own = others.flat_map(|hypothesis| library.hypotheses[*hypothesis].places.iter().copied());
    let slopes: Vec<Entries> = (0..library.reference)
        .chain(own)
        .map(|place| library.products.column(place))
        .chain(last.iter().cloned())
        .collect();
    let point = Point::at(problem, library, set, thetas, &slopes, Size::Usual);
    point.log_evidence + point.to_gain
}

fn is_zero(entries: &Entries) -> bool {
    entries
        .iter()
        .all(|(_, values)| values.iter().all(|value| *value == 0.0))
}

/// A set with its parameters, as a model.
pub fn model_of(library: &Library, set: &[usize], thetas: &[DVector<f64>]) -> Vec<Component> {
    set.iter()
        .zip(thetas)
        .map(|(hypothesis, theta)| library.hypotheses[*hypothesis].component(theta))
        .collect()
}

/// The problem made linear at some parameters.
struct Point {
    estimate: Estimate,
    /// \[nats\] the evidence of a prior about zero, were these parameters the best.
    log_evidence: f64,
    /// \[nats\] what the linear problem's optimum promises beyond these parameters.
    to_gain: f64,
}

impl Point {
    fn at(
        problem: &Problem,
        library: &Library,
        set: &[usize],
        thetas: &[DVector<f64>],
        slopes: &[Entries],
        size: Size,
    ) -> Self {
        let model = model_of(library, set, thetas);
        let mut values = vec![0.0; library.reference];
        let mut sigmas = library.prior_sigmas[..library.reference].to_vec();
        let mut parts = Vec::new();
        for (hypothesis, theta) in set.iter().zip(thetas) {
            parts.push(values.len()..values.len() + theta.len());
            values.extend(theta.iter());
            sigmas.extend(
                library.hypotheses[*hypothesis]
                    .parameters
                    .iter()
                    .map(|parameter| parameter.prior_sigma),
            );
        }
        let mut screen = Screen::zeros(sigmas);
        let of_channel = |channel: usize, memory: &mut Memory| {
            let frame = &problem.frames[channel];
            let entries = slopes.iter().enumerate().filter_map(|(place, entries)| {
                entries
                    .iter()
                    .find(|(index, _)| *index == channel)
                    .map(|(_, values)| (place, values))
            });
            let (places, columns): (Vec<usize>, Vec<&DVector<f64>>) = entries.unzip();
            let is_touched = |component: &Component| component.active.touches(channel, problem.twin.unit());
            if !model.iter().any(is_touched) && places.is_empty() {
                return None;
            }
            let mut about_zero = problem.residual_with(channel, &model, memory);
            let mut effects = DMatrix::zeros(about_zero.len(), places.len());
            for (index, (place, column)) in places.iter().zip(columns).enumerate() {
                effects.set_column(index, column);
                about_zero.axpy(values[*place], column, 1.0);
            }
            let normal = frame.normal(&effects, &about_zero);
            Some((places, normal))
        };
        let mut energy = 0.0;
        for (frame, own) in problem.frames.iter().zip(problem.each_channel(of_channel)) {
            match own {
                Some((places, normal)) => {
                    energy += normal.energy;
                    screen.add(&places, &normal);
                }
                None => energy += frame.quiet_energy,
            }
        }
        let all: Vec<usize> = (0..values.len()).collect();
        let of_any_size = match size {
            Size::Usual => screen.of_any_size(parts),
            Size::Likeliest => {
                let of_other_sizes = screen.settle(parts);
                screen.log_evidence().map(|evidence| evidence + of_other_sizes)
            }
        };
        let Some((estimate, log_evidence)) = screen.estimate(&all).zip(of_any_size) else {
            return Point {
                estimate: nothing(values.len()),
                log_evidence: f64::NEG_INFINITY,
                to_gain: 0.0,
            };
        };
        let away = DVector::from_fn(values.len(), |index, _| {
            if index < library.reference {
                0.0
            } else {
                estimate.parameters[index] - values[index]
            }
        });
        let prior: f64 = away
            .iter()
            .zip(&screen.prior_sigmas)
            .map(|(away, sigma)| (away / sigma).powi(2))
            .sum();
        let to_gain = 0.5 * (away.dot(&(&screen.information * &away)) + prior);
        Point {
            log_evidence: log_evidence - 0.5 * energy - to_gain,
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
