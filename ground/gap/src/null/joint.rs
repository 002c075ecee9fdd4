//! The joint fit of a few effects and every channel's calibration, which can be repeated on many residuals.
//!
//! In: per channel the columns `[N | E]` in units of its noise, `N` already times its prior sigmas. Out, for any residual:
//! the effects' parameters, each channel's calibration over its sigmas, and what is left. The factorisations are made
//! once, because [`crate::unknown::adequacy`] repeats the fit on hundreds of simulated logs.

use std::sync::Arc;

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// One channel's columns.
#[derive(Clone, Debug)]
pub struct Columns {
    /// What the calibration leaves open, in units of noise for one prior sigma.
    pub nuisance: Arc<DMatrix<f64>>,
    /// The effects', in units of noise for one unit of the parameter; zero where the channel is not touched.
    pub effects: DMatrix<f64>,
}

/// A fit ready to be repeated.
#[derive(Clone, Debug)]
pub struct Joint {
    channels: Vec<Channel>,
    precision: Option<Cholesky<f64, Dyn>>,
}

#[derive(Clone, Debug)]
struct Channel {
    columns: Columns,
    factor: Option<Cholesky<f64, Dyn>>,
    slope: DMatrix<f64>,
}

/// What a fit found.
#[derive(Clone, Debug)]
pub struct Fitted {
    /// The effects' parameters.
    pub parameters: DVector<f64>,
    /// Per channel, its calibration over its sigmas.
    pub nuisance: Vec<DVector<f64>>,
    /// Per channel, what is left in units of noise.
    pub rest: Vec<DVector<f64>>,
}

impl Joint {
    /// Prepares the fit of effects with these prior sigmas.
    pub fn new(columns: Vec<Columns>, prior_sigmas: &[f64]) -> Self {
        let width = prior_sigmas.len();
        let mut precision = DMatrix::from_fn(width, width, |row, column| {
            if row == column { prior_sigmas[row].powi(-2) } else { 0.0 }
        });
        let mut channels = Vec::new();
        for columns in columns {
            let open = columns.nuisance.ncols();
            let factor = Cholesky::new(DMatrix::identity(open, open) + columns.nuisance.tr_mul(&columns.nuisance));
            let cross = columns.nuisance.tr_mul(&columns.effects);
            let slope = factor
                .as_ref()
                .map_or_else(|| DMatrix::zeros(open, width), |factor| factor.solve(&cross));
            precision += columns.effects.tr_mul(&columns.effects) - cross.tr_mul(&slope);
            channels.push(Channel { columns, factor, slope });
        }
        Joint {
            channels,
            precision: Cholesky::new(precision),
        }
    }

    /// Fits one residual a channel.
    pub fn fit(&self, residuals: &[DVector<f64>]) -> Fitted {
        self.fit_beside(residuals, &vec![None; self.width()])
    }

    /// The same with those parameters held that have a value.
    pub fn fit_beside(&self, residuals: &[DVector<f64>], held: &[Option<f64>]) -> Fitted {
        let mut score = DVector::zeros(self.width());
        let mut alone = Vec::new();
        for (channel, residual) in self.channels.iter().zip(residuals) {
            let pull = channel.columns.nuisance.tr_mul(residual);
            score += channel.columns.effects.tr_mul(residual) - channel.slope.tr_mul(&pull);
            alone.push(
                channel
                    .factor
                    .as_ref()
                    .map_or_else(|| pull.map(|_| 0.0), |factor| factor.solve(&pull)),
            );
        }
        let mut fitted = Fitted {
            parameters: self.parameters(&score, held),
            nuisance: Vec::new(),
            rest: Vec::new(),
        };
        for ((channel, residual), alone) in self.channels.iter().zip(residuals).zip(alone) {
            let nuisance = alone - &channel.slope * &fitted.parameters;
            let mut rest = residual.clone();
            rest.gemv(-1.0, &channel.columns.nuisance, &nuisance, 1.0);
            rest.gemv(-1.0, &channel.columns.effects, &fitted.parameters, 1.0);
            fitted.nuisance.push(nuisance);
            fitted.rest.push(rest);
        }
        fitted
    }

