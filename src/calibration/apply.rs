//! A reading through a parameter set: counts to SI, axis by axis.
//!
//! In: a [`Reading`], its [`Temperatures`], a [`Set`]. Out: [`Measured`]. A count that was not read, stands at the end of
//! its range or cannot come from the part gives no value, and is said to be which.

use super::{Axis, Channel, Channels, Set, Temperatures};
use crate::{
    geometry::{PLATES, TRIAD_AXES},
    sample::{Kind, Reading},
    sensor::hmc5883l::OVERFLOW,
};

/// [counts] ends of the LIS331HH's 12 bits.
const ACC_ENDS: (i16, i16) = (-2048, 2047);
/// [counts] just beyond the HMC5883L's 12 bits, where it says [`OVERFLOW`].
const MAG_ENDS: (i16, i16) = (-2049, 2048);
/// [counts] where the ADIS16265 ends: 320 deg/s of 0.07326, and the same counts in its other ranges.
const GYRO_ENDS: (i16, i16) = (-4368, 4368);

/// What each axis measured along itself in one cycle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measured {
    /// [m/s2] specific force along each axis of [`Set::acc`]; 0 where there is none.
    pub acc: [f32; TRIAD_AXES],
    /// [uT] field along each axis of [`Set::mag`]; 0 where there is none.
    pub mag: [f32; TRIAD_AXES],
    /// [rad/s] rate about each axis of [`Set::gyro`]; 0 where there is none.
    pub gyro: [f32; PLATES],
    /// Axes that have a value.
    pub present: Channels,
    /// Axes at the end of their range, which have none.
    pub saturated: Channels,
    /// A temperature is not of this cycle or was never read.
    pub temperature_held: bool,
    /// A temperature is outside what the set holds for; its nearer end was used.
    pub beyond_validity: bool,
}

impl Set {
    /// What the axes measured.
    pub fn apply(&self, reading: &Reading, temperatures: &Temperatures) -> Measured {
        let mut beyond_validity = false;
        let mut above_c = |at_c: Option<f32>| {
            let at_c = at_c.unwrap_or(self.reference_c);
            let valid_c = at_c.clamp(self.lowest_c, self.highest_c);
            beyond_validity |= valid_c != at_c;
            valid_c - self.reference_c
        };
        let plates_c: [f32; PLATES] = core::array::from_fn(|plate| above_c(temperatures.plate_c(plate)));
        let gyros_c: [f32; PLATES] = core::array::from_fn(|plate| above_c(temperatures.gyro_c(plate)));
        let mut seen = Seen::default();
        let (acc, mag) = (reading.acc_p.as_flattened(), reading.mag_p.as_flattened());
        Measured {
            acc: core::array::from_fn(|k| {
                let channel = Channel::of(Kind::Accelerometer, k);
                seen.value(channel, &self.acc[k], acc[k], plates_c[k / 3], ACC_ENDS)
            }),
            mag: core::array::from_fn(|k| {
                let channel = Channel::of(Kind::Magnetometer, k);
                seen.value(channel, &self.mag[k], mag[k], plates_c[k / 3], MAG_ENDS)
            }),
            gyro: core::array::from_fn(|k| {
                let channel = Channel::of(Kind::Gyro, k);
                seen.value(channel, &self.gyro[k], reading.gyro[k], gyros_c[k], GYRO_ENDS)
            }),
            present: seen.present,
            saturated: seen.saturated,
            temperature_held: temperatures.held(),
            beyond_validity,
        }
    }
}

#[derive(Default)]
struct Seen {
    present: Channels,
    saturated: Channels,
}

impl Seen {
    fn value(&mut self, channel: Channel, axis: &Axis, counts: i16, above_c: f32, ends: (i16, i16)) -> f32 {
        let overflowed = channel.kind() == Kind::Magnetometer && counts == OVERFLOW;
        if overflowed || counts == ends.0 || counts == ends.1 {
            self.saturated.insert(channel);
        } else if (ends.0..=ends.1).contains(&counts) {
            self.present.insert(channel);
            return axis.value(counts, above_c);
        }
        0.0
    }
}
