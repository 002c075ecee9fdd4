//! What the calibration believes of the temperatures.
//!
//! In: the thermometers' counts of each cycle. Out: a temperature a plate and a gyro. A missing one is held at its last
//! value; one that jumps by more than [`JUMP_C`] is not believed until it has stayed there for [`JUMP_CYCLES`] cycles, as
//! copper and glass do not change so fast and a failing thermometer does.

use crate::{
    geometry::PLATES,
    sample::{NOT_READ, Reading},
    sensor::{adis16265, tmp102},
};

/// \[degC\] from one cycle to the next.
const JUMP_C: f32 = 5.0;
/// Cycles; 5 s at the unit's 5 Hz.
const JUMP_CYCLES: u8 = 25;

/// One thermometer.
#[derive(Clone, Copy, Debug, Default)]
struct Held {
    believed_c: Option<f32>,
    doubted_c: f32,
    doubted_for: u8,
    fresh: bool,
}

impl Held {
    fn note(&mut self, seen_c: Option<f32>) {
        self.fresh = false;
        let Some(seen_c) = seen_c else { return };
        let near = |other_c: f32| (seen_c - other_c).abs() <= JUMP_C;
        if self.believed_c.is_none_or(near) {
            self.doubted_for = 0;
            self.believed_c = Some(seen_c);
            self.fresh = true;
            return;
        }
        self.doubted_for = if self.doubted_for > 0 && near(self.doubted_c) {
            self.doubted_for.saturating_add(1)
        } else {
            1
        };
        self.doubted_c = seen_c;
        if self.doubted_for >= JUMP_CYCLES {
            self.believed_c = None;
            self.note(Some(seen_c));
        }
    }
}

/// The eight thermometers.
#[derive(Clone, Copy, Debug, Default)]
pub struct Temperatures {
    plates: [Held; PLATES],
    gyros: [Held; PLATES],
}

impl Temperatures {
    /// Takes a cycle's reading.
    pub fn note(&mut self, reading: &Reading) {
        let read = |counts: i16| (counts != NOT_READ).then(|| f32::from(counts));
        for plate in 0..PLATES {
            let plate_c = read(reading.temperature[plate]).map(|counts| counts * tmp102::CELSIUS_PER_COUNT);
            let gyro_c = read(reading.gyro_temperature[plate])
                .map(|counts| adis16265::ZERO_C + counts * adis16265::CELSIUS_PER_COUNT);
            self.plates[plate].note(plate_c);
            self.gyros[plate].note(gyro_c);
        }
    }

    /// \[degC\] of the accelerometer and magnetometer of a plate; `None` before it was first read.
    pub fn plate_c(&self, plate: usize) -> Option<f32> {
        self.plates[plate].believed_c
    }

    /// \[degC\] of a plate's gyro.
    pub fn gyro_c(&self, plate: usize) -> Option<f32> {
        self.gyros[plate].believed_c
    }

    /// Whether some temperature is not of this cycle.
    pub fn held(&self) -> bool {
        self.plates
            .iter()
            .chain(&self.gyros)
            .any(|thermometer| !thermometer.fresh)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn reading(temperature: i16) -> Reading {
        Reading {
            temperature: [temperature; 4],
            gyro_temperature: [0; 4],
            ..Reading::unread(0)
        }
    }

    #[test]
    fn a_missing_temperature_is_held_and_said_to_be() {
        let mut temperatures = Temperatures::default();
        assert_eq!(temperatures.plate_c(0), None);
        temperatures.note(&reading(400));
        assert_eq!((temperatures.plate_c(0), temperatures.held()), (Some(25.0), false));
        temperatures.note(&reading(NOT_READ));
        assert_eq!((temperatures.plate_c(0), temperatures.held()), (Some(25.0), true));
        assert_eq!(temperatures.gyro_c(3), Some(25.0));
    }

    #[test]
    fn a_jump_of_40_k_is_believed_after_five_seconds_and_garbage_never() {
        let mut temperatures = Temperatures::default();
        temperatures.note(&reading(400));
        for _ in 1..JUMP_CYCLES {
            temperatures.note(&reading(400 + 640));
            assert_eq!((temperatures.plate_c(1), temperatures.held()), (Some(25.0), true));
        }
        temperatures.note(&reading(400 + 640));
        assert_eq!((temperatures.plate_c(1), temperatures.held()), (Some(65.0), false));
        for cycle in 0..1000_i16 {
            temperatures.note(&reading(if cycle % 2 == 0 { -700 } else { 100 + cycle % 7 }));
        }
        assert_eq!(temperatures.plate_c(1), Some(65.0));
    }
}
