//! Step 1, what is given: a unit's log, what it was made to do, and what its designers believed of it.
//!
//! In: the folder of a case. Out: [`case::Subject`]: the twin along the log, how well the reference knows, what may be fitted
//! ([`windows::Fit`]) and what only judges ([`hold::Held`], locked away). Gross errors of a table are put right on the way
//! ([`gross`]). What rows say by themselves is asked before a long log is thinned: samples that were sent twice ([`repeats`]), a
//! vibration that is too fast for the reference ([`faster`]), and gyros that stop before the end of their range ([`stops`]).
//!
//! Refuses, naming file and key, whatever cannot be read or does not fit the rest ([`case::CaseError`]).

pub mod case;
pub mod faster;
pub mod gross;
pub mod hold;
pub mod level;
pub mod log;
pub mod reference;
pub mod repeats;
pub mod stops;
pub mod windows;
