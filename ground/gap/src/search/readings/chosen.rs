//! What a search gives: an effect that was chosen, and those that could stand in its place.

use nalgebra::{DMatrix, DVector};

use crate::null::interval::Interval;

/// A chosen effect.
#[derive(Clone, Debug)]
pub struct Chosen {
    /// Index of its hypothesis.
    pub hypothesis: usize,
    /// Its parameters.
    pub theta: DVector<f64>,
    /// Their covariance.
    pub covariance: DMatrix<f64>,
    /// \[nats\] over the model without it, prior odds included.
    pub gain: f64,
    /// Hypotheses that could stand in its place, itself among them; best first.
    pub rivals: Vec<Rival>,
}

/// A hypothesis that could stand in the place of a chosen one.
#[derive(Clone, Copy, Debug)]
pub struct Rival {
    /// Its index.
    pub hypothesis: usize,
    /// \[nats\] over the model with neither, prior odds included.
    pub gain: f64,
    /// When it would be on; `None` for always.
    pub span: Option<Interval>,
    /// Whether it is the hypothesis, and not the same course without what its physics makes of it, which has no name.
    pub is_named: bool,
}
