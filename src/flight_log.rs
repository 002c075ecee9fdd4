//! The flight log: records on a NAND that are there afterwards, whatever was cut when.
//!
//! In: an [`Entry`] a cycle. Out: its [`Key`] once it is durable; after a start, what the unit was doing; pages for a
//! dump. The log is a function of the chip and its calls: it reads no clock and waits for nothing but the chip.
//!
//! ```text
//! blocks 0..4     superblock, two good blocks in turn           superblock.rs
//! blocks 4..      records, ascending, bad blocks left out       page.rs, record.rs
//! the last 4      the calibration set that is kept, two in turn  kept_set.rs
//! ```
//!
//! 1. A page is programmed once, with a record and a copy of the one before: a lost page takes only the newest with it.
//! 2. A block belongs to one boot. Bits that a cut tore may read differently each time, so nothing is programmed into a
//!    block whose erase was not completed since this start, and no key is used twice. A boot that left little takes no
//!    block of its own for good: the next one copies it and takes turns with it (carry.rs).
//! 3. The first thing a boot changes is the superblock, and only then an old block: what a torn superblock seems to
//!    say is made true before anything follows from it.
//! 4. Appending is done when the page has been read back. A block that fails is retired in the superblock, and the
//!    record goes to the next one.
//! 5. Erasing the log is one more in the superblock's epoch; blocks are erased later, in free time, and each again just
//!    before it is used. A block that carries the running epoch is never erased, whatever the search for the end said,
//!    unless all of it has been read from another block (carry.rs).
//! 6. A full log says so and stops.
//!
//! Refuses: another chip or none, a newer format (named), foreign content (until it is erased by command), a chip without a
//! block that works.

mod blocks;
mod carry;
pub mod dump;
mod error;
mod kept_set;
mod mount;
pub mod page;
pub mod record;
mod status;
pub mod superblock;
#[cfg(test)]
mod tests;

pub use self::{error::LogError, status::Status, superblock::LOG_START};
use self::{
    page::PageKind,
    record::{BootHeader, Entry, Key, RecordBytes},
    superblock::Superblock,
};
pub use crate::mode::Resumed;
use crate::{
    mode::Change,
    nand::{Nand, PAGE_BYTES, PAGES_PER_BLOCK, PageAddress, PageBytes},
};

/// Blocks tried for one page before the chip is given up: the data sheet allows 80 of 4096 to fail in a life.
const ATTEMPTS: usize = 4;

/// The log on a chip.
pub struct FlightLog<N> {
    chip: N,
    header: BootHeader,
    state: State,
    superblock: Superblock,
    /// The block with the newest superblock, and its next page if the block was erased since this start.
    home: (u16, Option<u8>),
    /// This boot has its number.
    opened: bool,
    /// This boot has its header in the log.
    begun: bool,
    /// The header says something else since.
    described_anew: bool,
    /// The next page, in a block erased since this start.
    head: Option<PageAddress>,
    /// The block after it, erased ahead of time.
    ahead: Option<u16>,
    /// No block from here on is used.
    next_block: u16,
    /// Where the newest records are, found at mount.
    newest_block: Option<u16>,
    erase_next: Option<u16>,
    seq: u32,
    /// The record of the newest page, or found newest at mount; how many of `last` and `second` are set.
    last: RecordBytes,
    /// The one before it, found at mount.
    second: RecordBytes,
    carried: u8,
    /// A page to be programmed.
    page: PageBytes,
    /// A page that was read.
    back: PageBytes,
    status: Status,
}

/// What may be done.
#[derive(Clone, Copy, PartialEq, Eq)]
enum State {
    Mounted,
    /// Only an erase makes it a log.
    Erasable,
    Unmounted,
}

impl<N: Nand> FlightLog<N> {
    /// The log on this chip; every boot that records begins with `header`. Nothing is sent to the chip.
    pub fn new(chip: N, header: BootHeader) -> Self {
        FlightLog {
            chip,
            header,
            state: State::Unmounted,
            superblock: Superblock::default(),
            home: (0, None),
            opened: false,
            begun: false,
            described_anew: false,
            head: None,
            ahead: None,
            next_block: LOG_START,
            newest_block: None,
            erase_next: None,
            seq: 0,
            last: [0; record::RECORD_BYTES],
            second: [0; record::RECORD_BYTES],
            carried: 0,
            page: [0; PAGE_BYTES],
            back: [0; PAGE_BYTES],
            status: Status::default(),
        }
    }

    /// From the next record on the log is of a unit as `header` has it; before it comes that header.
    pub fn describe(&mut self, header: BootHeader) {
        self.header = header;
        self.described_anew = true;
    }

