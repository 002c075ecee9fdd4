//! What survives a reset: 8 KiB of SRAM that start-up leaves alone (memory.x), and the reset flags.
//!
//! In: bytes to keep. Out: the bytes kept before the reset, or anything after a power cut: [`emems::retained`] tells.

use core::cell::UnsafeCell;
use core::mem::MaybeUninit;

use embassy_stm32::pac::RCC;
use emems::board::{ResetCause, Retained};
use emems::crash::CrashRecord;
use emems::retained::RETAINED_BYTES;

/// Bytes that start-up does not initialise.
struct Kept(UnsafeCell<MaybeUninit<[u8; RETAINED_BYTES]>>);

// SAFETY: the bytes are read and written by the one `ResetSafeRam`, and by crash handlers that never return, so that nobody
// sees in the same run what they wrote. One access is one byte.
unsafe impl Sync for Kept {}

#[unsafe(link_section = ".retained")]
static KEPT: Kept = Kept(UnsafeCell::new(MaybeUninit::uninit()));

/// The retained memory. There is one.
pub struct ResetSafeRam(());

impl ResetSafeRam {
    /// The retained memory; the first and only call is the board's.
    pub fn new() -> Self {
        ResetSafeRam(())
    }
}

impl Retained for ResetSafeRam {
    fn read(&self, at: usize, bytes: &mut [u8]) {
        let first = KEPT.0.get().cast::<u8>();
        for (index, byte) in (at..RETAINED_BYTES).zip(bytes) {
            // SAFETY: the index is below the length, every bit pattern is a byte, and a volatile read takes what is there
            // whether or not this run has written it.
            *byte = unsafe { first.add(index).read_volatile() };
        }
    }

    fn write(&self, at: usize, bytes: &[u8]) {
        let first = KEPT.0.get().cast::<u8>();
        for (index, byte) in (at..RETAINED_BYTES).zip(bytes) {
            // SAFETY: as for `read`; volatile, because nothing in this run may ever read it back.
            unsafe { first.add(index).write_volatile(*byte) }
        }
    }
}

/// Leaves a crash record for the next start.
pub fn keep_crash(record: &CrashRecord) {
    // It never returns to who holds the other one.
    record.keep(&ResetSafeRam(()));
}

/// Why the chip started (RM0090 section 7.3.21); clears the flags, which add up otherwise.
pub fn reset_cause() -> ResetCause {
    let flags = RCC.csr().read();
    RCC.csr().modify(|w| w.set_rmvf(true));
    // Every reset also pulls the pin, and a power-on also counts as brown-out: from the particular to the general.
    if flags.wdgrstf() || flags.wwdgrstf() {
        ResetCause::Watchdog
    } else if flags.sftrstf() {
        ResetCause::Software
    } else if flags.porrstf() || flags.borrstf() || !flags.padrstf() {
        ResetCause::PowerOn
    } else {
        ResetCause::Pin
    }
}
