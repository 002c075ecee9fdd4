//! `ground drill`: the catalogue of faults, flown.
//!
//! In: rows of the catalogue (all, or those named), a seed. Out: a table with, for each row, the fault, how it was injected, how
//! often it struck, what the unit did, and whether that is accepted. `--write` keeps the table as CSV; the one in
//! `ground/drill/catalogue.csv` is that of `ground drill --write ground/drill/catalogue.csv`.
//!
//! A row is plain data ([`catalogue::Row`]) and at most one function that judges ([`judge`]). It is drilled in one of two ways:
//!
//! - **flights**: faults in the words of [`twin::fault`], a motion, what is said on the umbilical. They are flown by the unit's
//!   code in virtual time, or by the release image with `--image`, with the same words and the same judge.
//! - **campaigns**: many runs on a model of one part, such as the log on its chip.
//!
//! What neither can inject is covered by tests that the row names; a test of this package looks whether they are there, and
//! `cargo host-test` runs them. Their verdict here is `by test`.
//!
//! A drill whose fault never struck is not accepted, whatever the unit did. What is not accepted ends the
//! command with exit code 1.
//!
//! `--long` flies more runs of each row, and then a day in which faults arrive at random ([`endurance`]); with `--image` an hour.
//! `ground drill day` flies that alone.
//!
//! `--guards` asks the opposite of the tests: does each fail without its guard ([`guards`])?
//!
//! A failing run is replayed by its row and seed: `ground drill F8 --seed 123`.

pub mod campaign;
pub mod catalogue;
pub mod command;
pub mod endurance;
mod flight;
pub mod guards;
pub mod judge;
mod table;

pub use command::{DrillArguments, DrillError, run};
pub use flight::{Board, OnImage};
