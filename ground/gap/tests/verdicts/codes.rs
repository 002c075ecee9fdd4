//! Codes of a gyro that do not come as they should: a bit that sticks, bits that are cut off, digits that are garbled.

use crate::gyros::{diagnosed_in, erring, rewritten};
use gap::report::terminal;
use tempfile::TempDir;
use twin::effect::kin;

/// [rad/s] of a code of gz: its noise is six of them.
const LSB: f64 = 0.0005;

/// A zero of gz, [rad/s], that its calibration leaves open.
const ZERO: f64 = 0.0012;

/// Sigmas that are left if all is explained, and two standard deviations of that: of 600 samples.
const LEFT: f64 = 1.06;

/// The table's gyros, whose gz sends codes, made so of what is read in row k.
fn coded(made: impl Fn(i64, usize) -> i64) -> TempDir {
    let folder = erring(|_| ZERO, "bits = 14\n");
    let path = folder.path().join("unit.toml");
    let text = std::fs::read_to_string(&path).expect("a file");
    let (others, gz) = text.rsplit_once("lsb = 1.0").expect("gz");
    let gz = gz.replace("range = [-6.0, 6.0]", "range = [-4.096, 4.0955]");
    std::fs::write(&path, format!("{others}lsb = {LSB}{gz}")).expect("a file");
    let mut row = 0;
    rewritten(folder, |cells| {
        let read: f64 = cells[3].parse().expect("a number");
        let code = made((read / LSB).round() as i64, row);
        cells[3] = format!("{:.7}", code as f64 * LSB);
        row += 1;
    })
}

/// Probability by chance below which something is seen: a few of two hundred simulated logs.
const SEEN: f64 = 0.03;

/// The names given, how likely none of them is, and how many sigmas of gz are left in the hold windows.
fn said(folder: &TempDir, withheld: &[&str]) -> (Vec<&'static str>, f64, f64) {
    let (names, none, left, _) = said_with_chance(folder, withheld);
    (names, none, left)
}

/// The same, and the probability of what is left by chance.
fn said_with_chance(folder: &TempDir, withheld: &[&str]) -> (Vec<&'static str>, f64, f64, f64) {
    let diagnosis = diagnosed_in(folder, withheld).1;
    let names = diagnosis.causes.iter().map(|cause| cause.effect);
    (
        names.collect(),
        diagnosis.none_of_these,
        diagnosis.shrink.channels[2].after,
        diagnosis.leftover.p,
    )
}

#[test]
fn codes_as_they_should_be_need_nothing() {
    let (names, none, _) = said(&coded(|code, _| code), &[]);
    assert!(names.is_empty() && none < 0.5, "{names:?} {none}");
}

/// Half of what it adds goes into the zero of a calibration that is fitted to it as it is, and the other half is as large; of a
/// high bit nothing then fits what is left.
#[test]
fn a_bit_that_sticks_is_named_beneath_what_the_calibration_took_of_it() {
    for bit in [16, 256] {
        let stuck = coded(|code, _| code | bit);
        let (names, none, left) = said(&stuck, &[]);
        assert_eq!(names, ["bit-fault"], "{bit}: {none}");
        assert!(none < 0.1 && left < LEFT, "{bit}: {none} {left}");
        let (names, none, _) = said(&stuck, &kin("bit-fault"));
        assert!(none > 0.9, "{bit}: {names:?} {none}");
    }
}

#[test]
fn the_screen_says_which_bit() {
    let (subject, diagnosis) = diagnosed_in(&coded(|code, _| code | 16), &[]);
    let screen = terminal::screen(&subject, &diagnosis, "");
    assert!(screen.contains("which: bit 4 is always 1"), "{screen}");
}

/// Cut off, readings are low by half a step on the whole, which a calibration takes for a zero that is off, of steps that are
/// rounded.
#[test]
fn bits_that_are_cut_off_leave_no_zero_to_explain() {
    let cut = coded(|code, _| code & !15);
    let (names, none, left) = said(&cut, &[]);
    assert_eq!(names, ["coarse-quantisation"], "{none}");
    assert!(none < 0.1 && left < LEFT, "{none} {left}");
    let (names, none, _, chance) = said_with_chance(&cut, &kin("coarse-quantisation"));
    // Seen, and less than a twentieth of the noise: it does not matter.
    assert!(
        names.is_empty() && chance < SEEN && none < 0.5,
        "{names:?} {chance} {none}"
    );
}

/// One in a hundred drags the calibration by more than its noise.
#[test]
fn digits_that_are_garbled_do_not_drag_the_calibration() {
    let garbled = coded(
        |code, row| match (row as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 32 {
            word if word % 100 == 0 => code ^ 1 << (4 + word / 100 % 9),
            _ => code,
        },
    );
    let (names, none, _) = said(&garbled, &[]);
    assert_eq!(names, ["packet-corruption"], "{none}");
}

/// What is left of a gyro that says nothing any more goes with all that it should have felt, and many effects together take up
/// most of that.
#[test]
fn a_gyro_that_sticks_is_not_patched_up() {
    let stuck = coded(|code, row| match row < 150 {
        true => code,
        false => 36,
    });
    let (names, none, left) = said(&stuck, &[]);
    assert_eq!(names, ["stuck-channel"], "{none}");
    assert!(left < LEFT, "{left}");
}
