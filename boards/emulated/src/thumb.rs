//! As much of the Thumb instructions as it takes to make an image go wrong on purpose.
//!
//! In: an ELF file. Out: where it calls a function with an address, and the branch that leads there (ARMv7-M ARM, A7.7.12 and A7.7.18).

use object::{Object, ObjectSection, ObjectSymbol, SectionKind};

/// `MOVW` and `MOVT` of r0, which make the first argument (A7.7.76 and A7.7.79): first halves without the immediate.
const MOVES: [u16; 2] = [0xF240, 0xF2C0];

/// Whether these halves move an immediate into r0 so.
fn moves(kind: u16, [first, second]: [u16; 2]) -> bool {
    first & 0xFBF0 == kind && second & 0x8F00 == 0
}

/// The address of the two instructions that put an address into r0, after which the function whose mangled name contains `callee`
/// is called.
pub fn call_with_place(elf: &[u8], callee: &str) -> Option<u64> {
    let file = object::File::parse(elf).ok()?;
    let named = file
        .symbols()
        .filter(|symbol| symbol.name().is_ok_and(|name| name.contains(callee)));
    let callees: Vec<u64> = named.map(|symbol| symbol.address() & !1).collect();
    let code = file.sections().filter(|section| section.kind() == SectionKind::Text);
    for section in code {
        let bytes = section.data().ok()?;
        let halves: Vec<u16> = bytes
            .chunks_exact(2)
            .map(|half| u16::from_le_bytes([half[0], half[1]]))
            .collect();
        for (at, window) in halves.windows(6).enumerate() {
            let address = section.address() + 2 * at as u64;
            let is_made = moves(MOVES[0], [window[0], window[1]]) && moves(MOVES[1], [window[2], window[3]]);
            let calls = call(address + 8, [window[4], window[5]]).is_some_and(|to| callees.contains(&to));
            if is_made && calls {
                return Some(address);
            }
        }
    }
    None
}

/// Where the `BL` at `address` leads, if it is one.
fn call(address: u64, [first, second]: [u16; 2]) -> Option<u64> {
    let is_one = first >> 11 == 0b11110 && second & 0xD000 == 0xD000;
    let bit = |half: u16, at: u16| i64::from(half >> at & 1);
    let sign = bit(first, 10);
    let exchanged = |j: i64| 1 - (j ^ sign);
    let offset = -sign << 24
        | exchanged(bit(second, 13)) << 23
        | exchanged(bit(second, 11)) << 22
        | i64::from(first & 0x3FF) << 12
        | i64::from(second & 0x7FF) << 1;
    is_one.then(|| address.checked_add_signed(4 + offset))?
}

/// `B.W` at `from` to `to`, as a word of the image.
pub fn branch(from: u64, to: u64) -> u32 {
    let offset = to.wrapping_sub(from + 4);
    let bit = |at: u64| (offset >> at & 1) as u32;
    let sign = bit(24);
    let exchanged = |i: u32| 1 - (i ^ sign);
    let first = 0xF000 | sign << 10 | (offset >> 12 & 0x3FF) as u32;
    let second = 0x9000 | exchanged(bit(23)) << 13 | exchanged(bit(22)) << 11 | (offset >> 1 & 0x7FF) as u32;
    first | second << 16
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_branch_leads_where_a_call_with_the_same_offset_does() {
        for (from, to) in [
            (0x0800_1000, 0x0803_4560),
            (0x0803_4560, 0x0800_1000),
            (0x0800_0400, 0x0800_0404),
        ] {
            let word = branch(from, to);
            // Bit 14 of the second half makes a call of it.
            let halves = [word as u16, (word >> 16) as u16 | 0x4000];
            assert_eq!(call(from, halves), Some(to), "{word:08X}");
        }
        assert_eq!(call(0, [0x4801, 0xD000]), None);
    }
}
