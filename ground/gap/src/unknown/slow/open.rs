//! What is open beside a slow course: calibration, reference, the field's gradient, and the effects' parameters.
//!
//! In: the problem with its model, and what each channel has ([`Seen`]). Out: [`Open`], a column for each open parameter, averaged as the
//! residual is and scaled to one prior sigma.

use nalgebra::DVector;

use super::Seen;
use crate::{
    input::case::SlowErrors,
    null::{gradient, model::Model, problem::Problem},
};

/// For each open parameter, per channel that it touches the means of its column, for one prior sigma.
pub(super) type Open = Vec<Vec<(usize, Vec<f64>)>>;

pub(super) fn open_columns(problem: &Problem, model: &Model, errors: &SlowErrors, seen: &[Seen]) -> Open {
    let mut open = Open::new();
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
    for column in problem.reference.iter().chain(&gradient) {
        let means = |(channel, values): &(usize, Vec<f64>)| {
            let rows = &problem.frames[*channel].series.rows;
            let binned = &seen[*channel].binned;
            (
                *channel,
                binned.means(|sample| values[rows[sample] as usize] * column.sigma),
            )
        };
        open.push(column.entries.iter().map(means).collect());
    }
    for (at, component) in model.components.iter().enumerate() {
        let parameters = component.active.cause.parameters(problem.twin.unit());
        for (column, parameter) in problem.slopes(&model.components, at).iter().zip(&parameters) {
            let means = |(channel, values): &(usize, DVector<f64>)| {
                let weights = &problem.frames[*channel].weights;
                let of = |sample: usize| values[sample] * weights[sample] * parameter.prior_sigma;
                (*channel, seen[*channel].binned.means(of))
            };
            open.push(column.iter().map(means).collect());
        }
    }
    open
}
