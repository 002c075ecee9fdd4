//! What a unit's estimation took of what a launch crew told it, from its flight log: launch rails and sites.
//!
//! In: a flight log, an image of the chip or a dump. Out: of the unit's latest start in the newest epoch each rail and site, in the order
//! they were taken, and when by the unit's clock. The stream of packets has none of them, and without them the attitude from the first one
//! on is not the unit's.
//!
//! Refuses a file that holds no record of a log.

use std::{
    io::{self, Read},
    path::Path,
};

use emems::mode::Cause;
use logs::flight::{Taken, Told};
use packets::input;
use recorder::log::{self, LIMIT, Log, LogError};

/// Why nothing is read.
#[derive(Debug, thiserror::Error)]
pub enum NothingTold {
    /// The file cannot be read.
    #[error("{file}: {error}")]
    Io {
        /// Which.
        file: String,
        /// Why.
        error: io::Error,
    },
    /// It is no log that this program reads.
    #[error("{file}: {error}")]
    Log {
        /// Which.
        file: String,
        /// Why.
        error: LogError,
    },
    /// It holds nothing of a log.
    #[error("{0}: no record of a flight log; an image of the chip or what `ground dump` wrote is wanted")]
    Nothing(String),
}

/// Those of a file.
///
/// # Errors
/// When it cannot be read, or is no flight log.
pub fn read(path: &Path) -> Result<Vec<Taken>, NothingTold> {
    let file = path.display().to_string();
    let mut bytes = Vec::new();
    let content = input::open(path).and_then(|content| content.take(LIMIT + 1).read_to_end(&mut bytes));
    if let Err(error) = content {
        return Err(NothingTold::Io { file, error });
    }
    let log = match log::read(&bytes) {
        Ok(log) => log,
        Err(error) => return Err(NothingTold::Log { file, error }),
    };
    if log.headers.is_empty() && log.changes.is_empty() && log.packets.is_empty() {
        return Err(NothingTold::Nothing(file));
    }
    Ok(of(&log))
}

/// Those of a log.
pub fn of(log: &Log) -> Vec<Taken> {
    let starts = log.headers.keys().chain(log.changes.keys()).chain(log.packets.keys());
    let latest = starts.map(|key| (key.epoch, key.boot)).max();
    let of_latest = log
        .changes
        .iter()
        .filter(|(key, _)| Some((key.epoch, key.boot)) == latest);
    of_latest
        .filter_map(|(_, change)| {
            let told = match change.cause {
                Cause::RailTaken(rail) => Told::Rail(rail),
                Cause::SiteTaken(site) => Told::Site(site),
                _ => return None,
            };
            let at_us = change.at_us;
            Some(Taken { at_us, told })
        })
        .collect()
}
