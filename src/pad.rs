//! How the unit lies on its pad, in degrees for a person: the answer to G_PA.
//!
//! In: attitude, its covariance and the sensors' health, as the newest derived frame has them. Out: azimuth and elevation of the nose
//! x_b, roll of the body about it, each with one standard deviation; and which sensors of each plate are in use.
//!
//! Azimuth, elevation and roll are the Euler angles 3-2-1 of [`crate::attitude`]: azimuth east of the north of the unit's site (true
//! where its declination is right), elevation above the horizontal, roll right side down. An error of the attitude, the rotation
//! vector `d_n`, moves them by
//!
//! ```text
//! d elevation = e . d_n                   e = (-sin az, cos az, 0)
//! d roll      = h . d_n / cos el          h = ( cos az, sin az, 0)
//! d azimuth   = z . d_n + tan el h . d_n
//! ```
//!
//! (from `d_n = d_az z + d_el e + d_roll x_b`), so each variance is `g' P g`. On a rail near the vertical azimuth and roll are badly known
//! each by itself, and say so: at most 180 deg, which is nothing. The angles are libm's, good to every digit that is shown; those of
//! micromath, good to 0.2 deg, would add more than a crew's theodolite leaves.

use core::fmt;

use nalgebra::{ComplexField, Matrix3, Vector3};

use crate::{
    attitude::{self, euler, sin_cos},
    derived::Derived,
    faults::SensorHealth,
    sample::{Errors, Kind},
};

/// Slot of the first thermometer in the reading order.
const THERMOMETERS: usize = 12;

/// What a derived frame has of it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pad {
    q_nb: Option<[f32; 4]>,
    covariance_n: [f32; 6],
    sensors: SensorHealth,
    errors: Errors,
}

/// An angle and its standard deviation \[deg\].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Angle {
    /// The angle.
    pub deg: f32,
    /// One standard deviation; 180 at most: nothing is known.
    pub sd_deg: f32,
}

/// How the unit lies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Alignment {
    /// Of the nose, 0 to 360.
    pub azimuth: Angle,
    /// Of the nose, -90 to 90.
    pub elevation: Angle,
    /// Of the body, -180 to 180.
    pub roll: Angle,
}

/// Which sensors are in use.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plates<'a>(&'a Pad);

impl Pad {
    /// Of this frame.
    pub fn of(frame: &Derived) -> Pad {
        Pad {
            q_nb: frame.estimate.q_nb,
            covariance_n: frame.estimate.covariance_n,
            sensors: frame.estimate.sensors,
            errors: Errors(frame.health.0 as u16),
        }
    }

    /// How the unit lies; `None` without an attitude.
    pub fn alignment(&self) -> Option<Alignment> {
        let angles = euler(&attitude::from_parts(self.q_nb?)?);
        let [nn, ne, nd, ee, ed, dd] = self.covariance_n;
        let covariance_n = Matrix3::new(nn, ne, nd, ne, ee, ed, nd, ed, dd);
        let ((sin_az, cos_az), (sin_el, cos_el)) = (sin_cos(angles.yaw), sin_cos(angles.pitch));
        let across_n = Vector3::new(cos_az, sin_az, 0.0) / cos_el.max(f32::EPSILON);
        let angle = |angle: f32, by_n: Vector3<f32>| Angle {
            deg: angle.to_degrees(),
            sd_deg: ComplexField::sqrt(by_n.dot(&(covariance_n * by_n)).max(0.0))
                .to_degrees()
                .min(180.0),
        };
        let azimuth = angle(angles.yaw, Vector3::z() + across_n * sin_el);
        Some(Alignment {
            azimuth: Angle {
                deg: if azimuth.deg < 0.0 {
                    azimuth.deg + 360.0
                } else {
                    azimuth.deg
                },
                ..azimuth
            },
            elevation: angle(angles.pitch, Vector3::new(-sin_az, cos_az, 0.0)),
            roll: angle(angles.roll, across_n),
        })
    }

    /// Which sensors are in use.
    pub fn plates(&self) -> Plates<'_> {
        Plates(self)
    }

    /// Whether a sensor is used, with all its axes.
    fn uses(&self, kind: Kind, plate: usize) -> bool {
        let unused = self.sensors.unused_channels().of(kind);
        match kind {
            Kind::Thermometer => !self.errors.contains(THERMOMETERS.wrapping_add(plate)),
            Kind::Gyro => unused.wrapping_shr(plate as u32) & 1 == 0,
            Kind::Accelerometer | Kind::Magnetometer => unused.wrapping_shr(plate.wrapping_mul(3) as u32) & 0b111 == 0,
        }
    }
}

/// Hundredths, rounded.
impl fmt::Display for Angle {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let hundredths = |deg: f32| (deg * 100.0 + 0.5) as u32;
        let (of_angle, of_sd) = (hundredths(self.deg.max(-self.deg)), hundredths(self.sd_deg));
        let sign = if self.deg < 0.0 && of_angle > 0 { "-" } else { "" };
        write!(
            f,
            "{sign}{}.{:02} sd {}.{:02}",
            of_angle / 100,
            of_angle % 100,
            of_sd / 100,
            of_sd % 100
        )
    }
}

impl fmt::Display for Alignment {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Alignment {
            azimuth,
            elevation,
            roll,
        } = self;
        write!(f, "azimuth {azimuth} elevation {elevation} roll {roll} deg")
    }
}

/// A letter for each sensor that is used with all its axes: a, m, g, t; a dash for one that is not.
impl fmt::Display for Plates<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        const KINDS: [(Kind, char); 4] = [
            (Kind::Accelerometer, 'a'),
            (Kind::Magnetometer, 'm'),
            (Kind::Gyro, 'g'),
            (Kind::Thermometer, 't'),
        ];
        f.write_str("plates")?;
        for (plate, number) in (0..).zip([" 1 ", " 2 ", " 3 ", " 4 "]) {
            f.write_str(number)?;
            for (kind, letter) in KINDS {
                fmt::Write::write_char(f, if self.0.uses(kind, plate) { letter } else { '-' })?;
            }
        }
        let said = [
            (SensorHealth::ACCELEROMETERS, ", accelerometers disagree"),
            (SensorHealth::MAGNETOMETERS, ", magnetometers disagree"),
            (SensorHealth::GYROS, ", gyros disagree"),
            (SensorHealth::CALIBRATION, ", calibration in doubt"),
        ];
        for (bit, text) in said {
            if self.0.sensors.contains(bit) {
                f.write_str(text)?;
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests;
