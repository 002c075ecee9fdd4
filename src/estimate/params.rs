//! What the filter is told of the site and of the unit.
//!
//! In: a [`Site`] and the parameter [`Set`] of the unit. Out: the filter's [`Params`].
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
    site::{Launch, Site},
};

/// [rad/s] rate of the Earth (IERS, nominal mean angular velocity).
const EARTH_RATE: f32 = 7.292_115e-5;

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

/// The filter's parameters for a unit with this set.
pub fn params(site: &Site, set: &Set) -> Params {
    let [acc, _, gyro] = set.uncertainty;
    let (sin, cos) = sin_cos(site.latitude_deg.to_radians());
    let usual = match &site.launch {
        Some(launch) => at_launch(site, launch),
        None => Params {
            field: Reference::at_site(site.declination_deg.to_radians()),
            ..Params::ROOM
        },
    };
    Params {
        bias_sd: gyro.bias.max(usual.bias_sd),
        gyro_matrix_sd: gyro.scale.max(gyro.direction),
        // The mean of four plates, whose errors are their own.
        acc_error: usual.acc_error.max(acc.bias / 2.0),
        delays: DELAYS,
        gravity: site.gravity,
        earth_rate_n: Vector3::new(cos, 0.0, -sin) * EARTH_RATE,
        ..usual
    }
}

/// Where the field is known.
fn at_launch(site: &Site, launch: &Launch) -> Params {
    let [dip, declination, sd] = [launch.dip_deg, site.declination_deg, launch.sd_deg].map(f32::to_radians);
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
