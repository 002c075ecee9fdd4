//! What a channel looks at, and the physical state that it looks at.

use nalgebra::{SVector, UnitQuaternion, Vector3};

use super::unit::{Channel, Kind};

/// The physical state of the unit's centre at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Feel {
    /// \[s\] the instant, from the start of the log.
    pub t_s: f64,
    /// [rad/s] inertial rate of b, in b.
    pub rate_b: Vector3<f64>,
    /// [rad/s2] its time derivative.
    pub rate_dot_b: Vector3<f64>,
    /// [m/s2] specific force at the centre, in b.
    pub force_b: Vector3<f64>,
    /// \[uT\] magnetic field, in b.
    pub field_b_ut: Vector3<f64>,
    /// \[degC\] temperature.
    pub temperature_c: f64,
    /// [degC/s] its time derivative.
    pub temperature_rate: f64,
    /// Body to navigation: `v_n = q_nb v_b q_nb*`.
    pub q_nb: UnitQuaternion<f64>,
    /// \[m\] place of the centre in n.
    pub position_n: Vector3<f64>,
    /// \[rad\] turned about the vertical since the motion began, whole turns counted ([`crate::predict::Scene`]).
    pub heading: f64,
    /// [rad/s] its time derivative.
    pub heading_rate: f64,
    /// [rad/s2] and that one's.
    pub heading_acc: f64,
}

impl Feel {
    /// This vector of n, in b.
    pub fn to_b(&self, v_n: Vector3<f64>) -> Vector3<f64> {
        self.q_nb.inverse() * v_n
    }

    /// [m/s2] specific force at `lever_m` from the centre.
    pub fn force_at(&self, lever_m: Vector3<f64>) -> Vector3<f64> {
        let carried = self.rate_dot_b.cross(&lever_m) + self.rate_b.cross(&self.rate_b.cross(&lever_m));
        self.force_b + carried
    }
}

/// What a channel looks at: the only things of it that its input depends on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aim {
    /// What it measures.
    pub sensor: Kind,
    /// Its axis in b. Its length is its scale.
    pub axis_b: Vector3<f64>,
    /// \[m\] its place in b; accelerometers only.
    pub lever_m: Vector3<f64>,
}

impl Aim {
    /// As the description has it.
    pub fn of(channel: &Channel) -> Self {
        Self {
            sensor: channel.sensor,
            axis_b: channel.axis_b,
            lever_m: channel.lever_m,
        }
    }

    /// Its input without a low-pass.
    pub fn input(&self, feel: &Feel) -> f64 {
        match self.sensor {
            Kind::Gyro => self.axis_b.dot(&feel.rate_b),
            Kind::Accelerometer => self.axis_b.dot(&feel.force_at(self.lever_m)),
            Kind::Magnetometer => self.axis_b.dot(&feel.field_b_ut),
            Kind::Thermometer => feel.temperature_c,
        }
    }

    /// Coefficients of [`crate::predict::Scene`]'s quantities in the input of an accelerometer.
    pub(crate) fn force_weights(&self) -> SVector<f64, 12> {
        let (a, r) = (self.axis_b, self.lever_m);
        let across = r.cross(&a);
        let along = a.dot(&r);
        SVector::from([
            a.x,
            a.y,
            a.z,
            across.x,
            across.y,
            across.z,
            a.x * r.x - along,
            a.y * r.y - along,
            a.z * r.z - along,
            a.x * r.y + a.y * r.x,
            a.x * r.z + a.z * r.x,
            a.y * r.z + a.z * r.y,
        ])
    }
}
