//! A NAND flash of the K9F1208 class: its cells, what befalls them, and the rules its data sheet sets.
//!
//! In: pages and blocks, through [`emems::nand::Nand`] or, latch cycle by latch cycle, through [`latch::K9f1208`]. Out:
//! what the cells hold then. An operation during which the power is cut tears in one of the ways of [`Tear`]; cells left
//! between two states read differently each time (UBI's "unstable bits"). Every break of a rule is kept
//! ([`Cells::breaks`]): a part would not complain, it would lose data months later.
//!
//! Same seed and same calls, same chip. Time is counted, not spent: [`Cells::time`].

mod befalls;
mod chip;
pub mod latch;
mod tear;

use emems::flight_log::{
    page::{self, PageKind, Tag},
    superblock::{self, Superblock},
};
use emems::nand::{BAD_MARK, MAIN_BYTES, PAGE_BYTES, PAGES_PER_BLOCK, PageAddress, PageBytes};
use rand_xoshiro::{
    Xoshiro256PlusPlus,
    rand_core::{Rng, SeedableRng},
};

pub use self::{
    befalls::{Befalls, Wear},
    tear::{TEARS, Tear},
};
use super::Nanos;

/// \[ns\] a latch cycle (tRC, tWC 50 ns, and what the FSMC adds).
pub const CYCLE: Nanos = 60;
/// \[ns\] page to register, tR at most.
pub const READ: Nanos = 15_000;
/// \[ns\] program, typical.
pub const PROGRAM: Nanos = 200_000;
/// \[ns\] erase, typical.
pub const ERASE: Nanos = 2_000_000;
/// Command and address cycles of an operation, status included.
const OVERHEAD_CYCLES: Nanos = 10;

const BLOCK_BYTES: usize = PAGE_BYTES * PAGES_PER_BLOCK as usize;

/// A rule of the chip that was broken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Break {
    /// A page was programmed a second time since its erase.
    ProgrammedTwice(PageAddress),
    /// A page was programmed after a higher one of its block.
    OutOfOrder(PageAddress),
    /// A page was programmed in a block that was not wholly erased, or torn since.
    NotErased(PageAddress),
    /// A block the maker marked was programmed or erased.
    MarkedBad(u16),
    /// The mark's column of a good block was programmed.
    MarkWritten(PageAddress),
    /// A program or erase was commanded sooner after WP# rose than tWW.
    WritableTooShort,
}

/// One block.
#[derive(Clone)]
struct Block {
    /// `None` while every cell reads one.
    bytes: Option<Box<[u8; BLOCK_BYTES]>>,
    /// Bits of the block that read differently each time.
    unstable: Vec<u32>,
    /// Pages programmed since the erase, a bit each.
    programmed: u32,
    /// The erase was complete, and nothing was torn since.
    sound: bool,
    reads: u32,
    operations: u32,
}

/// The cells of a chip.
#[derive(Clone)]
pub struct Cells {
    blocks: Vec<Block>,
    /// What befalls them.
    pub befalls: Befalls,
    /// Programs and erases begun.
    pub operations: u64,
    /// \[ns\] the chip was busy or being talked to.
    pub time: Nanos,
    /// Rules that were broken.
    pub breaks: Vec<Break>,
    /// Operations that a cut left neither undone nor done: what a campaign of cuts must have seen.
    pub torn: u64,
    /// Reads that found wrong bits.
    pub flipped: u64,
    /// Programs that went astray.
    pub strayed: u64,
    /// Blocks whose wear has struck, in the order of its first strikes.
    pub worn: Vec<u16>,
    /// The power is off: nothing answers.
    pub off: bool,
    random: Xoshiro256PlusPlus,
}

/// What a program or erase came to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// The status says that it worked.
    Done,
    /// The status says that it failed.
    Failed,
    /// The power went.
    Cut,
}

impl Cells {
    /// A chip as it comes from the maker, erased, with these blocks marked bad.
    pub fn new(blocks: u16, marked: &[u16], seed: u64) -> Self {
        let block = Block {
            bytes: None,
            unstable: Vec::new(),
            programmed: 0,
            sound: true,
            reads: 0,
            operations: 0,
        };
        let mut cells = Cells {
            blocks: vec![block; usize::from(blocks)],
            befalls: Befalls::default(),
            operations: 0,
            time: 0,
            breaks: Vec::new(),
            torn: 0,
            flipped: 0,
            strayed: 0,
            worn: Vec::new(),
            off: false,
            random: Xoshiro256PlusPlus::seed_from_u64(seed),
        };
        for block in marked {
            // In the first page or the second: both are legal.
            let at = PageAddress {
                block: *block,
                page: (block % 2) as u8,
            };
            cells.page_mut(at)[MAIN_BYTES + BAD_MARK] = 0;
        }
        cells.befalls.marked = marked.to_vec();
        cells
    }

