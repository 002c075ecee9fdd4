//! What a finished fit may be off by on any row of the log: its parameters, and of one effect the value between its variants
//! (an onset, a time constant, a limit), which was moved to where it explains most.
//!
//! In: a finished model. Out: [`FitError`], slopes by all parameters with the calibration refitted to each, and their
//! covariance.
//!
//! The model's fit is without the value between variants. With a column `x` beside columns `A` and their prior precision `L`,
//! block inversion gives `var = 1 / (x'(x - A b) + 1/sigma^2)` where `b = (A'A + L)^-1 A'x` is the fit of `x` itself; the
//! others' parameters follow it by `-b`, so their covariance with it is `-b var` and among themselves `b b' var` more.

use nalgebra::{DMatrix, DVector};
use twin::{effect::Active, predict::Column};

use crate::{
    library::hypotheses::Hypothesis,
    null::{interval::Interval, model::Model, problem::Problem},
};

/// Times the slope is taken anew over one standard deviation of what was found: an onset has no slope over less than a cycle.
const ROUNDS: usize = 3;

/// Errors of everything that is fitted.
#[derive(Clone, Debug)]
pub struct FitError {
    /// Slopes of readings by each parameter, channels with values of every row, in physical units.
    pub slopes: Vec<Column>,
    /// Covariance of those parameters.
    pub covariance: DMatrix<f64>,
}

impl FitError {
    /// Of a model: of the reference's parameters and those of its effects, in the order of its fit.
    pub fn of(problem: &Problem, model: &Model) -> Self {
        let actives: Vec<Active> = (model.components.iter())
            .map(|component| component.active.clone())
            .collect();
        let mut slopes = problem.reference.clone();
        for (index, component) in model.components.iter().enumerate() {
            let own = problem.twin.jacobian(&actives, index).into_iter();
            slopes.extend(own.map(|column| within(problem, column, component.span)));
        }
        FitError {
            slopes: slopes.into_iter().map(|slope| refitted(problem, slope)).collect(),
            covariance: model.joint.covariance(),
        }
    }

    /// The same with the value of `model[at]`, a hypothesis' between its variants, if it has such a one.
    pub fn with_value(&self, problem: &Problem, model: &Model, at: usize, hypothesis: &Hypothesis) -> Self {
        let mut error = self.clone();
        let cause = &model.components[at].active.cause;
        let value = cause.variant;
        let Some(prior) = hypothesis.values_between(problem.twin.starts_s()).and_then(|grid| {
            let above = grid.partition_point(|other| *other <= value).min(grid.len() - 1);
            Some(grid.get(above)? - grid.get(above.checked_sub(1)?)?)
        }) else {
            return error;
        };
        // A time constant or a limit has no other sign.
        let most = match cause.effect.has_values_between() && value != 0.0 {
            true => prior.min(0.5 * value.abs()),
            false => prior,
        };
        let mut step = (0.1 * prior).min(most);
        for _ in 0..ROUNDS {
            let slope = slope(problem, model, at, step, prior);
            let column = whole(problem, &slope);
            let fitted = model.joint.fit(&column);
            let told: f64 = column.iter().zip(&fitted.rest).map(|(own, rest)| own.dot(rest)).sum();
            let variance = 1.0 / (told.max(0.0) + prior.powi(-2));
            error.covariance = extended(&self.covariance, &-fitted.parameters, variance);
            error.slopes.truncate(self.slopes.len());
            error.slopes.push(refitted(problem, slope));
            step = variance.sqrt().min(most);
        }
        error
    }
}

/// The covariance of parameters that follow a value of this variance by `along`, and of that value.
fn extended(covariance: &DMatrix<f64>, along: &DVector<f64>, variance: f64) -> DMatrix<f64> {
    let own = along.len();
    DMatrix::from_fn(own + 1, own + 1, |row, column| match (row < own, column < own) {
        (true, true) => covariance[(row, column)] + along[row] * variance * along[column],
        (true, false) => along[row] * variance,
        (false, true) => along[column] * variance,
        (false, false) => variance,
    })
}

/// The slope over a step to either side.
fn slope(problem: &Problem, model: &Model, at: usize, step: f64, prior: f64) -> Column {
    let moved = |by: f64| {
        let mut components = model.components.clone();
        components[at].active.cause.variant += by;
        components
    };
    let [above, below] = [moved(step), moved(-step)];
    let entry = |channel: usize| {
        let [above, below] = [&above, &below].map(|components| problem.predict(channel, components));
        let slopes = above
            .iter()
            .zip(below)
            .map(|(above, below)| (above - below) / (2.0 * step));
        (channel, slopes.collect())
    };
    let touched = model.components[at].active.cause.channels(problem.twin.unit());
    Column {
        name: "value".into(),
        sigma: prior,
        entries: touched.into_iter().map(entry).collect(),
    }
}

/// A column while a component is on.
fn within(problem: &Problem, mut column: Column, span: Option<Interval>) -> Column {
    let Some(span) = span else { return column };
    for (_, values) in &mut column.entries {
        for (value, start_s) in values.iter_mut().zip(problem.twin.starts_s()) {
            if !span.contains(*start_s) {
                *value = 0.0;
            }
        }
    }
    column
}

/// A column less what the calibration takes up of it when it is fitted to it.
fn refitted(problem: &Problem, mut column: Column) -> Column {
    let fitted = problem.in_noise(&column, None);
    for ((channel, values), (_, fitted)) in column.entries.iter_mut().zip(fitted) {
        let taken = problem
            .still_open(*channel)
            .tr_mul(&problem.frames[*channel].open_part(&fitted));
        values
            .iter_mut()
            .zip(taken.iter())
            .for_each(|(value, taken)| *value -= taken);
    }
    column
}

/// A column at the fitted samples of every channel, in units of noise.
fn whole(problem: &Problem, column: &Column) -> Vec<DVector<f64>> {
    let mut whole: Vec<DVector<f64>> = problem.frames.iter().map(|frame| frame.weights.map(|_| 0.0)).collect();
    for (channel, values) in problem.in_noise(column, None) {
        whole[channel] = values;
    }
    whole
}

#[cfg(test)]
mod tests {
    use nalgebra::Cholesky;

    use super::*;
    use crate::null::joint::{Columns, Joint};

    #[test]
    fn a_value_beside_parameters_is_off_by_what_fitting_all_together_says() {
        const ROWS: usize = 40;
        let column = |k: f64| DVector::from_fn(ROWS, |row, _| (row as f64 * k).sin());
        let effects = DMatrix::from_columns(&[column(0.11), column(0.13)]);
        let beside = column(0.12);
        let nuisance = DMatrix::zeros(ROWS, 0);
        let joint = Joint::new(
            vec![Columns {
                nuisance: nuisance.into(),
                effects,
            }],
            &[2.0, 0.5],
        );
        let fitted = joint.fit(std::slice::from_ref(&beside));
        let variance = 1.0 / (beside.dot(&fitted.rest[0]) + 1.0 / 9.0);
        let found = extended(&joint.covariance(), &-fitted.parameters, variance);
        let all = DMatrix::from_columns(&[column(0.11), column(0.13), beside]);
        let prior = DMatrix::from_diagonal(&DVector::from_column_slice(&[0.25, 4.0, 1.0 / 9.0]));
        let together = Cholesky::new(all.tr_mul(&all) + prior).expect("positive").inverse();
        assert!((found - together).norm() < 1e-9);
    }
}
