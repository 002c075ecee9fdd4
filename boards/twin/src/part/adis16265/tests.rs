use std::sync::Arc;

use super::converter::{LSB_RAD_S, TAU_S};
use super::*;
use crate::part::signal::Specimen;

const MS: Nanos = 1_000_000;
/// Samples are complete at multiples of 1/256 s: a look this much before the next one sees the last.
const SAMPLE: Nanos = 3_906_250;

/// Ideal part turning at a rate in counts of 320 deg/s.
fn part(rate_counts: impl Fn(f64) -> f64 + Send + Sync + 'static) -> Adis16265 {
    let rate = move |t| rate_counts(t) * LSB_RAD_S;
    Adis16265::new(Measurand {
        rate: Arc::new(rate),
        temperature_c: Arc::new(|_| 35.0),
        rate_specimen: Specimen::ideal(),
        temperature_specimen: Specimen::ideal(),
    })
}

fn frame(part: &mut Adis16265, word: u16, now: Nanos) -> u16 {
    part.select(now);
    let answer = part.transfer(word, now);
    part.deselect(now);
    answer
}

/// Asks at `now`, fetches after the stall time.
fn ask(part: &mut Adis16265, word: u16, now: Nanos) -> u16 {
    frame(part, word, now);
    frame(part, 0x5600, now + STALL_NS)
}

#[test]
fn each_frame_answers_the_one_before() {
    let mut part = part(|_| -148.39);
    let words = [0x5600, 0x0400, 0x0C00, 0x0200, 0x3800, 0x0000];
    let answers: Vec<u16> = (0..)
        .zip(words)
        .map(|(i, word)| frame(&mut part, word, 300 * MS + i * STALL_NS))
        .collect();
    // PROD_ID, -148 with new data, 69 counts above 25 degC, 5 V, SENS_AVG.
    assert_eq!(answers, [0x0000, 0x3F89, 0xBF6C, 0x8045, 0x8AAA, 0x0402]);
}

#[test]
fn it_answers_zero_while_it_starts_up() {
    let mut part = part(|_| 100.0);
    assert_eq!(ask(&mut part, 0x5600, 219 * MS), 0x0000);
    assert_eq!(ask(&mut part, 0x5600, 220 * MS), 0x3F89);
    frame(&mut part, 0xBE80, 300 * MS);
    assert_eq!(ask(&mut part, 0x5600, 519 * MS), 0x0000);
    assert_eq!(ask(&mut part, 0x5600, 521 * MS), 0x3F89);
}

#[test]
fn new_data_is_said_once_a_sample() {
    let mut part = part(|_| 5.0);
    let seen = [100, 110, 250, 256].map(|part_of| ask(&mut part, 0x0400, 80 * SAMPLE + part_of * SAMPLE / 256));
    assert_eq!(seen, [0x8005, 0x0005, 0x0005, 0x8005]);
}

#[test]
fn the_range_scales_from_the_next_sample_and_clips_at_full_range() {
    for (sens_avg, data) in [(0xB902, 2000), (0xB901, 4000), (0xB904, 1000)] {
        let mut part = part(|_| 1000.0);
        let now = 80 * SAMPLE + 1;
        assert_eq!(ask(&mut part, 0x0400, now), 0x83E8);
        frame(&mut part, sens_avg, now + 2 * STALL_NS);
        assert_eq!(ask(&mut part, 0x0400, now + 3 * STALL_NS), 0x03E8);
        assert_eq!(ask(&mut part, 0x0400, 81 * SAMPLE) & 0x3FFF, data);
    }
    let clipped = |sign: f64| ask(&mut self::part(move |_| sign * 9000.0), 0x0400, 300 * MS) & 0x3FFF;
    assert_eq!([clipped(1.0), clipped(-1.0)], [4368, 0x4000 - 4368]);
}

#[test]
fn the_sample_rate_follows_its_register() {
    let mut part = part(|_| 7.0);
    // 66 samples a second / 2 = 30.3 ms.
    frame(&mut part, 0xB681, 300 * MS);
    assert_eq!(ask(&mut part, 0x3600, 301 * MS), 0x0081);
    let new = [304, 320, 332, 334].map(|ms| ask(&mut part, 0x0400, ms * MS) >> 15);
    assert_eq!(new, [1, 0, 0, 1]);
}

#[test]
fn a_new_sample_rate_leaves_the_last_sample_as_it_is() {
    let mut part = part(|t| 1000.0 * t);
    let now = 80 * SAMPLE + 1;
    let before = ask(&mut part, 0x0400, now) & 0x3FFF;
    frame(&mut part, 0xB681, now + 2 * STALL_NS);
    // The next sample at the new rate is complete at 333.3 ms.
    let after = [now + 4 * STALL_NS, 333 * MS, 334 * MS].map(|now| ask(&mut part, 0x0400, now) & 0x3FFF);
    assert!(
        after[0] == before && after[1] == before && after[2] > before,
        "{before} {after:?}"
    );
}

#[test]
fn a_frame_within_the_stall_time_is_lost_and_flagged_once() {
    let mut part = part(|_| 7.0);
    frame(&mut part, 0x5600, 300 * MS);
    assert_eq!(frame(&mut part, 0x5600, 300 * MS + STALL_NS - 1), 0x0000);
    assert_eq!(ask(&mut part, 0x0400, 301 * MS), 0xC007);
    assert_eq!(ask(&mut part, 0x3C00, 302 * MS), 0x0008);
    assert_eq!(ask(&mut part, 0x3C00, 303 * MS), 0x0000);
}

#[test]
fn a_frame_of_two_words_is_not_a_frame() {
    let mut part = part(|_| 7.0);
    part.select(300 * MS);
    assert_eq!(
        [part.transfer(0x5600, 300 * MS), part.transfer(0x5600, 300 * MS)],
        [0, 0]
    );
    part.deselect(300 * MS);
    assert_eq!(ask(&mut part, 0x3C00, 301 * MS), 0x0008);
}

#[test]
fn only_user_registers_can_be_written_byte_by_byte() {
    let mut part = part(|_| 7.0);
    for (i, word) in (0..).zip([0xA012, 0xA134, 0xD6FF, 0x84FF, 0xB504]) {
        frame(&mut part, word, 300 * MS + i * STALL_NS);
    }
    let registers = [0x2000, 0x5600, 0x3400, 0x7E00];
    let read: Vec<u16> = (0..)
        .zip(registers)
        .map(|(i, word)| ask(&mut part, word, (301 + i) * MS))
        .collect();
    assert_eq!(read, [0x3412, 0x3F89, 0x0006, 0x0000]);
}

#[test]
fn the_rate_is_low_passed() {
    // A step half a sample before sample 80; one time constant later 63 % of it is there.
    let mut part = part(|t| if t < 79.5 * SAMPLE as f64 * 1e-9 { 0.0 } else { 4000.0 });
    let t_s = 3.5 * SAMPLE as f64 * 1e-9;
    let expected = 4000.0 * (1.0 - (-t_s / TAU_S).exp());
    let counts = f64::from(ask(&mut part, 0x0400, 83 * SAMPLE) & 0x3FFF);
    // The linear input stands for the step to (step/tau)^2/24 of it.
    assert!(
        (counts - expected).abs() < 4000.0 * (SAMPLE as f64 * 1e-9 / TAU_S).powi(2) / 24.0,
        "{counts} {expected}"
    );
}
