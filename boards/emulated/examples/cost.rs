//! Instructions on the emulated board: of one update, ours beside published filters, and of the whole estimation of a cycle
//! with two parts of it. The tables of the README.
//!
//! Run it with `CARGO_PROFILE_RELEASE_OPT_LEVEL=3`, or it counts what the release profile's `s` makes.

use std::error::Error;

use emulated::{Options, fly_with, image};
use twin::{
    motion,
    part::Nanos,
    plant::Plant,
    run::{Bench, Flow},
};

/// As in the image, in its order.
const FILTERS: [&str; 4] = [
    "emems, gathers for a second and then updates",
    "the same at rest",
    "Madgwick (ahrs)",
    "VQF (vqf-rs)",
];
const UPDATES: usize = 600;

/// As in the image, in its order.
const PARTS: [&str; 6] = [
    "tumble: calibration",
    "tumble: fault detection and the three vectors",
    "tumble: whole estimation of a cycle",
    "rest: calibration",
    "rest: fault detection and the three vectors",
    "rest: whole estimation of a cycle",
];
const CYCLES: usize = 150;

/// [ns] far longer than it takes.
const LONGEST: Nanos = 4_000_000_000;

/// Hears nothing.
struct Deaf;

impl Bench for Deaf {
    fn telemetry(&mut self, _at: Nanos, _bytes: &[u8]) {}

    fn umbilical(&mut self, _at: Nanos, _bytes: &[u8]) {}

    fn log(&mut self, _at: Nanos, _line: &str) {}

    fn commands(&mut self, _now: Nanos) -> Vec<u8> {
        Vec::new()
    }

    fn advanced(&mut self, _now: Nanos) -> Flow {
        Flow::Continue
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let options = Options {
        statics: vec![
            ("DONE".to_owned(), 4),
            ("COSTS".to_owned(), 4 * FILTERS.len() * UPDATES),
            ("CYCLES".to_owned(), 4 * PARTS.len() * CYCLES),
        ],
        ..Options::default()
    };
    let image = image::build_package("cost")?;
    let report = fly_with(
        &options,
        &image,
        Plant::ideal(motion::by_name("still").ok_or("the twin has no motion still")?.into()),
        &[],
        LONGEST,
        &mut Deaf,
    )?;
    let words = |bytes: &[u8]| -> Vec<u32> {
        (bytes.as_chunks().0.iter())
            .map(|word| u32::from_le_bytes(*word))
            .collect()
    };
    if words(&report.statics[0]) != [1] {
        return Err(format!("the image was not done after {} s", LONGEST / 1_000_000_000).into());
    }
    println!("instructions of an update at 50 Hz              least  median    mean    most");
    for (name, costs) in FILTERS.iter().zip(words(&report.statics[1]).chunks(UPDATES)) {
        print(name, costs);
    }
    println!("instructions of a cycle at 5 Hz                 least  median    mean    most");
    for (name, costs) in PARTS.iter().zip(words(&report.statics[2]).chunks(CYCLES)) {
        print(name, costs);
    }
    Ok(())
}

fn print(name: &str, costs: &[u32]) {
    let mut costs = costs.to_vec();
    costs.sort_unstable();
    let mean = costs.iter().sum::<u32>() / costs.len() as u32;
    println!(
        "{name:46} {:6} {:7} {mean:7} {:7}",
        costs[0],
        costs[costs.len() / 2],
        costs[costs.len() - 1]
    );
}
