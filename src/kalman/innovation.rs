//! One record for every scalar compared, and the correction that the scalars of a window add up to.

use super::{
    at_least,
    joseph::Seen,
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
    /// \[1\] field east, in parts of the reference's norm.
    FieldEast,
    /// \[1\] field across itself in the meridian, north and up, in parts of the reference's norm.
    FieldMeridian,
    /// \[1\] the nose across the direction it is known to have.
    Nose,
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

/// Variance of what is wrong with a measurement itself.
#[derive(Clone, Copy, Debug)]
pub(super) struct Noise {
    /// In one window: what the residual shows.
    pub alone: f32,
    /// What the gain takes for it: an error that lasts is one witness, however often it is asked.
    pub lasting: f32,
}

impl Noise {
    /// Another one in each window.
    pub fn white(variance: f32) -> Noise {
        Noise::lasting(variance, 0.0, 1.0)
    }

    /// The same for `lasts_s`: white noise of as much power at low frequency.
    pub fn lasting(variance: f32, lasts_s: f32, duration_s: f32) -> Noise {
        Noise {
            alone: variance,
            lasting: variance * at_least(1.0, lasts_s / duration_s),
        }
    }

    /// Together with one that is another in each window.
    pub fn and_white(self, variance: f32) -> Noise {
        Noise {
            alone: self.alone + variance,
            lasting: self.lasting + variance,
        }
    }
}

/// What the scalars of a window correct together.
#[derive(Clone, Debug, Default)]
pub(super) struct Correction {
    gate: f32,
    /// Scalars compared while this is `false` are recorded and not used.
    pub usable: bool,
    /// The error state as estimated so far.
    pub error: State,
    /// What was compared.
    pub innovations: Innovations,
}

/// \[1\] a scalar is taken to have at least this part of the variance that it sees: f32 keeps 24 bits of a variance, and of what 14 of
/// them take off it ten stay right. Without it an exact scalar leaves correlations beyond one.
const LEAST_NOISE: f32 = 1.0 / 16384.0;

/// A scalar to be compared.
pub(super) struct Scalar<'a> {
    pub quantity: Quantity,
    /// As the state has it.
    pub predicted: f32,
    pub measured: f32,
    /// `h`: how it depends on the error state at the end of the window.
    pub row: Row<'a>,
    /// `r`.
    pub noise: Noise,
}

/// A scalar after those of its window before it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Looked {
    /// Measured less predicted.
    pub residual: f32,
    /// `h P h'`.
    pub of_state: f32,
}

impl Correction {
    /// Of another window.
    pub fn begin(&mut self, gate: f32) {
        self.gate = gate;
        self.usable = true;
        self.error = State::default();
        self.innovations.clear();
    }

    /// Residual of a scalar, and the variance that the state gives it. The column of `own` is `P h'` of the covariance at the end
    /// of the window before any of its scalars, and becomes that after the ones `before`, `P h' - sum k (p h')`; the covariance
    /// itself has their updates later.
    pub fn look(&self, scalar: &Scalar, before: &[Seen], own: &mut Seen) -> Looked {
        let row = scalar.row;
        let residual = scalar.measured - scalar.predicted - row.of(&self.error);
        let part = |seen: &Seen| -(row.of(&seen.column) / seen.variance);
        let (twos, last) = before.as_chunks::<2>();
        for [one, other] in twos {
            own.column
                .add_two([&one.column, &other.column], [part(one), part(other)]);
        }
        for seen in last {
            own.column.add(&seen.column, part(seen));
        }
        Looked {
            residual,
            of_state: row.of(&own.column),
        }
    }

    /// Judges a scalar by what it was [seen](Self::look) to be. Whether it was accepted.
    pub fn judge(&mut self, scalar: &Scalar, looked: &Looked, own: &mut Seen) -> bool {
        let Scalar {
            quantity,
            predicted,
            measured,
            noise,
            ..
        } = *scalar;
        let Looked { residual, of_state } = *looked;
        own.variance = of_state + at_least(of_state * LEAST_NOISE, noise.lasting);
        let variance = of_state + noise.alone;
        let test_ratio = residual * residual / (self.gate * self.gate * variance);
        // Not greater than one, so that NaN is rejected too.
        let accepted = self.usable && variance > 0.0 && test_ratio <= 1.0;
        if accepted {
            self.error.add(&own.column, residual / own.variance);
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kalman::{Params, covariance::Covariance};

    #[test]
    fn an_error_that_lasts_is_one_witness_and_shows_once_in_the_residual() {
        const VARIANCE: f32 = 1e-6;
        let left = |lasts_s: f32| {
            let mut covariance = Covariance::new(&Params::ROOM);
            let scalar = Scalar {
                quantity: Quantity::Bias,
                predicted: 0.0,
                measured: 0.0,
                row: Row::Driver(0),
                noise: Noise::lasting(VARIANCE, lasts_s, 1.0),
            };
            let mut correction = Correction::default();
            for _ in 0..60 {
                correction.begin(5.0);
                let mut own = Seen {
                    column: covariance.of_driver(0),
                    variance: 0.0,
                };
                let looked = correction.look(&scalar, &[], &mut own);
                correction.judge(&scalar, &looked, &mut own);
                covariance.update(&own, &Seen::NOTHING);
            }
            let known = covariance.bias()[(0, 0)];
            let shown = correction.innovations[0].variance - VARIANCE;
            assert!(shown > 0.0 && shown < 1.2 * known, "{shown} {known}");
            known
        };
        assert!((left(20.0) / left(0.0) / 20.0 - 1.0).abs() < 0.02);
        assert_eq!(left(0.5), left(0.0));
    }
}
