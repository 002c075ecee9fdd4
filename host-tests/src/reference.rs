//! Textbook forms in f64, written from the equations and not from the unit's code, to hold the unit's f32 against.

pub mod calibration;
pub mod redundancy;
