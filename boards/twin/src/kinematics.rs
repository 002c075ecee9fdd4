//! What a motion is: a pose as a pure function of time, with its derivatives.
//!
//! [`Motion`] is the trait, [`Pose`] what it gives, [`Attitude`] and [`Profile`] what analytic motions are built of. The motions
//! themselves are in [`crate::motion`].

mod attitude;
mod profile;

use nalgebra::Vector3;

pub use attitude::Attitude;
pub use profile::{Jet, Profile};

/// Where the unit is in its motion at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// Attitude with its derivatives.
    pub attitude: Attitude,
    /// [m/s2] acceleration of the unit's centre relative to n, in n.
    pub acc_n: Vector3<f64>,
    /// \[degC\] temperature of the unit, where the motion knows it.
    pub temperature_c: Option<f64>,
    /// Lift-off line, `true` = asserted.
    pub lift_off: bool,
    /// Micro-gravity line, `true` = asserted.
    pub micro_g: bool,
}

impl Pose {
    /// Turning about a centre that does not move, with both lines idle.
    pub fn turning(attitude: Attitude) -> Self {
        Self {
            attitude,
            acc_n: Vector3::zeros(),
            temperature_c: None,
            lift_off: false,
            micro_g: false,
        }
    }
}

/// A motion of the unit.
pub trait Motion: Send + Sync {
    /// Pose at `t_s` seconds after power-on. Defined for every time: before the start it is the start, after the end the
    /// end.
    fn at(&self, t_s: f64) -> Pose;
    /// \[s\] when it ends; `None` for a motion without an end.
    fn duration_s(&self) -> Option<f64>;
    /// \[m\] place of the unit's centre in n, from wherever the motion counts; zero where it does not tell.
    fn position_n(&self, _t_s: f64) -> Vector3<f64> {
        Vector3::zeros()
    }
}
