//! The RAM as it is: what a value's bytes add up to, whoever wrote them.

use core::{arch::asm, ptr};

/// A checksum of a value's bytes on top of the one before: each word changes it one to one (a product with an odd number and a
/// rotation, as in xxHash32), so that a word which alone is another always shows.
pub fn sum<T>(value: &T, before: u32) -> u32 {
    of_words(
        ptr::from_ref(value).cast(),
        size_of::<T>() / 4,
        size_of::<T>() % 4,
        before,
    )
}

#[inline(never)]
fn of_words(first: *const u32, words: usize, bytes: usize, before: u32) -> u32 {
    let next = |sum: u32, word: u32| (sum ^ word).wrapping_mul(0x9E37_79B1).rotate_left(13);
    let sum = (0..words).fold(before, |sum, index| {
        let word: u32;
        // SAFETY: the word is within the value that `sum` has a reference to. Of the bytes between its fields the language knows no
        // content; an instruction that loads them finds some. A word need not be aligned (ARMv7-M ARM, A3.2.1).
        unsafe {
            asm!("ldr {word}, [{at}]", at = in(reg) first.wrapping_add(index), word = lateout(reg) word,
                options(nostack, readonly, preserves_flags));
        }
        next(sum, word)
    });
    let rest = first.wrapping_add(words).cast::<u8>();
    (0..bytes).fold(sum, |sum, index| {
        let byte: u32;
        // SAFETY: as above.
        unsafe {
            asm!("ldrb {byte}, [{at}]", at = in(reg) rest.wrapping_add(index), byte = lateout(reg) byte,
                options(nostack, readonly, preserves_flags));
        }
        next(sum, byte)
    })
}
