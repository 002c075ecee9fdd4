//! Samples of one plate as vectors: rate, specific force and field, each at an instant of its own.
//!
//! In: a log and its unit. Out: [`Samples`] at the instants of the gyros; forces are put on these instants on the line between two
//! samples, fields keep their own. Three gyros and three accelerometers along three independent directions are needed; magnetometers
//! may be missing.

use nalgebra::{Matrix3, Vector3};
use packets::magnitude::median;

/// One kind of sensor along three directions: `[rows]`.
#[derive(Clone, Debug, Default)]
pub struct Triad {
    /// \[s\] when each was felt.
    pub t_s: Vec<f64>,
    /// In b, biases of the description taken off.
    pub in_b: Vec<Vector3<f64>>,
}

impl Triad {
    /// Of three channels: their directions in b, one a row, and what each read at the same instants.
    ///
    /// None where the directions are not independent.
    pub fn of(directions: &Matrix3<f64>, t_s: Vec<f64>, readings: &[Vector3<f64>]) -> Option<Self> {
        let inverse = directions.try_inverse()?;
        Some(Self {
            t_s,
            in_b: readings.iter().map(|reading| inverse * reading).collect(),
        })
    }

    /// On the line between two samples; the first or the last beyond them.
    pub fn at(&self, t_s: f64) -> Vector3<f64> {
        let after = self.t_s.partition_point(|own| *own < t_s);
        match after {
            0 => self.in_b.first().copied().unwrap_or_else(Vector3::zeros),
            after if after >= self.t_s.len() => self.in_b[self.t_s.len() - 1],
            after => {
                let (from_s, to_s) = (self.t_s[after - 1], self.t_s[after]);
                self.in_b[after - 1].lerp(&self.in_b[after], (t_s - from_s) / (to_s - from_s))
            }
        }
    }
}

/// All of a log.
#[derive(Clone, Debug)]
pub struct Samples {
    /// [rad/s]
    pub rates: Triad,
    /// [m/s2] at the instants of the rates.
    pub forces: Vec<Vector3<f64>>,
    /// [m/s2] as they were sampled: a line between two samples softens a knock.
    pub felt: Triad,
    /// \[uT\]; empty where there is no magnetometer.
    pub fields: Triad,
}

impl Samples {
    /// Of triads.
    pub fn of(rates: Triad, felt: Triad, fields: Triad) -> Self {
        Self {
            forces: rates.t_s.iter().map(|t_s| felt.at(*t_s)).collect(),
            felt,
            rates,
            fields,
        }
    }

    /// \[s\] of a sample, from the middle one of all steps.
    pub fn step_s(&self) -> f64 {
        median(self.rates.t_s.windows(2).map(|pair| pair[1] - pair[0])).unwrap_or(0.0)
    }
}
