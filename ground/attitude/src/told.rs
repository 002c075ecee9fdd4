//! What a unit's estimation took of what a launch crew told it, from its flight log: launch rails and sites.
//!
//! In: a flight log, an image of the chip or a dump, and the packets of a flight. Out: of the boot that recorded them each rail and site, in
//! the order they were taken, and when by the unit's clock. The stream of packets has none of them, and without them the attitude from the first one
//! on is not the unit's. For what wants one place for a whole log, the site at which the latest boot estimated in the end ([`site()`]).
//!
//! Refuses a file that holds no record of a log.

use std::{
    io::{self, Read},
    path::Path,
};

use emems::{mode::Cause, packet, sample::Reading, site};
use logs::flight::{CrewWord, Taken};
use packets::input;
use recorder::{
    kept::InSuperblock,
    log::{self, Boot, LIMIT, Log, LogError},
};

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

/// The flight log of a file.
///
/// # Errors
/// When it cannot be read, or is no flight log.
pub fn open(path: &Path) -> Result<Log, NothingTold> {
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
    Ok(log)
}

/// The launch site at which the latest boot estimated in the end: the last one that it took. Where no record says so, and some are lost,
/// it is the one that the superblock surely keeps. `None`: the one that is compiled in.
pub fn site(log: &Log) -> Option<site::Told> {
    let boot = log.latest_boot();
    let taken = of(log, boot).into_iter().rev().find_map(|taken| match taken.told {
        CrewWord::Site(site) => Some(site),
        CrewWord::Rail(_) => None,
    });
    let is_lost = boot.is_some_and(|boot| !log.is_whole(boot));
    let kept = || match log.superblock {
        InSuperblock::Save(kept) if is_lost && kept.is_sure && kept.site.fault().is_none() => Some(kept.site),
        _ => None,
    };
    taken.or_else(kept).filter(|site| !site.is_none())
}

/// The site that the latest boot was told and did not take: the superblock keeps another site than the last one that was taken, as where it was
/// confirmed too shortly before the flight.
pub fn untaken(log: &Log) -> Option<site::Told> {
    let InSuperblock::Save(kept) = log.superblock else {
        return None;
    };
    let taken = site(log).unwrap_or_default();
    (kept.is_sure && kept.site != taken).then_some(kept.site)
}

/// Rails and sites that a boot took.
pub fn of(log: &Log, boot: Option<Boot>) -> Vec<Taken> {
    let changes = boot.into_iter().flat_map(|boot| log.changes_of(boot));
    let taken = changes.filter_map(|change| {
        let told = match change.cause {
            Cause::RailTaken(rail) => CrewWord::Rail(rail),
            Cause::SiteTaken(site) => CrewWord::Site(site),
            _ => return None,
        };
        let at_us = change.at_us;
        Some(Taken { at_us, told })
    });
    taken.collect()
}

/// The boot whose packets these are. A unit that is started once more, to be read out, leaves a boot in its log, too. Where none was
/// recorded it is the latest one.
pub fn boot(log: &Log, readings: impl Iterator<Item = Reading>) -> Option<Boot> {
    let packets = readings.map(|reading| packet::encode(&reading)).collect();
    log.boot_of_packets(&packets).or_else(|| log.latest_boot())
}
