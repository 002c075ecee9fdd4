//! Attitude from a log: the methods on recorded data, beside a reference and beside peers.

pub mod broad;
pub mod recording;
pub mod replay;
pub mod score;
