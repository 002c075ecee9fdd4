//! The ground side as a library.

pub mod channel;
pub mod digest;
pub mod envelope;
pub mod log;
pub mod plot;
pub mod summary;
pub mod table;
