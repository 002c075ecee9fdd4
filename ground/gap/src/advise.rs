//! Step 9, what to do next: which motion tells apart what this log could not, and what it would not have shown.
//!
//! In: the library with its columns and what was chosen. Out: the next [`experiment`]; sets that cannot be told apart and the
//! smallest size of each effect that this log would show ([`confusion`]); which effect imitates which ([`imitation`]).

pub mod confusion;
pub mod experiment;
pub mod imitation;
