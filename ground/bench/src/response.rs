//! One channel's answer to a known excitation: scale, sensitive axis, bias, and how they move with temperature.
//!
//! `y = (1 + k1 t + .. + kq t^q) s.x + b0 + b1 t + .. + bp t^p`, with excitation `x` in b (rate [rad/s], specific force
//! [m/s2] or field \[uT\]), output `y` \[counts\], `t` \[K\] from the reference temperature. Sensitivity `s = K n` holds scale
//! `K` [counts per unit] and unit axis `n`, so the axis never needs a constraint while it is being fitted. This is
//! Eq 4.11 and Eq 4.26 of Marinho (2017) and Eq 7.5 of Siqueira (2014), whose scale is then the length of a row (Eqs
//! 4.13, 4.33, 7.10); temperature is ours.
//!
//! With `q = 0` the model is linear and solved in one step; otherwise by Gauss-Newton from there. Refused: excitations
//! that leave a parameter open, which [`Response::fit`] names.

use std::ops::RangeInclusive;

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};

use crate::least_squares::{self, Open, Solution};

/// Most Gauss-Newton steps; three are usual.
const STEPS: usize = 20;

/// A step shorter than this share of the parameters' sigmas (or their size) ends the iteration.
const CONVERGED: f64 = 1e-10;

/// How far the model follows temperature.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Orders {
    /// Degree of the bias polynomial.
    pub bias: usize,
    /// Degree of the scale polynomial.
    pub scale: usize,
}

/// One position held, or one rate run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Observation {
    /// Excitation in b.
    pub excitation_b: Vector3<f64>,
    /// Temperature of the channel \[degC\].
    pub temperature_c: f64,
    /// Mean output \[counts\].
    pub value: f64,
}

/// A calibrated channel.
#[derive(Clone, Debug, PartialEq)]
pub struct Response {
    /// `K n` in b [counts per unit].
    pub sensitivity_b: Vector3<f64>,
    /// Bias polynomial, constant first [counts, counts/K, ..].
    pub bias: Vec<f64>,
    /// Scale polynomial without its constant 1 [1/K, 1/K2, ..].
    pub scale: Vec<f64>,
    /// Where both polynomials have their zero \[degC\].
    pub reference_c: f64,
    /// Temperatures the fit has seen \[degC\]; beyond them it is a guess.
    pub valid_c: RangeInclusive<f64>,
    /// Covariance of sensitivity, bias and scale, in this order.
    pub covariance: DMatrix<f64>,
    /// Observed minus predicted \[counts\], in the order of the observations.
    pub residuals: Vec<f64>,
    /// Root mean square residual per degree of freedom \[counts\].
    pub scatter: f64,
    /// Observations less parameters.
    pub freedom: usize,
}

/// Why a channel could not be calibrated.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ResponseError {
    /// Something was never excited.
    #[error("not determined: {}", .0.join("; "))]
    Open(Vec<String>),
    /// Scale and bias over temperature did not settle.
    #[error("the fit over temperature does not settle; ask for lower orders")]
    Unsettled,
}

impl Response {
    /// Fits one channel.
    ///
    /// # Errors
    /// When the observations leave something open.
    pub fn fit(observations: &[Observation], orders: Orders) -> Result<Self, ResponseError> {
        let temperatures = observations.iter().map(|one| one.temperature_c);
        let coldest = temperatures.clone().fold(f64::INFINITY, f64::min);
        let warmest = temperatures.clone().fold(f64::NEG_INFINITY, f64::max);
        let reference_c = temperatures.sum::<f64>() / observations.len().max(1) as f64;
        let linear = Orders { scale: 0, ..orders };
        let mut parameters = DVector::zeros(3 + orders.bias + 1 + orders.scale);
        let open =
            |error: Open, orders| ResponseError::Open(error.directions.iter().map(|d| name(d, orders)).collect());
        let start = step(observations, &parameters, reference_c, linear).map_err(|error| open(error, linear))?;
        parameters
            .rows_mut(0, start.parameters.len())
            .copy_from(&start.parameters);
        let mut solution = start;
        if orders.scale > 0 {
            let mut settled = false;
            for _ in 0..STEPS {
                solution = step(observations, &parameters, reference_c, orders).map_err(|error| open(error, orders))?;
                parameters += &solution.parameters;
                if solution.parameters.norm() <= CONVERGED * parameters.norm() {
                    settled = true;
                    break;
                }
            }
            if !settled {
                return Err(ResponseError::Unsettled);
            }
        }
        let part = |from: usize, count: usize| parameters.rows(from, count).iter().copied().collect();
        Ok(Response {
            sensitivity_b: Vector3::new(parameters[0], parameters[1], parameters[2]),
            bias: part(3, orders.bias + 1),
            scale: part(4 + orders.bias, orders.scale),
            reference_c,
            valid_c: coldest..=warmest,
            covariance: solution.covariance,
            residuals: solution.residuals.iter().copied().collect(),
            scatter: solution.scatter,
            freedom: solution.freedom,
        })
    }

