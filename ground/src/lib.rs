//! The ground side as a library.

pub mod acceptance;
pub mod case;
pub mod compare;
pub mod console;
pub mod decode;
pub mod demo;
pub mod drill;
pub mod effects;
pub mod exit;
pub mod fly;
pub mod sbom;
pub mod size;
pub mod words;
pub mod xtce;
