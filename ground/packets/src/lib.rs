//! What came over a line or out of a file: bytes to readings, readings to channels with names and units, and whether numbers
//! can be in the unit that they are said to be in.

pub mod channel;
pub mod input;
pub mod magnitude;
pub mod output;
pub mod reach;
pub mod stream;
