//! The ground side as a library.

pub mod console;
