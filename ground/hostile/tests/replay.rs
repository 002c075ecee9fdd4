//! Every input of every corpus, replayed on stable Rust: what once found something finds nothing now.
//!
//! A failing input is named: `cargo test -p emems-hostile NAME` runs one target's again. Each target must have a corpus, so that
//! none is replayed in name only.

use std::{
    fs,
    panic::{AssertUnwindSafe, catch_unwind},
    path::Path,
    time::{Duration, Instant},
};

use hostile::TARGETS;

/// Fewer inputs are no corpus.
const FEWEST_INPUTS: usize = 5;

/// An input that takes longer hangs: the slowest needs 0.1 s alone, and the rest is a margin for company.
const PATIENCE: Duration = Duration::from_secs(30);

fn replay(name: &str) {
    let (_, target) = TARGETS.into_iter().find(|(known, _)| *known == name).expect("a target");
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../fuzz/corpus").join(name);
    let mut inputs: Vec<_> = fs::read_dir(&folder)
        .expect("a corpus")
        .map(|entry| entry.expect("an entry").path())
        .collect();
    inputs.sort();
    assert!(inputs.len() >= FEWEST_INPUTS, "{name}: {} inputs", inputs.len());
    let mut found = Vec::new();
    for input in &inputs {
        let bytes = fs::read(input).expect("read");
        let begun = Instant::now();
        let held = catch_unwind(AssertUnwindSafe(|| target(&bytes))).is_ok();
        if !held || begun.elapsed() > PATIENCE {
            found.push(input.file_name().unwrap_or_default());
        }
    }
    assert!(found.is_empty(), "{name}: found something again, or hung: {found:?}");
}

macro_rules! replayed {
    ($($name:ident),*) => {
        $(
            #[test]
            fn $name() {
                replay(stringify!($name));
            }
        )*

        #[test]
        fn every_target_is_replayed() {
            assert_eq!(TARGETS.map(|(name, _)| name), [$(stringify!($name)),*]);
        }
    };
}

replayed!(
    case, commands, console, csv, flight_log, packets, recording, recover, set, toml
);
