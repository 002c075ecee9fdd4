//! What is physically true at an instant, in the right-handed body frame b (forward, right, down).

use nalgebra::Vector3;

/// The state of the world around the unit at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Truth {
    /// [rad/s] inertial angular rate of b, in b (motion plus Earth rate).
    pub rate_b: Vector3<f64>,
    /// [rad/s2] its time derivative.
    pub rate_dot_b: Vector3<f64>,
    /// [m/s2] specific force at the unit's centre of rotation, in b: (0, 0, -g) at rest and level.
    pub force_b: Vector3<f64>,
    /// \[uT\] magnetic field, in b.
    pub field_b_ut: Vector3<f64>,
    /// \[degC\] temperature of the unit.
    pub temperature_c: f64,
    /// Lift-off line, `true` = asserted.
    pub lift_off: bool,
    /// Micro-gravity line, `true` = asserted.
    pub micro_g: bool,
}

/// Where truth comes from: a motion in an environment, or a recording.
///
/// A pure function of time, so that the host board and the emulated board see the same world in whatever order they ask.
pub trait TruthSource: Send + Sync {
    /// Truth `t_s` seconds after power-on. Defined for every time: before the start it is the start, after the end the end.
    fn at(&self, t_s: f64) -> Truth;
    /// \[s\] how long it lasts; `None` for a source without an end.
    fn duration_s(&self) -> Option<f64>;
}
