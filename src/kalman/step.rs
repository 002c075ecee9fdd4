//! What the filter takes, and what it answers.

use nalgebra::Vector3;

use super::Innovations;

/// A vector sampled at an instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sampled {
    /// Components in b: specific force \[m/s2\] or field \[uT\].
    pub value_b: Vector3<f32>,
    /// White variance of each component, in the square of that unit.
    pub variance: f32,
    /// Mean square by which the readings that it is the mean of scatter beyond their noise, of all components; zero of a single one.
    pub scatter: f32,
    /// \[us\] when it was sampled, as stamped; `Params::delays` are taken off.
    pub at_us: u64,
}

/// What came since the step before.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    /// \[us\] end of the increment.
    pub at_us: u64,
    /// \[s\] time the increment covers; what is missing to the step before is a gap.
    pub covered_s: f32,
    /// \[rad\] rotation vector that the gyros saw over it, in b.
    pub angle_b: Vector3<f32>,
    /// [rad^2] white variance of each component of it.
    pub angle_variance: f32,
    /// [rad/s] rate at its end, in b: carries samples over the few milliseconds to their instants.
    pub rate_b: Vector3<f32>,
    /// A gyro stood at the end of its range: the increment is a lower bound.
    pub saturated: bool,
    /// Specific force, if it was sampled.
    pub acc: Option<Sampled>,
    /// Field, if it was sampled.
    pub mag: Option<Sampled>,
    /// After lift-off nothing is taken for rest, and specific force for the vertical only if every sample of a window
    /// is near one g.
    pub lift_off: bool,
}

/// Why a step, or a part of it, was left out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
pub enum Refusal {
    /// Increment or rate is not finite, or the increment is longer than a turn: the step counts as a gap.
    NotARotation,
    /// It does not end later than the step before: left out.
    NotLater,
    /// The gap before it is too long: the attitude starts afresh.
    Gap,
}

/// What a step led to.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Outcome {
    /// What was wrong with it.
    pub refusal: Option<Refusal>,
    /// One for each scalar of a window, when the state has its correction.
    pub innovations: Innovations,
    /// The attitude was found afresh with TRIAD.
    pub aligned: bool,
}

/// \[rad\] longest increment that is believed: the rotation vector of more than a turn has lost count.
const LONGEST_TURN: f32 = core::f32::consts::TAU;

impl Step {
    /// Finite, and short enough to be believed; comparisons with NaN are false.
    pub(super) fn is_a_rotation(&self) -> bool {
        self.angle_b.norm_squared() < LONGEST_TURN * LONGEST_TURN
            && self.rate_b.norm_squared() < 1e6
            && self.covered_s > 0.0
            && self.angle_variance >= 0.0
            && self.angle_variance < 1.0
    }
}

/// What no line through the samples before foresees is noise up to so many times the variance of that, and motion beyond.
pub(super) const BEYOND_NOISE: f32 = 2.0;

/// Longer than any specific force or field that a sensor could give: what is beyond is a fault.
const LONGEST_SAMPLE: f32 = 1e4;

impl Sampled {
    /// It is one of readings that have this variance in each component, found from how they move, or will be their mean.
    pub fn is_of_readings_with(&mut self, variance: f32) {
        if variance > BEYOND_NOISE * self.variance {
            self.scatter = 3.0 * (variance - self.variance);
            self.variance = variance;
        }
    }

    /// Finite, and no larger than a sensor could give.
    pub(super) fn is_believable(&self) -> bool {
        self.value_b.norm_squared() < LONGEST_SAMPLE * LONGEST_SAMPLE
            && self.variance >= 0.0
            && self.variance < LONGEST_SAMPLE
            && self.scatter >= 0.0
            && self.scatter < LONGEST_SAMPLE * LONGEST_SAMPLE
    }
}

#[cfg(test)]
mod tests;
