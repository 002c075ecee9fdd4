//! The acceptance test of the release image on the emulated board: a good unit, and two that have many faults at once. Each fault alone
//! is tried on the host board, beside the judge.

use ground::acceptance::{
    judge::{Finding, Outcome, Place, judge},
    page,
    rig::{Board, Wrong, run},
};

fn tried(words: &[&str]) -> Outcome {
    let wrong: Vec<Wrong> = words.iter().map(|word| word.parse().expect("a defect")).collect();
    let run = run(Board::Emulated, &wrong, 1, &mut |_, _| {}).expect("it runs");
    let place = Place {
        gravity: 9.80665,
        field_ut: None,
    };
    judge(&run.evidence, place)
}

fn bad(outcome: &Outcome) -> Vec<&Finding> {
    outcome.findings.iter().filter(|finding| !finding.good).collect()
}

/// A unit with these faults, each with the part that is named and with what is said of it; no line of `well` is blamed.
fn named(faults: &[(&str, &str, &str)], well: &[&str]) {
    let words: Vec<&str> = faults.iter().map(|(words, ..)| *words).collect();
    let outcome = tried(&words);
    let bad = bad(&outcome);
    let is_said = |(_, part, says): &&(&str, &str, &str)| {
        bad.iter()
            .any(|finding| finding.part == *part && finding.text().contains(says))
    };
    let missed: Vec<_> = faults.iter().filter(|fault| !is_said(fault)).collect();
    assert!(missed.is_empty(), "{missed:?}\n{}", page::text(&outcome));
    for well in well {
        assert!(bad.iter().all(|finding| finding.part != *well), "{well} is blamed");
    }
}

/// What takes more than six seconds of a core.
mod long {
    use super::*;

    #[test]
    #[ignore = "takes more than six seconds: cargo host-test-long runs it"]
    fn the_image_of_a_good_unit_is_good() {
        let outcome = tried(&[]);
        assert!(outcome.is_good(), "{}", page::text(&outcome));
    }

    #[test]
    #[ignore = "takes more than six seconds: cargo host-test-long runs it"]
    fn faults_of_parts_are_named_on_the_image() {
        named(
            &[
                ("silent:a2@0s", "accelerometer 2", "nothing at 0x18"),
                ("other:m1", "magnetometer 1", "another part answers at 0x1E"),
                ("silent:g3@0s", "gyro 3", "chip select PC2"),
                ("scale:a3=3", "accelerometer 3", "LIS331DLH"),
                ("bias:m3=40", "magnetometer 3", "a magnet"),
                ("bias:g4=15", "gyro 4", "bias at rest"),
                ("noise:a4=0.4", "accelerometer 4", "noise at rest"),
                ("inverted:g2", "gyro 2", "inverted"),
                ("nand-absent@0s", "recorder", "answers"),
            ],
            &[
                "gyro 1",
                "accelerometer 1",
                "magnetometer 2",
                "lift-off line",
                "sensor bus",
            ],
        );
    }

    #[test]
    #[ignore = "takes more than six seconds: cargo host-test-long runs it"]
    fn faults_of_wiring_are_named_on_the_image() {
        named(
            &[
                ("crossed-selects:2,3", "gyro 2", "chip selects PC1 and PC2 are crossed"),
                ("clone:m4", "magnetometer 4", "QMC5883L"),
                ("slow-bus=80", "sensor bus", "pull-ups"),
                ("inverted:a1x", "accelerometer 1", "x inverted"),
                ("turned:m2", "magnetometer 2", "x is y, y is -x"),
                ("silent:t4@0s", "thermometer 4", "nothing at 0x48"),
                ("lift-off:low@0s", "lift-off line", "PC6 to the connector"),
                ("no-brown-out", "option bytes", "BOR_LEV = 00"),
                ("no-read-out", "option bytes", "RDP = 0xBB"),
                ("supply@1s..1.02s", "supply", "the regulator"),
            ],
            &["gyro 1", "gyro 4", "magnetometer 1", "accelerometer 2", "recorder"],
        );
    }
}
