//! The bench: calibrates the unit and measures its noise.

pub mod allan;
pub mod calibrate;
pub mod calibration;
pub mod checks;
pub mod consensus;
pub mod controlled;
pub mod coverage;
pub mod design;
pub mod drift;
pub mod ellipsoid;
pub mod experiment;
pub mod lean;
pub mod least_squares;
pub mod log;
pub mod nominal;
pub mod report;
pub mod reproduction;
pub mod response;
pub mod set;
pub mod stretches;
pub mod table;
pub mod turntable;
pub mod wiring;
