//! The ground side as a library.

pub mod acceptance;
pub mod case;
pub mod compare;
pub mod console;
pub mod decode;
pub mod demo;
pub mod digest;
pub mod drill;
pub mod effects;
pub mod envelope;
pub mod events;
pub mod exit;
pub mod fly;
pub mod folder;
pub mod messages;
pub mod plot;
pub mod record;
pub mod sbom;
pub mod size;
pub mod spectra;
pub mod summary;
pub mod table;
pub mod words;
pub mod xtce;
