//! One record for every scalar compared, and the correction that the scalars of a window add up to.

use super::{
    covariance::Seen,
    state::{Row, State},
};

/// Most scalars of a window: bias 3, velocity 2, field 2.
pub const INNOVATIONS: usize = 7;

/// The records of a window, in the order they were compared.
pub type Innovations = heapless::Vec<Innovation, INNOVATIONS>;

/// What a scalar is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
pub enum Quantity {
    /// [rad/s] gyro bias along an axis of b, at rest.
    Bias,
    /// [m/s] velocity, north then east.
    Velocity,
    /// [1] field east, in parts of the reference's norm.
    FieldEast,
    /// [1] field across itself in the meridian, north and up, in parts of the reference's norm.
    FieldMeridian,
}

/// What became of one scalar.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
pub struct Innovation {
    /// What was compared.
    pub quantity: Quantity,
    /// As the state has it.
    pub predicted: f32,
    /// As measured.
    pub measured: f32,
    /// Measured less predicted, after the scalars of the window before it.
    pub residual: f32,
    /// Variance that the residual should have.
    pub variance: f32,
    /// Squared residual over squared gate times variance: over one is rejected.
    pub test_ratio: f32,
    /// Whether it was used.
    pub accepted: bool,
}

/// What the scalars of a window correct together.
pub(super) struct Correction<'a> {
    gate: f32,
    /// Scalars compared while this is `false` are recorded and not used.
    pub usable: bool,
    /// The error state as estimated so far.
    pub error: State,
    /// What was compared.
    innovations: &'a mut Innovations,
}

/// A scalar to be compared.
pub(super) struct Scalar<'a> {
    pub quantity: Quantity,
    /// As the state has it.
    pub predicted: f32,
    pub measured: f32,
    /// `h`: how it depends on the error state at the end of the window.
    pub row: Row<'a>,
    /// `r`.
    pub variance: f32,
}

impl<'a> Correction<'a> {
    pub fn new(gate: f32, innovations: &'a mut Innovations) -> Self {
        Correction {
            gate,
            usable: true,
            error: State::default(),
            innovations,
        }
    }

    /// Compares a scalar. Whether it was accepted. The column of `own` is `P h'` of the covariance at the end of the window
    /// before any of its scalars, and becomes that after the ones `before`, `P h' - sum k (p h')`; the covariance itself has
    /// their updates later.
    pub fn compare(&mut self, scalar: &Scalar, before: &[Seen], own: &mut Seen) -> bool {
        let Scalar {
            quantity,
            predicted,
            measured,
            row,
            variance,
        } = *scalar;
        let residual = measured - predicted - row.of(&self.error);
        for seen in before {
            own.column.add(&seen.column, -(row.of(&seen.column) / seen.variance));
        }
        let variance = row.of(&own.column) + variance;
        own.variance = variance;
        let test_ratio = residual * residual / (self.gate * self.gate * variance);
        // Not greater than one, so that NaN is rejected too.
        let accepted = self.usable && variance > 0.0 && test_ratio <= 1.0;
        if accepted {
            self.error.add(&own.column, residual / variance);
        }
        // There are as many places as scalars.
        let _ = self.innovations.push(Innovation {
            quantity,
            predicted,
            measured,
            residual,
            variance,
            test_ratio,
            accepted,
        });
        accepted
    }
}
