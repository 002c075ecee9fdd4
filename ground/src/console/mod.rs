//! The umbilical console.
pub mod line;
pub mod recording;
pub mod serial;
pub mod stream;
