//! How deep the stack has grown.
//!
//! Start-up paints the stack (cortex-m-rt, feature `paint-stack`) between `_stack_end` and `_stack_start`, which
//! memory.x sets; the lowest word without paint is as deep as it went. A stack that outgrows its place runs off the start
//! of SRAM and faults (memory.x); this tells long before.

use cortex_m_rt::STACK_PAINT_VALUE;
use emems::board::StackUse;

unsafe extern "C" {
    static _stack_start: u32;
    static _stack_end: u32;
}

/// The stack's high-water mark: a word with the paint's value that was really used is missed.
pub fn stack_use() -> StackUse {
    let (end, start) = (&raw const _stack_end, &raw const _stack_start);
    // SAFETY: the words from `_stack_end` up to `_stack_start` are SRAM, which the linker keeps for the stack alone. Only
    // those below the stack pointer still bear paint, and nothing writes them while this runs but interrupts, which make a
    // word used. Volatile, because the compiler knows nothing of them.
    let painted = |word: &*const u32| unsafe { word.read_volatile() } == STACK_PAINT_VALUE;
    let words = (start as usize - end as usize) / size_of::<u32>();
    let unused = (0..words)
        .map(|index| end.wrapping_add(index))
        .take_while(painted)
        .count();
    StackUse {
        used: (words - unused) * size_of::<u32>(),
        size: words * size_of::<u32>(),
    }
}
