//! The recorder's NAND on the FSMC's bank 2: latch cycles are bus accesses to 0x7000_0000.
//!
//! In: [`NandBus`] calls. Out: accesses, and WP#. Command latch is address line A16, address latch A17. Waiting is not
//! left to NWAIT: a chip that holds it would hold the processor. Timing for HCLK = 168 MHz (5.95 ns), against the
//! K9F1208U0M's least times; common and attribute space have the same, so either may be used:
//!
//! | | cycles | ns | data sheet |
//! |---|---|---|---|
//! | set-up (MEMSET + 1) | 5 | 29.8 | tCLS, tALS, tCS 0 |
//! | strobe (MEMWAIT + 1) | 8 | 47.6 | tWP 25, tRP 30, tREA 35 |
//! | hold (MEMHOLD) | 6 | 35.7 | tCLH, tALH, tDH 10, tWH, tREH 15 |
//! | hold and set-up between a command and its status | 11 | 65.5 | tWHR 60 |
//! | whole access | 19 | 113 | tWC, tRC 50, tWB 100 |
//! | data bus driven after (MEMHIZ) | 4 | 23.8 | tDS 20 is within the strobe |
//!
//! The supply is watched by the programmable voltage detector at 2.9 V (PLS 7), above the chip's 2.7 V: a program takes
//! 0.5 ms and an erase 3 ms, which the board's capacitors carry from there (RM0090 section 5.2.3).

use embassy_stm32::Peri;
use embassy_stm32::gpio::{AfType, AnyPin, Flex, Level, Output, OutputType, Pull, Speed};
use embassy_stm32::pac;
use emems::nand::k9f1208::NandBus;

/// The bank's common memory space (RM0090 section 36.4.2).
const DATA: *mut u8 = 0x7000_0000 as *mut u8;
/// CLE is A16.
const COMMAND: *mut u8 = 0x7001_0000 as *mut u8;
/// ALE is A17.
const ADDRESS: *mut u8 = 0x7002_0000 as *mut u8;

/// The FSMC's alternate function on all its pins.
const FSMC: u8 = 12;

/// Supply threshold of the voltage detector: 2.9 V.
const THRESHOLD: u8 = 7;

/// The chip's wires, or none on a board without one.
pub struct NandPort {
    write_protect: Option<Output<'static>>,
}

impl NandPort {
    /// The chip on the FSMC's pins: D0 to D7, NOE, NWE, NCE2, A16, A17; and WP#.
    pub fn new(pins: [Peri<'static, AnyPin>; 13], write_protect: Peri<'static, AnyPin>) -> Self {
        let write_protect = Output::new(write_protect, Level::Low, Speed::Low);
        pac::RCC.ahb3enr().modify(|w| w.set_fsmcen(true));
        pac::RCC.apb1enr().modify(|w| w.set_pwren(true));
        pac::PWR.cr1().modify(|w| {
            w.set_pls(THRESHOLD);
            w.set_pvde(true);
        });
        for pin in pins {
            let mut pin = Flex::new(pin);
            pin.set_as_af_unchecked(
                FSMC,
                AfType::output_pull(OutputType::PushPull, Speed::VeryHigh, Pull::Up),
            );
            // A dropped pin would be disconnected.
            core::mem::forget(pin);
        }
        pac::FSMC.pmem(0).write(|w| {
            w.set_memset(4);
            w.set_memwait(7);
            w.set_memhold(6);
            w.set_memhiz(4);
        });
        pac::FSMC.patt(0).write(|w| {
            w.set_attset(4);
            w.set_attwait(7);
            w.set_atthold(6);
            w.set_atthiz(4);
        });
        pac::FSMC.pcr(0).write(|w| {
            w.set_ptyp(pac::fsmc::vals::Ptyp::NANDFLASH);
            w.set_pbken(true);
        });
        NandPort {
            write_protect: Some(write_protect),
        }
    }

    /// A board without a chip: every answer is what a bus without one reads.
    #[allow(dead_code, reason = "each board uses one of the two")]
    pub fn absent() -> Self {
        NandPort { write_protect: None }
    }

    fn put(&self, at: *mut u8, byte: u8) {
        if self.write_protect.is_some() {
            // SAFETY: `new` has switched the bank on, whose space this is, and there is one port: the pins are gone.
            unsafe { at.write_volatile(byte) }
        }
    }
}

impl NandBus for NandPort {
    fn command(&mut self, byte: u8) {
        self.put(COMMAND, byte);
    }

    fn address(&mut self, byte: u8) {
        self.put(ADDRESS, byte);
    }

    fn write(&mut self, bytes: &[u8]) {
        bytes.iter().for_each(|byte| self.put(DATA, *byte));
    }

    fn read(&mut self, bytes: &mut [u8]) {
        if self.write_protect.is_none() {
            return bytes.fill(0xFF);
        }
        for byte in bytes {
            // SAFETY: as for `put`.
            *byte = unsafe { DATA.read_volatile() };
        }
    }

    fn protect(&mut self, on: bool) {
        if let Some(pin) = &mut self.write_protect {
            pin.set_level(if on { Level::Low } else { Level::High });
        }
    }

    fn power_good(&mut self) -> bool {
        !pac::PWR.csr1().read().pvdo()
    }
}
