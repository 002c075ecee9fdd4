//! Mounting: what a chip holds after whatever happened to it. Reads only.
//!
//! In: the chip. Out: what the unit was doing ([`Resumed`]), where the log goes on, the two newest records. Typically
//! some 60 reads: the superblock's pages, a search over the blocks of the newest boot (they ascend without a gap but for
//! bad ones), the newest page. Any doubt in the superblock, and every block's first page is looked at: 4092 reads of a
//! spare area, 70 ms. A chip never used has its factory marks read in both pages where they may stand, before any erase.

use embassy_futures::yield_now;

use super::{
    FlightLog, LOG_START, LogError, State,
    page::{self, PageKind, Stamp},
    record,
    superblock::{self, Superblock, SuperblockError},
};
use crate::{
    mode::Resumed,
    nand::{Nand, PAGES_PER_BLOCK, PageAddress},
    rail::Rail,
    site,
};

/// Blocks below the newest boot's first that are looked at for the boot before: boots that left nothing but a torn page
/// used the same block again, so that the next one below is live unless it was retired.
const LOOK_BACK: u16 = 8;

/// Pages at the start of a boot that repeat records of the boots before, out of the order of their keys.
const COPIES_OF_OLDER: u8 = 2;

/// Blocks read between two chances for the rest of the unit.
const STRIDE: u16 = 16;

/// Boots that a lost superblock may have counted without leaving a record.
pub(super) const UNSEEN_BOOTS: u32 = 16;

/// What the superblock's blocks hold.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Found {
    /// The newest save, both copies, and nothing torn.
    Sure,
    /// A save, but a newer one may be lost.
    Doubtful,
    /// None.
    Nothing,
}

/// What a record says of the mode: its key, FLIGHT, recording.
pub(super) type Told = (record::Key, bool, bool);

impl<N: Nand> FlightLog<N> {
    /// Finds out what the chip holds. Nothing is changed on it.
    pub async fn mount(&mut self) -> Result<Resumed, LogError> {
        self.forget();
        let outcome = self.find_all().await;
        if outcome == Err(LogError::Foreign) {
            self.state = State::Erasable;
        }
        outcome?;
        self.state = State::Mounted;
        Ok(Resumed {
            flight: self.superblock.flight,
            recording: self.superblock.recording,
            derived: self.superblock.derived,
            rail: self.superblock.rail,
            site: self.superblock.site,
        })
    }

    fn forget(&mut self) {
        self.state = State::Unmounted;
        self.superblock = Superblock::default();
        self.home = (LOG_START - 1, None);
        (self.opened, self.begun) = (false, false);
        (self.head, self.ahead, self.erase_next) = (None, None, None);
        (self.next_block, self.seq, self.carried) = (LOG_START, 0, 0);
        self.newest_block = None;
        self.status.last = None;
    }

    async fn find_all(&mut self) -> Result<(), LogError> {
        self.chip.identify().await?;
        let found = self.find_superblock()?;
        let saved_in = self.superblock.boot;
        if found != Found::Sure {
            // A newer save may say otherwise.
            self.superblock.block_before = 0;
            self.superblock.rail = Rail::default();
            self.superblock.site = site::Told::default();
        }
        let head = match found {
            Found::Sure => match self.search_head()? {
                Some(head) => Some(head),
                None if self.superblock.first_block <= LOG_START => None,
                None => self.scan(true).await?,
            },
            found => self.scan(found == Found::Doubtful).await?,
        };
        if let Some(head) = head {
            self.next_block = head.saturating_add(1);
            // Which boot is the newest only a sure superblock tells.
            self.newest_block = Some(match found {
                Found::Sure => self.find_newest_block(head)?,
                _ => head,
            });
            let told = self.find_newest(head, found)?;
            // A save that is left may be an older one; what was recorded since tells the mode better.
            if let Some((_, flight, recording)) = told.filter(|(key, ..)| found != Found::Sure && key.boot >= saved_in)
            {
                (self.superblock.flight, self.superblock.recording) = (flight, recording);
            }
        }
        // Counted from the highest number in a save or a record, so that no key is used twice.
        if found == Found::Doubtful || found == Found::Nothing && head.is_some() {
            self.superblock.boot = self.superblock.boot.saturating_add(UNSEEN_BOOTS);
        }
        Ok(())
    }

