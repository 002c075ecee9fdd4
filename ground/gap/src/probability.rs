//! Step 7, how sure: from the odds of the evidence to the probability of a name.
//!
//! In: an explanation, what it leaves, and what the held-out windows say. Out: [`posterior::Believed`]: [`cause`]s with their
//! [`contribution`]s and the [`regime`] in which they show, each believed less where something speaks against it ([`doubt`])
//! or it does not matter ([`importance`]), what [`rows`] say by themselves, and what it all comes to ([`outcome`]).

pub mod cause;
pub mod contribution;
pub mod doubt;
pub mod importance;
pub mod outcome;
pub mod posterior;
pub mod regime;
pub mod rows;
