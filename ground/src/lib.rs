//! The ground side as a library.

pub mod channel;
pub mod console;
pub mod log;
