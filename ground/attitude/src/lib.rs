//! Attitude from a log: the methods on recorded data, beside a reference and beside peers.

pub mod align;
pub mod broad;
pub mod chapter6;
pub mod command;
pub mod counts;
pub mod flight;
pub mod log;
pub mod methods;
pub mod orbit;
pub mod peers;
pub mod plausible;
pub mod plots;
pub mod recording;
pub mod reference;
pub mod replay;
pub mod score;
pub mod whiteness;

pub use command::{Arguments, AttitudeError, run};
