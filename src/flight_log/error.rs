//! Why the log refuses, in words for the console.

use core::fmt;

use crate::nand::NandError;

/// Why the log refuses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
pub enum LogError {
    /// The chip does not do what it is asked.
    Nand(NandError),
    /// [`FlightLog::mount`](super::FlightLog::mount) was not called, or did not succeed.
    NotMounted,
    /// The log was written by a newer firmware, in this format version.
    Newer(u8),
    /// The chip holds something that is no log.
    Foreign,
    /// No room is left; nothing was overwritten.
    Full,
    /// No block can be written: all are bad, several failed one after the other, or the superblock's own have.
    Worn,
}

impl From<NandError> for LogError {
    fn from(error: NandError) -> Self {
        LogError::Nand(error)
    }
}

impl fmt::Display for LogError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            LogError::Nand(error) => error.fmt(f),
            LogError::NotMounted => f.write_str("not mounted"),
            LogError::Newer(version) => write!(f, "log of newer format {version}: update the firmware"),
            LogError::Foreign => f.write_str("NAND holds something else: G_MA makes it a log"),
            LogError::Full => f.write_str("full"),
            LogError::Worn => f.write_str("no block of the NAND can be written"),
        }
    }
}

impl core::error::Error for LogError {}