    /// Keeps an entry. `Ok` means it is durable. Takes one program of a page, and an erase where
    /// [`FlightLog::free_time`] had no chance to do it ahead; the first of a boot writes superblock and header first.
    pub async fn append(&mut self, entry: &Entry) -> Result<Key, LogError> {
        self.mounted()?;
        let outcome = self.try_append(entry).await;
        self.stop_if_unsure(&outcome);
        outcome
    }

    async fn try_append(&mut self, entry: &Entry) -> Result<Key, LogError> {
        self.introduce(entry.start_us).await?;
        let key = self.next_key();
        self.put_record(record::encode_entry(key, entry)).await?;
        self.status.last = Some((key, entry.start_us));
        Ok(key)
    }

    /// Keeps a change of mode, as an entry is kept.
    pub async fn note(&mut self, change: &Change) -> Result<(), LogError> {
        self.mounted()?;
        let outcome = self.try_note(change).await;
        self.stop_if_unsure(&outcome);
        outcome
    }

    async fn try_note(&mut self, change: &Change) -> Result<(), LogError> {
        self.introduce(change.at_us).await?;
        let key = self.next_key();
        self.put_record(record::encode_change(key, change)).await
    }

    /// The header before the first record of a boot, and before one of a unit that is described anew.
    async fn introduce(&mut self, now_us: u64) -> Result<(), LogError> {
        if !self.begun {
            self.begin(now_us).await?;
        } else if self.described_anew {
            self.header.opened_us = now_us;
            let key = self.next_key();
            self.put_record(record::encode_header(key, &self.header)).await?;
        }
        self.described_anew = false;
        Ok(())
    }

    /// The header of this boot is in the log.
    pub fn is_begun(&self) -> bool {
        self.begun
    }

    /// The newest packet record that mounting found, as it stands there.
    pub fn newest(&self) -> Option<&RecordBytes> {
        (self.carried > 0 && !self.begun).then_some(&self.last)
    }

    /// Programs a page with a record and the one before it.
    async fn put_record(&mut self, record: RecordBytes) -> Result<(), LogError> {
        page::compose(&mut self.page, &record, &self.last);
        self.put_page().await?;
        self.last = record;
        Ok(())
    }

    /// A bounded part of what is better done before it is needed (one erase at most); whether there is more.
    pub async fn free_time(&mut self) -> Result<bool, LogError> {
        self.mounted()?;
        let outcome = self.try_free_time().await;
        self.stop_if_unsure(&outcome);
        outcome
    }

    async fn try_free_time(&mut self) -> Result<bool, LogError> {
        if self.begun && self.ahead.is_none() {
            self.ahead = match self.erased_block().await {
                Ok(block) => Some(block),
                Err(LogError::Full) => None,
                Err(error) => return Err(error),
            };
            if self.ahead.is_some() {
                return Ok(self.erase_next.is_some());
            }
        }
        // In flight the time belongs to the log, which erases what it needs itself.
        let Some(next) = self.erase_next.filter(|_| !self.superblock.flight) else {
            return Ok(false);
        };
        self.erase_next = match self.free_block(next.max(self.next_block))? {
            Some(block) => {
                self.erase(block).await?;
                Some(block.saturating_add(1))
            }
            None => None,
        };
        Ok(self.erase_next.is_some())
    }

    /// Keeps the mode for the next start.
    pub async fn keep_mode(&mut self, mode: Resumed) -> Result<(), LogError> {
        self.mounted()?;
        let kept = &mut self.superblock;
        let Resumed {
            flight,
            recording,
            derived,
            rail,
            site,
        } = mode;
        if (kept.flight, kept.recording, kept.derived, kept.rail, kept.site) == (flight, recording, derived, rail, site)
        {
            return Ok(());
        }
        (kept.flight, kept.recording, kept.derived) = (flight, recording, derived);
        (kept.rail, kept.site) = (rail, site);
        let outcome = self.save().await;
        self.stop_if_unsure(&outcome);
        outcome
    }

    /// Makes the log empty; [`FlightLog::free_time`] erases its blocks. Cut anywhere, the old log is whole or gone.
    pub async fn start_erase(&mut self) -> Result<(), LogError> {
        if self.state == State::Unmounted {
            return Err(LogError::NotMounted);
        }
        self.superblock.epoch = self.superblock.epoch.checked_add(1).ok_or(LogError::Worn)?;
        self.superblock.first_block = LOG_START;
        self.superblock.block_before = 0;
        self.open();
        self.begun = false;
        self.head = None;
        self.ahead = None;
        self.next_block = LOG_START;
        self.newest_block = None;
        self.carried = 0;
        self.status.last = None;
        self.state = State::Mounted;
        self.erase_next = Some(LOG_START);
        let outcome = self.save().await;
        self.stop_if_unsure(&outcome);
        outcome
    }

