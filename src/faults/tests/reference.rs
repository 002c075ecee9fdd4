//! What the pages of fault detection say, in f64: whole histories instead of rings and running sums, a matrix inverted instead of
//! steps saved.

extern crate std;

mod gyros;
mod triads;
mod vector_rate;
mod watched;

use nalgebra::{Matrix3, Vector3};

pub(crate) use self::{gyros::GyrosModel, triads::TriadsModel, vector_rate::VectorRateModel};

pub(crate) type V = Vector3<f64>;

pub(crate) fn of(x: f32) -> f64 {
    f64::from(x)
}

/// Weighted least squares; `None` where the axes do not span space.
pub(crate) fn solve(axes_b: &[V], values: &[f64], variances: &[f64], wanted: u16) -> Option<(V, Matrix3<f64>)> {
    let (mut information, mut weighted) = (Matrix3::zeros(), V::zeros());
    for k in (0..axes_b.len()).filter(|k| wanted >> k & 1 == 1) {
        information += axes_b[k] * axes_b[k].transpose() / variances[k];
        weighted += axes_b[k] * (values[k] / variances[k]);
    }
    let least = information.symmetric_eigenvalues().min();
    let covariance = (least > 1e-6 * information.trace()).then(|| information.try_inverse())??;
    Some((covariance * weighted, covariance))
}

/// What an axis should measure, and the variance of that.
pub(crate) fn along(solution: &(V, Matrix3<f64>), axis_b: &V) -> (f64, f64) {
    (axis_b.dot(&solution.0), axis_b.dot(&(solution.1 * axis_b)))
}

/// What a cycle gave.
#[derive(Clone, Copy)]
pub(crate) struct Given<const N: usize> {
    pub(crate) values: [f64; N],
    pub(crate) present: u16,
    pub(crate) frozen: u16,
    pub(crate) dt_s: Option<f64>,
    pub(crate) later: bool,
}

fn is_in(set: u16, k: usize) -> bool {
    set >> k & 1 == 1
}

/// How sure a calibration is: bias, scale, direction; and \[s\] the sampling instants.
#[derive(Clone, Copy)]
pub(crate) struct Sure {
    pub(crate) bias: f64,
    pub(crate) scale: f64,
    pub(crate) direction: f64,
    pub(crate) timing_s: f64,
}

impl Sure {
    /// Relative, squared.
    pub(super) fn relative(&self) -> f64 {
        self.scale.powi(2) + self.direction.powi(2)
    }
}

/// A mean of the vector since the beginning, of at most 1000 cycles.
#[derive(Clone, Default)]
struct Usual {
    mean: Option<V>,
    cycles: f64,
}

impl Usual {
    pub(super) fn take(&mut self, vector: V) {
        self.cycles = (self.cycles + 1.0).min(1000.0);
        let mean = self.mean.get_or_insert(vector);
        *mean += (vector - *mean) / self.cycles;
    }

    pub(super) fn off(&self, vector: V) -> f64 {
        self.mean.map_or(0.0, |mean| (vector - mean).norm_squared())
    }
}
