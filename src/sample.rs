//! One read cycle: sixteen sensors in counts, when each was sampled, and which failed.
//!
//! The order of [`SENSORS`] is *the* reading order: of the acquisition, of the packet's fields (Tab. A.3) and of the
//! error identifier, in which bit `k` (least significant first) is the `k`-th sensor read.

use core::fmt;

/// Sent for a value that was not read. No sensor of the unit produces it: their codes have at most 14 bits.
pub const NOT_READ: i16 = i16::MIN;

/// How many sensors a cycle reads.
pub const SENSOR_COUNT: usize = 16;

/// What a sensor measures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
pub enum Kind {
    /// LIS331HH.
    Accelerometer,
    /// HMC5883L.
    Magnetometer,
    /// ADIS16265: rate and its own temperature.
    Gyro,
    /// TMP102.
    Thermometer,
}

/// One of the sixteen sensors.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
pub struct Sensor {
    /// What it measures.
    pub kind: Kind,
    /// Plate it sits on, 0 to 3 (the thesis' plates 1 to 4).
    pub plate: usize,
}

impl fmt::Display for Sensor {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let kind = match self.kind {
            Kind::Accelerometer => "accelerometer",
            Kind::Magnetometer => "magnetometer",
            Kind::Gyro => "gyro",
            Kind::Thermometer => "thermometer",
        };
        write!(f, "{kind} {}", self.plate.wrapping_add(1))
    }
}

/// The reading order (thesis, App. B.2: accelerometers first; Tab. A.3 for the rest).
pub const SENSORS: [Sensor; SENSOR_COUNT] = {
    const KINDS: [Kind; 4] = [Kind::Accelerometer, Kind::Magnetometer, Kind::Gyro, Kind::Thermometer];
    let mut order = [Sensor {
        kind: Kind::Accelerometer,
        plate: 0,
    }; SENSOR_COUNT];
    let mut slot = 0;
    while slot < SENSOR_COUNT {
        order[slot] = Sensor {
            kind: KINDS[slot / 4],
            plate: slot % 4,
        };
        slot += 1;
    }
    order
};

/// Which sensors failed in a cycle: the packet's bytes 5 to 8.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
pub struct Errors(pub u16);

impl Errors {
    /// Marks the sensor in reading-order `slot`.
    pub fn insert(&mut self, slot: usize) {
        self.0 |= Errors::bit(slot);
    }

    /// Clears the sensor in reading-order `slot`.
    pub fn remove(&mut self, slot: usize) {
        self.0 &= !Errors::bit(slot);
    }

    /// Whether the sensor in reading-order `slot` failed.
    pub fn contains(self, slot: usize) -> bool {
        self.0 & Errors::bit(slot) != 0
    }

    /// None where the reading order has no such slot.
    fn bit(slot: usize) -> u16 {
        u32::try_from(slot)
            .ok()
            .and_then(|slot| 1_u16.checked_shl(slot))
            .unwrap_or(0)
    }
}

/// What one read cycle measured: all that a packet carries. Counts are as Tab. A.3 has them: right-justified two's
/// complement.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
pub struct Reading {
    /// Cycle number, wraps.
    pub counter: u16,
    /// Sensors that failed.
    pub errors: Errors,
    /// [LIS331HH counts] x, y, z of each plate, plate frame `p`.
    pub acc_p: [[i16; 3]; 4],
    /// [HMC5883L counts] x, y, z of each plate, plate frame `p`.
    pub mag_p: [[i16; 3]; 4],
    /// [ADIS16265 counts] rate about each plate's sense axis.
    pub gyro: [i16; 4],
    /// [ADIS16265 counts] temperature of each gyro; 0 is 25 degC.
    pub gyro_temperature: [i16; 4],
    /// [TMP102 counts] temperature of each plate.
    pub temperature: [i16; 4],
    /// Debounced lift-off, `true` = asserted.
    pub lift_off: bool,
    /// Debounced micro-gravity, `true` = asserted.
    pub micro_g: bool,
}

impl Reading {
    /// A cycle in which nothing has been read yet: every value [`NOT_READ`], every error bit set.
    pub fn unread(counter: u16) -> Self {
        Reading {
            counter,
            errors: Errors(u16::MAX),
            acc_p: [[NOT_READ; 3]; 4],
            mag_p: [[NOT_READ; 3]; 4],
            gyro: [NOT_READ; 4],
            gyro_temperature: [NOT_READ; 4],
            temperature: [NOT_READ; 4],
            lift_off: false,
            micro_g: false,
        }
    }
}

/// Slot time of a sensor that was not sampled.
pub const NO_SLOT: u32 = u32::MAX;

/// A read cycle with its times.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
pub struct Sample {
    /// What was measured.
    pub reading: Reading,
    /// \[us\] start of the cycle, since the unit's clock started.
    pub start_us: u64,
    /// \[us\] instant at which each sensor was sampled, after `start_us`, in reading order; [`NO_SLOT`] if it was not.
    pub slots_us: [u32; SENSOR_COUNT],
}

impl Sample {
    /// \[us\] slot times of the sensors of a kind, plate 1 to 4.
    pub fn slots_of(&self, kind: Kind) -> &[u32] {
        let first = first_of(kind);
        &self.slots_us[first..first + 4]
    }
}

/// Slot of a kind's first sensor: the kinds come one after another in the reading order.
const fn first_of(kind: Kind) -> usize {
    match kind {
        Kind::Accelerometer => 0,
        Kind::Magnetometer => 4,
        Kind::Gyro => 8,
        Kind::Thermometer => 12,
    }
}

// Another reading order does not compile until `first_of` follows it.
const _: () = {
    let mut slot = 0;
    while slot < SENSOR_COUNT {
        let Sensor { kind, plate } = SENSORS[slot];
        assert!(
            first_of(kind) + plate == slot,
            "slots_of does not follow the reading order"
        );
        slot += 1;
    }
};

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slots_of_a_kind_are_those_of_its_sensors() {
        let sample = Sample {
            reading: Reading::unread(0),
            start_us: 0,
            slots_us: core::array::from_fn(|slot| slot as u32),
        };
        for kind in [Kind::Accelerometer, Kind::Magnetometer, Kind::Gyro, Kind::Thermometer] {
            for (plate, slot) in sample.slots_of(kind).iter().enumerate() {
                assert_eq!(SENSORS[*slot as usize], Sensor { kind, plate });
            }
        }
    }
}
