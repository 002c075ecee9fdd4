//! The firmware's own image in flash: vectors, code, constants and the first content of its variables.
//!
//! In: a place in it. Out: the bytes there, and how many there are: none beyond its end.

unsafe extern "C" {
    static __vector_table: u8;
    static __sidata: u8;
    static __sdata: u8;
    static __edata: u8;
}

/// Reads a piece of the image.
pub fn read_image(at: usize, piece: &mut [u8]) -> usize {
    let first = &raw const __vector_table;
    let variables = (&raw const __edata as usize).saturating_sub(&raw const __sdata as usize);
    let bytes = (&raw const __sidata as usize)
        .saturating_add(variables)
        .saturating_sub(first as usize);
    let places = at..bytes.min(at.saturating_add(piece.len()));
    let count = places.len();
    for (place, byte) in places.zip(piece) {
        // SAFETY: the place is within what the linker has laid into flash, from the vectors to the end of what `.data` is copied
        // from. Volatile, because the compiler takes the flash for constant, and this looks whether it is.
        *byte = unsafe { first.add(place).read_volatile() };
    }
    count
}
