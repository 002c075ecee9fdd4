//! The thirty-six channels of a packet: their names, and counts to nominal SI.
//!
//! In: a [`Reading`]. Out: its values in [`CHANNELS`] order, `None` for a value that was not read. The order is the
//! packet's (Tab. A.3), and the names are those of a gap case: `a1x` .. `a4z`, `m1x` .. `m4z`, `g1` .. `g4`, `tg1` ..
//! `tg4`, `t1` .. `t4`, numbered like the thesis' plates.
//!
//! Nominal means datasheet scale, no calibration: what the unit measured is in counts, and only a calibration file
//! says what a count was worth.

use std::ops::RangeInclusive;

use emems::{
    sample::{Kind, NOT_READ, Reading, SENSORS},
    sensor::{
        adis16265::{self, RANGE_COUNTS},
        hmc5883l::{GAUSS_UT, Gain, OVERFLOW},
        lis331hh::{CODES, FullScale},
        tmp102,
    },
};

use crate::magnitude::G;

/// Values in a packet.
pub const CHANNEL_COUNT: usize = 36;

/// [m/s2 per count] LIS331HH at +-6 g, 12 bit.
pub const ACC_LSB: f64 = FullScale::G6.mg_per_count() as f64 * 1e-3 * G;

/// [uT per count] HMC5883L at gain 1 (+-1.3 Ga), by its counts a gauss (datasheet, table 9, whose 0.92 mG a digit is
/// that rounded: 0.3 % too much, as much as a magnetometer's scale is known).
pub const MAG_LSB_UT: f64 = GAUSS_UT as f64 / Gain::PerGauss1090.counts_per_gauss() as f64;

/// [rad/s per count] ADIS16265 at +-320 deg/s.
pub const GYRO_LSB: f64 = adis16265::Range::DegPerS320.deg_s_per_count_f64() * std::f64::consts::PI / 180.0;

/// [degC per count] ADIS16265 TEMP_OUT.
pub const GYRO_TEMPERATURE_LSB_C: f64 = adis16265::CELSIUS_PER_COUNT_F64;

/// \[degC\] ADIS16265 temperature at 0 counts.
pub const GYRO_TEMPERATURE_ZERO_C: f64 = adis16265::ZERO_C as f64;

/// [degC per count] TMP102.
pub const TEMPERATURE_LSB_C: f64 = tmp102::CELSIUS_PER_COUNT as f64;

/// What a channel measures: a sensor's [`Kind`], but a gyro's own temperature is a quantity of its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// [m/s2] specific force along an axis of the plate.
    SpecificForce,
    /// \[uT\] magnetic field along an axis of the plate.
    Field,
    /// [rad/s] angular rate about the plate's sense axis.
    Rate,
    /// \[degC\] temperature inside a gyro.
    GyroTemperature,
    /// \[degC\] temperature of a plate.
    Temperature,
}

impl Quantity {
    /// Nominal value of a count, and the value at zero counts.
    pub fn scale(self) -> (f64, f64) {
        match self {
            Quantity::SpecificForce => (ACC_LSB, 0.0),
            Quantity::Field => (MAG_LSB_UT, 0.0),
            Quantity::Rate => (GYRO_LSB, 0.0),
            Quantity::GyroTemperature => (GYRO_TEMPERATURE_LSB_C, GYRO_TEMPERATURE_ZERO_C),
            Quantity::Temperature => (TEMPERATURE_LSB_C, 0.0),
        }
    }

    /// Decimals that lose nothing of a count.
    pub fn decimals(self) -> usize {
        match self {
            Quantity::SpecificForce => 5,
            Quantity::Field => 3,
            Quantity::Rate => 6,
            Quantity::GyroTemperature | Quantity::Temperature => 4,
        }
    }

