//! Blocks and pages of the log: which are free, erased, bad; and the superblock that remembers.

use super::{
    FlightLog, LOG_START, LogError,
    page::{self, PageKind, Stamp, Tag},
    record, superblock,
};
use crate::nand::{BAD_MARK, Nand, NandError, PAGES_PER_BLOCK, PageAddress, SPARE_BYTES};

/// Pages that hold one save of the superblock.
const COPIES: u8 = 2;

impl<N: Nand> FlightLog<N> {
    pub(super) fn tag(&self, kind: PageKind) -> Tag {
        Tag {
            kind,
            epoch: self.superblock.epoch,
            boot: self.superblock.boot as u16,
        }
    }

    /// What the spare area of a page says, and whether the maker marked it bad.
    pub(super) fn stamp(&mut self, block: u16, page: u8) -> Result<(Stamp, bool), LogError> {
        let at = PageAddress { block, page };
        let mut spare = [0xFF; SPARE_BYTES];
        self.chip.read_spare(at, &mut spare)?;
        let stamp = page::stamp(&spare, at);
        let mut marked = spare[BAD_MARK] != 0xFF;
        if marked {
            // Once more: a bit that reads wrong once must not cost a block.
            self.chip.read_spare(at, &mut spare)?;
            marked = spare[BAD_MARK] != 0xFF;
        }
        self.status.astray |= matches!(stamp, Stamp::Astray(tag, _) if tag.epoch == self.superblock.epoch);
        Ok((stamp, marked))
    }

    /// Whether a page carries records of the running epoch, its own or another's.
    pub(super) fn is_of_this_log(&self, stamp: Stamp) -> bool {
        let (Stamp::Ours(tag) | Stamp::Astray(tag, _)) = stamp else {
            return false;
        };
        tag.kind == PageKind::Log && tag.epoch == self.superblock.epoch
    }

    /// Whether there is such a block, and it is none of the superblock's.
    pub(super) fn is_of_the_log(&self, block: u16) -> bool {
        (LOG_START..self.log_end()).contains(&block)
    }

