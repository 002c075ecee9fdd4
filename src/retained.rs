//! What survives a reset: 8 KiB of memory, who has which part of it, and how a part is kept.
//!
//! In: what is to be kept, at most as long as its part has room. Out: what was kept last, or `None` after a power cut, or
//! where both copies are damaged. Every part stands twice, one copy behind the other, and the first is written first: a
//! reset that strikes in mid-write leaves one of them whole. A copy is
//!
//! | bytes | |
//! |---|---|
//! | 0-1 | length of the content |
//! | 2-3 | 0 |
//! | 4.. | the content |
//! | then 4 | CRC-32 (ISO-HDLC) of the part's address, the layout's number, the length and the content |
//!
//! The parts, by address: [`STATE`], [`STARTS`], [`PULSE`], [`CRASH`], [`ATTITUDE`], [`SET`], [`RAIL`], [`SITE`]. A firmware with another
//! layout has another number and finds nothing, as after a power cut.

use crc::Digest;

use crate::{board::Retained, checksum::CRC};

/// Bytes of the retained memory.
pub const RETAINED_BYTES: usize = 8192;

/// Number of this layout.
const LAYOUT: u8 = 1;

const HEAD: usize = 4;
const TAIL: usize = 4;
/// A length that no content has: nothing is kept.
const FORGOTTEN: u16 = u16::MAX;
/// Bytes moved at once.
const CHUNK: usize = 64;

/// A part of the retained memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Region {
    /// Where its first copy begins.
    at: usize,
    /// Bytes of a copy.
    room: usize,
}

/// What the unit was doing: [`crate::resume::Resume`].
pub const STATE: Region = Region { at: 0, room: 64 };
/// How often it started: [`crate::resume::Starts`].
pub const STARTS: Region = STATE.before(64);
/// When it was last alive: [`crate::resume::Pulse`].
pub const PULSE: Region = STARTS.before(64);
/// What ended the run before: [`crate::crash::CrashRecord`].
pub const CRASH: Region = PULSE.before(128);
/// The attitude filters: [`crate::estimate::Estimator::keep`].
pub const ATTITUDE: Region = CRASH.before(1536);
/// The calibration set in use: [`crate::calibration::Set::encode`]; empty for the one compiled in.
pub const SET: Region = ATTITUDE.before(1280);

/// The launch rail: [`crate::rail::Rail::bytes`].
pub const RAIL: Region = SET.before(16);

/// The launch site: [`crate::site::Told::bytes`].
pub const SITE: Region = RAIL.before(24);

const _: () = assert!(SITE.at + 2 * SITE.room <= RETAINED_BYTES);

impl Region {
    /// The part behind this one, with so many bytes a copy.
    const fn before(self, room: usize) -> Region {
        Region {
            at: self.at + 2 * self.room,
            room,
        }
    }

    /// Bytes of content that fit.
    pub const fn fits(&self) -> usize {
        self.room - HEAD - TAIL
    }

    /// Keeps `content`, as much of it as fits: both copies, one after the other.
    pub fn keep(&self, memory: &impl Retained, content: &[u8]) {
        let content = content.get(..self.fits()).unwrap_or(content);
        let mut head = [0; HEAD];
        head[..2].copy_from_slice(&(content.len() as u16).to_le_bytes());
        let mut digest = self.digest(&head);
        digest.update(content);
        let crc = digest.finalize().to_le_bytes();
        for at in self.copies() {
            let content_at = at.wrapping_add(HEAD);
            memory.write(at, &head);
            memory.write(content_at, content);
            memory.write(content_at.wrapping_add(content.len()), &crc);
        }
    }

    /// Keeps nothing any more.
    pub fn forget(&self, memory: &impl Retained) {
        for at in self.copies() {
            memory.write(at, &FORGOTTEN.to_le_bytes());
        }
    }

    /// What was kept, in `buffer`; `None` if nothing was, if neither copy is whole, or if it is longer than the buffer.
    pub fn recall<'b>(&self, memory: &impl Retained, buffer: &'b mut [u8]) -> Option<&'b [u8]> {
        let length = self
            .copies()
            .into_iter()
            .find_map(|at| self.whole(memory, at, buffer))?;
        buffer.get(..length)
    }

    /// Length of the copy at `at`, read into the buffer, if it is whole.
    fn whole(&self, memory: &impl Retained, at: usize, buffer: &mut [u8]) -> Option<usize> {
        let mut head = [0; HEAD];
        memory.read(at, &mut head);
        let length = usize::from(u16::from_le_bytes([head[0], head[1]]));
        if length > self.fits() {
            return None;
        }
        let content = buffer.get_mut(..length)?;
        let mut digest = self.digest(&head);
        let mut next_at = at.wrapping_add(HEAD);
        for chunk in content.chunks_mut(CHUNK) {
            memory.read(next_at, chunk);
            next_at = next_at.wrapping_add(chunk.len());
            digest.update(chunk);
        }
        let mut crc = [0; TAIL];
        memory.read(next_at, &mut crc);
        (crc == digest.finalize().to_le_bytes()).then_some(length)
    }

    fn digest(&self, head: &[u8; HEAD]) -> Digest<'static, u32> {
        let mut digest = CRC.digest();
        digest.update(&[LAYOUT, self.at as u8, (self.at >> 8) as u8]);
        digest.update(head);
        digest
    }

    fn copies(&self) -> [usize; 2] {
        [self.at, self.at.wrapping_add(self.room)]
    }
}

