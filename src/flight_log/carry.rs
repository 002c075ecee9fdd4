//! Short starts carried on: a start costs pages of the log and no block.
//!
//! In: the blocks that the mount found. Out: the [`Course`] of this start: the block it goes on from, whether it copies the
//! records of that in front of its own, and the block it begins in, where that is one with records.
//!
//! A block belongs to one boot, so each start would take one, and a unit that restarts every two seconds would fill the
//! log in two hours. So the newest block is carried on while it is short: the next start copies its records to where it
//! begins, and from then on the old block is superseded. The start after that begins there. Two blocks take turns until
//! one has more than [`SHORT`] pages.
//!
//! ```text
//! boot 7 in block 9:   header 7, records of 7
//! boot 8 in block 10:  header 7, records of 7, header 8, records of 8     block 9 is superseded
//! boot 9 in block 9:   header 7, records of 7, header 8, ... header 9     block 10 is superseded
//! ```
//!
//! The superblock names both blocks before either is erased. A block with records of the running epoch is erased here and
//! nowhere else, and only if each whole record in it was read from the other block in this start, in a page that stays:
//! not its last one, which a cut may have torn so that it reads well only now; and of the block where the boot began only
//! pages that bear this boot's number, since an erase that was cut leaves old ones that read well only now.
//! Anything else (a bad block, a doubtful superblock, a record in neither) ends the turns: both blocks stay, and the start
//! takes a new one.

use heapless::Vec;

use super::{
    FlightLog, LogError,
    page::{self, Stamp},
    record::Key,
};
use crate::nand::{Nand, PAGES_PER_BLOCK, PageAddress};

/// Pages of a block that is carried on: all but the page of the new header, one of a record and a few that a page read
/// twice may cost. Copying as many takes 10 ms.
const SHORT: u8 = PAGES_PER_BLOCK - 4;

/// Records of a block: one new one a page, and those before it where a page is lost.
type Keys = Vec<Key, { 2 * PAGES_PER_BLOCK as usize }>;

/// Where a start goes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Course {
    /// The block with the newest records: nothing in it is superseded before this start has copied it.
    pub from: Option<u16>,
    /// It is short, so its records are copied.
    pub copies: bool,
    /// The block to begin in: it may be erased. Without one it is the next free block.
    pub into: Option<u16>,
}

impl<N: Nand> FlightLog<N> {
    /// The course of this start.
    pub(super) fn course(&mut self) -> Result<Course, LogError> {
        let Some(newest) = self.newest_block else {
            return Ok(Course::default());
        };
        let (first, before) = (self.superblock.first_block, self.superblock.block_before);
        let take_turns = first != before
            && (newest == first || newest == before)
            && self.may_be_written(first)?
            && self.may_be_written(before)?;
        let (from, into) = if take_turns && newest == first && self.is_superseded(before, first)? {
            (newest, Some(before))
        } else if take_turns && self.is_only_begun(first, before)? {
            (before, Some(first))
        } else {
            (newest, None)
        };
        Ok(Course {
            from: Some(from),
            copies: self.used_pages(from)? <= SHORT,
            into,
        })
    }

    /// Whether it is a block of the log, neither failed nor marked by the maker.
    fn may_be_written(&mut self, block: u16) -> Result<bool, LogError> {
        Ok(self.is_of_the_log(block)
            && !self.superblock.bad.contains(block)
            && !self.stamp(block, 0)?.1
            && !self.stamp(block, 1)?.1)
    }

    /// Whether each whole record of `before` is also in `first`, where this boot copied it.
    fn is_superseded(&mut self, before: u16, first: u16) -> Result<bool, LogError> {
        let boot = self.superblock.boot as u16;
        let there = self.lasting_keys(first, |tag_boot| tag_boot == boot)?;
        self.all_records(before, |key| there.contains(&key))
    }

    /// Whether `first` holds nothing but copies out of `before`, or what an erase that was cut left, and headers of the boot
    /// that began there.
    pub(super) fn is_only_begun(&mut self, first: u16, before: u16) -> Result<bool, LogError> {
        let boot = self.superblock.boot;
        let there = self.lasting_keys(before, |_| true)?;
        self.all_records(first, |key| there.contains(&key) || (key.boot == boot && key.seq == 0))
    }

    /// Keys of the whole records in all pages of a block but its last, of the boots that count.
    fn lasting_keys(&mut self, block: u16, counts: impl Fn(u16) -> bool) -> Result<Keys, LogError> {
        let mut keys = Keys::new();
        for page in 0..self.used_pages(block)?.saturating_sub(1) {
            let (stamp, _) = self.stamp(block, page)?;
            if !matches!(stamp, Stamp::Ours(tag) if counts(tag.boot)) {
                continue;
            }
            self.chip.read(PageAddress { block, page }, &mut self.back)?;
            for key in self.whole_records().into_iter().flatten() {
                if keys.last() != Some(&key) {
                    // Full only on a chip that holds something else; then nothing is superseded.
                    let _ = keys.push(key);
                }
            }
        }
        Ok(keys)
    }

    /// Whether `fits` holds for each whole record of a block.
    fn all_records(&mut self, block: u16, fits: impl Fn(Key) -> bool) -> Result<bool, LogError> {
        for page in 0..PAGES_PER_BLOCK {
            self.chip.read(PageAddress { block, page }, &mut self.back)?;
            if !self.whole_records().into_iter().flatten().all(&fits) {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Pages of a block up to the last that is not blank.
    fn used_pages(&mut self, block: u16) -> Result<u8, LogError> {
        for page in (0..PAGES_PER_BLOCK).rev() {
            if self.stamp(block, page)?.0 != Stamp::Blank {
                return Ok(page.saturating_add(1));
            }
        }
        Ok(0)
    }

    /// Copies the whole records of a block, each as often as it stands there but for the repetition in the page after it;
    /// whether there were any.
    pub(super) async fn copy(&mut self, block: u16) -> Result<bool, LogError> {
        let mut copied = None;
        for page in 0..PAGES_PER_BLOCK {
            // The second half repeats the page before, where that one is whole: the older record first.
            for half in [1, 0] {
                self.chip.read(PageAddress { block, page }, &mut self.back)?;
                let key = self.whole_records().get(half).copied().flatten();
                if key.is_none() || key == copied {
                    continue;
                }
                let record = *page::record(&self.back, half);
                if copied.is_none() {
                    self.last = record;
                }
                copied = key;
                self.put_record(record).await?;
            }
        }
        Ok(copied.is_some())
    }

    /// The boot whose pages begin a block, lower half.
    pub(super) fn boot_of(&mut self, block: u16) -> Result<Option<u16>, LogError> {
        for page in 0..2 {
            let (stamp, _) = self.stamp(block, page)?;
            if let Stamp::Ours(tag) = stamp
                && self.is_of_this_log(stamp)
            {
                return Ok(Some(tag.boot));
            }
        }
        Ok(None)
    }
}
