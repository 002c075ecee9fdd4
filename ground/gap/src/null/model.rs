//! A finished model: effects, calibration and reference fitted together, and what it predicts for every row of the log.

use std::sync::Arc;

use nalgebra::{DMatrix, DVector};

use crate::null::{
    joint::{Fitted, Joint},
    normal::widen,
    problem::{Component, Problem},
};

/// Square root of an energy, in units of noise, that no test of what is left sees.
const AT_BEST: f64 = 0.5;

/// What a fit may follow of some channels besides their calibration: columns at every row, in physical units for one prior sigma.
pub type Courses = Vec<(usize, DMatrix<f64>)>;

/// Effects with everything else refitted around them.
#[derive(Clone)]
pub struct Model {
    /// The effects.
    pub components: Vec<Component>,
    /// The fit, for simulating it.
    pub joint: Joint,
    /// What it found: the reference's and the effects' parameters, each channel's calibration, what is left.
    pub fitted: Fitted,
    /// Per channel, readings at every row with effects, calibration and reference in.
    pub predicted: Vec<Vec<f64>>,
}

impl Model {
    /// Refits calibration and reference around effects whose parameters `theta` are the best already, or nearly: where the
    /// calibration can take the place of a part of an effect a little more noise in one channel moves both far, and what is
    /// predicted must have both from one fit.
    pub fn around(problem: &Problem, components: Vec<Component>) -> Self {
        let near = Model::linear(problem, components, false, &Courses::new());
        let off = near.off(problem);
        if off < AT_BEST {
            return near;
        }
        let moved = Model::linear(problem, near.at_best(problem), false, &Courses::new());
        if moved.off(problem) < off { moved } else { near }
    }

    /// Refits calibration and reference around effects whose parameters stay what they are: found in the colour of what is left
    /// ([`crate::null::tint`]), beside whose slow errors the problem's white noise would move them far. Some courses are followed.
    pub fn beside(problem: &Problem, components: Vec<Component>, followed: &Courses) -> Self {
        Model::linear(problem, components, true, followed)
    }

    /// Everything fitted with the effects' slopes about their parameters, which are held or not; predicted with these.
    fn linear(problem: &Problem, components: Vec<Component>, are_held: bool, followed: &Courses) -> Self {
        let mut slopes = problem.reference_columns();
        let mut sigmas: Vec<f64> = problem.reference.iter().map(|column| column.sigma).collect();
        let mut values = vec![0.0; slopes.len()];
        for (index, component) in components.iter().enumerate() {
            let parameters = component.active.cause.parameters(problem.twin.unit());
            if parameters.is_empty() {
                continue;
            }
            slopes.extend(problem.slopes(&components, index));
            sigmas.extend(parameters.iter().map(|parameter| parameter.prior_sigma));
            values.extend(&component.active.theta);
        }
        let mut columns = problem.columns(&slopes);
        for (channel, courses) in followed {
            let frame = &problem.frames[*channel];
            let rows: Vec<usize> = frame.series.rows.iter().map(|row| *row as usize).collect();
            let fitted = courses.select_rows(&rows);
            widen(Arc::make_mut(&mut columns[*channel].nuisance), &frame.whites(fitted));
        }
        let of_effect = |(at, value): (usize, &f64)| (are_held && at >= problem.reference.len()).then_some(*value);
        let held: Vec<Option<f64>> = values.iter().enumerate().map(of_effect).collect();
        let values = DVector::from_vec(values);
        let readings = problem.predictions(&components);
        let about_zero: Vec<DVector<f64>> = (columns.iter().zip(&readings).enumerate())
            .map(|(channel, (columns, readings))| problem.left_by(channel, readings) + &columns.effects * &values)
            .collect();
        let joint = Joint::new(columns, &sigmas);
        let fitted = joint.fit_beside(&about_zero, &held);
        let predicted = readings.into_iter().enumerate();
        let predicted = predicted.map(|(channel, readings)| finished(problem, readings, &fitted, channel));
        let mut predicted: Vec<Vec<f64>> = predicted.collect();
        for (channel, courses) in followed {
            let found = &fitted.nuisance[*channel];
            let added = courses * found.rows(found.len() - courses.ncols(), courses.ncols());
            (predicted[*channel].iter_mut().zip(added.iter())).for_each(|(reading, added)| *reading += added);
        }
        Model {
            components,
            joint,
            fitted,
            predicted,
        }
    }

    /// Its effects with the parameters that the fit found.
    fn at_best(&self, problem: &Problem) -> Vec<Component> {
        let mut found = self.fitted.parameters.iter().skip(problem.reference.len());
        let mut components = self.components.clone();
        for component in &mut components {
            if !component.active.cause.parameters(problem.twin.unit()).is_empty() {
                let theta = component.active.theta.iter_mut();
                theta.zip(&mut found).for_each(|(theta, found)| *theta = *found);
            }
        }
        components
    }

    /// How far what is predicted is from what the fit found, in square roots of the energy of noise.
    fn off(&self, problem: &Problem) -> f64 {
        let of = |(channel, rest): (usize, &DVector<f64>)| -> f64 {
            let (frame, predicted) = (&problem.frames[channel], &self.predicted[channel]);
            let rows = frame.series.rows.iter().zip(&frame.series.values);
            let left = rows.map(|(row, value)| value - predicted[*row as usize]);
            let both = left.zip(frame.weights.iter()).zip(rest.iter());
            both.map(|((left, weight), rest)| (left / weight - rest).powi(2)).sum()
        };
        self.fitted.rest.iter().enumerate().map(of).sum::<f64>().sqrt()
    }

    /// The energy of what is left, per channel.
    pub fn energies(&self) -> Vec<f64> {
        self.fitted.rest.iter().map(|rest| rest.norm_squared()).collect()
    }

    /// What it leaves: residual energy, and how far it strained the calibration.
    pub fn left(&self) -> f64 {
        let open: f64 = self.fitted.nuisance.iter().map(|values| values.norm_squared()).sum();
        self.energies().iter().sum::<f64>() + open
    }
}

/// Readings of one channel at every row, with calibration and reference as fitted.
fn finished(problem: &Problem, mut readings: Vec<f64>, fitted: &Fitted, channel: usize) -> Vec<f64> {
    let columns = problem.open(channel);
    let calibration = columns
        .iter()
        .zip(fitted.nuisance[channel].iter())
        .map(|(column, value)| (column, value * column.sigma));
    let reference = problem
        .reference
        .iter()
        .zip(fitted.parameters.iter())
        .map(|(column, value)| (column, *value));
    for (column, value) in calibration.chain(reference) {
        if let Some((_, values)) = column.entries.iter().find(|(index, _)| *index == channel) {
            readings
                .iter_mut()
                .zip(values)
                .for_each(|(reading, slope)| *reading += slope * value);
        }
    }
    readings
}
