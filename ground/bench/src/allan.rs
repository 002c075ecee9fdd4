//! Noise of a record: Allan deviations.

pub mod bounds;
pub mod deviation;
pub mod noise;
pub mod phase;
pub mod series;
#[cfg(test)]
mod simulate;
