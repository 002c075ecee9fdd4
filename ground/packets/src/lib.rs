//! What came over a line or out of a file: bytes to readings, and readings to channels with names and units.

pub mod channel;
pub mod stream;
