//! Textbook forms in f64 of what `emems` computes in f32, written from the equations and not from the code: slow, plain,
//! and wrong in other ways if wrong at all.

pub mod calibration;
pub mod mekf;
pub mod redundancy;
pub mod spin;
pub mod wahba;
