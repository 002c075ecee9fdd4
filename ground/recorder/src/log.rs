//! What a raw image or a dump holds: records by key.
//!
//! In: the bytes of a chip (528 a page, block after block) or of a dump (packets and `%` frames, however mixed with other
//! text). Out: a [`Log`]. Every whole record of every epoch counts, from either half of whichever page, in place or not;
//! a key found twice must hold the same. Refuses what is larger than any chip of this class or its dump
//! ([`LIMIT`]), so that memory and time are bounded by it, whatever the content claims.

use std::collections::{BTreeMap, BTreeSet};

use emems::{
    flight_log::{
        dump::{self, DUMP_BYTES, DUMP_START},
        page::{self, PageKind, Stamp},
        record::{self, BootHeader, Content, Entry, Key, RecordBytes, RecordError},
        superblock,
    },
    mode::Change,
    nand::{MAIN_BYTES, PAGE_BYTES, PAGES_PER_BLOCK, PageAddress, PageBytes},
    packet::PACKET_BYTES,
};

use crate::kept::{InSuperblock, Saves};

/// \[bytes\] the largest file that is read: a K9F1208's image has 69 million, a dump of it 49 million.
pub const LIMIT: u64 = 128 << 20;

/// What was found.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Log {
    /// Packet records.
    pub packets: BTreeMap<Key, Entry>,
    /// Boot headers.
    pub headers: BTreeMap<Key, BootHeader>,
    /// Changes of mode.
    pub changes: BTreeMap<Key, Change>,
    /// What the superblock keeps.
    pub superblock: InSuperblock,
    /// How good the medium was.
    pub damage: Damage,
}

/// A start of the unit that wrote to the log; a later one is greater.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Boot {
    /// How often the log had been erased.
    pub epoch: u16,
    /// Its number.
    pub number: u32,
}

impl Boot {
    /// The one that wrote the record of this key.
    pub fn of(key: &Key) -> Self {
        Boot {
            epoch: key.epoch,
            number: key.boot,
        }
    }
}

/// How good the medium was.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Damage {
    /// Pages or frames that hold something.
    pub used: u64,
    /// Bits corrected.
    pub corrected: u64,
    /// Halves of pages that no code puts right, torn pages included.
    pub lost: u64,
    /// Pages that say they belong elsewhere.
    pub astray: u64,
    /// Records that differ from another with the same key; the one found first is kept.
    pub conflicts: BTreeSet<Key>,
    /// Versions of records of a newer format: they are left out.
    pub newer: BTreeSet<u8>,
}

/// Why a file is not read.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum LogError {
    /// It is larger than a chip.
    #[error("{0} bytes are more than any chip of this class or a dump of it ({LIMIT})")]
    TooLarge(u64),
    /// The log is of a newer format.
    #[error("the log is of format version {0}, newer than this program: update it")]
    Newer(u8),
}

/// Whether the bytes are a raw image: a superblock or a page of the log stands in some page's place.
pub fn is_image(bytes: &[u8]) -> bool {
    let pages = bytes.as_chunks::<PAGE_BYTES>().0.iter().enumerate();
    pages
        .into_iter()
        .any(|(number, bytes)| matches!(stamp_of(number, bytes), Stamp::Ours(_)))
}

/// What these bytes hold: an image or a dump, whichever they are.
///
/// # Errors
/// When they are too many, or a superblock says that the format is newer.
pub fn read(bytes: &[u8]) -> Result<Log, LogError> {
    if bytes.len() as u64 > LIMIT {
        return Err(LogError::TooLarge(bytes.len() as u64));
    }
    if is_image(bytes) {
        read_image(bytes)
    } else {
        Ok(read_dump(bytes))
    }
}

fn address(number: usize) -> PageAddress {
    PageAddress {
        // An image of more blocks than fit is longer than `LIMIT`.
        block: (number / usize::from(PAGES_PER_BLOCK)) as u16,
        page: (number % usize::from(PAGES_PER_BLOCK)) as u8,
    }
}