    /// A chip with an empty log on it, as a unit leaves the bench.
    pub fn formatted(blocks: u16, seed: u64) -> Self {
        let mut cells = Cells::new(blocks, &[], seed);
        let bytes = superblock::encode(&Superblock {
            number: 1,
            ..Superblock::default()
        });
        let tag = Tag {
            kind: PageKind::Superblock,
            epoch: 0,
            boot: 0,
        };
        for page in 0..2 {
            let at = PageAddress { block: 0, page };
            page::compose(cells.page_mut(at), &bytes, &bytes);
            page::address(cells.page_mut(at), at, tag);
        }
        cells.blocks[0].programmed = 3;
        cells
    }

    /// A chip that holds these bytes, block after block; what is missing is erased.
    pub fn of_image(blocks: u16, image: &[u8], seed: u64) -> Self {
        let mut cells = Cells::new(blocks, &[], seed);
        for (block, bytes) in cells.blocks.iter_mut().zip(image.chunks(BLOCK_BYTES)) {
            let mut whole = Box::new([0xFF; BLOCK_BYTES]);
            whole[..bytes.len()].copy_from_slice(bytes);
            block.bytes = Some(whole);
            block.sound = false;
        }
        cells
    }

    /// The cells as an image, block after block.
    pub fn image(&self) -> Vec<u8> {
        let erased = [0xFF; BLOCK_BYTES];
        let bytes = self
            .blocks
            .iter()
            .map(|block| block.bytes.as_deref().unwrap_or(&erased));
        bytes.flatten().copied().collect()
    }

    /// How many blocks it has.
    pub fn block_count(&self) -> u16 {
        self.blocks.len() as u16
    }

    /// How often a block was read since its erase.
    pub fn reads_mut(&mut self, block: u16) -> &mut u32 {
        &mut self.blocks[usize::from(block)].reads
    }

    /// The power returns.
    pub fn power_on(&mut self) {
        self.off = false;
        self.befalls.cut = None;
    }

    /// Makes a page read as random bits, for good.
    pub fn destroy(&mut self, at: PageAddress) {
        let mut bytes = [0; PAGE_BYTES];
        self.random.fill_bytes(&mut bytes);
        // The mark of a good block is not what a failing page loses.
        bytes[MAIN_BYTES + BAD_MARK] = 0xFF;
        *self.page_mut(at) = bytes;
    }

    /// The page as the chip gives it.
    pub fn read(&mut self, at: PageAddress) -> PageBytes {
        self.time += READ + (PAGE_BYTES as Nanos + OVERHEAD_CYCLES) * CYCLE;
        self.page(at)
    }

    /// The time of reading a spare area only; its bytes are those of [`Cells::read`].
    pub fn read_spare(&mut self, at: PageAddress) -> PageBytes {
        self.time += READ + (16 + OVERHEAD_CYCLES) * CYCLE;
        self.page(at)
    }

    fn page(&mut self, at: PageAddress) -> PageBytes {
        let at = self.befalls.decoded(at);
        let from = usize::from(at.page) * PAGE_BYTES;
        let block = &mut self.blocks[usize::from(at.block)];
        block.reads = block.reads.saturating_add(1);
        let mut page = match &block.bytes {
            Some(bytes) => core::array::from_fn(|byte| bytes[from + byte]),
            None => [0xFF; PAGE_BYTES],
        };
        let bits = (from * 8) as u32..((from + PAGE_BYTES) * 8) as u32;
        for bit in block.unstable.iter().filter(|bit| bits.contains(bit)) {
            if self.random.next_u32() & 1 == 0 {
                let bit = (*bit - bits.start) as usize;
                page[bit / 8] ^= 1 << (bit % 8);
            }
        }
        let reads = block.reads;
        self.flipped += u64::from(self.befalls.flip(&mut page, at, reads, &mut self.random));
        page
    }

