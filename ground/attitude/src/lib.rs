//! Attitude from a log: the methods on recorded data, beside a reference and beside peers.

pub mod broad;
pub mod command;
pub mod flight;
pub mod log;
pub mod peers;
pub mod plots;
pub mod recording;
pub mod replay;
pub mod score;
pub mod whiteness;

pub use command::{Arguments, AttitudeError, run};
