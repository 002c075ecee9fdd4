//! A set from its bytes to the values it gives.

use nalgebra::Vector3;

use super::*;
use crate::{
    sample::{Kind, NOT_READ, Reading, Sensor},
    sensor::hmc5883l::{Gain, OVERFLOW},
    unit::Settings,
};

fn ranges() -> Ranges {
    Ranges::of(&Settings::NOMINAL)
}

/// A set that differs from the nominal one in every number.
fn own() -> Set {
    let mut set = Set::nominal(ranges());
    set.identity = Identity {
        unit: 7,
        set: 42,
        methods: [Method::LmsEc, Method::MvSec, Method::LmsEc],
    };
    set.reference_c = 22.0;
    let mut step = 0.0;
    for axis in set.acc.iter_mut().chain(&mut set.mag).chain(&mut set.gyro) {
        step += 1.0;
        axis.scale *= 1.0 + 1e-3 * step;
        axis.bias_counts = step - 9.0;
        axis.bias_per_c = 0.01 * step;
        axis.bias_per_c2 = 1e-4 * step;
        axis.scale_per_c = 1e-5 * step;
        axis.axis_b = (axis.axis_b + Vector3::new(1e-3 * step, 0.0, -1e-3 * step)).normalize();
    }
    set
}

fn refused(spoil: impl FnOnce(&mut Set)) -> Refusal {
    let mut set = own();
    spoil(&mut set);
    Set::load(&set.encode(), ranges(), 7).expect_err("refused")
}

#[test]
fn a_set_comes_back_from_its_bytes() {
    assert_eq!(Set::load(&own().encode(), ranges(), 7), Ok(own()));
    assert_eq!(ENCODED_BYTES, 1136);
    assert_eq!(Set::nominal(ranges()).check(), Ok(()));
}

#[test]
fn every_one_bit_error_is_refused() {
    let bytes = own().encode();
    for bit in 0..8 * ENCODED_BYTES {
        let mut bytes = bytes;
        bytes[bit / 8] ^= 1 << (bit % 8);
        assert!(Set::load(&bytes, ranges(), 7).is_err(), "bit {bit}");
    }
}

#[test]
fn another_length_unit_or_range_is_refused_with_the_reason() {
    let bytes = own().encode();
    assert_eq!(
        Set::load(&bytes[1..], ranges(), 7),
        Err(Refusal::Length(ENCODED_BYTES - 1))
    );
    assert_eq!(
        Set::load(&bytes, ranges(), 8),
        Err(Refusal::OtherUnit { found: 7, expected: 8 })
    );
    assert_eq!(
        Set::load(&bytes, ranges(), 0),
        Ok(own()),
        "a unit without a number takes any"
    );
    let wide = Ranges {
        field: Gain::PerGauss390,
        ..ranges()
    };
    assert_eq!(Set::load(&bytes, wide, 7), Err(Refusal::OtherRanges));
    assert_eq!(Set::load(&[0; ENCODED_BYTES], ranges(), 7), Err(Refusal::NotASet));
}

#[test]
fn an_ill_conditioned_sensor_is_refused_by_name() {
    // y almost along x: noise would come out two thousand times larger.
    let flat = refused(|set| set.acc[4].axis_b = (set.acc[3].axis_b + set.acc[4].axis_b * 1e-3).normalize());
    let Refusal::IllConditioned(sensor, condition) = flat else {
        panic!("{flat}")
    };
    assert_eq!(
        sensor,
        Sensor {
            kind: Kind::Accelerometer,
            plate: 1
        }
    );
    assert!((1e3..1e4).contains(&condition), "{condition}");
    let singular = refused(|set| set.gyro[2].axis_b = set.gyro[1].axis_b);
    assert!(
        matches!(singular, Refusal::IllConditioned(Sensor { kind: Kind::Gyro, .. }, _)),
        "{singular}"
    );
}

