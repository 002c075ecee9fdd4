//! The Hamming code of NAND flash: one wrong bit in 256 bytes is corrected, two are noticed.
//!
//! In: half a page, and the three bytes kept beside it. Out: the bytes corrected, and how many bits that took. Line and
//! column parities over 2^11 bits, as in SmartMedia; arranged in bytes as Linux's `ecc-sw-hamming` arranges them (its
//! default order), so that a chip can be read on a bench under Linux. Parities are kept inverted: an erased half, all
//! ones, has the code FF FF FF, which is what erased cells hold. Refuses two wrong bits; more than two may look like one,
//! which is why every record has a CRC-32 as well.
//!
//! There is no use of the STM32F407's hardware code: this one costs some 20 us a page, and its bit order is known.

/// Bytes the code covers.
pub const HALF_BYTES: usize = 256;

/// The code of a half page.
pub type Code = [u8; 3];

/// More bits are wrong than the code can correct.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Uncorrectable;

/// The code of these bytes.
pub fn code(half: &[u8; HALF_BYTES]) -> Code {
    let mut column = 0_u8;
    // Exclusive-or of the indices of all bytes of odd parity: bit k is the parity of the lines whose index has bit k.
    let mut odd_lines = 0_u8;
    for (index, byte) in half.iter().enumerate() {
        column ^= byte;
        if odd(*byte) {
            odd_lines ^= index as u8;
        }
    }
    // A line parity and its complement add up to the parity of everything.
    let even_lines = if odd(column) { !odd_lines } else { odd_lines };
    let lines = interleave(odd_lines) << 1 | interleave(even_lines);
    let mut columns = 0;
    for mask in [0xF0, 0x0F, 0xCC, 0x33, 0xAA, 0x55] {
        columns = columns << 1 | u8::from(odd(column & mask));
    }
    [!(lines >> 8) as u8, !lines as u8, !(columns << 2)]
}

/// Puts right what can be put right; how many bits were wrong, the code's own included.
pub fn correct(half: &mut [u8; HALF_BYTES], stored: Code) -> Result<u32, Uncorrectable> {
    let computed = code(half);
    let ([a, b, c], [x, y, z]) = (stored, computed);
    let (first, second, third) = (a ^ x, b ^ y, c ^ z);
    // The lowest two bits of the third byte are no parities; they are written as ones and may flip unnoticed.
    let syndrome = u32::from(first) << 14 | u32::from(second) << 6 | u32::from(third >> 2);
    // One wrong bit changes exactly one of the two parities of each of the eleven pairs.
    const EVEN: u32 = 0x15_5555;
    match syndrome {
        0 => Ok(0),
        _ if (syndrome ^ syndrome >> 1) & EVEN == EVEN => {
            let place = deinterleave(syndrome >> 1);
            half[usize::from(place >> 3) % HALF_BYTES] ^= 1 << (place & 7);
            Ok(1)
        }
        _ if syndrome.is_power_of_two() => Ok(1),
        _ => Err(Uncorrectable),
    }
}

/// Whether an odd number of bits is set.
fn odd(byte: u8) -> bool {
    let folded = byte ^ byte >> 4;
    0x6996 >> (folded & 0xF) & 1 == 1
}

/// Bit k of the byte at bit 2k.
fn interleave(byte: u8) -> u16 {
    let mut spread = u16::from(byte);
    spread = (spread | spread << 4) & 0x0F0F;
    spread = (spread | spread << 2) & 0x3333;
    (spread | spread << 1) & 0x5555
}

/// Bit 2k of the word at bit k, eleven bits.
fn deinterleave(word: u32) -> u16 {
    (0..11).fold(0, |place, bit| place | ((word >> (2 * bit) & 1) as u16) << bit)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Bytes of the C standard's example generator.
    fn mixed() -> [u8; HALF_BYTES] {
        let mut state = 1_u32;
        core::array::from_fn(|_| {
            state = state.wrapping_mul(1_103_515_245).wrapping_add(12_345);
            (state >> 16) as u8
        })
    }

    fn with(fill: u8, at: usize, byte: u8) -> [u8; HALF_BYTES] {
        let mut half = [fill; HALF_BYTES];
        half[at] = byte;
        half
    }

    /// Computed bit by bit from the parity table in Linux's Documentation/driver-api/mtd/nand_ecc.rst, arranged as
    /// its `nand_calculate_ecc` does without CONFIG_MTD_NAND_ECC_SMC.
    #[test]
    fn codes_are_those_of_linux() {
        assert_eq!(code(&[0xFF; HALF_BYTES]), [0xFF, 0xFF, 0xFF]);
        assert_eq!(code(&[0x00; HALF_BYTES]), [0xFF, 0xFF, 0xFF]);
        assert_eq!(code(&with(0x00, 0, 0x01)), [0xAA, 0xAA, 0xAB]);
        assert_eq!(code(&with(0x00, 0xA5, 0x40)), [0x66, 0x99, 0x5B]);
        assert_eq!(code(&with(0xFF, 255, 0x7F)), [0x55, 0x55, 0x57]);
        assert_eq!(code(&mixed()), [0xC3, 0xFF, 0x03]);
    }

    #[test]
    fn every_single_wrong_bit_is_put_right() {
        let good = mixed();
        let stored = code(&good);
        for bit in 0..8 * HALF_BYTES {
            let mut half = good;
            half[bit / 8] ^= 1 << (bit % 8);
            assert_eq!(correct(&mut half, stored), Ok(1), "bit {bit}");
            assert_eq!(half, good, "bit {bit}");
        }
        for bit in 0..24 {
            let mut flipped = stored;
            flipped[bit / 8] ^= 1 << (bit % 8);
            let mut half = good;
            // Bits 16 and 17 of the code are no parities.
            assert_eq!(
                correct(&mut half, flipped),
                Ok(u32::from(bit / 2 != 8)),
                "code bit {bit}"
            );
            assert_eq!(half, good, "code bit {bit}");
        }
    }

    #[test]
    fn two_wrong_bits_are_noticed_wherever_they_are() {
        let good = mixed();
        let stored = code(&good);
        for first in 0..8 * HALF_BYTES {
            for second in [first + 1, first + 8, first + 1000, first + 2040].map(|bit| bit % (8 * HALF_BYTES)) {
                if first != second {
                    let mut half = good;
                    half[first / 8] ^= 1 << (first % 8);
                    half[second / 8] ^= 1 << (second % 8);
                    assert_eq!(
                        correct(&mut half, stored),
                        Err(Uncorrectable),
                        "bits {first} and {second}"
                    );
                }
            }
        }
    }
}