#[cfg(test)]
mod tests {
    extern crate std;

    use core::cell::{Cell, RefCell};
    use std::{vec, vec::Vec};

    use super::*;

    /// Memory whose writes end after so many bytes, as at a reset.
    struct Memory {
        bytes: RefCell<Vec<u8>>,
        writes: Cell<usize>,
    }

    impl Memory {
        fn after_power_on(fill: u8) -> Self {
            Memory {
                bytes: RefCell::new(vec![fill; RETAINED_BYTES]),
                writes: Cell::new(usize::MAX),
            }
        }
    }

    impl Retained for Memory {
        fn read(&self, at: usize, bytes: &mut [u8]) {
            bytes.copy_from_slice(&self.bytes.borrow()[at..at + bytes.len()]);
        }

        fn write(&self, at: usize, bytes: &[u8]) {
            let count = bytes.len().min(self.writes.get());
            self.bytes.borrow_mut()[at..at + count].copy_from_slice(&bytes[..count]);
            self.writes.set(self.writes.get() - count);
        }
    }

    const REGIONS: [Region; 8] = [STATE, STARTS, PULSE, CRASH, ATTITUDE, SET, RAIL, SITE];

    fn recalled(region: Region, memory: &Memory) -> Option<Vec<u8>> {
        let mut buffer = [0; 2048];
        region.recall(memory, &mut buffer).map(<[u8]>::to_vec)
    }

    #[test]
    fn every_part_keeps_what_it_was_given_beside_the_others() {
        let memory = Memory::after_power_on(0xA5);
        for (number, region) in REGIONS.into_iter().enumerate() {
            region.keep(&memory, &vec![number as u8; region.fits() - number]);
        }
        for (number, region) in REGIONS.into_iter().enumerate() {
            assert_eq!(
                recalled(region, &memory),
                Some(vec![number as u8; region.fits() - number])
            );
            region.forget(&memory);
            assert_eq!(recalled(region, &memory), None);
        }
        SET.keep(&memory, &[]);
        assert_eq!(recalled(SET, &memory), Some(vec![]), "nothing is content, too");
    }

    #[test]
    fn memory_after_power_on_holds_nothing() {
        for fill in [0, 0xFF, 0x5A] {
            let memory = Memory::after_power_on(fill);
            assert!(REGIONS.into_iter().all(|region| recalled(region, &memory).is_none()));
        }
    }

    #[test]
    fn a_reset_in_mid_write_leaves_the_old_content_or_the_new() {
        let (old, new) = (vec![0x11; 40], vec![0x22; 33]);
        let mut seen = [0; 2];
        for writes in 0..2 * (HEAD + new.len() + TAIL) + 1 {
            let memory = Memory::after_power_on(0);
            STATE.keep(&memory, &old);
            memory.writes.set(writes);
            STATE.keep(&memory, &new);
            let found = recalled(STATE, &memory).expect("one copy is whole");
            assert!(found == old || found == new, "{writes} bytes written");
            seen[usize::from(found == new)] += 1;
        }
        assert!(seen.iter().all(|count| *count > 30), "{seen:?}");
    }

    #[test]
    fn a_damaged_copy_is_passed_over_and_two_are_refused() {
        let content = [7; 20];
        for bit in 0..8 * (HEAD + content.len() + TAIL) {
            let memory = Memory::after_power_on(0);
            STATE.keep(&memory, &content);
            let [first, second] = STATE.copies();
            memory.bytes.borrow_mut()[first + bit / 8] ^= 1 << (bit % 8);
            assert_eq!(recalled(STATE, &memory), Some(content.to_vec()), "bit {bit}");
            memory.bytes.borrow_mut()[second + bit / 8] ^= 1 << (bit % 8);
            assert_eq!(recalled(STATE, &memory), None, "bit {bit} of both");
        }
    }

    #[test]
    fn the_content_of_one_part_is_not_that_of_another() {
        let memory = Memory::after_power_on(0);
        STATE.keep(&memory, &[1, 2, 3]);
        memory.bytes.borrow_mut().copy_within(..128, 128);
        assert_eq!(recalled(STARTS, &memory), None);
    }
}
