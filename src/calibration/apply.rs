//! A reading through a parameter set: counts to SI, axis by axis.
//!
//! In: a [`Reading`], its [`Temperatures`], a [`Set`]. Out: [`Measured`]. A count that was not read, stands at the end of
//! its range or cannot come from the part gives no value, and is said to be which.

use super::{Axis, Channels, Set, Temperatures};
use crate::{
    geometry::{PLATES, TRIAD_AXES},
    sample::{Kind, Reading},
    sensor::{adis16265::RANGE_COUNTS, hmc5883l::OVERFLOW, lis331hh},
};

/// \[counts\] what a part says at the ends of its range, and beyond it if it has a word for that.
struct Ends {
    least: i16,
    most: i16,
    overflow: i16,
}

/// \[counts\] ends of the LIS331HH's 12 bits.
const ACC_ENDS: Ends = Ends {
    least: *lis331hh::CODES.start(),
    most: *lis331hh::CODES.end(),
    overflow: *lis331hh::CODES.start(),
};
/// \[counts\] just beyond the HMC5883L's 12 bits, where it says [`OVERFLOW`].
const MAG_ENDS: Ends = Ends {
    least: -2049,
    most: 2048,
    overflow: OVERFLOW,
};
/// \[counts\] where the ADIS16265 ends.
const GYRO_ENDS: Ends = Ends {
    least: -RANGE_COUNTS,
    most: RANGE_COUNTS,
    overflow: -RANGE_COUNTS,
};

/// What each axis measured along itself in one cycle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measured {
    /// [m/s2] specific force along each axis of [`Set::acc`]; 0 where there is none.
    pub acc: [f32; TRIAD_AXES],
    /// \[uT\] field along each axis of [`Set::mag`]; 0 where there is none.
    pub mag: [f32; TRIAD_AXES],
    /// [rad/s] rate about each axis of [`Set::gyro`]; 0 where there is none.
    pub gyro: [f32; PLATES],
    /// Axes that have a value.
    pub present: Channels,
    /// Axes at the end of their range, which have none.
    pub saturated: Channels,
    /// \[degC\] each gyro's temperature above the reference, within what the set holds for.
    pub gyros_above_c: [f32; PLATES],
    /// A temperature is not of this cycle or was never read.
    pub temperature_held: bool,
    /// A temperature is outside what the set holds for; its nearer end was used.
    pub beyond_validity: bool,
}

impl Set {
    /// What the axes measured.
    pub fn apply(&self, reading: &Reading, temperatures: &Temperatures) -> Measured {
        let mut beyond_c = 0.0;
        let mut above_c = |at_c: Option<f32>| {
            let at_c = at_c.unwrap_or(self.reference_c);
            // Not `clamp`, which panics where the ends are not in order, and brings the formatting of floats into the image.
            let valid_c = if at_c < self.lowest_c {
                self.lowest_c
            } else if at_c > self.highest_c {
                self.highest_c
            } else {
                at_c
            };
            // A sum: eight comparisons cost more.
            beyond_c += (valid_c - at_c).abs();
            valid_c - self.reference_c
        };
        let plates_c: [f32; PLATES] = core::array::from_fn(|plate| above_c(temperatures.plate_c(plate)));
        let gyros_c: [f32; PLATES] = core::array::from_fn(|plate| above_c(temperatures.gyro_c(plate)));
        let mut measured = Measured {
            acc: [0.0; TRIAD_AXES],
            mag: [0.0; TRIAD_AXES],
            gyro: [0.0; PLATES],
            present: Channels::default(),
            saturated: Channels::default(),
            gyros_above_c: gyros_c,
            temperature_held: temperatures.held(),
            beyond_validity: beyond_c != 0.0,
        };
        let (acc, mag) = (reading.acc_p.as_flattened(), reading.mag_p.as_flattened());
        let found = values(&self.acc, acc, &plates_c, &ACC_ENDS, &mut measured.acc);
        measured.take(Kind::Accelerometer, &found);
        let found = values(&self.mag, mag, &plates_c, &MAG_ENDS, &mut measured.mag);
        measured.take(Kind::Magnetometer, &found);
        let found = values(&self.gyro, &reading.gyro, &gyros_c, &GYRO_ENDS, &mut measured.gyro);
        measured.take(Kind::Gyro, &found);
        measured
    }
}

impl Measured {
    fn take(&mut self, kind: Kind, found: &Seen) {
        self.present = self.present.with(kind, found.present);
        self.saturated = self.saturated.with(kind, found.saturated);
    }
}

/// Axes of one kind, bit `k` for its axis `k`.
struct Seen {
    present: u16,
    saturated: u16,
}

/// What the axes of one kind measured, as many a plate as there are.
fn values(axes: &[Axis], counts: &[i16], above_c: &[f32; PLATES], ends: &Ends, values: &mut [f32]) -> Seen {
    let mut seen = Seen {
        present: 0,
        saturated: 0,
    };
    let (mut bit, a_plate) = (1, axes.len() / PLATES);
    let plates = axes.chunks_exact(a_plate).zip(counts.chunks_exact(a_plate));
    for (((axes, counts), values), above_c) in plates.zip(values.chunks_exact_mut(a_plate)).zip(above_c) {
        for ((axis, &counts), value) in axes.iter().zip(counts).zip(values) {
            // Between the ends in one comparison.
            let first = ends.least.wrapping_add(1);
            let inside = counts.wrapping_sub(first) as u16;
            if inside < ends.most.wrapping_sub(first) as u16 {
                seen.present |= bit;
                *value = axis.value(counts, *above_c);
            } else if counts == ends.least || counts == ends.most || counts == ends.overflow {
                seen.saturated |= bit;
            }
            bit <<= 1;
        }
    }
    seen
}