    /// The block where the newest boot left its last records, or, if it left none, the one before: not always the last
    /// block, because two may take turns ([`super::carry`]).
    fn find_newest_block(&mut self, head: u16) -> Result<u16, LogError> {
        let boot = self.superblock.boot as u16;
        for block in [head, self.superblock.first_block] {
            if self.is_of_the_log(block) && self.boot_of(block)? == Some(boot) {
                return Ok(block);
            }
        }
        let before = self.superblock.block_before;
        let is_there = self.is_of_the_log(before) && self.is_live(before)?;
        Ok(if is_there { before } else { head })
    }

    /// Reads the superblock's blocks.
    pub(super) fn find_superblock(&mut self) -> Result<Found, LogError> {
        let mut found = Found::Nothing;
        let mut copies = 0_u8;
        let mut torn = [false; LOG_START as usize];
        for block in 0..LOG_START.min(self.chip.blocks()) {
            for page in 0..PAGES_PER_BLOCK {
                let at = PageAddress { block, page };
                self.chip.read(at, &mut self.back)?;
                if page::is_blank(&self.back) {
                    break;
                }
                let ours = matches!(page::stamp(page::spare(&self.back), at),
                    Stamp::Ours(tag) if tag.kind == PageKind::Superblock);
                let whole = self.corrected();
                let mut readable = false;
                for (half, whole) in whole.into_iter().enumerate() {
                    if !whole {
                        continue;
                    }
                    match superblock::decode(page::record(&self.back, half)) {
                        Ok(superblock) => {
                            readable = true;
                            if found == Found::Nothing || superblock.number > self.superblock.number {
                                self.superblock = superblock;
                                self.home = (block, None);
                                found = Found::Doubtful;
                                copies = 0;
                            }
                        }
                        Err(SuperblockError::Newer(version)) => return Err(LogError::Newer(version)),
                        Err(SuperblockError::Damaged) => {}
                    }
                    if readable {
                        break;
                    }
                }
                copies = copies.wrapping_add((readable && self.home.0 == block).into());
                if let Some(torn) = torn.get_mut(usize::from(block)) {
                    *torn |= !(readable && ours);
                }
            }
        }
        // What a retired block holds is no news.
        let torn = (0..)
            .zip(torn)
            .any(|(block, torn)| torn && !self.superblock.bad.contains(block));
        Ok(match found {
            Found::Doubtful if copies >= 2 && !torn => Found::Sure,
            found => found,
        })
    }

    /// The last live block, sought among those of the newest boot.
    pub(super) fn search_head(&mut self) -> Result<Option<u16>, LogError> {
        let begun = [self.superblock.first_block, self.superblock.block_before];
        let [other, first] = [begun.iter().min(), begun.iter().max()].map(|block| *block.unwrap_or(&0));
        let first = first.max(LOG_START);
        let end = self.chip.blocks();
        let Some(mut low) = self.good(first..end)? else {
            return Ok(None);
        };
        if !self.is_live(low)? {
            if self.is_of_the_log(other) && self.is_live(other)? {
                return Ok(Some(other));
            }
            for block in (LOG_START.max(first.saturating_sub(LOOK_BACK))..first).rev() {
                if !self.superblock.bad.contains(block) && self.is_live(block)? {
                    return Ok(Some(block));
                }
            }
            return Ok(None);
        }
        let (mut high, mut step) = (end, 1);
        // Twice as far each time, until a block is not live; then halfway between.
        while let Some(from) = low.checked_add(step) {
            let Some(block) = self.good(from..end)? else { break };
            if !self.is_live(block)? {
                high = block;
                break;
            }
            low = block;
            step = step.saturating_mul(2);
        }
        while high.saturating_sub(low) > 1 {
            let middle = low.midpoint(high);
            match self.good(middle..high)? {
                Some(block) if self.is_live(block)? => low = block,
                _ => high = middle,
            }
        }
        Ok(Some(low))
    }

    /// The first of these blocks that is not known to be bad.
    fn good(&mut self, blocks: core::ops::Range<u16>) -> Result<Option<u16>, LogError> {
        for block in blocks {
            // Where some are not remembered, the maker's mark tells.
            let is_bad = self.superblock.bad.contains(block)
                || self.superblock.bad.is_full() && (self.stamp(block, 0)?.1 || self.stamp(block, 1)?.1);
            if !is_bad {
                return Ok(Some(block));
            }
        }
        Ok(None)
    }

