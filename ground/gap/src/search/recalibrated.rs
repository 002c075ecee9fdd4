//! The calibration fitted to what a log was before an effect on its scatter.
//!
//! In: a model, and of some channels every row as it was before the effect ([`Beneath`]), which the effect tells given what is
//! predicted. Out: that prediction with the calibration of these channels fitted anew, the rest of the model as it is: the
//! second half of a step of expectation and maximisation (Dempster, Laird and Rubin 1977), the first being
//! [`twin::effect::Effect::beneath`]. A bit that is stuck raises every second reading, a garbled one is anything: fitted to
//! these as they are, a calibration takes up their mean, and no law fits what is left.

use nalgebra::{Cholesky, DMatrix, DVector};
use twin::effect::Beneath;

use crate::null::{model::Model, problem::Problem};

/// A channel's prediction with its calibration fitted anew.
pub struct Recalibrated {
    /// [physical unit] at every row of the log.
    pub predicted: Vec<f64>,
    /// \[nats\] that its calibration is likelier by than the model's.
    pub gain: f64,
}

/// Fits the calibration of `channel` to its rows as they were.
pub fn recalibrated(problem: &Problem, model: &Model, channel: usize, rows: &[Beneath]) -> Recalibrated {
    let (frame, before) = (&problem.frames[channel], &model.fitted.nuisance[channel]);
    let roots = of_samples(problem, channel, rows, |beneath, _| beneath.worth.max(0.0).sqrt());
    let rest = of_samples(problem, channel, rows, |beneath, row| {
        beneath.value - model.predicted[channel][row]
    })
    .component_div(&frame.weights)
    .component_mul(&roots);
    let open = DMatrix::from_fn(frame.nuisance.nrows(), frame.nuisance.ncols(), |sample, column| {
        frame.nuisance[(sample, column)] * roots[sample]
    });
    let width = open.ncols();
    // The model's calibration is in its prediction already: what it costs pulls back.
    let pull = open.tr_mul(&rest) - before;
    let change = Cholesky::new(DMatrix::identity(width, width) + open.tr_mul(&open))
        .map_or_else(|| DVector::zeros(width), |factor| factor.solve(&pull));
    Recalibrated {
        predicted: changed(problem, model, channel, &change),
        gain: 0.5 * (before.norm_squared() - (before + change).norm_squared()),
    }
}

/// What a model predicts of `channel` at every row with the calibration as described.
pub fn as_described(problem: &Problem, model: &Model, channel: usize) -> Vec<f64> {
    changed(problem, model, channel, &-&model.fitted.nuisance[channel])
}

/// What a model predicts with the calibration changed by so many of its sigmas.
fn changed(problem: &Problem, model: &Model, channel: usize, change: &DVector<f64>) -> Vec<f64> {
    let mut predicted = model.predicted[channel].clone();
    for (column, change) in problem.open(channel).iter().zip(change.iter()) {
        let slopes = &column.entries[0].1;
        (predicted.iter_mut().zip(slopes)).for_each(|(value, slope)| *value += slope * column.sigma * change);
    }
    predicted
}

/// A number for each fitted sample of a channel, from its row.
pub fn of_samples(
    problem: &Problem,
    channel: usize,
    rows: &[Beneath],
    number: impl Fn(&Beneath, usize) -> f64,
) -> DVector<f64> {
    let fitted = problem.frames[channel].series.rows.iter().map(|row| *row as usize);
    DVector::from_iterator(fitted.len(), fitted.map(|row| number(&rows[row], row)))
}