fn stamp_of(number: usize, bytes: &PageBytes) -> Stamp {
    page::stamp(page::spare(bytes), address(number))
}

fn read_image(image: &[u8]) -> Result<Log, LogError> {
    let mut log = Log::default();
    let mut saves = Saves::default();
    for (number, bytes) in image.as_chunks::<PAGE_BYTES>().0.iter().enumerate() {
        if page::is_blank(bytes) {
            continue;
        }
        log.damage.used += 1;
        let stamp = stamp_of(number, bytes);
        log.damage.astray += u64::from(matches!(stamp, Stamp::Astray(..)));
        let mut bytes = *bytes;
        let whole = page::correct(&mut bytes);
        let mut save = None;
        for (half, wrong) in whole.into_iter().enumerate() {
            let Ok(wrong) = wrong else {
                log.damage.lost += 1;
                continue;
            };
            log.damage.corrected += u64::from(wrong);
            let bytes = page::record(&bytes, half);
            match superblock::decode(bytes) {
                Ok(superblock) => save = save.or(Some(superblock)),
                Err(superblock::SuperblockError::Newer(version)) => return Err(LogError::Newer(version)),
                Err(superblock::SuperblockError::Damaged) => {
                    let of_records = !matches!(stamp, Stamp::Ours(tag) if tag.kind != PageKind::Log);
                    log.damage.lost += u64::from(!log.take(bytes) && of_records);
                }
            }
        }
        let is_tagged = matches!(stamp, Stamp::Ours(tag) if tag.kind == PageKind::Superblock);
        saves.take(address(number), save, is_tagged);
    }
    log.superblock = saves.newest().map_or(InSuperblock::Lost, InSuperblock::Save);
    Ok(log)
}

fn read_dump(bytes: &[u8]) -> Log {
    let mut log = Log::default();
    for (_, record) in frames(bytes) {
        log.damage.used += 1;
        log.take(&record);
    }
    log
}

/// The page and the record of every whole frame of a dump.
pub fn frames(bytes: &[u8]) -> impl Iterator<Item = (u32, RecordBytes)> {
    let starts = bytes.iter().enumerate().filter(|(_, byte)| **byte == DUMP_START);
    starts.filter_map(|(at, _)| {
        let rest = &bytes[at..(at + DUMP_BYTES).min(bytes.len())];
        let end = rest.iter().position(|byte| *byte == b'\n')?;
        let packet = at
            .checked_sub(PACKET_BYTES)
            .and_then(|from| bytes[from..at].first_chunk());
        dump::decode(&rest[..=end], packet)
    })
}

impl Log {
    /// Takes a record; whether it is one.
    fn take(&mut self, bytes: &RecordBytes) -> bool {
        match record::decode(bytes) {
            Ok((key, Content::Packet(entry))) => {
                if self.packets.entry(key).or_insert_with(|| entry.clone()) != &entry {
                    self.damage.conflicts.insert(key);
                }
            }
            Ok((key, Content::Header(header))) => {
                if self.headers.entry(key).or_insert_with(|| header.clone()) != &header {
                    self.damage.conflicts.insert(key);
                }
            }
            Ok((key, Content::Change(change))) => {
                if *self.changes.entry(key).or_insert(change) != change {
                    self.damage.conflicts.insert(key);
                }
            }
            Err(RecordError::Newer(version)) => {
                self.damage.newer.insert(version);
            }
            Err(RecordError::Magic | RecordError::Checksum | RecordError::Type(_)) => return false,
        }
        true
    }

    /// The epoch that counts: the newest superblock's, or the newest record's.
    pub fn newest_epoch(&self) -> Option<u16> {
        match self.superblock {
            InSuperblock::Save(kept) => Some(kept.epoch),
            InSuperblock::Dump | InSuperblock::Lost => self.packets.last_key_value().map(|(key, _)| key.epoch),
        }
    }

