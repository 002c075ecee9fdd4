//! Logs of the unit on the ground: what a stream or a recording says, and the folder and page that show it.
//!
//! In: bytes of a telemetry line ([`digest`]), or rows of a nine-axis recording ([`recording`]). Out: figures of a flight
//! ([`record`]), its attitude step by step ([`follow`], [`flight`]), tables, messages, and one page ([`folder`], [`plot`]).
//! Whoever flies, decodes, compares or scores builds on this; nothing here flies or commands anything.

pub mod cycles;
pub mod digest;
pub mod envelope;
pub mod events;
pub mod flight;
pub mod folder;
pub mod follow;
pub mod messages;
pub mod plausible;
pub mod plot;
pub mod record;
pub mod recording;
pub mod score;
pub mod spectra;
pub mod spectrum;
pub mod summary;
pub mod table;
pub mod units;
pub mod whiteness;