    /// Unit as written in the field.
    pub fn unit(self) -> &'static str {
        match self {
            Quantity::SpecificForce => "m/s²",
            Quantity::Field => "µT",
            Quantity::Rate => "rad/s",
            Quantity::GyroTemperature | Quantity::Temperature => "°C",
        }
    }

    /// Codes of a part that is within its range, and codes that it can give at all: 12 bits, of the gyro's rate 14
    /// (LIS331HH, HMC5883L, ADIS16265, TMP102 datasheets).
    fn codes(self) -> (RangeInclusive<i16>, RangeInclusive<i16>) {
        match self {
            Quantity::SpecificForce | Quantity::Field => (*CODES.start() + 1..=*CODES.end() - 1, CODES),
            Quantity::Rate => (1 - RANGE_COUNTS..=RANGE_COUNTS - 1, -8192..=8191),
            Quantity::GyroTemperature | Quantity::Temperature => (-2048..=2047, -2048..=2047),
        }
    }

    /// Whether some counts are a measurement.
    pub fn reach(self, counts: i16) -> Reach {
        let (within, possible) = self.codes();
        if within.contains(&counts) {
            Reach::Within
        } else if possible.contains(&counts) || (self == Quantity::Field && counts == OVERFLOW) {
            Reach::End
        } else {
            Reach::Impossible
        }
    }

    /// Nominal SI value of some counts that say how much it was: `None` of an overflow mark and of a code that the part
    /// cannot give. A value at the end of its range is a bound, and stays.
    pub fn meant(self, counts: i16) -> Option<f64> {
        let (_, possible) = self.codes();
        possible.contains(&counts).then(|| self.si(counts))
    }

    /// Nominal SI value of some counts.
    pub fn si(self, counts: i16) -> f64 {
        let (lsb, zero) = self.scale();
        f64::from(counts) * lsb + zero
    }
}

/// Whether counts are a measurement.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reach {
    /// They are.
    Within,
    /// The part stands at the end of its range, or says that it overflowed: it was that much or more.
    End,
    /// The part cannot give this code.
    Impossible,
}

/// One value of a packet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Channel {
    /// Its name in files.
    pub name: &'static str,
    /// What it measures.
    pub quantity: Quantity,
    /// Plate it sits on, 0 to 3.
    pub plate: usize,
}

impl Channel {
    /// Reading-order slot of the sensor it comes from: the bit in the packet's error identifier.
    pub fn slot(self) -> usize {
        let group = match self.quantity {
            Quantity::SpecificForce => 0,
            Quantity::Field => 1,
            Quantity::Rate | Quantity::GyroTemperature => 2,
            Quantity::Temperature => 3,
        };
        4 * group + self.plate
    }
}

/// All channels in packet order.
pub const CHANNELS: [Channel; CHANNEL_COUNT] = {
    use Quantity::*;
    const fn of(name: &'static str, quantity: Quantity, plate: usize) -> Channel {
        Channel { name, quantity, plate }
    }
    [
        of("a1x", SpecificForce, 0),
        of("a1y", SpecificForce, 0),
        of("a1z", SpecificForce, 0),
        of("a2x", SpecificForce, 1),
        of("a2y", SpecificForce, 1),
        of("a2z", SpecificForce, 1),
        of("a3x", SpecificForce, 2),
        of("a3y", SpecificForce, 2),
        of("a3z", SpecificForce, 2),
        of("a4x", SpecificForce, 3),
        of("a4y", SpecificForce, 3),
        of("a4z", SpecificForce, 3),
        of("m1x", Field, 0),
        of("m1y", Field, 0),
        of("m1z", Field, 0),
        of("m2x", Field, 1),
        of("m2y", Field, 1),
        of("m2z", Field, 1),
        of("m3x", Field, 2),
        of("m3y", Field, 2),
        of("m3z", Field, 2),
        of("m4x", Field, 3),
        of("m4y", Field, 3),
        of("m4z", Field, 3),
        of("g1", Rate, 0),
        of("g2", Rate, 1),
        of("g3", Rate, 2),
        of("g4", Rate, 3),
        of("tg1", GyroTemperature, 0),
        of("tg2", GyroTemperature, 1),
        of("tg3", GyroTemperature, 2),
        of("tg4", GyroTemperature, 3),
        of("t1", Temperature, 0),
        of("t2", Temperature, 1),
        of("t3", Temperature, 2),
        of("t4", Temperature, 3),
    ]
};

