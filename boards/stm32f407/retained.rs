//! What survives a reset: 256 bytes of SRAM that start-up leaves alone (memory.x), and the reset flags.
//!
//! In: the state to keep. Out: the state kept before the reset, or `None` after a power cut. The state is kept twice
//! and the two are written one after the other, so a reset that strikes in mid-write leaves one of them whole.

use core::cell::UnsafeCell;
use core::mem::MaybeUninit;

use embassy_stm32::pac::RCC;
use emems::board::{ResetCause, Retained};
use emems::crash::{CRASH_BYTES, CrashRecord};
use emems::resume::{RESUME_BYTES, Resume};

/// Bytes that start-up does not initialise.
struct Kept<const N: usize>(UnsafeCell<MaybeUninit<[u8; N]>>);

// SAFETY: the resume bytes are used by the one `ResetSafeRam` only. The crash bytes are written by handlers that never
// return, so nobody reads them in the same run.
unsafe impl<const N: usize> Sync for Kept<N> {}

impl<const N: usize> Kept<N> {
    const fn new() -> Self {
        Kept(UnsafeCell::new(MaybeUninit::uninit()))
    }

    fn read(&self) -> [u8; N] {
        let first = self.0.get().cast::<u8>();
        // SAFETY: these N bytes exist, every bit pattern is a byte, and a volatile read takes what is there whether or not
        // this run has written it. One by one, because a volatile read of them all is N loads and N stores of code.
        core::array::from_fn(|index| unsafe { first.add(index).read_volatile() })
    }

    fn write(&self, bytes: [u8; N]) {
        let first = self.0.get().cast::<u8>();
        for (index, byte) in bytes.into_iter().enumerate() {
            // SAFETY: as for `read`; volatile, because nothing in this run may ever read it back.
            unsafe { first.add(index).write_volatile(byte) }
        }
    }
}

#[unsafe(link_section = ".retained.resume")]
static RESUME: [Kept<RESUME_BYTES>; 2] = [Kept::new(), Kept::new()];

#[unsafe(link_section = ".retained.crash")]
static CRASH: Kept<CRASH_BYTES> = Kept::new();

/// The retained memory. There is one.
pub struct ResetSafeRam(());

impl ResetSafeRam {
    /// The retained memory; the first and only call is the board's.
    pub fn new() -> Self {
        ResetSafeRam(())
    }
}

impl Retained for ResetSafeRam {
    fn resume(&mut self) -> Option<Resume> {
        RESUME.iter().find_map(|kept| Resume::decode(&kept.read()))
    }

    fn keep(&mut self, resume: &Resume) {
        let bytes = resume.encode();
        RESUME.iter().for_each(|kept| kept.write(bytes));
    }

    fn take_crash(&mut self) -> Option<CrashRecord> {
        let crash = CrashRecord::decode(&CRASH.read());
        CRASH.write([0; CRASH_BYTES]);
        crash
    }
}

/// Leaves a crash record for the next start.
pub fn keep_crash(record: &CrashRecord) {
    CRASH.write(record.encode());
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
