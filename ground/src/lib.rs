//! The ground side as a library.

pub mod console;
pub mod decode;
pub mod digest;
pub mod envelope;
pub mod fly;
pub mod folder;
pub mod plot;
pub mod size;
pub mod summary;
pub mod table;