    /// Its packet records in order: of the epoch that counts, or of all.
    pub fn packets_of(&self, all_epochs: bool) -> impl Iterator<Item = (&Key, &Entry)> {
        let newest = self.newest_epoch();
        let counts = move |key: &Key| all_epochs || Some(key.epoch) == newest;
        self.packets.iter().filter(move |(key, _)| counts(key))
    }

    /// The latest boot that left a record.
    pub fn latest_boot(&self) -> Option<Boot> {
        self.keys().map(Boot::of).max()
    }

    /// Of every record that is there.
    fn keys(&self) -> impl Iterator<Item = &Key> {
        (self.headers.keys())
            .chain(self.changes.keys())
            .chain(self.packets.keys())
    }

    /// Whether no record of a boot is lost: their numbers follow each other from its header on.
    pub fn is_whole(&self, boot: Boot) -> bool {
        let of_boot: BTreeSet<u32> = self
            .keys()
            .filter(|key| Boot::of(key) == boot)
            .map(|key| key.seq)
            .collect();
        let (Some(first), Some(last)) = (of_boot.first(), of_boot.last()) else {
            return false;
        };
        let header = Key {
            epoch: boot.epoch,
            boot: boot.number,
            seq: *first,
        };
        self.headers.contains_key(&header) && of_boot.len() as u64 == u64::from(last - first) + 1
    }

    /// The boot that recorded most of these packets; `None` where none did.
    pub fn boot_of_packets(&self, packets: &BTreeSet<[u8; PACKET_BYTES]>) -> Option<Boot> {
        let mut counts: BTreeMap<Boot, usize> = BTreeMap::new();
        for (key, _) in self.packets.iter().filter(|(_, entry)| packets.contains(&entry.packet)) {
            *counts.entry(Boot::of(key)).or_default() += 1;
        }
        counts.into_iter().max_by_key(|(_, count)| *count).map(|(boot, _)| boot)
    }

    /// Changes of a boot, in order.
    pub fn changes_of(&self, boot: Boot) -> impl DoubleEndedIterator<Item = &Change> {
        let of_boot = self.changes.iter().filter(move |(key, _)| Boot::of(key) == boot);
        of_boot.map(|(_, change)| change)
    }

    /// Stretches of records that are missing within a boot: first and last that is, and when the record before began
    /// \[us\]. Records are numbered from 1 without a gap, but for copies and headers.
    pub fn gaps(&self) -> Vec<Gap> {
        let mut gaps = Vec::new();
        let mut before: Option<(Key, u64)> = None;
        for (key, entry) in &self.packets {
            let same_boot = before.filter(|(last, _)| (last.epoch, last.boot) == (key.epoch, key.boot));
            let expected = match same_boot {
                Some((last, _)) => last.seq + 1,
                // A boot that was erased over begins where it was.
                None => self.first_of_boot(*key),
            };
            // A header stands among the records where a log was opened again, and so does a change of mode.
            let is_other = |key| self.headers.contains_key(&key) || self.changes.contains_key(&key);
            let missing = (expected..key.seq).filter(|seq| !is_other(Key { seq: *seq, ..*key }));
            let (mut missing, first) = (missing.clone(), missing.into_iter().next());
            if let Some(first) = first {
                gaps.push(Gap {
                    first: Key { seq: first, ..*key },
                    last: missing.next_back().unwrap_or(first),
                    after_us: same_boot.map(|(_, start_us)| start_us),
                });
            }
            before = Some((*key, entry.start_us));
        }
        gaps
    }

    fn first_of_boot(&self, key: Key) -> u32 {
        let headers = self.headers.range(Key { seq: 0, ..key }..key);
        headers.last().map_or(key.seq, |(header, _)| header.seq + 1)
    }
}

/// Records that are missing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Gap {
    /// The first.
    pub first: Key,
    /// Number of the last.
    pub last: u32,
    /// \[us\] when the record before them began, in its boot.
    pub after_us: Option<u64>,
}

const _: () =
    assert!(LIMIT / PAGE_BYTES as u64 / (PAGES_PER_BLOCK as u64) < u16::MAX as u64 && MAIN_BYTES < PAGE_BYTES);

#[cfg(test)]
mod tests;
