//! The driver of a K9F1208-class NAND: latch cycles on an 8-bit bus to pages and blocks.
//!
//! In: what [`Nand`] asks. Out: command, address and data cycles on a [`NandBus`]. The parts are Samsung's K9F1208U0M
//! (maker EC, device 76) and its equal NAND512W3A2 (20 76): 4096 blocks of 32 pages of 512 + 16 bytes, four address
//! cycles (column, then the row in three bytes), pointer commands 00h for the main area and 50h for the spare area.
//!
//! | | typical | at most | limit here |
//! |---|---|---|---|
//! | page to its register, tR | | 15 us | 1000 status reads |
//! | program, tPROG | 200 us | 500 us | 5 ms |
//! | erase, tBERS | 2 ms | 3 ms | 10 ms |
//!
//! (K9F1208U0M data sheet, AC characteristics.) A read is waited for in place: it is over before a sleep would be. The
//! others are slept for. Refuses another identity, a part that stays busy, and to begin anything once the supply fails;
//! write protection is lifted for the duration of a program or erase only.

use embedded_hal_async::delay::DelayNs;

use super::{K9F1208_BLOCKS, MAIN_BYTES, Nand, NandError, PAGES_PER_BLOCK, PageAddress, PageBytes, SpareBytes};

/// The wires to the chip, one latch cycle a byte.
pub trait NandBus {
    /// A byte with CLE high.
    fn command(&mut self, byte: u8);
    /// A byte with ALE high.
    fn address(&mut self, byte: u8);
    /// Data towards the chip.
    fn write(&mut self, bytes: &[u8]);
    /// Data from the chip.
    fn read(&mut self, bytes: &mut [u8]);
    /// WP#: `true` protects.
    fn protect(&mut self, on: bool);
    /// Whether the supply still carries a whole program or erase.
    fn power_good(&mut self) -> bool;
}

/// Command bytes, named as in the data sheet.
mod command {
    pub const READ_MAIN: u8 = 0x00;
    pub const READ_SPARE: u8 = 0x50;
    pub const READ_ID: u8 = 0x90;
    pub const RESET: u8 = 0xFF;
    pub const PROGRAM: u8 = 0x80;
    pub const PROGRAM_CONFIRM: u8 = 0x10;
    pub const ERASE: u8 = 0x60;
    pub const ERASE_CONFIRM: u8 = 0xD0;
    pub const READ_STATUS: u8 = 0x70;
}

/// Status bit: the last program or erase failed.
const FAIL: u8 = 1 << 0;
/// Status bit: ready.
const READY: u8 = 1 << 6;

/// Identities that this driver knows: maker, device.
const KNOWN: [[u8; 2]; 2] = [[0xEC, 0x76], [0x20, 0x76]];

/// Status reads that are waited for in place: each takes two latch cycles of some 60 ns, and tR is 15 us.
const READ_POLLS: u32 = 1000;
/// [us] limit of a program; twice the data sheet's would do, a chip at the end of its life takes longer.
const PROGRAM_LIMIT_US: u32 = 5_000;
/// [us] limit of an erase.
const ERASE_LIMIT_US: u32 = 10_000;
/// [us] what a program or erase takes at least, and then between two looks.
const PROGRAM_SLEEP_US: u32 = 200;
const ERASE_SLEEP_US: u32 = 500;

/// A chip on a bus.
pub struct K9f1208<B, D> {
    bus: B,
    delay: D,
}

impl<B: NandBus, D: DelayNs> K9f1208<B, D> {
    /// The chip on this bus; nothing is sent to it before [`Nand::identify`].
    pub fn new(bus: B, delay: D) -> Self {
        K9f1208 { bus, delay }
    }

    fn row(&mut self, row: u32) {
        for byte in row.to_le_bytes().iter().take(3) {
            self.bus.address(*byte);
        }
    }

    fn status(&mut self) -> u8 {
        self.bus.command(command::READ_STATUS);
        let mut status = [0];
        self.bus.read(&mut status);
        status[0]
    }

    /// Waits in place until a page is in the chip's register, and turns its output back from status to data.
    fn page_is_ready(&mut self, pointer: u8) -> Result<(), NandError> {
        for _ in 0..READ_POLLS {
            if self.status() & READY != 0 {
                self.bus.command(pointer);
                return Ok(());
            }
        }
        Err(NandError::Timeout)
    }

    /// Sleeps until a program or erase is over.
    async fn done(&mut self, sleep_us: u32, limit_us: u32) -> Result<(), NandError> {
        for _ in 0..limit_us / sleep_us {
            self.delay.delay_us(sleep_us).await;
            let status = self.status();
            if status & READY != 0 {
                return if status & FAIL == 0 {
                    Ok(())
                } else {
                    Err(NandError::Failed)
                };
            }
        }
        Err(NandError::Timeout)
    }

    fn may_change(&mut self) -> Result<(), NandError> {
        if !self.bus.power_good() {
            return Err(NandError::PowerFailing);
        }
        self.bus.protect(false);
        Ok(())
    }
}

impl<B: NandBus, D: DelayNs> Nand for K9f1208<B, D> {
    fn blocks(&self) -> u16 {
        K9F1208_BLOCKS
    }

    async fn identify(&mut self) -> Result<(), NandError> {
        self.bus.protect(true);
        self.bus.command(command::RESET);
        // An interrupted erase takes up to 500 us to be given up (tRST).
        self.delay.delay_us(PROGRAM_SLEEP_US).await;
        self.bus.command(command::READ_ID);
        self.bus.address(0);
        let mut id = [0; 2];
        self.bus.read(&mut id);
        if !KNOWN.contains(&id) {
            return Err(NandError::WrongId(id));
        }
        self.done(PROGRAM_SLEEP_US, PROGRAM_LIMIT_US)
            .await
            .or_else(|error| match error {
                // What an operation before the reset came to is of no interest.
                NandError::Failed => Ok(()),
                error => Err(error),
            })
    }

    async fn read(&mut self, at: PageAddress, bytes: &mut PageBytes) -> Result<(), NandError> {
        self.bus.command(command::READ_MAIN);
        self.bus.address(0);
        self.row(at.row());
        self.page_is_ready(command::READ_MAIN)?;
        self.bus.read(bytes);
        Ok(())
    }

    async fn read_spare(&mut self, at: PageAddress, bytes: &mut SpareBytes) -> Result<(), NandError> {
        self.bus.command(command::READ_SPARE);
        self.bus.address(0);
        self.row(at.row());
        self.page_is_ready(command::READ_SPARE)?;
        self.bus.read(bytes);
        Ok(())
    }

    async fn program(&mut self, at: PageAddress, bytes: &PageBytes) -> Result<(), NandError> {
        self.may_change()?;
        self.bus.command(command::READ_MAIN);
        self.bus.command(command::PROGRAM);
        self.bus.address(0);
        self.row(at.row());
        self.bus.write(bytes);
        self.bus.command(command::PROGRAM_CONFIRM);
        let done = self.done(PROGRAM_SLEEP_US, PROGRAM_LIMIT_US).await;
        self.bus.protect(true);
        done
    }

    async fn erase(&mut self, block: u16) -> Result<(), NandError> {
        self.may_change()?;
        self.bus.command(command::ERASE);
        self.row(u32::from(block) * u32::from(PAGES_PER_BLOCK));
        self.bus.command(command::ERASE_CONFIRM);
        let done = self.done(ERASE_SLEEP_US, ERASE_LIMIT_US).await;
        self.bus.protect(true);
        done
    }
}

const _: () = assert!(
    MAIN_BYTES == 512,
    "the column of a page is one byte, its half chosen by the pointer command"
);
