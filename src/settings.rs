//! What a laboratory may choose, and what each part is configured to because of it.
//!
//! In: the choice. Out: the configuration of an accelerometer, a magnetometer and a gyro. Whoever needs a scale or the period
//! (the unit, the estimation, the calibration set) takes it from here.

use crate::{
    sensor::{adis16265, hmc5883l, lis331hh},
    site::Site,
};

/// What a laboratory may choose without touching the code.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// \[ms\] from packet to packet, 20 to 1000. Short: more packets, less idle time. The thesis has 200.
    pub period_ms: u64,
    /// \[Hz\] fast samples of the gyros, 1 to 250. High: less aliasing and coning error, more work.
    pub gyro_hz: u64,
    /// Full scale of the accelerometers. Large: survives the boost unclipped. Small: finer counts.
    pub acceleration: lis331hh::FullScale,
    /// Gain of the magnetometers.
    pub field: hmc5883l::Gain,
    /// Range of the gyros.
    pub rate: adis16265::Range,
    /// Where the unit is.
    pub site: Site,
    /// Which unit this is, at most 16 letters: every boot in the log begins with it.
    pub unit: &'static str,
    /// Which set of calibration parameters belongs to it, at most 16 letters; empty for none.
    pub calibration: &'static str,
}

impl Settings {
    /// The thesis' unit: 5 Hz, 3 mg, a 1090th of a gauss and 0.07326 deg/s a count, in the laboratory.
    pub const NOMINAL: Settings = Settings {
        period_ms: 200,
        gyro_hz: 100,
        acceleration: lis331hh::FullScale::G6,
        field: hmc5883l::Gain::PerGauss1090,
        rate: adis16265::Range::DegPerS320,
        site: Site::LABORATORY,
        unit: match option_env!("EMEMS_UNIT") {
            Some(unit) => unit,
            None => "EM",
        },
        calibration: "",
    };

    /// The accelerometers': as many samples a second as cycles, or 50.
    pub(crate) fn accelerometer(&self) -> lis331hh::Config {
        let rate = if self.period_ms < 40 {
            lis331hh::Rate::Hz100
        } else {
            lis331hh::Rate::Hz50
        };
        lis331hh::Config {
            full_scale: self.acceleration,
            rate,
        }
    }

    /// The magnetometers': they measure when they are asked. The rate is the one to which their delay is the same by their own clock.
    pub(crate) fn magnetometer(&self) -> hmc5883l::Config {
        hmc5883l::Config {
            gain: self.field,
            rate: hmc5883l::Rate::Hz75,
            average: hmc5883l::Average::Of1,
            mode: hmc5883l::Mode::Asked,
        }
    }

    /// The gyros'.
    pub(crate) fn gyro(&self) -> adis16265::Config {
        adis16265::Config {
            range: self.rate,
            ..adis16265::Config::default()
        }
    }
}
