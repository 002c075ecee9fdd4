//! The acceptance test of the release image on the emulated board: a good unit, and faults that only the image can have.

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

#[test]
fn the_image_of_a_good_unit_is_good() {
    let outcome = tried(&[]);
    assert!(outcome.is_good(), "{}", page::text(&outcome));
}

#[test]
fn faults_of_wiring_and_parts_are_named_on_the_image() {
    let outcome = tried(&["crossed-selects:2,3", "clone:m4", "slow-bus=80"]);
    let bad = bad(&outcome);
    for (part, says) in [
        ("gyro 2", "chip selects PC1 and PC2 are crossed"),
        ("magnetometer 4", "QMC5883L"),
        ("sensor bus", "pull-ups"),
    ] {
        let named = bad
            .iter()
            .any(|finding| finding.part == part && finding.text().contains(says));
        assert!(named, "{part}: {says}\n{}", page::text(&outcome));
    }
    for well in ["gyro 1", "gyro 4", "magnetometer 1", "recorder", "lift-off line"] {
        assert!(bad.iter().all(|finding| finding.part != well), "{well} is blamed");
    }
}
