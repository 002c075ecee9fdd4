//! The flight log on the ground: pulled over the umbilical, decoded, recovered.
//!
//! ```text
//! unit --umbilical--> dump --> file of packets and frames --+
//! chip read out on a bench --> raw image ------------------+--> log --> table (CSV, Parquet)
//! ```
//!
//! `ground dump` pulls, `ground recover` turns either file into tables and says what is missing, of this epoch and of
//! older ones that no erase has reached. The formats are the unit's own: `emems::flight_log`.
//!
//! ```
//! // A dump is packets with a frame after each; what is neither is passed over.
//! let log = recorder::log::read(b"no dump").unwrap();
//! assert!(log.packets.is_empty() && !recorder::log::is_image(b"no dump"));
//! ```

pub mod dump;
pub mod kept;
pub mod log;
pub mod parquet;
pub mod recover;
pub mod table;
