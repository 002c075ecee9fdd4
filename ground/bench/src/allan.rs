//! Noise of a record: Allan deviations.

pub mod bounds;
pub mod covariance;
pub mod deviation;
pub mod fit;
pub mod noise;
pub mod phase;
pub mod series;
#[cfg(test)]
mod simulate;
pub mod terms;
