//! The stacks: one for the program, one for handlers, and how deep the program's has grown.
//!
//! After a reset both are one. A program that runs off its stack then faults, and so does the handler of that fault when its
//! frame is pushed: the processor locks up, and nobody ever knows why. So the program goes on with the process stack
//! pointer, and handlers have the CCM's first 4 KiB: they nest no deeper than an interrupt, a fault in it and the crash record.
//!
//! Start-up paints the stack (cortex-m-rt, feature `paint-stack`) between `_stack_end` and `_stack_start`, which
//! memory.x sets; the lowest word without paint is as deep as it went. A stack that outgrows its place runs off the start
//! of SRAM and faults (memory.x), which leaves a crash record (crash.rs); this tells long before.

use cortex_m_rt::STACK_PAINT_VALUE;
use emems::board::StackUse;

unsafe extern "C" {
    static _stack_start: u32;
    static _stack_end: u32;
    static _handlers_stack_start: u32;
}

/// Gives handlers a stack of their own. To be called once, before any interrupt is enabled.
pub fn part() {
    // SAFETY: the program's stack pointer keeps its value, so nothing on its stack moves, and no handler runs meanwhile. The
    // handlers' new stack is memory that the linker gives to nobody (memory.x).
    unsafe {
        core::arch::asm!(
            "mrs {of_program}, msp",
            "msr psp, {of_program}",
            "mrs {control}, control",
            // CONTROL.SPSEL: the program uses the process stack pointer (ARMv7-M ARM, B1.4.4).
            "orr {control}, {control}, #2",
            "msr control, {control}",
            "isb",
            "msr msp, {of_handlers}",
            of_program = out(reg) _,
            control = out(reg) _,
            of_handlers = in(reg) &raw const _handlers_stack_start,
            options(nostack, preserves_flags),
        );
    }
}

/// Whether so many bytes at `at` are on the program's stack or on the handlers'.
pub fn is_on_a_stack(at: usize, bytes: usize) -> bool {
    let (end, start) = (&raw const _stack_end as usize, &raw const _stack_start as usize);
    let of_handlers = &raw const _handlers_stack_start as usize;
    let (first, after) = (at, at.saturating_add(bytes));
    first >= end && after <= start || first >= CCM && after <= of_handlers
}

/// Where the CCM begins (RM0090 section 2.3).
const CCM: usize = 0x1000_0000;

/// The stack's high-water mark: a word with the paint's value that was really used is missed.
pub fn stack_use() -> StackUse {
    let (end, start) = (&raw const _stack_end, &raw const _stack_start);
    // SAFETY: the words from `_stack_end` up to `_stack_start` are SRAM, which the linker keeps for the stack alone. Only
    // those below the stack pointer still bear paint, and nothing writes them while this runs but interrupts, which make a
    // word used. Volatile, because the compiler knows nothing of them.
    let painted = |word: &*const u32| unsafe { word.read_volatile() } == STACK_PAINT_VALUE;
    let words = (start as usize).saturating_sub(end as usize) / size_of::<u32>();
    let unused = (0..words)
        .map(|index| end.wrapping_add(index))
        .take_while(painted)
        .count();
    StackUse {
        used: words.saturating_sub(unused) * size_of::<u32>(),
        size: words * size_of::<u32>(),
    }
}
