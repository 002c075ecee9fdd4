//! A small-block NAND flash as the flight log sees it: pages read, pages programmed, blocks erased.
//!
//! In: addresses and page bytes. Out: page bytes, or why not. The trait has two implementations: the driver of the
//! K9F1208 class ([`k9f1208`]) and, on a host, a model that tears, flips and dies. [`ecc`] corrects what a page lost.
//!
//! What the chip asks of whoever uses it (K9F1208U0M data sheet): a page's main area is programmed once between erases,
//! pages of a block in ascending order, only after an erase that was not interrupted, and a block that carries the
//! maker's bad mark is neither programmed nor erased. The log keeps these rules; the model counts breaks of them.

pub mod ecc;
pub mod k9f1208;

use core::fmt;

/// Bytes of a page's main area.
pub const MAIN_BYTES: usize = 512;

/// Bytes of a page's spare area.
pub const SPARE_BYTES: usize = 16;

/// Bytes of a whole page: main area, then spare area.
pub const PAGE_BYTES: usize = MAIN_BYTES + SPARE_BYTES;

/// Pages of a block.
pub const PAGES_PER_BLOCK: u8 = 32;

/// Blocks of a K9F1208.
pub const K9F1208_BLOCKS: u16 = 4096;

/// Where in the spare area the maker marks a bad block: column 517 of its first or second page, anything but FFh.
pub const BAD_MARK: usize = 517 - MAIN_BYTES;

/// A page as it is on the chip.
pub type PageBytes = [u8; PAGE_BYTES];

/// A page's spare area.
pub type SpareBytes = [u8; SPARE_BYTES];

/// Which page.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
pub struct PageAddress {
    /// Block, from 0.
    pub block: u16,
    /// Page in the block, 0 to 31.
    pub page: u8,
}

impl PageAddress {
    /// Page number from the start of the chip: the row address of the data sheet.
    pub fn row(self) -> u32 {
        (u32::from(self.block) * u32::from(PAGES_PER_BLOCK)).wrapping_add(self.page.into())
    }
}

/// Why the chip did not do what it was asked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
pub enum NandError {
    /// Another part, or none, answers: maker and device code.
    WrongId([u8; 2]),
    /// It stayed busy beyond its limit.
    Timeout,
    /// Its status says that the program or erase failed: the block is worn out.
    Failed,
    /// The supply is failing: nothing was begun, or what was under way was given up.
    PowerFailing,
    /// Its status says that it is write-protected while its WP# is lifted: nothing was begun.
    Protected,
}

impl fmt::Display for NandError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            NandError::WrongId([maker, device]) => {
                write!(
                    f,
                    "no K9F1208 answers: identity {maker:02X} {device:02X}, not EC 76 or 20 76"
                )
            }
            NandError::Timeout => f.write_str("the NAND stays busy"),
            NandError::Failed => f.write_str("the NAND reports a failed program or erase"),
            NandError::PowerFailing => f.write_str("the supply is failing"),
            NandError::Protected => f.write_str("the NAND stays write-protected: look at its WP# wire"),
        }
    }
}

impl core::error::Error for NandError {}

/// The chip. Every method is bounded in time.
#[allow(async_fn_in_trait)]
pub trait Nand {
    /// How many blocks it has.
    fn blocks(&self) -> u16;
    /// Resets it and asks who it is.
    async fn identify(&mut self) -> Result<(), NandError>;
    /// Reads a page as it is, wrong bits included.
    /// Waited for in place: it is over before a sleep would be.
    fn read(&mut self, at: PageAddress, bytes: &mut PageBytes) -> Result<(), NandError>;
    /// Reads a page's spare area as it is.
    fn read_spare(&mut self, at: PageAddress, bytes: &mut SpareBytes) -> Result<(), NandError>;
    /// Programs a page. `Ok` says that the chip reports success, not that the bytes are there.
    async fn program(&mut self, at: PageAddress, bytes: &PageBytes) -> Result<(), NandError>;
    /// Erases a block.
    async fn erase(&mut self, block: u16) -> Result<(), NandError>;
}

/// A chip that lives elsewhere.
impl<N: Nand> Nand for &mut N {
    fn blocks(&self) -> u16 {
        N::blocks(self)
    }

    async fn identify(&mut self) -> Result<(), NandError> {
        N::identify(self).await
    }

    fn read(&mut self, at: PageAddress, bytes: &mut PageBytes) -> Result<(), NandError> {
        N::read(self, at, bytes)
    }

    fn read_spare(&mut self, at: PageAddress, bytes: &mut SpareBytes) -> Result<(), NandError> {
        N::read_spare(self, at, bytes)
    }

    async fn program(&mut self, at: PageAddress, bytes: &PageBytes) -> Result<(), NandError> {
        N::program(self, at, bytes).await
    }

    async fn erase(&mut self, block: u16) -> Result<(), NandError> {
        N::erase(self, block).await
    }
}