    /// Parameters of this score, zero where they are not finite: of `P p = s`, with `P_ff p_f = s_f - P_fh p_h` beside those that are held.
    fn parameters(&self, score: &DVector<f64>, held: &[Option<f64>]) -> DVector<f64> {
        let mut parameters = DVector::from_iterator(held.len(), held.iter().map(|value| value.unwrap_or(0.0)));
        let Some(factor) = &self.precision else {
            return parameters;
        };
        let free: Vec<usize> = (0..held.len()).filter(|at| held[*at].is_none()).collect();
        if free.len() == held.len() {
            return factor.solve(score);
        }
        let precision = factor.l() * factor.l().transpose();
        let left = (score - &precision * &parameters).select_rows(&free);
        let of_free = Cholesky::new(precision.select_rows(&free).select_columns(&free));
        if let Some(found) = of_free.map(|factor| factor.solve(&left)) {
            free.iter()
                .zip(found.iter())
                .for_each(|(at, value)| parameters[*at] = *value);
        }
        parameters
    }

    /// Covariance of the effects' parameters; zero where numbers that are not finite let nothing be fitted.
    pub fn covariance(&self) -> DMatrix<f64> {
        let width = self.width();
        let precision = self.precision.as_ref();
        precision.map_or_else(|| DMatrix::zeros(width, width), Cholesky::inverse)
    }

    fn width(&self) -> usize {
        let first = self.channels.first();
        first.map_or(0, |channel| channel.columns.effects.ncols())
    }

    /// Columns of each channel.
    pub fn columns(&self) -> impl Iterator<Item = &Columns> {
        self.channels.iter().map(|channel| &channel.columns)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::null::{evidence::Screen, normal::Normal};

    /// Double precision over some hundred operations on numbers near one.
    const ROUNDING: f64 = 1e-9;

    fn columns(phase: f64) -> Columns {
        Columns {
            nuisance: DMatrix::from_fn(50, 2, |row, column| ((row * (column + 1)) as f64 * 0.21 + phase).sin()).into(),
            effects: DMatrix::from_fn(50, 2, |row, column| ((row * (column + 3)) as f64 * 0.13 + phase).cos()),
        }
    }

    #[test]
    fn it_finds_what_the_marginal_normal_equations_find() {
        let residuals: Vec<_> = [0.3, 0.9]
            .map(|k| DVector::from_fn(50, |row, _| (row as f64 * k).sin()))
            .into();
        let sigmas = [0.5, 2.0];
        let joint = Joint::new(vec![columns(0.1), columns(0.7)], &sigmas).fit(&residuals);
        let mut screen = Screen::zeros(sigmas.to_vec());
        for (phase, residual) in [0.1, 0.7].into_iter().zip(&residuals) {
            let Columns { nuisance, effects } = columns(phase);
            let factor = Cholesky::new(DMatrix::identity(2, 2) + nuisance.tr_mul(&nuisance));
            screen.add(
                &[0, 1],
                &Normal::marginal(&nuisance, factor.as_ref(), &effects, residual),
            );
        }
        let estimate = screen.estimate(&[0, 1]).expect("finite");
        assert!((joint.parameters - estimate.parameters).norm() < ROUNDING);
    }

    #[test]
    fn beside_a_parameter_that_is_held_the_other_is_what_it_is_without_it() {
        let residual = DVector::from_fn(50, |row, _| (row as f64 * 0.3).sin());
        let both = Joint::new(vec![columns(0.1)], &[0.5, 2.0]);
        let held = both.fit_beside(std::slice::from_ref(&residual), &[Some(0.7), None]);
        // The same by taking the first off the residual and having the second alone.
        let Columns { nuisance, effects } = columns(0.1);
        let alone = Columns {
            nuisance,
            effects: effects.columns(1, 1).into_owned(),
        };
        let expected = Joint::new(vec![alone], &[2.0]).fit(&[residual - effects.column(0) * 0.7]);
        assert_eq!(held.parameters[0], 0.7);
        assert!((held.parameters[1] - expected.parameters[0]).abs() < ROUNDING);
        assert!((&held.rest[0] - &expected.rest[0]).norm() < ROUNDING);
    }

    #[test]
    fn what_cannot_be_fitted_has_parameters_and_a_covariance_nevertheless() {
        let mut broken = columns(0.1);
        broken.effects[(3, 0)] = f64::NAN;
        let joint = Joint::new(vec![broken], &[1.0, 1.0]);
        let found = joint.fit(&[DVector::zeros(50)]).parameters;
        assert_eq!(joint.covariance() * &found, found * 0.0);
    }

    #[test]
    fn what_lies_along_an_effect_is_taken_off() {
        let truth = DVector::from_column_slice(&[0.4, -0.2]);
        let residual = &columns(0.1).effects * &truth * 100.0;
        let fitted = Joint::new(vec![columns(0.1)], &[1e6, 1e6]).fit(&[residual]);
        assert!((fitted.parameters / 100.0 - truth).norm() < 1e-6);
        assert!(fitted.rest[0].norm() < 1e-3 && fitted.nuisance[0].norm() < 1e-3);
    }
}