    /// Reads page `number` of the log for a dump, counted from its first block: the whole records of the running epoch
    /// in it. Works until the chip itself fails; pages from [`Status::used`] on are blank.
    pub fn read(&mut self, number: u32) -> Result<[Option<&RecordBytes>; 2], LogError> {
        self.mounted()?;
        let at = self.page_number(number).ok_or(LogError::Full)?;
        self.chip.read(at, &mut self.back)?;
        let whole = self.whole_records();
        let [first, second] = whole;
        Ok([
            first.map(|_| page::record(&self.back, 0)),
            second.map(|_| page::record(&self.back, 1)),
        ])
    }

    /// How it stands.
    pub fn status(&self) -> Status {
        let per_block = u32::from(PAGES_PER_BLOCK);
        let (blocks, log_end) = (self.chip.blocks(), self.log_end());
        let log_bad = |end| u32::from(self.superblock.bad.count(LOG_START..end));
        let after = |block: u16| block.saturating_add(1);
        let end_block = match self.ahead {
            Some(ahead) if after(ahead) == self.next_block => ahead,
            _ => self.next_block,
        };
        let end = match self.head {
            Some(at) if after(at.block) >= end_block => at.row(),
            _ => u32::from(end_block) * per_block,
        };
        Status {
            used: end.saturating_sub(u32::from(LOG_START) * per_block),
            capacity: u32::from(log_end.saturating_sub(LOG_START)).saturating_sub(log_bad(log_end)) * per_block,
            bad_blocks: self.superblock.bad.count(0..blocks),
            more_bad_blocks: self.superblock.bad.is_full(),
            erasing: self.erase_next.map(|next| u32::from(log_end.saturating_sub(next))),
            ..self.status
        }
    }

    fn mounted(&self) -> Result<(), LogError> {
        if self.state == State::Mounted {
            Ok(())
        } else {
            Err(LogError::NotMounted)
        }
    }

    /// After a failure of the chip nobody knows what it holds: only a new mount may tell.
    fn stop_if_unsure<T>(&mut self, outcome: &Result<T, LogError>) {
        if let Err(LogError::Nand(_)) = outcome {
            self.state = State::Unmounted;
        }
    }

    fn next_key(&mut self) -> Key {
        let key = Key {
            epoch: self.superblock.epoch,
            boot: self.superblock.boot,
            seq: self.seq,
        };
        // Taken even if the record does not come to be: half of it may.
        self.seq = self.seq.saturating_add(1);
        key
    }

    /// Gives this boot its number; the caller saves it.
    fn open(&mut self) {
        if !self.opened {
            self.superblock.boot = self.superblock.boot.saturating_add(1);
            self.opened = true;
        }
    }

    /// Writes superblock and header of this boot, and before the header the records of the block that it carries on, or
    /// after it the two newest records of the boots before: their last pages may be torn, and then these are the only copies.
    async fn begin(&mut self, now_us: u64) -> Result<(), LogError> {
        let course = self.course()?;
        let first = match course.into {
            Some(block) => block,
            None => self.free_block(self.next_block)?.ok_or(LogError::Full)?,
        };
        if !self.opened || self.superblock.first_block != first {
            self.open();
            // Not the newest block: a start that was cut while it copied may have left that one half of what is here.
            self.superblock.block_before = course.from.unwrap_or(0);
            self.superblock.first_block = first;
            self.save().await?;
        }
        if let Some(block) = course.into {
            self.next_block = self.next_block.max(block.saturating_add(1));
            self.ahead = self.erase(block).await?.then_some(block);
        }
        let copied = match course.from {
            Some(block) if course.copies => self.copy(block).await?,
            _ => false,
        };
        self.header.opened_us = now_us;
        let key = self.next_key();
        let header = record::encode_header(key, &self.header);
        if copied {
            self.put_record(header).await?;
        } else {
            let newest = if self.carried > 0 { &self.last } else { &header };
            page::compose(&mut self.page, &header, newest);
            self.put_page().await?;
            if self.carried < 2 {
                self.second = header;
            }
            page::compose(&mut self.page, &self.second, &header);
            self.put_page().await?;
            self.last = self.second;
        }
        self.begun = true;
        Ok(())
    }

    /// Programs the composed page, wherever it holds.
    async fn put_page(&mut self) -> Result<(), LogError> {
        for _ in 0..ATTEMPTS {
            let at = match (self.head.take(), self.ahead.take()) {
                (Some(at), ahead) => {
                    self.ahead = ahead;
                    at
                }
                (None, Some(block)) => PageAddress { block, page: 0 },
                (None, None) => PageAddress {
                    block: self.erased_block().await?,
                    page: 0,
                },
            };
            let tag = self.tag(PageKind::Log);
            page::address(&mut self.page, at, tag);
            if self.program(at).await? {
                let page = at.page.wrapping_add(1);
                self.head = (page < PAGES_PER_BLOCK).then_some(PageAddress { page, ..at });
                return Ok(());
            }
            self.retire(at.block).await?;
        }
        Err(LogError::Worn)
    }
}
