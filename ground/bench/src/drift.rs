//! Tests of a dry-tuned gyro.

pub mod positions;
pub mod rotor;
pub mod scale;
pub mod sensitivity;
pub mod stability;
