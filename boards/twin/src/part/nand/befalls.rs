//! What befalls a chip besides a cut: wear, flips, stuck address lines.

use emems::nand::{MAIN_BYTES, PAGES_PER_BLOCK, PageAddress, PageBytes};
use rand_xoshiro::{Xoshiro256PlusPlus, rand_core::Rng};

use super::Tear;

/// How a block is worn out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wear {
    /// Programs fail, and the status says so; half of the bits are there.
    ProgramFails,
    /// Erases fail, and the status says so.
    EraseFails,
    /// Programs change nothing, and the status says that they worked.
    ProgramDoesNothing,
    /// Erases change nothing, and the status says that they worked.
    EraseDoesNothing,
}

/// What befalls a chip.
#[derive(Clone, Debug, Default)]
pub struct Befalls {
    /// The power goes during this operation, counted from 1.
    pub cut: Option<(u64, Tear)>,
    /// Blocks the maker marked.
    pub marked: Vec<u16>,
    /// Blocks that wear out, and after how many of their programs and erases.
    pub worn: Vec<(u16, u32, Wear)>,
    /// Of a thousand reads of a page, how many find a wrong bit in each half (or its code) and in the rest of the spare.
    pub flips_per_thousand: u32,
    /// Reads of a block after which half of its pages have one cell each half that reads wrong until it is erased.
    pub disturbed_after: Option<u32>,
    /// This bit of the row address is stuck at zero.
    pub stuck_row_bit: Option<u32>,
    /// This program goes to the page so many blocks further on.
    pub astray: Option<(u64, u16)>,
    /// It is busy for ever.
    pub dead: bool,
    /// Nothing is soldered there.
    pub absent: bool,
}

/// Columns of the code of half 0, of half 1, and of what else the spare area holds but for the mark.
const CODES: [[usize; 3]; 2] = [[0, 1, 2], [6, 7, 8]];
const REST: [usize; 9] = [3, 4, 9, 10, 11, 12, 13, 14, 15];

impl Befalls {
    /// The page that answers for `at`.
    pub(super) fn decoded(&self, at: PageAddress) -> PageAddress {
        let Some(bit) = self.stuck_row_bit else {
            return at;
        };
        let row = at.row() & !(1 << bit);
        PageAddress {
            block: (row / u32::from(PAGES_PER_BLOCK)) as u16,
            page: (row % u32::from(PAGES_PER_BLOCK)) as u8,
        }
    }

    /// Where program number `operation`, meant for `at`, goes.
    pub(super) fn astray(&self, operation: u64, at: PageAddress) -> PageAddress {
        match self.astray {
            Some((which, further)) if which == operation => PageAddress {
                block: at.block + further,
                ..at
            },
            _ => at,
        }
    }

    pub(super) fn wear(&self, block: u16, operations: u32, program: bool) -> Option<Wear> {
        let (_, after, wear) = self.worn.iter().find(|(worn, ..)| *worn == block)?;
        let of_programs = matches!(wear, Wear::ProgramFails | Wear::ProgramDoesNothing);
        (operations > *after && of_programs == program).then_some(*wear)
    }

    /// Wrong bits of one read: fresh ones, and those that reading itself has caused.
    /// Whether there are any.
    pub(super) fn flip(
        &self,
        page: &mut PageBytes,
        at: PageAddress,
        reads: u32,
        random: &mut Xoshiro256PlusPlus,
    ) -> bool {
        let fresh = self.flips_per_thousand > 0 && random.next_u32() % 1000 < self.flips_per_thousand;
        if fresh {
            for (half, code) in CODES.into_iter().enumerate() {
                // Anywhere in the half or its code.
                let place = random.next_u32() as usize % (256 + code.len());
                let byte = match place {
                    0..256 => 256 * half + place,
                    _ => MAIN_BYTES + code[place - 256],
                };
                page[byte] ^= 1 << (random.next_u32() % 8);
            }
            page[MAIN_BYTES + REST[random.next_u32() as usize % REST.len()]] ^= 1 << (random.next_u32() % 8);
        }
        let disturbed = self.disturbed_after.is_some_and(|limit| reads > limit) && at.row().is_multiple_of(2);
        if disturbed {
            // The same cell at each read: which one follows from the row.
            let cell = at.row().wrapping_mul(2_654_435_761);
            for half in 0..2 {
                page[256 * half + (cell >> 24) as usize] ^= 1 << (cell >> 8 & 7);
            }
        }
        fresh || disturbed
    }
}