#[test]
fn exchanged_plates_swapped_axes_and_signs_are_refused() {
    let channel = |n| Channel(n);
    let exchanged = refused(|set| {
        let (first, rest) = set.mag.split_at_mut(3);
        first.swap_with_slice(&mut rest[..3]);
    });
    assert_eq!(exchanged, Refusal::Direction(channel(12)));
    assert_eq!(refused(|set| set.acc.swap(6, 7)), Refusal::Direction(channel(6)));
    assert_eq!(
        refused(|set| set.gyro[3].axis_b *= -1.0),
        Refusal::Direction(channel(27))
    );
}

#[test]
fn what_is_not_a_sensible_number_is_refused_by_channel() {
    assert_eq!(
        refused(|set| set.mag[2].noise = f32::NAN),
        Refusal::NotFinite(Some(Channel(14)))
    );
    assert_eq!(
        refused(|set| set.place_b[1].y = f32::INFINITY),
        Refusal::NotFinite(None)
    );
    assert_eq!(refused(|set| set.acc[0].axis_b *= 1.1), Refusal::NotUnit(Channel(0)));
    // Degrees taken for radians.
    assert_eq!(refused(|set| set.gyro[1].scale *= 57.3), Refusal::Scale(Channel(25)));
    assert_eq!(refused(|set| set.gyro[1].scale *= -1.0), Refusal::Scale(Channel(25)));
    assert_eq!(refused(|set| set.acc[5].bias_per_c2 = 1.0), Refusal::Bias(Channel(5)));
    assert_eq!(refused(|set| set.acc[5].scale_per_c = 0.02), Refusal::Scale(Channel(5)));
    assert_eq!(refused(|set| set.mag[7].noise = 0.0), Refusal::Noise(Channel(19)));
    assert_eq!(refused(|set| set.reference_c = 90.0), Refusal::Temperatures);
    assert_eq!(refused(|set| set.uncertainty[1].scale = -0.1), Refusal::Uncertainty);
    assert_eq!(refused(|set| set.place_b[0].x = 4.2), Refusal::Uncertainty);
}

/// A reading at 25 degC in which every axis has this count.
fn reading(counts: i16) -> Reading {
    Reading {
        acc_p: [[counts; 3]; 4],
        mag_p: [[counts; 3]; 4],
        gyro: [counts; 4],
        gyro_temperature: [0; 4],
        temperature: [400; 4],
        ..Reading::unread(0)
    }
}

fn applied(set: &Set, reading: &Reading) -> Measured {
    let mut temperatures = Temperatures::default();
    temperatures.note(reading);
    set.apply(reading, &temperatures)
}

#[test]
fn counts_become_si_by_the_datasheets() {
    let measured = applied(&Set::nominal(ranges()), &reading(100));
    // 3 mg, 1/1090 gauss, 0.07326 deg/s a count.
    assert!(measured.acc.iter().all(|value| (value - 2.941_995).abs() < 1e-6));
    assert!(measured.mag.iter().all(|value| (value - 9.174_312).abs() < 1e-5));
    assert!(measured.gyro.iter().all(|value| (value - 0.127_862_82).abs() < 1e-7));
    assert_eq!(
        (measured.present, measured.saturated),
        (Channels::ALL, Channels::default())
    );
    assert!(!measured.temperature_held && !measured.beyond_validity);
}

#[test]
fn the_temperature_of_its_own_plate_corrects_an_axis() {
    let set = own();
    let mut warm = reading(100);
    warm.temperature[2] = 600;
    warm.gyro_temperature[1] = 100;
    let (cold, warm) = (applied(&set, &reading(100)), applied(&set, &warm));
    let changed = |before: &[f32], after: &[f32]| -> u16 {
        before
            .iter()
            .zip(after)
            .enumerate()
            .map(|(k, (b, a))| u16::from(b != a) << k)
            .sum()
    };
    assert_eq!(changed(&cold.acc, &warm.acc), 0b111 << 6);
    assert_eq!(changed(&cold.mag, &warm.mag), 0b111 << 6);
    assert_eq!(changed(&cold.gyro, &warm.gyro), 0b10);
    // Plate 3 at 37.5 degC, 15.5 above the reference.
    assert_eq!(warm.acc[6], set.acc[6].value(100, 15.5));
}

