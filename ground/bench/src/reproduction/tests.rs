use std::path::PathBuf;

use super::*;

/// What each table is known to differ in, and of how many lines. A change here is a finding about a table or an error.
const KNOWN: [(&str, usize, usize); 27] = [
    ("Table 3.1", 1, 3),
    ("Table 4.1", 2, 12),
    ("Table 4.2", 0, 1),
    ("Table 4.3", 0, 12),
    ("Table 4.4", 0, 12),
    ("Table 4.5", 0, 12),
    ("Table 4.6", 0, 6),
    ("Table 4.7", 2, 12),
    ("Table 6.1", 0, 9),
    ("Table 6.2", 0, 4),
    ("Table 6.3", 0, 2),
    ("Table 6.4", 1, 3),
    ("Table 7.2", 4, 4),
    ("Table 7.3", 5, 16),
    ("Table 7.4", 0, 4),
    ("Table 7.5", 4, 8),
    ("Table 8.1", 0, 1),
    ("Table 7.6", 6, 16),
    ("Table 7.7", 0, 5),
    ("Table 7.8", 2, 8),
    ("Table E.1", 0, 16),
    ("Table E.2", 0, 16),
    ("Table E.3", 0, 1),
    ("Table E.4", 0, 16),
    ("Drift stability", 0, 2),
    ("Decay", 1, 1),
    ("Figure of merit", 1, 2),
];

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../data/golden")
}

#[test]
fn every_table_agrees_or_differs_where_it_is_known_to() {
    let all = all(&Sources(&folder())).expect("tables");
    for one in &all {
        for line in one.lines.iter().filter(|line| !line.agrees()) {
            println!("{}: {}: {:?} {:?}", one.table, line.what, line.printed, line.ours);
        }
    }
    let found: Vec<(&str, usize, usize)> = all
        .iter()
        .filter(|one| !one.lines.is_empty())
        .map(|one| (one.table, one.differing(), one.lines.len()))
        .collect();
    assert_eq!(found.len(), KNOWN.len());
    for (known, found) in KNOWN.iter().zip(found) {
        assert!(found.0.starts_with(known.0), "{found:?}");
        assert_eq!((known.1, known.2), (found.1, found.2), "{}", known.0);
    }
    assert!(all.iter().all(|one| !one.why.is_empty()));
}

#[test]
fn a_line_without_numbers_or_of_another_length_does_not_agree() {
    assert!(Line::new("", &[1.0, 2.0], &[1.0, 2.1], 0.11).agrees());
    assert!(!Line::new("", &[1.0, 2.0], &[1.0, 2.2], 0.11).agrees());
    assert!(!Line::new("", &[1.0], &[f64::NAN], 1.0).agrees());
    assert!(!Line::new("", &[1.0, 2.0], &[1.0], 1.0).agrees());
}

#[test]
fn an_absent_folder_is_named() {
    let error = all(&Sources(Path::new("no-such-folder")))
        .expect_err("absent")
        .to_string();
    assert!(error.contains("no-such-folder"), "{error}");
}
