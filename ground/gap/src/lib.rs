//! The gap between the twin and the unit: where it is, which effect makes it, how far it shrinks.
//!
//! In: a case ([`case`]), that is a unit's log, what it was made to do, and what its designers believed of it. Out: a
//! verdict. The flow, one module a step:
//!
//! ```text
//! case -> windows (what is fitted | what only judges) -> problem (residual in units of noise)
//!      -> library (every effect at every place) -> attribute (which, by evidence) -> explain (and how it scatters)
//!      -> leftover (is it enough) -> held (how far it shrinks) -> belief, believed (how likely a name is) -> verdict
//! ```
//!
//! What the calibration leaves open is marginalised throughout ([`gram`]): with thousands of samples any error of 0.1 % is
//! significant, and none of it is an effect.

pub mod advise;
pub mod command;
pub mod correct;
pub mod diagnose;
pub mod holdout;
pub mod input;
pub mod library;
pub mod null;
pub mod probability;
pub mod report;
pub mod search;
pub mod unknown;

pub use command::{Arguments, GapError, run, write_baselines, write_verdict, write_withheld};
