//! One channel of a unit: what is described of it, what it looks at, and the chain from there to what it reads.
//!
//! [`UnitDescription`] is `unit.toml`: every [`Channel`] with its noise and how well it is calibrated. [`Aim`] is what of it its
//! input depends on, [`Feel`] the state of the unit's centre that it looks at, and [`Chain`] the stages at which an effect can
//! act. Effects and predictions both stand on this; it needs neither.

mod chain;
mod feel;
mod unit;

pub(crate) use chain::BEFORE;
pub use chain::Chain;
pub use feel::{Aim, Feel};
pub use unit::{Channel, Kind, KnownEffect, UnitDescription, UnitError};
