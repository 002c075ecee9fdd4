//! The bench: calibrates the unit and measures its noise.

pub mod least_squares;
pub mod response;
pub mod table;
