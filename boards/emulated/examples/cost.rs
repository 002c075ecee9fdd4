//! Instructions on the emulated board: of one update, ours beside published filters, and of the whole estimation of a cycle
//! with two parts of it. The tables of the README.
//!
//! Run it with `CARGO_PROFILE_RELEASE_OPT_LEVEL=3`, or it counts what the release profile's `s` makes. With it, it fails if
//! a step of ours took more instructions than it may, and names it: the counts come out the same in every run.

use std::error::Error;

use emulated::{Options, fly_with, toolchain};
use twin::{
    motion,
    part::Nanos,
    plant::Plant,
    run::{Bench, Flow},
};

/// What is counted, and what it may take at most at opt-level 3, if that is ours to say.
type Row = (&'static str, Option<u32>);

/// Instructions that a filter step with force and field may take, and a whole estimation.
const STEP_CEILING: u32 = 6_000;
const WHOLE_CEILING: u32 = 20_000;
/// And a whole estimation while a rocket spins: 2 % of the processor.
const SPIN_CEILING: u32 = 600_000;

/// As in the image, in its order.
const FILTERS: [Row; 4] = [
    ("emems, gathers for a second and then updates", Some(STEP_CEILING)),
    ("the same at rest", Some(STEP_CEILING)),
    ("Madgwick (ahrs)", None),
    ("VQF (vqf-rs)", None),
];
const UPDATES: usize = 600;

/// As in the image, in its order.
const PARTS: [Row; 12] = [
    ("tumble: calibration", None),
    ("tumble: fault detection and the three vectors", None),
    ("tumble: two readings of force before it", None),
    ("tumble: whole estimation of a cycle", Some(WHOLE_CEILING)),
    ("rest: calibration", None),
    ("rest: fault detection and the three vectors", None),
    ("rest: two readings of force before it", None),
    ("rest: whole estimation of a cycle", Some(WHOLE_CEILING)),
    ("spin: calibration", None),
    ("spin: fault detection and the three vectors", None),
    ("spin: two readings of force before it", None),
    ("spin: whole estimation of a cycle", Some(SPIN_CEILING)),
];
const CYCLES: usize = 150;

/// Says, to cargo, what the image is optimised for.
const OPT_LEVEL: &str = "CARGO_PROFILE_RELEASE_OPT_LEVEL";

/// \[ns\] far longer than it takes.
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
    let image = toolchain::build_package("emems-cost")?;
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
    let mut beyond = Vec::new();
    println!("instructions of an update at 50 Hz              least  median    mean    most");
    for (row, costs) in FILTERS.iter().zip(words(&report.statics[1]).chunks(UPDATES)) {
        beyond.extend(print(row, costs));
    }
    println!("instructions of a cycle at 5 Hz                 least  median    mean    most");
    for (row, costs) in PARTS.iter().zip(words(&report.statics[2]).chunks(CYCLES)) {
        beyond.extend(print(row, costs));
    }
    if std::env::var(OPT_LEVEL).is_ok_and(|level| level == "3") {
        return if beyond.is_empty() {
            Ok(())
        } else {
            Err(beyond.join("; ").into())
        };
    }
    println!("held to no ceiling: those are for {OPT_LEVEL}=3");
    Ok(())
}

/// Prints a line. What is wrong if it is more than it may be.
fn print(&(name, ceiling): &Row, costs: &[u32]) -> Option<String> {
    let mut costs = costs.to_vec();
    costs.sort_unstable();
    let mean = costs.iter().sum::<u32>() / costs.len() as u32;
    let most = costs[costs.len() - 1];
    println!(
        "{name:46} {:6} {:7} {mean:7} {most:7}",
        costs[0],
        costs[costs.len() / 2],
    );
    let ceiling = ceiling.filter(|&ceiling| most > ceiling)?;
    Some(format!("{name}: {most} instructions, at most {ceiling} are allowed"))
}
