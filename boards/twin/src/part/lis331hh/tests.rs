use core::f64::consts::TAU;
use std::sync::Arc;

use super::converter::{STANDARD_GRAVITY, TAU_S};
use super::*;
use crate::part::testing::{read, write};

const MS: Nanos = 1_000_000;
/// Normal mode, 50 Hz, all axes.
const ON_50_HZ: u8 = 0x27;
/// OUT_X_L with auto-increment.
const OUT: u8 = 0xA8;

/// Ideal part in a force of whole counts at 3 mg.
fn part(force: impl Fn(f64) -> [f64; 3] + Send + Sync + 'static) -> Lis331hh {
    let counts = move |t| Vector3::from(force(t)) * 3e-3 * STANDARD_GRAVITY;
    Lis331hh::new(Arc::new(counts), Specimen::ideal())
}

fn axes(part: &mut Lis331hh, now: Nanos) -> [i16; 3] {
    let bytes: [u8; 6] = read(part, OUT, now);
    [0, 2, 4].map(|i| i16::from_le_bytes([bytes[i], bytes[i + 1]]))
}

#[test]
fn at_power_on_it_sleeps_with_the_datasheet_defaults() {
    let mut part = part(|_| [100.0, -200.0, 300.0]);
    assert_eq!(read(&mut part, 0x0F, 0), [0x32]);
    assert_eq!(read(&mut part, 0xA0, 0), [0x07, 0, 0, 0, 0, 0, 0, 0]);
    assert_eq!(axes(&mut part, 900 * MS), [0; 3]);
}

#[test]
fn it_answers_left_justified_codes_after_the_turn_on_time() {
    let mut part = part(|_| [100.0, -200.0, 300.0]);
    write(&mut part, &[0x20, ON_50_HZ], MS);
    assert_eq!(read(&mut part, 0x27, 20 * MS), [0x00]);
    assert_eq!(read(&mut part, 0x27, 40 * MS), [0x0F]);
    assert_eq!(read(&mut part, OUT, 40 * MS), [0x40, 0x06, 0x80, 0xF3, 0xC0, 0x12]);
    assert_eq!(read(&mut part, 0x27, 40 * MS), [0x00]);
}

#[test]
fn without_the_increment_bit_one_register_repeats() {
    let mut part = part(|_| [0.0; 3]);
    assert_eq!(read(&mut part, 0x20, 0), [0x07, 0x07, 0x07]);
    write(&mut part, &[0xA0, 0x2F, 0x00, 0x00, 0xB0], 0);
    assert_eq!(read(&mut part, 0xA0, 0), [0x2F, 0x00, 0x00, 0xB0]);
}

#[test]
fn what_was_not_read_in_time_is_an_overrun() {
    let mut part = part(|_| [1.0; 3]);
    write(&mut part, &[0x20, ON_50_HZ], 0);
    axes(&mut part, 100 * MS);
    assert_eq!(read(&mut part, 0x27, 120 * MS), [0x0F]);
    assert_eq!(read(&mut part, 0x27, 140 * MS), [0xFF]);
    let _: [u8; 2] = read(&mut part, OUT, 140 * MS);
    assert_eq!(read(&mut part, 0x27, 140 * MS), [0x66]);
}

#[test]
fn a_new_full_scale_acts_from_the_next_conversion() {
    let mut part = part(|_| [100.0; 3]);
    write(&mut part, &[0x20, ON_50_HZ], 0);
    for (ctrl_reg4, code) in [(0x10, 50 << 4), (0x30, 25 << 4), (0x00, 100 << 4)] {
        let before = axes(&mut part, 110 * MS);
        write(&mut part, &[0x23, ctrl_reg4], 110 * MS);
        assert_eq!(axes(&mut part, 119 * MS), before);
        assert_eq!(axes(&mut part, 120 * MS), [code; 3]);
        part.power_on(0);
        write(&mut part, &[0x20, ON_50_HZ], 0);
    }
}

#[test]
fn it_clips_at_its_code() {
    let mut part = part(|_| [2047.0, 5000.0, -5000.0]);
    write(&mut part, &[0x20, ON_50_HZ], 0);
    assert_eq!(axes(&mut part, 100 * MS), [0x7FF0, 0x7FF0, -0x8000]);
}

#[test]
fn block_data_update_keeps_the_two_bytes_of_an_axis_together() {
    for (ctrl_reg4, torn) in [(0x00, true), (0x80, false)] {
        // 15 counts before half a second, 16 after: the two bytes of 0x00F0 and 0x0100 differ both.
        let mut part = part(|t| if t < 0.5 { [15.0; 3] } else { [16.0; 3] });
        write(&mut part, &[0x20, ON_50_HZ], 0);
        write(&mut part, &[0x23, ctrl_reg4], 0);
        let [low] = read(&mut part, 0x28, 490 * MS);
        let [high] = read(&mut part, 0x29, 900 * MS);
        assert_eq!([low, high], if torn { [0xF0, 0x01] } else { [0xF0, 0x00] });
        assert_eq!(axes(&mut part, 900 * MS), [0x0100; 3]);
    }
}

#[test]
fn the_high_pass_takes_gravity_away_and_lets_a_step_decay_at_its_cut_off() {
    let mut part = part(|t| if t < 10.0 { [333.0; 3] } else { [1333.0; 3] });
    write(&mut part, &[0x20, ON_50_HZ], 0);
    write(&mut part, &[0x21, 0x10], 0);
    assert_eq!(axes(&mut part, 9_000 * MS), [0; 3]);
    // Cut-off 50 Hz / 48; 200 ms after the step.
    let tau_s = 48.0 / TAU / 50.0;
    let gain = tau_s / (tau_s - TAU_S);
    let expected = 1000.0 * gain * (-0.2 / tau_s).exp();
    let counts = f64::from(axes(&mut part, 10_200 * MS)[0] >> 4);
    // The high-pass sees the step as a ramp of one conversion: half of 20 ms at a slope of 1/tau.
    assert!(
        (counts / expected - 1.0).abs() < 0.5 * 0.02 / tau_s,
        "{counts} {expected}"
    );
}

#[test]
fn the_self_test_bit_adds_its_offset_with_the_sign_asked_for() {
    let mut part = part(|_| [10.0; 3]);
    write(&mut part, &[0x20, ON_50_HZ], 0);
    write(&mut part, &[0x23, 0x02], 0);
    assert_eq!(axes(&mut part, 100 * MS), [120 << 4, 120 << 4, 305 << 4]);
    write(&mut part, &[0x23, 0x0A], 100 * MS);
    assert_eq!(axes(&mut part, 200 * MS), [-100 << 4, -100 << 4, -285 << 4]);
}

#[test]
fn power_down_stops_the_conversions_and_a_power_cycle_forgets_the_settings() {
    let mut part = part(|t| [(t * 10.0).floor() * 10.0; 3]);
    write(&mut part, &[0x20, ON_50_HZ], 0);
    write(&mut part, &[0x20, 0x07], 190 * MS);
    assert_eq!(axes(&mut part, 900 * MS), [10 << 4; 3]);
    part.power_on(900 * MS);
    assert_eq!(read(&mut part, 0xA0, 900 * MS), [0x07, 0x00]);
    assert_eq!(axes(&mut part, 900 * MS), [0; 3]);
}
