//! The bench: calibrates the unit and measures its noise.

pub mod allan;
pub mod consensus;
pub mod controlled;
pub mod coverage;
pub mod drift;
pub mod ellipsoid;
pub mod experiment;
pub mod lean;
pub mod least_squares;
pub mod response;
pub mod set;
pub mod spectrum;
pub mod stretches;
pub mod table;
pub mod turntable;
pub mod wiring;
