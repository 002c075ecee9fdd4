//! A flight of the unit: what is flown, what is done to it, who watches, and what is left of it.
//!
//! In: [`plan::FlyArguments`] and a [`board`] that flies. Out: the folder of a flight, which is a gap case too ([`case`]). The program
//! `fly` has the host board alone, so that little is built before the first page; `ground fly` has the emulated one as well.

pub mod board;
pub mod case;
mod disturb;
pub mod exit;
mod flight;
pub mod interrupt;
pub mod plan;
mod progress;
pub mod site;
pub mod source;
mod taught;
mod transit;
pub mod watch;
mod words;

pub use self::flight::{FlyError, Landed, TakeOff, fly_until};