    /// Whether a block holds records of the running epoch; its second page speaks for a first one that is lost.
    pub(super) fn is_live(&mut self, block: u16) -> Result<bool, LogError> {
        for page in 0..2 {
            let (stamp, _) = self.stamp(block, page)?;
            if matches!(stamp, Stamp::Ours(_)) && self.is_of_this_log(stamp) {
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// The first block from `from` on that may be erased. A block that is live, or answers for one that is, may not,
    /// whatever mount made of it; nor one the maker marked.
    pub(super) fn free_block(&mut self, from: u16) -> Result<Option<u16>, LogError> {
        'blocks: for block in from.max(LOG_START)..self.log_end() {
            if self.superblock.bad.contains(block) {
                continue;
            }
            for page in 0..2 {
                let (stamp, marked) = self.stamp(block, page)?;
                if marked {
                    self.remember_bad(block);
                    continue 'blocks;
                }
                if self.is_of_this_log(stamp) {
                    continue 'blocks;
                }
            }
            return Ok(Some(block));
        }
        Ok(None)
    }

    /// The next free block, erased.
    pub(super) async fn erased_block(&mut self) -> Result<u16, LogError> {
        while let Some(block) = self.free_block(self.next_block)? {
            self.next_block = block.saturating_add(1);
            if self.erase(block).await? {
                return Ok(block);
            }
        }
        Err(LogError::Full)
    }

    /// Erases a block, or retires it; whether it was erased.
    pub(super) async fn erase(&mut self, block: u16) -> Result<bool, LogError> {
        match self.chip.erase(block).await {
            Ok(()) => Ok(true),
            Err(NandError::Failed) => self.retire(block).await.map(|()| false),
            Err(error) => Err(error.into()),
        }
    }

    /// Programs the composed page at `at` and reads it back; whether it holds.
    pub(super) async fn program(&mut self, at: PageAddress) -> Result<bool, LogError> {
        match self.chip.program(at, &self.page).await {
            Ok(()) => {}
            Err(NandError::Failed) => return Ok(false),
            Err(error) => return Err(error.into()),
        }
        self.chip.read(at, &mut self.back)?;
        if self.back == self.page {
            return Ok(true);
        }
        let stamp = page::stamp(page::spare(&self.back), at);
        let whole = self.corrected();
        let [first, second] = whole;
        let same = |half: usize| page::record(&self.back, half) == page::record(&self.page, half);
        Ok(matches!(stamp, Stamp::Ours(_)) && first && second && same(0) && same(1))
    }

    /// Corrects the page that was read; which halves are whole. Counts.
    pub(super) fn corrected(&mut self) -> [bool; 2] {
        page::correct(&mut self.back).map(|half| {
            match half {
                Ok(wrong) => self.status.corrected = self.status.corrected.saturating_add(wrong),
                Err(_) => self.status.uncorrectable = self.status.uncorrectable.saturating_add(1),
            }
            half.is_ok()
        })
    }

    /// The keys of the whole records of the running epoch in the page that was read, which is corrected.
    pub(super) fn whole_records(&mut self) -> [Option<record::Key>; 2] {
        if page::is_blank(&self.back) {
            return [None; 2];
        }
        let whole = self.corrected();
        let mut half = 0;
        whole.map(|whole| {
            let key = record::key(page::record(&self.back, half)).ok();
            half = 1;
            key.filter(|key| whole && key.epoch == self.superblock.epoch)
        })
    }

    pub(super) fn page_number(&self, number: u32) -> Option<PageAddress> {
        let per_block = u32::from(PAGES_PER_BLOCK);
        let block = u16::try_from(number / per_block).ok()?.checked_add(LOG_START)?;
        (block < self.chip.blocks()).then_some(PageAddress {
            block,
            page: (number % per_block) as u8,
        })
    }

    /// Never uses a block again.
    pub(super) fn retire(&mut self, block: u16) -> impl Future<Output = Result<(), LogError>> {
        self.remember_bad(block);
        self.save()
    }

    /// A bad block beyond those that can be remembered costs a look at it in each start, and no record: the maker's mark is
    /// read before an erase, and a block that fails is left for the next one.
    pub(super) fn remember_bad(&mut self, block: u16) {
        let _ = self.superblock.bad.insert(block);
    }

    /// Saves the superblock: two pages in a block that was erased since this start and is not the one with the save
    /// before. Leaves the composed page alone.
    pub(super) async fn save(&mut self) -> Result<(), LogError> {
        // Each of the blocks fails once, and the home perhaps with room in it.
        for _ in 0..=LOG_START {
            self.superblock.number = self.superblock.number.saturating_add(1);
            let (block, page) = match self.home {
                (block, Some(page)) if page <= PAGES_PER_BLOCK - COPIES => (block, page),
                (block, _) => {
                    let next = self.next_home(block).ok_or(LogError::Worn)?;
                    match self.chip.erase(next).await {
                        Ok(()) => {}
                        Err(NandError::Failed) => {
                            self.remember_bad(next);
                            continue;
                        }
                        Err(error) => return Err(error.into()),
                    }
                    (next, 0)
                }
            };
            let mut kept = true;
            for copy in 0..COPIES {
                kept = kept
                    && self
                        .put_superblock(PageAddress {
                            block,
                            page: page.wrapping_add(copy),
                        })
                        .await?;
            }
            if kept {
                self.home = (block, Some(page.wrapping_add(COPIES)));
                return Ok(());
            }
            self.remember_bad(block);
            // The home still has the save before, be it the one that failed; a block that was just erased has none.
            self.home.1 = None;
        }
        Err(LogError::Worn)
    }

    async fn put_superblock(&mut self, at: PageAddress) -> Result<bool, LogError> {
        let bytes = superblock::encode(&self.superblock);
        page::compose(&mut self.back, &bytes, &bytes);
        let tag = self.tag(PageKind::Superblock);
        page::address(&mut self.back, at, tag);
        match self.chip.program(at, &self.back).await {
            Ok(()) => {}
            Err(NandError::Failed) => return Ok(false),
            Err(error) => return Err(error.into()),
        }
        self.chip.read(at, &mut self.back)?;
        let whole = self.corrected();
        let same = |half: usize| *page::record(&self.back, half) == bytes;
        Ok(whole == [true; 2] && same(0) && same(1))
    }

    /// The next good block for the superblock after `block`, which keeps the save before.
    fn next_home(&self, block: u16) -> Option<u16> {
        (1..LOG_START)
            .map(|step| block.wrapping_add(step) % LOG_START)
            .find(|home| !self.superblock.bad.contains(*home))
    }
}
