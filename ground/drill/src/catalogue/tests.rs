use std::{collections::BTreeSet, fs, path::Path};

use super::*;

const GROUPS: [(char, usize); 5] = [('F', 21), ('S', 23), ('N', 12), ('C', 15), ('U', 15)];

#[test]
fn all_86_faults_are_there_each_once_and_in_order() {
    for (rows, (group, count)) in CATALOGUE.iter().zip(GROUPS) {
        let ids: Vec<&str> = rows.iter().map(|row| row.id).collect();
        let expected: Vec<String> = (1..=count).map(|n| format!("{group}{n}")).collect();
        assert_eq!(ids, expected);
    }
}

#[test]
fn every_row_has_a_drill_or_a_test_and_every_test_is_in_the_source() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    for row in CATALOGUE.iter().flat_map(|rows| rows.iter()) {
        assert!(
            !row.tests.is_empty() || !matches!(row.drill, Drill::None),
            "{} is covered by nothing",
            row.id
        );
        for test in row.tests {
            let (file, name) = test.split_once(": ").unwrap_or_else(|| panic!("{}: {test}", row.id));
            let text =
                fs::read_to_string(root.join(file)).unwrap_or_else(|error| panic!("{}: {file}: {error}", row.id));
            // A check that .ci/run makes, by its line.
            if file.starts_with(".ci/") {
                let run = fs::read_to_string(root.join(".ci/run")).expect(".ci/run");
                assert!(text.contains(name) && run.contains(file), "{}: {test}", row.id);
                continue;
            }
            // A test that a macro makes for each name in its list.
            if let Some((_, names)) = text.split_once("replayed!(\n") {
                let names = names.split(')').next().unwrap_or("");
                assert!(names.split(',').any(|known| known.trim() == name), "{}: {test}", row.id);
                continue;
            }
            let at = text.find(&format!("fn {name}("));
            let at = at.unwrap_or_else(|| panic!("{}: {file} has no function {name}", row.id));
            // A test of its own, or a property or fuzz target, which has no attribute just before it.
            let before = &text[at.saturating_sub(300)..at];
            assert!(
                before.contains("#[test]") || before.contains("proptest!") || file.contains("fuzz"),
                "{}: {name} is no test",
                row.id
            );
        }
    }
}

#[test]
fn every_plan_of_the_catalogue_can_be_read_and_flown_somewhere() {
    for row in CATALOGUE.iter().flat_map(|rows| rows.iter()) {
        let Drill::Flights(flights) = row.drill else { continue };
        for plan in flights.iter().flat_map(|fly| fly.plans) {
            let planned = crate::flight::planned(plan);
            assert!(!planned.is_empty(), "{}", row.id);
            for fault in &planned {
                assert!(fault.word.places.contains(['h', 'i']), "{}: {plan}", row.id);
            }
        }
    }
}

#[test]
fn the_committed_table_has_the_catalogue_s_rows() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("catalogue.csv");
    let mut reader = csv::Reader::from_path(&path).expect("ground/drill/catalogue.csv");
    let told: Vec<(String, String)> = reader
        .records()
        .map(|record| record.expect("a line"))
        .map(|record| (record[0].to_string(), record[1].to_string()))
        .collect();
    let rows = CATALOGUE.iter().flat_map(|rows| rows.iter());
    let rows: Vec<_> = rows.map(|row| (row.id.to_string(), row.fault.to_string())).collect();
    assert_eq!(
        told, rows,
        "regenerate it: ground drill --write ground/drill/catalogue.csv"
    );
}

/// A drill whose fault does not strike is not accepted, whatever the unit does.
#[test]
fn a_fault_that_never_strikes_is_not_accepted() {
    use crate::{command::drilled, flight::Board};
    static ROW: Row = row(
        "F0",
        "a recorder that nobody asks, dead",
        Drill::Flights(&[Fly {
            // The flight ends before the fault begins.
            plans: &["silent:a1@9s"],
            motion: "still",
            said: &[],
            ms: 3_000,
            judge: crate::judge::steady,
        }]),
        &[],
    );
    let line = drilled(&ROW, &Board::Host, 1, false);
    assert!(
        line.verdict.starts_with("not accepted: a fault never struck"),
        "{line:?}"
    );
    assert!(line.verdict.contains("ground drill F0 --seed 1"), "{line:?}");
    let names: BTreeSet<&str> = CATALOGUE
        .iter()
        .flat_map(|rows| rows.iter())
        .map(|row| row.id)
        .collect();
    assert_eq!(names.len(), 86);
}