/// Values of a reading in channel order; `None` where nothing was read.
pub fn counts(reading: &Reading) -> [Option<i16>; CHANNEL_COUNT] {
    let mut values = reading
        .acc_p
        .as_flattened()
        .iter()
        .chain(reading.mag_p.as_flattened())
        .chain(&reading.gyro)
        .chain(&reading.gyro_temperature)
        .chain(&reading.temperature)
        .map(|code| Some(*code).filter(|code| *code != NOT_READ));
    std::array::from_fn(|_| values.next().flatten())
}

/// A sensor as a reader of reports knows it: "accelerometer 1".
pub fn sensor_name(slot: usize) -> String {
    match SENSORS.get(slot) {
        Some(sensor) => {
            let kind = match sensor.kind {
                Kind::Accelerometer => "accelerometer",
                Kind::Magnetometer => "magnetometer",
                Kind::Gyro => "gyro",
                Kind::Thermometer => "thermometer",
            };
            format!("{kind} {}", sensor.plate + 1)
        }
        None => format!("sensor {slot}"),
    }
}

#[cfg(test)]
mod tests {
    use emems::packet;

    use super::*;

    const GOLDEN: &[u8] = b"@00010000FEC50002FF9EFEB5FFFCFF81FEBF000AFF8400020001015D0078FFDDFF2EFF4C003CFFA1008CFFB50021FFF400CDFF8AFFFD089BF71D0008000CFFFC0000000701900191018F019211#";

    /// Half of the last decimal written for each quantity.
    const ROUNDING: f64 = 5e-7;

    fn golden(name: &str) -> (Option<i16>, Channel) {
        let index = CHANNELS.iter().position(|channel| channel.name == name).expect(name);
        (
            counts(&packet::decode(GOLDEN).expect("golden frame"))[index],
            CHANNELS[index],
        )
    }

    #[test]
    fn every_channel_takes_its_own_field_of_the_golden_frame() {
        let check = |name, value| assert_eq!(golden(name).0, Some(value), "{name}");
        check("a1x", -315);
        check("a4z", 349);
        check("m1x", 120);
        check("m4z", -118);
        check("g1", -3);
        check("g3", -2275);
        check("tg1", 12);
        check("tg4", 7);
        check("t1", 400);
        check("t4", 402);
    }

    #[test]
    fn counts_become_nominal_si() {
        let check = |name, si: f64| {
            let (counts, channel) = golden(name);
            let value = channel.quantity.si(counts.expect(name));
            assert!((value - si).abs() < ROUNDING, "{name}: {value} is not {si}");
        };
        check("a1x", -315.0 * 0.029_419_95);
        check("m2x", -180.0 * 100.0 / 1090.0);
        check("g2", 2203.0 * 0.001_278_628_210);
        check("tg1", 25.0 + 1.7436);
        check("tg3", 25.0);
        check("t1", 25.0);
    }

    #[test]
    fn the_end_of_a_range_is_told_from_a_measurement_and_from_a_code_that_no_part_gives() {
        use Quantity::*;
        let check = |quantity: Quantity, counts, reach, meant: bool| {
            assert_eq!(quantity.reach(counts), reach, "{quantity:?} {counts}");
            assert_eq!(quantity.meant(counts).is_some(), meant, "{quantity:?} {counts}");
        };
        check(SpecificForce, 2046, Reach::Within, true);
        check(SpecificForce, 2047, Reach::End, true);
        check(SpecificForce, -2048, Reach::End, true);
        check(SpecificForce, 0x7FFF, Reach::Impossible, false);
        check(Field, OVERFLOW, Reach::End, false);
        check(Rate, 4367, Reach::Within, true);
        check(Rate, -4368, Reach::End, true);
        check(Temperature, 2048, Reach::Impossible, false);
    }

    #[test]
    fn a_value_that_was_not_read_has_no_counts() {
        assert_eq!(counts(&Reading::unread(0)), [None; CHANNEL_COUNT]);
    }

    #[test]
    fn a_channel_knows_the_error_bit_of_its_sensor() {
        let check = |name, slot, text| {
            assert_eq!(golden(name).1.slot(), slot, "{name}");
            assert_eq!(sensor_name(slot), text);
        };
        check("a1y", 0, "accelerometer 1");
        check("m4x", 7, "magnetometer 4");
        check("g2", 9, "gyro 2");
        check("tg2", 9, "gyro 2");
        check("t4", 15, "thermometer 4");
    }
}
