//! Panics and faults: a crash record in retained memory, then a reset. Nothing here halts.
//!
//! In: where the firmware was. Out: [`CrashRecord`], read at the next start. A panic is also logged, since its place
//! is text; a fault is not, because it may have struck inside the logger. A program that ran off its stack left no frame
//! to tell where it was: its record has the stack pointer instead.

use core::panic::PanicInfo;
use core::sync::atomic::{AtomicBool, Ordering};

use cortex_m::peripheral::SCB;
use cortex_m_rt::{ExceptionFrame, exception};
use defmt_rtt as _;
use embassy_time::Instant;
use emems::crash::{CrashCause, CrashRecord};

use super::{retained, stack};

/// Whether a crash is being dealt with. Another one on the way is not recorded: the first says what went wrong.
static CRASHING: AtomicBool = AtomicBool::new(false);

#[panic_handler]
fn panic(info: &PanicInfo) -> ! {
    cortex_m::interrupt::disable();
    let (line, file) = info.location().map_or((0, ""), |place| (place.line(), place.file()));
    if first() {
        keep(CrashCause::Panic, line, 0, file);
        defmt::error!("panicked at {=str}:{=u32}", file, line);
    }
    SCB::sys_reset()
}

// SAFETY: cortex-m-rt asks for `unsafe` because a fault handler may run inside a critical section. This one touches
// nothing but the crash record and never returns.
#[exception]
unsafe fn HardFault(frame: &ExceptionFrame) -> ! {
    let at = &raw const *frame as usize;
    if first() {
        // Pushing the frame below the stack failed as well, and reading it there would be a fault inside this one.
        if stack::is_on_a_stack(at, size_of::<ExceptionFrame>()) {
            keep(CrashCause::HardFault, frame.pc(), frame.lr(), "");
        } else {
            keep(CrashCause::StackOverflow, at as u32, 0, "");
        }
    }
    SCB::sys_reset()
}

// SAFETY: as for `HardFault`. `at` is the exception number: negative for the core's own, among them -14, the clock
// security system's NMI.
#[exception]
unsafe fn DefaultHandler(exception: i16) -> ! {
    if first() {
        keep(CrashCause::UnhandledException, exception as u32, 0, "");
    }
    SCB::sys_reset()
}

fn first() -> bool {
    !CRASHING.swap(true, Ordering::Relaxed)
}

fn keep(cause: CrashCause, at: u32, lr: u32, place: &str) {
    // SAFETY: a read without side effects of a register that always exists (ARMv7-M ARM, B3.2.15).
    let cfsr = unsafe { (*SCB::PTR).cfsr.read() };
    let uptime_us = Instant::now().as_micros();
    retained::keep_crash(&CrashRecord::new(cause, at, lr, cfsr, uptime_us, place));
}