    /// The output for an excitation \[counts\].
    pub fn predict(&self, excitation_b: &Vector3<f64>, temperature_c: f64) -> f64 {
        // Without a thermometer there is no polynomial either.
        let t = if self.reference_c.is_finite() {
            temperature_c - self.reference_c
        } else {
            0.0
        };
        let series = |coefficients: &[f64]| coefficients.iter().rev().fold(0.0, |sum, c| sum * t + c);
        (1.0 + t * series(&self.scale)) * self.sensitivity_b.dot(excitation_b) + series(&self.bias)
    }

    /// Scale `K` at the reference temperature [counts per unit].
    pub fn counts_per_unit(&self) -> f64 {
        self.sensitivity_b.norm()
    }

    /// Sensitive axis in b.
    pub fn axis_b(&self) -> Vector3<f64> {
        self.sensitivity_b.normalize()
    }

    /// Relative sigma of the scale.
    pub fn scale_sigma(&self) -> f64 {
        let axis_b = self.axis_b();
        (axis_b.transpose() * self.sensitivity_covariance() * axis_b)[0]
            .max(0.0)
            .sqrt()
            / self.counts_per_unit()
    }

    /// Sigma of the axis about each of the two directions across it \[rad\], root mean square of both.
    pub fn axis_sigma_rad(&self) -> f64 {
        let across = Matrix3::identity() - self.axis_b() * self.axis_b().transpose();
        let covariance = across * self.sensitivity_covariance() * across;
        (covariance.trace().max(0.0) / 2.0).sqrt() / self.counts_per_unit()
    }

    /// Sigma of the bias at the reference temperature \[counts\].
    pub fn bias_sigma(&self) -> f64 {
        self.covariance.get((3, 3)).map_or(f64::NAN, |variance| variance.sqrt())
    }

    fn sensitivity_covariance(&self) -> Matrix3<f64> {
        self.covariance.fixed_view::<3, 3>(0, 0).into_owned()
    }
}

/// One step from `parameters`: the increment, and the residuals before it. With no scale polynomial the step from zero
/// is the solution.
fn step(
    observations: &[Observation],
    parameters: &DVector<f64>,
    reference_c: f64,
    orders: Orders,
) -> Result<Solution, Open> {
    let (biases, scales) = (orders.bias + 1, orders.scale);
    let sensitivity_b = Vector3::new(parameters[0], parameters[1], parameters[2]);
    let mut design = DMatrix::zeros(observations.len(), 3 + biases + scales);
    let mut observed = DVector::zeros(observations.len());
    for (row, one) in observations.iter().enumerate() {
        let t = one.temperature_c - reference_c;
        let projected = sensitivity_b.dot(&one.excitation_b);
        let mut factor = 1.0;
        for k in 0..scales {
            let power = t.powi(k as i32 + 1);
            factor += parameters[3 + biases + k] * power;
            design[(row, 3 + biases + k)] = projected * power;
        }
        let mut bias = 0.0;
        for k in 0..biases {
            let power = t.powi(k as i32);
            bias += parameters[3 + k] * power;
            design[(row, 3 + k)] = power;
        }
        for axis in 0..3 {
            design[(row, axis)] = factor * one.excitation_b[axis];
        }
        observed[row] = one.value - factor * projected - bias;
    }
    least_squares::solve(&design, &observed)
}

/// An open direction in words: what it holds most of.
fn name(direction: &DVector<f64>, orders: Orders) -> String {
    const SHARE: f64 = 0.1;
    let label = |k: usize| match k {
        0 => "excitation along x".to_string(),
        1 => "excitation along y".to_string(),
        2 => "excitation along z".to_string(),
        3 => "bias".to_string(),
        k if k <= 3 + orders.bias => format!("bias times temperature^{}", k - 3),
        k => format!("scale times temperature^{}", k - 3 - orders.bias),
    };
    let held = direction.iter().enumerate().filter(|(_, c)| c.abs() > SHARE);
    let terms: Vec<String> = held.map(|(k, _)| label(k)).collect();
    match terms.as_slice() {
        [one] => format!("{one} is missing"),
        many => format!("{} cannot be told apart", many.join(", ")),
    }
}

#[cfg(test)]
mod tests;