    /// Looks at every block; the last one of the newest epoch. Without a superblock it makes a new one of what it finds.
    pub(super) async fn scan(&mut self, superblock: bool) -> Result<Option<u16>, LogError> {
        let mut newest: Option<(u16, u16)> = None;
        let (mut foreign, mut usable) = (false, false);
        for block in 0..self.chip.blocks() {
            if block % STRIDE == 0 {
                yield_now().await;
            }
            if self.superblock.bad.contains(block) {
                continue;
            }
            let (mut stamp, marked) = self.stamp(block, 0)?;
            if marked && !superblock {
                self.remember_bad(block);
                continue;
            }
            if block < LOG_START {
                continue;
            }
            usable = true;
            if stamp == Stamp::Garbage {
                stamp = self.stamp(block, 1)?.0;
                foreign |= stamp == Stamp::Garbage;
            }
            if let Stamp::Ours(tag) = stamp
                && tag.kind == PageKind::Log
                && newest.is_none_or(|newest| newest <= (tag.epoch, block))
            {
                newest = Some((tag.epoch, block));
            }
        }
        if !usable {
            return Err(LogError::Worn);
        }
        let newest = newest.filter(|(epoch, _)| *epoch >= self.superblock.epoch);
        if let Some((epoch, _)) = newest {
            self.superblock.epoch = epoch;
        } else if !superblock {
            if foreign {
                return Err(LogError::Foreign);
            }
            self.read_second_marks().await?;
        }
        Ok(newest.map(|(_, block)| block))
    }

    /// The factory marks in second pages, of a chip that was never used.
    async fn read_second_marks(&mut self) -> Result<(), LogError> {
        for block in 0..self.chip.blocks() {
            if block % STRIDE == 0 {
                yield_now().await;
            }
            if self.stamp(block, 1)?.1 {
                self.remember_bad(block);
            }
        }
        Ok(())
    }

    /// The two newest packet records, which the next boot copies: the newest may be torn, and then the one before has
    /// one copy left. From the last block backwards, until a block gives both by itself and not as such copies, which
    /// may be torn too. Out: what the newest record says of the mode.
    pub(super) fn find_newest(&mut self, head: u16, found: Found) -> Result<Option<Told>, LogError> {
        let mut newest = [record::Key::default(); 2];
        let mut told = None;
        // Two blocks may take turns, and which of them is newer need not be known.
        let turns = [self.superblock.first_block, self.superblock.block_before];
        for block in turns {
            if self.is_of_the_log(block) {
                self.find_newest_in(block, &mut newest, &mut told)?;
            }
        }
        // Where the superblock is not sure of those two, the newer one is not the last, nor always the one before it.
        let least = match found {
            Found::Sure => turns.len(),
            _ => usize::from(LOOK_BACK),
        };
        let mut looked_at = 0_usize;
        for block in (head.saturating_sub(LOOK_BACK).max(LOG_START)..=head).rev() {
            if self.superblock.bad.contains(block) {
                continue;
            }
            looked_at = looked_at.wrapping_add(1);
            if self.find_newest_in(block, &mut newest, &mut told)? && looked_at >= least {
                break;
            }
        }
        if self.carried > 0 {
            let (_, time_us) = record::mode_and_time(&self.last);
            self.status.last = Some((newest[0], time_us));
        }
        Ok(told)
    }

    /// Whether this block gave two by itself.
    fn find_newest_in(
        &mut self,
        block: u16,
        newest: &mut [record::Key; 2],
        told: &mut Option<Told>,
    ) -> Result<bool, LogError> {
        let (mut first_here, mut two_here) = (None, false);
        for page in (0..PAGES_PER_BLOCK).rev() {
            let at = PageAddress { block, page };
            if self.stamp(block, page)?.0 == Stamp::Blank {
                continue;
            }
            self.chip.read(at, &mut self.back)?;
            for (half, key) in [0, 1].into_iter().zip(self.whole_records()) {
                let Some(key) = key else { continue };
                self.superblock.boot = self.superblock.boot.max(key.boot);
                let bytes = page::record(&self.back, half);
                if let Some((flight, recording)) = record::mode(bytes)
                    && told.is_none_or(|(before, ..)| before < key)
                {
                    *told = Some((key, flight, recording));
                }
                if !record::is_packet(bytes) {
                    continue;
                }
                two_here |= *first_here.get_or_insert(key) != key;
                if self.carried == 0 || key > newest[0] {
                    (self.second, self.last) = (self.last, *bytes);
                    *newest = [key, newest[0]];
                    self.carried = if self.carried == 0 { 1 } else { 2 };
                } else if key < newest[0] && (self.carried == 1 || key > newest[1]) {
                    self.second = *bytes;
                    newest[1] = key;
                    self.carried = 2;
                }
            }
            if two_here && page >= COPIES_OF_OLDER {
                return Ok(true);
            }
        }
        Ok(false)
    }
}
