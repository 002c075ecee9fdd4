use std::sync::Arc;

use super::*;
use crate::part::testing::{read, write};

const MS: Nanos = 1_000_000;
/// 75 Hz, one measurement averaged.
const CRA_75_HZ: u8 = 0x18;

fn part(field_ut: impl Fn(f64) -> [f64; 3] + Send + Sync + 'static) -> Hmc5883l {
    Hmc5883l::new(Arc::new(move |t| Vector3::from(field_ut(t))), Specimen::ideal())
}

fn continuous(field_ut: impl Fn(f64) -> [f64; 3] + Send + Sync + 'static) -> Hmc5883l {
    let mut part = part(field_ut);
    write(&mut part, &[0x00, CRA_75_HZ, 0x20, 0x00], 0);
    part
}

fn xzy(part: &mut Hmc5883l, now: Nanos) -> [i16; 3] {
    let bytes: [u8; 6] = read(part, 0x03, now);
    [0, 2, 4].map(|i| i16::from_be_bytes([bytes[i], bytes[i + 1]]))
}

#[test]
fn at_power_on_it_has_the_datasheet_defaults_and_makes_one_measurement() {
    let mut part = part(|_| [10.0, 20.0, 30.0]);
    assert_eq!(read(&mut part, 0x0A, 0), *b"H43");
    assert_eq!(read(&mut part, 0x00, 0), [0x10, 0x20, 0x01]);
    part.power_on(0);
    assert_eq!(read(&mut part, 0x09, 55 * MS), [0x00]);
    assert_eq!(read(&mut part, 0x09, 57 * MS), [0x01]);
    assert_eq!(read(&mut part, 0x03, 57 * MS), [0x00, 0x6D, 0x01, 0x47, 0x00, 0xDA]);
    assert_eq!(read(&mut part, 0x02, 57 * MS), [0x03]);
}

#[test]
fn the_axes_come_in_the_order_x_z_y() {
    let mut part = continuous(|_| [10.0, -20.0, 30.0]);
    assert_eq!(xzy(&mut part, 100 * MS), [109, 327, -218]);
}

#[test]
fn the_pointer_goes_round_the_data_registers_and_round_the_end() {
    let mut part = continuous(|_| [10.0, -20.0, 30.0]);
    let bytes: [u8; 12] = read(&mut part, 0x03, 100 * MS);
    assert_eq!(bytes[..6], bytes[6..]);
    assert_eq!(read(&mut part, 0x0B, 100 * MS), [b'4', b'3', CRA_75_HZ]);
}

#[test]
fn beyond_the_converter_the_code_says_overflow() {
    let mut part = continuous(|_| [188.0, -187.8, 187.8]);
    assert_eq!(xzy(&mut part, 100 * MS), [-4096, 2047, -2047]);
}

#[test]
fn the_first_measurement_after_a_gain_change_has_the_previous_gain() {
    let mut part = continuous(|_| [100.0; 3]);
    assert_eq!(xzy(&mut part, 100 * MS), [1090; 3]);
    write(&mut part, &[0x01, 0xE0], 100 * MS);
    // Measurements are complete at 106.7 and 120.0 ms.
    let seen = [106, 107, 119, 121].map(|ms| xzy(&mut part, ms * MS)[0]);
    assert_eq!(seen, [1090, 1090, 1090, 230]);
}

#[test]
fn a_partial_read_locks_the_data_until_all_six_bytes_are_read() {
    let mut part = continuous(|t| [if t < 1.0 { 10.0 } else { 20.0 }; 3]);
    assert_eq!(read(&mut part, 0x03, 900 * MS), [0x00, 0x6D, 0x00]);
    assert_eq!(read(&mut part, 0x09, 900 * MS), [0x03]);
    assert_eq!(xzy(&mut part, 2_000 * MS), [109; 3]);
    assert_eq!(read(&mut part, 0x09, 2_000 * MS), [0x01]);
    assert_eq!(xzy(&mut part, 2_020 * MS), [218; 3]);
}

#[test]
fn reading_the_mode_locks_and_writing_it_unlocks() {
    let mut part = continuous(|t| [if t < 1.0 { 10.0 } else { 20.0 }; 3]);
    assert_eq!(read(&mut part, 0x02, 900 * MS), [0x00]);
    assert_eq!(read(&mut part, 0x09, 1_500 * MS), [0x03]);
    write(&mut part, &[0x02, 0x00], 1_500 * MS);
    assert_eq!(read(&mut part, 0x09, 1_501 * MS), [0x00]);
    assert_eq!(xzy(&mut part, 1_530 * MS), [218; 3]);
}

#[test]
fn ready_is_clear_while_new_data_are_placed() {
    let mut part = continuous(|_| [0.0; 3]);
    // The eighth measurement is complete at 106.67 ms.
    let seen = [106_300_000, 106_500_000, 106_700_000].map(|now| read::<1>(&mut part, 0x09, now)[0]);
    assert_eq!(seen, [1, 0, 1]);
}

#[test]
fn single_mode_measures_once_and_goes_idle() {
    let mut part = part(|t| [t * 1000.0; 3]);
    write(&mut part, &[0x02, 0x01], 100 * MS);
    assert_eq!(read(&mut part, 0x09, 105 * MS), [0x00]);
    assert_eq!(read(&mut part, 0x09, 106 * MS), [0x01]);
    assert_eq!(xzy(&mut part, 900 * MS), [1155; 3]);
    assert_eq!(read(&mut part, 0x02, 900 * MS), [0x03]);
}

#[test]
fn a_single_measurement_is_the_same_whenever_within_an_edge_it_was_asked_for() {
    let noisy = |asked: Nanos| {
        let mut part = Hmc5883l::new(
            Arc::new(|t| Vector3::repeat(t * 1000.0)),
            Specimen::draw(crate::part::signal::Noise::new(1), 20.0, 0.0, 0),
        );
        write(&mut part, &[0x02, 0x01], asked);
        xzy(&mut part, asked + 10 * MS)
    };
    let edge = |specimen: &Specimen<3>| ConversionClock::paced(EDGE_NS, specimen.pace).instant_ns(1_000) as Nanos;
    let at = edge(&Specimen::draw(crate::part::signal::Noise::new(1), 20.0, 0.0, 0));
    assert_eq!(noisy(at + 1_000), noisy(at + EDGE_NS - 2_000));
    assert_ne!(noisy(at + 1_000), noisy(at + EDGE_NS + 1_000));
}

#[test]
fn the_self_test_shows_the_strap_and_not_the_field() {
    for (measurement, sign) in [(1, 1), (2, -1)] {
        let mut part = continuous(|_| [40.0; 3]);
        write(&mut part, &[0x00, CRA_75_HZ | measurement, 0xA0], 0);
        // 390 counts/G: 1.16 G, 1.08 G, 1.16 G.
        assert_eq!(xzy(&mut part, 200 * MS), [452 * sign, 421 * sign, 452 * sign]);
    }
}
