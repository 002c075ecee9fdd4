//! Where the unit is, and what the filter is told because of it.
//!
//! In: gravity, latitude and declination of a site, and the parameter [`Set`] of the unit. Out: the filter's [`Params`].
//! In a room whatever stands around the unit changes norm and dip of the field, so they are learnt from the first
//! seconds, at rest or in motion ([`Params::learn_s`]). At a launch site they are given, with how well they are known
//! ([`Launch`]): a field model holds there to a part of a degree, and above the ground nothing disturbs it.
//!
//! What is the unit's own, beside [`Params::ROOM`]: its gyros are as far off as its calibration says, and its sensors are
//! late by their filters and by the age of what they hold when they are asked.

use nalgebra::Vector3;

use crate::{
    attitude::sin_cos,
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
    /// \[deg\] latitude, north positive. Wrong by a radian: 15 deg/h of drift that the gyro bias takes up.
    pub latitude_deg: f32,
    /// \[deg\] declination of the field, east positive. Wrong by an angle: heading is wrong by it. 0: north is magnetic.
    pub declination_deg: f32,
    /// What a launch crew knows beside; `None` in a room.
    pub launch: Option<Launch>,
}

/// What a launch crew knows: norm and dip of a field that a model gives and nothing disturbs, and the unit in its vehicle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Launch {
    /// \[uT\] norm. Wrong by a part: the field shows a disturbance of that part for ever.
    pub norm_ut: f32,
    /// \[deg\] below the horizontal.
    pub dip_deg: f32,
    /// \[deg\] error of its direction about each axis across it, standard deviation: the model's (IGRF-13 leaves
    /// some 0.1 uT of 25, P. Alken et al., Earth Planets Space 73:49, 2021) and the rail's iron.
    pub sd_deg: f32,
    /// \[uT\] the vehicle's hard iron on each axis after it was swung, standard deviation.
    pub iron_sd_ut: f32,
    /// [deg/s] by how much the bias of a gyro changes with each g, standard deviation: what a bench leaves of the data sheet's
    /// 0.2 (ADIS16265, Table 1). 0: it is known.
    pub bias_per_g_deg_s: f32,
}

/// [rad/sqrt(s)] angle noise of the gyros beside that of their samples, in a vehicle that is not handled: half the data sheet's
/// random walk (ADIS16265 data sheet, Table 1: 2 deg/sqrt(h)), the other half being in the samples.
const FLIGHT_ANGLE_NOISE: f32 = 0.0003;

/// [rad/s/sqrt(s)] walk of the bias: a quarter of the data sheet's 0.007 deg/s of in-run stability in six minutes.
const FLIGHT_BIAS_WALK: f32 = 1.5e-6;

/// How late the parts are: the time constant of the unit's low-pass and half a conversion (ADIS16265, 12.7 Hz, 3.9 ms;
/// LIS331HH, 25 Hz, 20 ms; HMC5883L, half of 13.3 ms by its own clock, and as long after the measurement that it was asked for).
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
        launch: None,
    };

    /// The launch centre of Alcantara: the normal gravity of WGS 84 at 2.32 S, IGRF-13 for 7 December 2016
    /// (24.23, -9.22, -4.07) uT.
    pub const ALCANTARA: Site = Site {
        gravity: 9.7804,
        latitude_deg: -2.32,
        declination_deg: -20.833,
        launch: Some(Launch {
            norm_ut: 26.242,
            dip_deg: -8.922,
            sd_deg: 0.2,
            iron_sd_ut: 0.15,
            bias_per_g_deg_s: 0.0,
        }),
    };

    /// The filter's parameters for a unit with this set.
    pub fn params(&self, set: &Set) -> Params {
        let [acc, _, gyro] = set.uncertainty;
        let (sin, cos) = sin_cos(self.latitude_deg.to_radians());
        let site = match &self.launch {
            Some(launch) => self.at_launch(launch),
            None => Params {
                field: Reference::at_site(self.declination_deg.to_radians()),
                ..Params::ROOM
            },
        };
        Params {
            bias_sd: gyro.bias.max(site.bias_sd),
            gyro_matrix_sd: gyro.scale.max(gyro.direction),
            // The mean of four plates, whose errors are their own.
            acc_error: site.acc_error.max(acc.bias / 2.0),
            delays: DELAYS,
            gravity: self.gravity,
            earth_rate_n: Vector3::new(cos, 0.0, -sin) * EARTH_RATE,
            ..site
        }
    }

    /// Where the field is known.
    fn at_launch(&self, launch: &Launch) -> Params {
        let [dip, declination, sd] = [launch.dip_deg, self.declination_deg, launch.sd_deg].map(f32::to_radians);
        Params {
            angle_noise: FLIGHT_ANGLE_NOISE,
            bias_walk: FLIGHT_BIAS_WALK,
            bias_per_g: launch.bias_per_g_deg_s.to_radians(),
            heading_sd: sd,
            start_field_sd: sd,
            dip_sd: sd,
            iron_sd_ut: launch.iron_sd_ut,
            field: Reference::known(launch.norm_ut, dip, declination),
            ..Params::ROOM
        }
    }
}
