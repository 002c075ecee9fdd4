//! One record for every scalar compared, and the correction that the scalars of a window add up to.

use nalgebra::SVector;

use super::covariance::{Covariance, STATES};

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
pub(super) struct Correction {
    gate: f32,
    /// Scalars compared while this is `false` are recorded and not used.
    pub usable: bool,
    /// The error state as estimated so far.
    pub error: SVector<f32, STATES>,
    /// What was compared.
    pub innovations: Innovations,
}

impl Correction {
    pub fn new(gate: f32) -> Self {
        Correction {
            gate,
            usable: true,
            error: SVector::zeros(),
            innovations: Innovations::new(),
        }
    }

    /// Compares a scalar that depends on the error state by `rows` (index, factor). Whether it was accepted.
    pub fn compare(
        &mut self,
        covariance: &mut Covariance,
        quantity: Quantity,
        predicted: f32,
        measured: f32,
        rows: &[(usize, f32)],
        variance: f32,
    ) -> bool {
        let explained: f32 = rows.iter().map(|(index, factor)| self.error[*index] * factor).sum();
        let residual = measured - predicted - explained;
        let seen = covariance.seen(rows, variance);
        let test_ratio = residual * residual / (self.gate * self.gate * seen.variance);
        // Not greater than one, so that NaN is rejected too.
        let accepted = self.usable && test_ratio <= 1.0;
        if accepted {
            self.error += seen.column * (residual / seen.variance);
            covariance.update(&seen);
        }
        // There are as many places as scalars.
        let _ = self.innovations.push(Innovation {
            quantity,
            predicted,
            measured,
            residual,
            variance: seen.variance,
            test_ratio,
            accepted,
        });
        accepted
    }
}
