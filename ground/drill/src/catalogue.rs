//! The catalogue: 86 faults in five groups, each with its drill and its tests. Plain data.
//!
//! A test is named `file: function`, the file from the root of the repository.

mod console;
mod estimator;
mod flash;
mod sensors;
mod system;
#[cfg(test)]
mod tests;

use host_tests::Flown;

use crate::{campaign::Told, judge::Verdict};

/// A fault of the catalogue.
pub struct Row {
    /// Its name: group and number.
    pub id: &'static str,
    /// The fault.
    pub fault: &'static str,
    /// How it is drilled.
    pub drill: Drill,
    /// The tests that cover it, or what the drill cannot.
    pub tests: &'static [&'static str],
}

/// How a fault is drilled.
#[derive(Clone, Copy)]
pub enum Drill {
    /// By its tests alone.
    None,
    /// By flights.
    Flights(&'static [Fly]),
    /// By a campaign: how it injects, and the runs.
    Campaign(&'static str, fn(seed: u64, long: bool) -> Told),
}

/// Flights alike, with different faults.
pub struct Fly {
    /// The faults of each, in the words of [`twin::fault`].
    pub plans: &'static [&'static str],
    /// A motion of the twin.
    pub motion: &'static str,
    /// What is said on the umbilical, and when \[ms\].
    pub said: &'static [(u64, &'static str)],
    /// \[ms\] how long.
    pub ms: u64,
    /// What is accepted.
    pub judge: fn(&Flown) -> Verdict,
}

/// The groups, in order.
pub const CATALOGUE: [&[Row]; 5] = [
    &flash::ROWS,
    &sensors::ROWS,
    &estimator::ROWS,
    &console::ROWS,
    &system::ROWS,
];

const fn row(id: &'static str, fault: &'static str, drill: Drill, tests: &'static [&'static str]) -> Row {
    Row {
        id,
        fault,
        drill,
        tests,
    }
}
