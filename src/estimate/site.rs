//! Where the unit is, and what the filter is told because of it.
//!
//! In: gravity, latitude and declination of a site, and the parameter [`Set`] of the unit. Out: the filter's [`Params`].
//! Norm and dip of the field are not part of a site: whatever stands around the unit changes them, so they are learnt
//! from the first seconds, at rest or in motion ([`Params::learn_s`]).
//!
//! What is the unit's own, beside [`Params::ROOM`]: its gyros are as far off as its calibration says, and its sensors are
//! late by their filters and by the age of what they hold when they are asked.

use nalgebra::{ComplexField, Vector3};

use crate::{
    calibration::Set,
    kalman::{Delays, Params, Reference},
};

/// [rad/s] rate of the Earth (IERS, nominal mean angular velocity).
const EARTH_RATE: f32 = 7.292_115e-5;

/// A place on Earth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Site {
    /// [m/s2] gravity. Wrong by a part: the velocity that bounds the tilt is wrong by that part.
    pub gravity: f32,
    /// [deg] latitude, north positive. Wrong by a radian: 15 deg/h of drift that the gyro bias takes up.
    pub latitude_deg: f32,
    /// [deg] declination of the field, east positive. Wrong by an angle: heading is wrong by it. 0: north is magnetic.
    pub declination_deg: f32,
}

/// How late the parts are: the time constant of the unit's low-pass and half a conversion (ADIS16265, 12.7 Hz, 3.9 ms;
/// LIS331HH, 25 Hz, 20 ms; HMC5883L, 13.3 ms).
const DELAYS: Delays = Delays {
    gyro_s: 0.0125 + 0.002,
    acc_s: 0.0064 + 0.010,
    mag_s: 0.0067,
};

impl Site {
    /// São José dos Campos, where the thesis' unit was turned: its gravity (WGS 84), the declination of the field in the
    /// laboratory.
    pub const LABORATORY: Site = Site {
        gravity: 9.7864,
        latitude_deg: -23.2111,
        declination_deg: -22.09,
    };

    /// The filter's parameters for a unit with this set.
    pub fn params(&self, set: &Set) -> Params {
        let [acc, _, gyro] = set.uncertainty;
        let (sin, cos) = ComplexField::sin_cos(self.latitude_deg.to_radians());
        Params {
            bias_sd: gyro.bias.max(Params::ROOM.bias_sd),
            gyro_matrix_sd: gyro.scale.max(gyro.direction),
            // The mean of four plates, whose errors are their own.
            acc_error: Params::ROOM.acc_error.max(acc.bias / 2.0),
            delays: DELAYS,
            gravity: self.gravity,
            earth_rate_n: Vector3::new(cos, 0.0, -sin) * EARTH_RATE,
            field: Reference::at_site(self.declination_deg.to_radians()),
            ..Params::ROOM
        }
    }
}
