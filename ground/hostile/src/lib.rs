//! What must hold whatever bytes come: one function a target, which the fuzzer (`ground/fuzz`) and the replay of its
//! corpora (`tests/replay.rs`, on stable Rust) both call.
//!
//! In: any bytes. Out: nothing, or a panic that says what did not hold. Each page says what the bytes are to its target.
//!
//! Parquet is written and never read, so that there is nothing to fuzz: its reader is a dependency of a test alone.

mod case;
mod commands;
mod console;
mod csv;
mod flight_log;
mod packet_stream;
mod recording;
mod recovered;
mod set;
mod toml;

pub use case::case;
pub use commands::commands;
pub use console::console;
pub use csv::csv;
pub use flight_log::flight_log;
pub use packet_stream::packets;
pub use recording::recording;
pub use recovered::recover;
pub use set::set;
pub use toml::toml;

/// A target: its name, which is also its corpus' folder, and its function.
pub type Target = (&'static str, fn(&[u8]));

/// Every target.
pub const TARGETS: [Target; 10] = [
    ("case", case),
    ("commands", commands),
    ("console", console),
    ("csv", csv),
    ("flight_log", flight_log),
    ("packets", packets),
    ("recording", recording),
    ("recover", recover),
    ("set", set),
    ("toml", toml),
];
