//! What is open beside a slow course: calibration, reference, the field's gradient, and the effects' parameters.
//!
//! In: the problem with its model, and what each channel has ([`Seen`]). Out: [`Open`], a column for each open parameter, averaged as the
//! residual is and scaled to one prior sigma.

use nalgebra::{DVector, Matrix3};
use twin::predict::Kind;

use super::Seen;
use crate::{
    input::case::SlowErrors,
    null::{model::Model, problem::Problem},
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
    for column in &problem.reference {
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
    open.extend(gradient(problem, errors, seen));
    open
}

/// The field's gradient, which is symmetric and has no trace.
fn gradient(problem: &Problem, errors: &SlowErrors, seen: &[Seen]) -> Open {
    let sigma = errors.field_gradient_sigma_ut_m;
    let all = problem.twin.unit().channels.iter().enumerate();
    let magnetometers: Vec<usize> = (all.filter(|(_, own)| own.sensor == Kind::Magnetometer))
        .map(|(channel, _)| channel)
        .collect();
    let Some(middle) = magnetometers
        .first()
        .and_then(|channel| seen[*channel].feels.first())
        .map(|feel| feel.position_n)
    else {
        return Open::new();
    };
    if sigma <= 0.0 {
        return Open::new();
    }
    let parts = [
        [(0, 0, 1.0), (2, 2, -1.0)],
        [(1, 1, 1.0), (2, 2, -1.0)],
        [(0, 1, 1.0), (1, 0, 1.0)],
        [(0, 2, 1.0), (2, 0, 1.0)],
        [(1, 2, 1.0), (2, 1, 1.0)],
    ];
    let column = |part: [(usize, usize, f64); 2]| {
        let mut gradient = Matrix3::zeros();
        part.iter()
            .for_each(|(row, column, value)| gradient[(*row, *column)] = value * sigma);
        let of_channel = |channel: &usize| {
            let (seen, axis_b) = (&seen[*channel], problem.twin.unit().channels[*channel].axis_b);
            let of = |sample: usize| {
                let feel = &seen.feels[sample];
                axis_b.dot(&feel.to_b(gradient * (feel.position_n - middle)))
            };
            (*channel, seen.binned.means(of))
        };
        magnetometers.iter().map(of_channel).collect()
    };
    parts.into_iter().map(column).collect()
}
