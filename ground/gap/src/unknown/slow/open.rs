//! What is open beside a slow course: calibration, reference, the field's gradient, the point whose position is told, and the effects'
//! parameters.
//!
//! In: the problem with its model, and what each channel has ([`Seen`]). Out: [`Open`], a column for each open parameter, averaged as the
//! residual is and scaled to one prior sigma.

use nalgebra::DVector;

use super::Seen;
use crate::{
    input::case::SlowErrors,
    null::{gradient, model::Model, point, problem::Problem},
};

/// What is open.
pub(super) struct Open {
    /// For each parameter, per channel that it touches the means of its column, for one prior sigma.
    pub columns: Vec<Vec<(usize, Vec<f64>)>>,
    /// Which of them are each effect's, with all parts of it ([`Problem::parts`]).
    pub of_effect: Vec<Vec<usize>>,
}

pub(super) fn open_columns(problem: &Problem, model: &Model, errors: &SlowErrors, seen: &[Seen]) -> Open {
    let mut open = Vec::new();
    for (channel, seen) in seen.iter().enumerate() {
        let rows = &problem.frames[channel].series.rows;
        open.extend((problem.open(channel).iter()).map(|column| {
            let values = &column.entries[0].1;
            vec![(
                channel,
                seen.binned.means(|sample| values[rows[sample] as usize] * column.sigma),
            )]
        }));
    }
    let gradient = gradient::columns(problem.true_twin(), errors);
    let point = point::columns(problem.true_twin(), &problem.instrument.accuracy);
    for column in problem.reference.iter().chain(&gradient).chain(&point) {
        let means = |(channel, values): &(usize, Vec<f64>)| {
            let rows = &problem.frames[*channel].series.rows;
            let binned = &seen[*channel].binned;
            // A point's acceleration at the ends of a record is not told.
            let told = |value: f64| if value.is_finite() { value } else { 0.0 };
            (
                *channel,
                binned.means(|sample| told(values[rows[sample] as usize]) * column.sigma),
            )
        };
        open.push(column.entries.iter().map(means).collect());
    }
    let mut of_part = Vec::new();
    for (at, component) in model.components.iter().enumerate() {
        let first = open.len();
        let parameters = component.active.cause.parameters(problem.twin.unit());
        for (column, parameter) in problem.slopes(&model.components, at).iter().zip(&parameters) {
            let means = |(channel, values): &(usize, DVector<f64>)| {
                let weights = &problem.frames[*channel].weights;
                let of = |sample: usize| values[sample] * weights[sample] * parameter.prior_sigma;
                (*channel, seen[*channel].binned.means(of))
            };
            open.push(column.iter().map(means).collect());
        }
        of_part.push(first..open.len());
    }
    let parts = (0..of_part.len()).map(|effect| problem.parts(&model.components, effect));
    let of_effect = parts.map(|parts| parts.into_iter().flat_map(|part| of_part[part].clone()).collect());
    let of_effect = of_effect.collect();
    Open {
        columns: open,
        of_effect,
    }
}
