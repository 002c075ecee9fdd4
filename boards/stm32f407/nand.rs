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
//! The supply is watched by the programmable voltage detector at 2.9 V (PLS 7), above the chip's 2.7 V (RM0090 section
//! 5.2.3). Its interrupt draws WP#, whatever is under way: below 2.7 V nobody says what an operation does, and a page that
//! was given up is one that the log knows how to do without. WP# is not lifted before the supply is back. Each such fall is counted.

use core::cell::Cell;
use core::sync::atomic::{AtomicU16, Ordering};

use embassy_stm32::Peri;
use embassy_stm32::gpio::{AfType, AnyPin, Flex, Level, Output, OutputType, Pull, Speed};
use embassy_stm32::interrupt::typelevel::{self, Handler, Interrupt};
use embassy_stm32::pac;
use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use emems::board::Supply;
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

/// EXTI line of the voltage detector's output (RM0090 section 12.2.5).
const DETECTOR: usize = 16;

/// WP#, which the driver and the voltage detector's interrupt share; none on a board without a chip.
static WRITE_PROTECT: Mutex<CriticalSectionRawMutex, Cell<Option<Output<'static>>>> = Mutex::new(Cell::new(None));

/// Draws WP#, or lifts it if the supply is good.
fn protect(on: bool) {
    WRITE_PROTECT.lock(|shared| {
        let mut pin = shared.take();
        if let Some(pin) = &mut pin {
            let level = if on || supply_fails() { Level::Low } else { Level::High };
            pin.set_level(level);
        }
        shared.set(pin);
    });
}

fn supply_fails() -> bool {
    pac::PWR.csr1().read().pvdo()
}

/// The voltage detector: the supply fell below [`THRESHOLD`].
pub struct SupplyInterrupt;

impl Handler<typelevel::PVD> for SupplyInterrupt {
    unsafe fn on_interrupt() {
        protect(true);
        DIPS.store(DIPS.load(Ordering::Relaxed).saturating_add(1), Ordering::Relaxed);
        pac::EXTI.pr(0).write(|w| w.set_line(DETECTOR, true));
    }
}

/// Interrupts of the voltage detector since the start. Only its handler writes it.
static DIPS: AtomicU16 = AtomicU16::new(0);

/// The voltage detector, at work.
pub struct VoltageDetector(());

impl VoltageDetector {
    /// Switches it on.
    pub fn new() -> Self {
        pac::RCC.apb1enr().modify(|w| w.set_pwren(true));
        pac::PWR.cr1().modify(|w| {
            w.set_pls(THRESHOLD);
            w.set_pvde(true);
        });
        // Its output rises when the supply falls (RM0090 section 5.2.3).
        pac::EXTI.rtsr(0).modify(|w| w.set_line(DETECTOR, true));
        pac::EXTI.imr(0).modify(|w| w.set_line(DETECTOR, true));
        // SAFETY: `Irqs` binds the handler, and what it needs is static.
        unsafe { typelevel::PVD::enable() };
        VoltageDetector(())
    }
}

impl Supply for VoltageDetector {
    fn dips(&self) -> u16 {
        DIPS.load(Ordering::Relaxed)
    }
}

/// The chip's wires, or none on a board without one.
pub struct NandPort {
    present: bool,
}

impl NandPort {
    /// The chip on the FSMC's pins: D0 to D7, NOE, NWE, NCE2, A16, A17; and WP#.
    pub fn new(pins: [Peri<'static, AnyPin>; 13], write_protect: Peri<'static, AnyPin>) -> Self {
        // Its edges take a fifth of tWW.
        let write_protect = Output::new(write_protect, Level::Low, Speed::Medium);
        WRITE_PROTECT.lock(|shared| shared.set(Some(write_protect)));
        pac::RCC.ahb3enr().modify(|w| w.set_fsmcen(true));
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
        NandPort { present: true }
    }

    /// A board without a chip: every answer is what a bus without one reads.
    #[allow(dead_code, reason = "each board uses one of the two")]
    pub fn absent() -> Self {
        NandPort { present: false }
    }

    fn put(&self, at: *mut u8, byte: u8) {
        if self.present {
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
        if !self.present {
            return bytes.fill(0xFF);
        }
        for byte in bytes {
            // SAFETY: as for `put`.
            *byte = unsafe { DATA.read_volatile() };
        }
    }

    fn protect(&mut self, on: bool) {
        protect(on);
    }

    fn power_good(&mut self) -> bool {
        !supply_fails()
    }
}
