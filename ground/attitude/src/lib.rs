//! Attitude from a log: the methods on recorded data, beside a reference and beside peers.
//!
//! ```
//! use attitude::broad;
//! use logs::recording;
//!
//! let rows = recording::read("../../data/broad/09_undisturbed_fast_rotation_with_breaks_B.csv.gz".as_ref())?;
//! let error = broad::replay(broad::Mode::FiveHz).score(&rows).expect("an attitude");
//! assert!(error.total_deg < 1.0);
//! # Ok::<(), recording::RecordingError>(())
//! ```

pub mod align;
pub mod broad;
pub mod chapter6;
pub mod command;
pub mod counts;
pub mod methods;
pub mod orbit;
pub mod peers;
pub mod reference;
pub mod replay;
pub mod told;

pub use command::{AttitudeArguments, AttitudeError, run};