#[test]
fn what_was_not_read_or_stands_at_its_end_has_no_value() {
    let mut reading = reading(5);
    reading.acc_p[1] = [NOT_READ; 3];
    reading.acc_p[2][0] = 2047;
    reading.mag_p[3][2] = OVERFLOW;
    reading.mag_p[0][0] = 3000;
    reading.gyro = [4368, -4368, NOT_READ, 4367];
    let measured = applied(&Set::nominal(ranges()), &reading);
    let absent = |kind, all: u16| !measured.present.of(kind) & all;
    assert_eq!(absent(Kind::Accelerometer, 0xFFF), 0b0111_1000);
    assert_eq!(absent(Kind::Magnetometer, 0xFFF), 1 << 11 | 1);
    assert_eq!(absent(Kind::Gyro, 0xF), 0b0111);
    let saturated = Channels::default()
        .with(Kind::Accelerometer, 1 << 6)
        .with(Kind::Magnetometer, 1 << 11);
    assert_eq!(measured.saturated, saturated.with(Kind::Gyro, 0b11));
    assert_eq!((measured.acc[3], measured.mag[11]), (0.0, 0.0));
}

#[test]
fn beyond_its_validity_a_set_is_applied_as_at_its_end_and_says_so() {
    let mut set = own();
    set.highest_c = 40.0;
    let mut hot = reading(100);
    hot.temperature = [800; 4];
    let measured = applied(&set, &hot);
    assert!(measured.beyond_validity);
    assert_eq!(measured.acc[0], set.acc[0].value(100, 18.0));
}

#[test]
fn a_set_is_intact_only_as_it_was_written() {
    let mut bytes = own().encode();
    assert!(bytes::is_intact(&bytes));
    bytes[500] ^= 1;
    assert!(!bytes::is_intact(&bytes));
}

/// What stands on the umbilical is read by a person: which axis, in the numbering of the plates.
#[test]
fn a_refusal_says_what_is_wrong_and_where() {
    extern crate std;
    use std::string::ToString;

    let sensor = Sensor {
        kind: Kind::Magnetometer,
        plate: 2,
    };
    let said = [
        (Refusal::Length(3), "3 bytes where a set has"),
        (Refusal::NotASet, "not a calibration set"),
        (Refusal::Version(9), "set of version 9: update the unit"),
        (
            Refusal::Checksum {
                written: 0xAB,
                computed: 0x12,
            },
            "checksum 000000AB written, 00000012 found: send it again",
        ),
        (Refusal::Code(17), "unknown code at byte 17"),
        (Refusal::OtherRanges, "made at other sensor ranges"),
        (
            Refusal::OtherUnit { found: 7, expected: 8 },
            "of unit 7, this is unit 8",
        ),
        (Refusal::NotFinite(Some(Channel(13))), "magnetometer 1 y: not a number"),
        (Refusal::NotFinite(None), "not a number"),
        (Refusal::Temperatures, "temperatures out of order or range"),
        (Refusal::Uncertainty, "uncertainty or place out of range"),
        (
            Refusal::NotUnit(Channel(11)),
            "accelerometer 4 z: axis is not of length 1",
        ),
        (
            Refusal::IllConditioned(sensor, 31.7),
            "magnetometer 3: condition 31, its axes do not span space",
        ),
        (Refusal::Direction(Channel(26)), "gyro 3: over 10 deg from nominal"),
        (
            Refusal::Scale(Channel(24)),
            "gyro 1: scale not within half to twice nominal",
        ),
        (Refusal::Bias(Channel(0)), "accelerometer 1 x: bias leaves no range"),
        (
            Refusal::Noise(Channel(12)),
            "magnetometer 1 x: noise not above 0 or absurd",
        ),
    ];
    for (refusal, words) in said {
        assert!(refusal.to_string().starts_with(words), "{refusal}");
    }
}
