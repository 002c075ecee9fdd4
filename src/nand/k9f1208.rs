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
//! | reset, tRST | | 5 us; 500 us out of an erase | 5 ms |
//!
//! (K9F1208U0M data sheet, AC characteristics.) A read is waited for in place: it is over before a sleep would be. The
//! others are slept for. Refuses another identity, a part that stays busy, and to begin anything once the supply fails.
//!
//! Write protection is lifted for the duration of a program or erase only. Between WP# and the command stand 100 ns (tWW);
//! the status read in that time (two latch cycles, 226 ns) has to say that the part is writable. WP# may be drawn at any
//! time by who watches the supply: the part gives up what it was doing, its status says so, and that is no worn block.

use embedded_hal_async::delay::DelayNs;

use super::{K9F1208_BLOCKS, MAIN_BYTES, Nand, NandError, PageAddress, PageBytes, SpareBytes};

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
/// Status bit: WP# is high.
const WRITABLE: u8 = 1 << 7;

/// Identities that this driver knows: maker, device.
const KNOWN: [[u8; 2]; 2] = [[0xEC, 0x76], [0x20, 0x76]];

/// Status reads that are waited for in place: each takes two latch cycles of some 60 ns, and tR is 15 us.
const READ_POLLS: u32 = 1000;

/// How the end of an operation is waited for: so many looks, so far apart \[us\].
struct Wait {
    looks: u32,
    apart_us: u32,
}

/// 5 ms; twice the data sheet's would do, a chip at the end of its life takes longer.
const PROGRAM: Wait = Wait {
    looks: 25,
    apart_us: 200,
};
/// 10 ms.
const ERASE: Wait = Wait {
    looks: 20,
    apart_us: 500,
};
/// 5 ms: as long as whatever is given up.
const RESET: Wait = Wait {
    looks: 25,
    apart_us: 200,
};

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
        let [status] = status;
        status
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

    /// Sleeps until the part is ready; its status.
    async fn ready(&mut self, wait: Wait) -> Result<u8, NandError> {
        for _ in 0..wait.looks {
            self.delay.delay_us(wait.apart_us).await;
            let status = self.status();
            if status & READY != 0 {
                return Ok(status);
            }
        }
        Err(NandError::Timeout)
    }

    /// Sleeps until a program or erase is over, protects, and says what came of it.
    async fn done(&mut self, wait: Wait) -> Result<(), NandError> {
        let status = self.ready(wait).await;
        self.bus.protect(true);
        let status = status?;
        if status & WRITABLE == 0 || !self.bus.power_good() {
            // Given up half-way, or nobody knows: a block is not worn because the supply failed.
            return Err(NandError::PowerFailing);
        }
        if status & FAIL == 0 {
            Ok(())
        } else {
            Err(NandError::Failed)
        }
    }

    /// Lifts write protection while the supply is good.
    fn lift_protection(&mut self) -> Result<(), NandError> {
        if !self.bus.power_good() {
            return Err(NandError::PowerFailing);
        }
        self.bus.protect(false);
        if self.status() & WRITABLE != 0 {
            return Ok(());
        }
        self.bus.protect(true);
        Err(if self.bus.power_good() {
            NandError::Protected
        } else {
            NandError::PowerFailing
        })
    }
}

impl<B: NandBus, D: DelayNs> Nand for K9f1208<B, D> {
    fn blocks(&self) -> u16 {
        K9F1208_BLOCKS
    }

    async fn identify(&mut self) -> Result<(), NandError> {
        self.bus.protect(true);
        self.bus.command(command::RESET);
        // While it resets it takes no other command, and would be taken for another part.
        self.ready(RESET).await?;
        self.bus.command(command::READ_ID);
        self.bus.address(0);
        let mut id = [0; 2];
        self.bus.read(&mut id);
        if KNOWN.contains(&id) {
            Ok(())
        } else {
            Err(NandError::WrongId(id))
        }
    }

    fn read(&mut self, at: PageAddress, bytes: &mut PageBytes) -> Result<(), NandError> {
        self.bus.command(command::READ_MAIN);
        self.bus.address(0);
        self.row(at.row());
        self.page_is_ready(command::READ_MAIN)?;
        self.bus.read(bytes);
        Ok(())
    }

    fn read_spare(&mut self, at: PageAddress, bytes: &mut SpareBytes) -> Result<(), NandError> {
        self.bus.command(command::READ_SPARE);
        self.bus.address(0);
        self.row(at.row());
        self.page_is_ready(command::READ_SPARE)?;
        self.bus.read(bytes);
        Ok(())
    }

    async fn program(&mut self, at: PageAddress, bytes: &PageBytes) -> Result<(), NandError> {
        self.lift_protection()?;
        self.bus.command(command::READ_MAIN);
        self.bus.command(command::PROGRAM);
        self.bus.address(0);
        self.row(at.row());
        self.bus.write(bytes);
        self.bus.command(command::PROGRAM_CONFIRM);
        self.done(PROGRAM).await
    }

    async fn erase(&mut self, block: u16) -> Result<(), NandError> {
        self.lift_protection()?;
        self.bus.command(command::ERASE);
        self.row(PageAddress { block, page: 0 }.row());
        self.bus.command(command::ERASE_CONFIRM);
        self.done(ERASE).await
    }
}

const _: () = assert!(
    MAIN_BYTES == 512,
    "the column of a page is one byte, its half chosen by the pointer command"
);
