//! The gap between the twin and the unit: where it is, which effect makes it, how far it shrinks.
//!
//! In: a case, that is a unit's log, what it was made to do, and what its designers believed of it. Out: a verdict. Ten steps,
//! a room each; a room needs only those above it, [`diagnose`] walks through all of them, and [`command`] is the shell.
//!
//! | step | room | asks | gives |
//! |---|---|---|---|
//! | 1 | [`input`] | what was logged, and what was the unit made to do? | [`input::case::Subject`], the hold windows locked away |
//! | 2 | [`null`] | what would calibration, noise and reference alone leave? | [`null::problem::Problem`], [`null::model::Model`] |
//! | 3 | [`library`] | what may be wrong, and how would it show in this log? | [`library::hypotheses::Library`] |
//! | 4 | [`search`] | which effects does the evidence prefer? | [`search::explanation::Explanation`] |
//! | 5 | [`unknown`] | is what is left more than noise, and where is it? | [`unknown::adequacy::Leftover`], [`unknown::place::Place`] |
//! | 6 | [`holdout`] | does it hold on samples it has not seen? | [`holdout::shrink::Shrink`], strengths, attitude |
//! | 7 | [`probability`] | how sure is each name? | [`probability::posterior::Believed`] |
//! | 8 | [`correct`] | what can the unit correct? | [`correct::correction::Correction`] |
//! | 9 | [`advise`] | what should be measured next, and what would not have been seen? | advice, sets, limits |
//! | 10 | [`report`] | how is it told? | `verdict.json`, a screen, a page |
//!
//! A log that no reference saw goes another way through the rooms 1 to 4: [`parity`], what the unit's own redundancy says.
//!
//! Several logs of one unit go through [`together`]: what they say of it is summed before anything is named.
//!
//! Beside the rooms, and only for [`command`] and other programs: [`kept`] keeps what was said beside the case, [`against`] holds a
//! corrected twin against another case.
//!
//! `tests/verdicts/rooms.rs` holds the order and the lock: no room needs a later one, and only [`holdout`] opens the held-out samples.
//! `tests/golden.rs` holds what is said.
//!
//! ```
//! use gap::{diagnose::diagnose, input::case::Subject};
//!
//! let subject = Subject::open("../../data/cases/siqueira-table-7-4".as_ref())?;
//! let diagnosis = diagnose(&subject, &[], &|_, _| {});
//! assert_eq!(diagnosis.causes[0].effect, "gyro-sine-response");
//! # Ok::<(), gap::input::case::CaseError>(())
//! ```

pub mod advise;
pub mod against;
pub mod command;
pub mod correct;
pub mod diagnose;
pub mod holdout;
pub mod input;
pub mod kept;
pub mod library;
pub mod null;
pub mod parity;
pub mod probability;
pub mod report;
pub mod search;
pub mod thresholds;
pub mod together;
pub mod unknown;

pub use command::{GapArguments, GapError, run, write_baselines, write_verdict, write_withheld};
