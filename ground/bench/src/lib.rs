//! The bench: calibrates the unit and measures its noise.

pub mod allan;
