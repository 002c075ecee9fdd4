//! The parameter set of a unit: every axis, how sure they are, and what they hold for.

use nalgebra::Vector3;

use super::{Axis, CHANNELS, Channel, Refusal, Uncertainty, bytes, check, method};
use crate::{
    geometry::{PLATES, TRIAD_AXES, accelerometer_place_b, gyro_axis_b, triad_axes_b},
    sample::Kind,
    sensor::{
        adis16265::Range,
        hmc5883l::{GAUSS_UT, Gain},
        lis331hh::{FullScale, STANDARD_GRAVITY},
    },
    settings::Settings,
};

/// Which method found the parameters of a kind of sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// Nominal matrices.
    Mt,
    /// Least squares with controlled inputs.
    LmsEc,
    /// Minimum variance without controlled inputs.
    MvSec,
}

/// Whose parameters they are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Identity {
    /// Serial number of the unit; 0 for the nominal set, which fits none in particular.
    pub unit: u32,
    /// Number of the set, counted up by whoever calibrates.
    pub set: u32,
    /// Method of the accelerometers, magnetometers and gyros.
    pub methods: [Method; 3],
}

/// Ranges of the sensors the counts of a set belong to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Ranges {
    /// Full scale of the accelerometers.
    pub acceleration: FullScale,
    /// Gain of the magnetometers.
    pub field: Gain,
    /// Range of the gyros.
    pub rate: Range,
}

impl Ranges {
    /// Those of a unit's settings.
    pub fn of(settings: &Settings) -> Self {
        Ranges {
            acceleration: settings.acceleration,
            field: settings.field,
            rate: settings.rate,
        }
    }

    /// [unit/count] what the datasheets say of a kind. Eq 3.30 is reproduced with their g to its last digit.
    pub fn nominal_scale(&self, kind: Kind) -> f32 {
        match kind {
            Kind::Accelerometer => self.acceleration.mg_per_count() * 1e-3 * STANDARD_GRAVITY,
            Kind::Magnetometer => GAUSS_UT / f32::from(self.field.counts_per_gauss()),
            Kind::Gyro | Kind::Thermometer => self.rate.deg_s_per_count().to_radians(),
        }
    }
}

/// A unit's parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Set {
    /// Whose they are.
    pub identity: Identity,
    /// What the counts belong to.
    pub ranges: Ranges,
    /// \[degC\] temperature the parameters are for.
    pub reference_c: f32,
    /// \[degC\] lowest temperature they hold at; below it they are applied as at it, and marked.
    pub lowest_c: f32,
    /// \[degC\] highest temperature they hold at.
    pub highest_c: f32,
    /// How far they may be off: accelerometers, magnetometers, gyros.
    pub uncertainty: [Uncertainty; 3],
    /// \[m\] places of the accelerometers, in b, from the unit's centre of rotation.
    pub place_b: [Vector3<f32>; PLATES],
    /// \[m\] standard deviation of a component of a place.
    pub place_sigma: f32,
    /// [m/s2] accelerometers, x, y, z of each plate.
    pub acc: [Axis; TRIAD_AXES],
    /// \[uT\] magnetometers, x, y, z of each plate.
    pub mag: [Axis; TRIAD_AXES],
    /// [rad/s] gyros.
    pub gyro: [Axis; PLATES],
}

impl Set {
    /// MT for every sensor, where no set was compiled in.
    ///
    /// Noise is that of the thesis' unit (sections 4.1 and 4.2: 1.53 and 2.68 counts at the unit's nominal ranges) and of
    /// the HMC5883L's datasheet (2 mG). How far datasheet parameters may be off is what LMS EC found on the thesis' unit
    /// (Eqs 4.21, 4.23, 4.39, 4.40): accelerometer biases up to 20 counts, scales 1 to 4 % off, axes up to 1.3 deg, gyro
    /// biases up to 1.5 deg/s, axes up to 0.8 deg. No magnetometer was calibrated in place: hard iron is anyone's guess.
    pub fn nominal(ranges: Ranges) -> Self {
        let axes_b = triad_axes_b();
        let triad = |kind, noise| axes_b.map(|axis_b| method::mt(axis_b, ranges.nominal_scale(kind), noise));
        let gyro_scale = ranges.nominal_scale(Kind::Gyro);
        Set {
            identity: Identity {
                unit: 0,
                set: 0,
                methods: [Method::Mt; 3],
            },
            ranges,
            reference_c: 25.0,
            lowest_c: -40.0,
            highest_c: 85.0,
            uncertainty: [
                Uncertainty {
                    bias: 0.3,
                    scale: 0.025,
                    direction: 0.015,
                },
                Uncertainty {
                    bias: 5.0,
                    scale: 0.05,
                    direction: 0.02,
                },
                Uncertainty {
                    bias: 0.015,
                    scale: 0.003,
                    direction: 0.01,
                },
            ],
            place_b: core::array::from_fn(accelerometer_place_b),
            place_sigma: 2e-3,
            acc: triad(Kind::Accelerometer, 0.045),
            mag: triad(Kind::Magnetometer, 0.2),
            gyro: core::array::from_fn(|plate| method::mt(gyro_axis_b(plate), gyro_scale, 0.00344)),
        }
    }

    /// The set in `bytes`, if it is whole, sound, for these ranges and of this unit; a unit that was built without a serial
    /// number (0) cannot tell, and takes any.
    pub fn load(bytes: &[u8], ranges: Ranges, unit: u32) -> Result<Self, Refusal> {
        let set = bytes::decode(bytes)?;
        if set.ranges != ranges {
            return Err(Refusal::OtherRanges);
        }
        if unit != 0 && set.identity.unit != unit {
            return Err(Refusal::OtherUnit {
                found: set.identity.unit,
                expected: unit,
            });
        }
        set.check()?;
        Ok(set)
    }

    /// Whether it can be used: numbers that are numbers, axes near the nominal ones, scales near the datasheets', sensors
    /// that span space.
    pub fn check(&self) -> Result<(), Refusal> {
        check::check(self)
    }

    /// Its [`super::ENCODED_BYTES`] as they are sent and stored.
    pub fn encode(&self) -> [u8; bytes::ENCODED_BYTES] {
        bytes::encode(self)
    }

    /// CRC-32 over what it says, as sent and stored with it.
    pub fn checksum(&self) -> u32 {
        let bytes = self.encode();
        u32::from_le_bytes(core::array::from_fn(|k| bytes[bytes::ENCODED_BYTES - 4 + k]))
    }

    /// Axes of a kind; none for the thermometers.
    pub fn axes(&self, kind: Kind) -> &[Axis] {
        match kind {
            Kind::Accelerometer => &self.acc,
            Kind::Magnetometer => &self.mag,
            Kind::Gyro => &self.gyro,
            Kind::Thermometer => &[],
        }
    }

    /// Every axis with its number.
    pub fn channels(&self) -> impl Iterator<Item = (Channel, &Axis)> {
        let axes = self.acc.iter().chain(&self.mag).chain(&self.gyro);
        (0..CHANNELS as u8).zip(axes).map(|(n, axis)| (Channel(n), axis))
    }
}
