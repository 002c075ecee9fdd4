//! A zero that walks more than described, as an effect among others.
//!
//! In: a problem about a motion. Out: hypotheses of `gyro-bias-walk` in the library ([`offer`]), with columns of its course.
//!
//! A walk is no shape but a law: effects that are on the scatter have no columns, and without this one a walk is
//! named as whichever step, ramp or temperature comes near to its course. A walk `s W(t)` over `T` is, by Karhunen and Loeve,
//!
//! ```text
//! s W(t) = sum a_k sin(x_k t/T),   a_k normal with sigma s sqrt(2 T)/x_k,   x_k = (k - 1/2) pi
//! ```
//!
//! so the evidence of that many free columns with these sigmas is the evidence of the law; a law pays for its freedom, and one course that is
//! right pays less. The first [`TERMS`] hold all but 2 % of its energy (the rest is `2/pi^2 sum 1/(k - 1/2)^2`). What it comes to in
//! another stretch of time nothing says. The held-out windows are asked whether they have a walk of their own
//! ([`crate::parity::smoothed::walked_on`]).

use nalgebra::{DMatrix, DVector};
use twin::{
    effect::{Active, Cause, LIBRARY, Locality, Nature, Parameter, by_name},
    predict::Kind,
};

use crate::{
    library::{
        column::{Column, Entries},
        hypotheses::{Hypothesis, Library},
    },
    null::problem::Problem,
};

/// The effect.
const NAME: &str = "gyro-bias-walk";

/// Terms of each zero.
const TERMS: usize = 12;

/// Adds its hypotheses to a library: each gyro, and every one its own.
pub fn offer(problem: &Problem, library: &mut Library, withheld: &[String]) {
    let Some(effect) = by_name(NAME).filter(|_| withheld.iter().all(|name| name != NAME)) else {
        return;
    };
    let unit = problem.twin.unit();
    let is_offered = |locality: &Locality| matches!(locality, Locality::All | Locality::Channel(_));
    let localities: Vec<Locality> = effect.localities(unit).into_iter().filter(is_offered).collect();
    let singles = localities.iter().filter(|own| **own != Locality::All).count();
    let mut known: Vec<(usize, Vec<usize>)> = Vec::new();
    for locality in localities {
        // Half to the widest place, as in the library.
        let shared = if locality == Locality::All { 1 } else { singles };
        let cause = Cause {
            effect,
            locality,
            variant: 0.0,
        };
        let mut places = Vec::new();
        for channel in cause.channels(unit) {
            let own = match known.iter().find(|(own, _)| *own == channel) {
                Some((_, own)) => own.clone(),
                None => {
                    let own = of_channel(problem, channel, prior_sigma(&cause, problem)).into_iter();
                    let own: Vec<usize> = own
                        .map(|(column, sigma)| {
                            library.prior_sigmas.push(sigma);
                            library.products.push(problem, Column::of(column))
                        })
                        .collect();
                    known.push((channel, own.clone()));
                    own
                }
            };
            places.extend(own);
        }
        library.hypotheses.push(Hypothesis {
            parameters: cause.parameters(unit),
            cause,
            places,
            log_prior: -((2 * shared * LIBRARY.len()) as f64).ln(),
            span: None,
        });
    }
}

/// Its columns with their sigmas, of a cause that is one.
pub fn columns(problem: &Problem, cause: &Cause) -> Vec<(Entries, f64)> {
    let sigma = prior_sigma(cause, problem);
    let channels = cause.channels(problem.twin.unit());
    channels
        .into_iter()
        .flat_map(|channel| of_channel(problem, channel, sigma))
        .collect()
}

/// Its columns with the sigmas that go with its parameters, of a cause that is one.
pub fn as_strong_as(problem: &Problem, walk: &Active) -> Vec<(Entries, f64)> {
    let usual = prior_sigma(&walk.cause, problem);
    let mut columns = columns(problem, &walk.cause);
    for (own, size) in columns.chunks_mut(TERMS).zip(&walk.theta) {
        own.iter_mut().for_each(|(_, sigma)| *sigma *= size / usual);
    }
    columns
}

fn prior_sigma(cause: &Cause, problem: &Problem) -> f64 {
    let parameters = cause.parameters(problem.twin.unit());
    parameters.first().map_or(0.0, |parameter| parameter.prior_sigma)
}

fn of_channel(problem: &Problem, channel: usize, walk: f64) -> Vec<(Entries, f64)> {
    let starts_s = problem.twin.starts_s();
    let (from_s, span_s) = match starts_s {
        [first, .., last] => (*first, last - first),
        _ => return Vec::new(),
    };
    let frame = &problem.frames[channel];
    if problem.twin.unit().channels[channel].sensor != Kind::Gyro || frame.series.rows.is_empty() {
        return Vec::new();
    }
    let of_term = |term: usize| {
        let x = (term as f64 - 0.5) * core::f64::consts::PI;
        let rows = frame.series.rows.iter();
        let values = rows.map(|row| (x * (starts_s[*row as usize] - from_s) / span_s).sin());
        let column = frame.white(DVector::from_iterator(frame.series.rows.len(), values));
        (vec![(channel, column)], walk * (2.0 * span_s).sqrt() / x)
    };
    (1..=TERMS).map(of_term).collect()
}

/// Whether a hypothesis has columns of a law and not of its parameters.
pub fn is_law(hypothesis: &Hypothesis) -> bool {
    hypothesis.cause.effect.page().nature == Nature::Spread
}

/// What the columns of a law come to in its own parameters, and their covariance: of each channel the root mean square of what its terms are in
/// units of theirs, which so many terms know to one part in `sqrt(2 n)`.
pub fn in_parameters(
    library: &Library,
    hypothesis: &Hypothesis,
    theta: &DVector<f64>,
    covariance: &DMatrix<f64>,
) -> (DVector<f64>, DMatrix<f64>) {
    let squares: Vec<f64> = (hypothesis.places.iter().enumerate())
        .map(|(at, place)| {
            let square = theta[at].powi(2) + covariance[(at, at)].max(0.0);
            square / library.prior_sigmas[*place].powi(2)
        })
        .collect();
    let of = |(own, parameter): (&[f64], &Parameter)| {
        parameter.prior_sigma * (own.iter().sum::<f64>() / own.len().max(1) as f64).sqrt()
    };
    let sizes: Vec<f64> = squares.chunks(TERMS).zip(&hypothesis.parameters).map(of).collect();
    let sizes = DVector::from_vec(sizes);
    let variances = sizes.map(|size| size * size / (2 * TERMS) as f64);
    (sizes, DMatrix::from_diagonal(&variances))
}