    /// Programs a page.
    pub fn program(&mut self, at: PageAddress, bytes: &PageBytes) -> Outcome {
        self.time += PROGRAM + (PAGE_BYTES as Nanos + OVERHEAD_CYCLES) * CYCLE;
        let tear = self.begin();
        let meant = self.befalls.decoded(at);
        let at = self.befalls.astray(self.operations, meant);
        self.strayed += u64::from(at != meant);
        self.keep_program_rules(at, bytes);
        let wear = self.wear(at.block, true);
        let block = &mut self.blocks[usize::from(at.block)];
        block.programmed |= 1 << at.page;
        if wear == Some(Wear::ProgramDoesNothing) {
            return Outcome::Done;
        }
        let failed = wear == Some(Wear::ProgramFails);
        let tear = tear.or(failed.then_some(Tear::Half));
        let from = usize::from(at.page) * PAGE_BYTES;
        let cells = block.bytes.get_or_insert_with(|| Box::new([0xFF; BLOCK_BYTES]));
        let page = &mut cells[from..from + PAGE_BYTES];
        match tear {
            None => page.iter_mut().zip(bytes).for_each(|(cell, byte)| *cell &= byte),
            Some(tear) => {
                let (before, unstable) = (page.to_vec(), block.unstable.len());
                tear.program(page, bytes, (from * 8) as u32, &mut block.unstable, &mut self.random);
                let done = before.iter().zip(bytes).map(|(cell, byte)| cell & byte);
                let is_between = *page != before[..] && !page.iter().copied().eq(done);
                self.torn += u64::from(!failed && (is_between || block.unstable.len() > unstable));
            }
        }
        self.end(at.block, tear.is_some() && !failed, failed)
    }

    /// Erases a block.
    pub fn erase(&mut self, block: u16) -> Outcome {
        self.time += ERASE + OVERHEAD_CYCLES * CYCLE;
        let tear = self.begin();
        let block = self.befalls.decoded(PageAddress { block, page: 0 }).block;
        if self.befalls.marked.contains(&block) {
            self.breaks.push(Break::MarkedBad(block));
        }
        let wear = self.wear(block, false);
        let cells = &mut self.blocks[usize::from(block)];
        (cells.programmed, cells.reads) = (0, 0);
        if wear == Some(Wear::EraseDoesNothing) {
            cells.sound = true;
            return Outcome::Done;
        }
        let failed = wear == Some(Wear::EraseFails);
        match tear.or(failed.then_some(Tear::Half)) {
            None => {
                (cells.bytes, cells.sound) = (None, true);
                cells.unstable.clear();
            }
            Some(tear) => {
                if let Some(bytes) = &mut cells.bytes {
                    let (before, unstable) = (bytes.clone(), cells.unstable.len());
                    tear.erase(&mut bytes[..], &mut cells.unstable, &mut self.random);
                    let is_between = *bytes != before && bytes.iter().any(|cell| *cell != 0xFF);
                    self.torn += u64::from(!failed && (is_between || cells.unstable.len() > unstable));
                }
            }
        }
        self.end(block, tear.is_some(), failed)
    }

    /// Counts an operation; how it tears, if the power goes during it.
    fn begin(&mut self) -> Option<Tear> {
        self.operations += 1;
        let cut = self.befalls.cut.filter(|(operation, _)| *operation == self.operations);
        cut.map(|(_, tear)| tear)
    }

    fn end(&mut self, block: u16, cut: bool, failed: bool) -> Outcome {
        if cut || failed {
            self.blocks[usize::from(block)].sound = false;
        }
        if cut {
            self.off = true;
            Outcome::Cut
        } else if failed {
            Outcome::Failed
        } else {
            Outcome::Done
        }
    }

    fn wear(&mut self, block: u16, program: bool) -> Option<Wear> {
        let count = &mut self.blocks[usize::from(block)].operations;
        *count += 1;
        let wear = self.befalls.wear(block, *count, program);
        if wear.is_some() && !self.worn.contains(&block) {
            self.worn.push(block);
        }
        wear
    }

    fn keep_program_rules(&mut self, at: PageAddress, bytes: &PageBytes) {
        let block = &self.blocks[usize::from(at.block)];
        let broken = if self.befalls.marked.contains(&at.block) {
            Some(Break::MarkedBad(at.block))
        } else if block.programmed >> at.page & 1 == 1 {
            Some(Break::ProgrammedTwice(at))
        } else if block.programmed >> at.page != 0 {
            Some(Break::OutOfOrder(at))
        } else if !block.sound {
            Some(Break::NotErased(at))
        } else if bytes[MAIN_BYTES + BAD_MARK] != 0xFF {
            Some(Break::MarkWritten(at))
        } else {
            None
        };
        self.breaks.extend(broken);
    }

    fn page_mut(&mut self, at: PageAddress) -> &mut PageBytes {
        let block = &mut self.blocks[usize::from(at.block)];
        let bytes = block.bytes.get_or_insert_with(|| Box::new([0xFF; BLOCK_BYTES]));
        &mut bytes.as_chunks_mut().0[usize::from(at.page)]
    }
}

#[cfg(test)]
mod tests;
