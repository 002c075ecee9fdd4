//! The superblock: what must be known before the log is read.
//!
//! In: the [`Superblock`]. Out: 256 bytes, half a page, and back; both halves of a page and two pages in a row hold the
//! same. Little endian: `0-3` magic, `4` version, `5` flags (1 FLIGHT, 2 recording, 4 derived frames), `6-7` epoch, `8-11` its own number,
//! `12-15` boot, `16-17` first block of that boot, `18-19` how many bad blocks, `20-229` their numbers ascending,
//! `230-242` the launch site ([`site::Told::bytes`]), `244-245` the block with the newest records before that boot (0: none),
//! `246-251` the launch rail ([`Rail::bytes`]), `252-255` CRC-32. Site and rail are big endian, and zeros in saves of older firmware: none.
//! Refuses a checksum that does not fit and a newer version by its number.

use heapless::Vec;

use super::record::{RECORD_BYTES, RecordBytes};
use crate::{
    checksum::CRC,
    rail::{RAIL_BYTES, Rail},
    site::{self, told::SITE_BYTES},
};

/// Blocks kept for the superblock: two in use, two for when those wear out.
pub const LOG_START: u16 = 4;

/// The version this code writes and the newest it reads.
pub const VERSION: u8 = 1;

/// Bad blocks that fit: the data sheet allows 80 of 4096 over the chip's life. Of them places for the superblock's own
/// blocks are kept free, which nothing but this list tells to be bad.
pub const BAD_BLOCKS: usize = 105;

const MAGIC: [u8; 4] = *b"eMSB";
const CHECKED: usize = RECORD_BYTES - 4;
const LIST: usize = 20;
const BLOCK_BEFORE: usize = 244;
const RAIL: usize = 246;
const SITE: usize = LIST + 2 * BAD_BLOCKS;

const _: () = assert!(RAIL + RAIL_BYTES == CHECKED && SITE + SITE_BYTES <= BLOCK_BEFORE);

/// Blocks that are not used, ascending.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct BadBlocks(Vec<u16, BAD_BLOCKS>);

/// There is no room to remember another bad block: the chip is beyond its specified life.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TooManyBadBlocks;

impl BadBlocks {
    /// Whether `block` is bad.
    pub fn contains(&self, block: u16) -> bool {
        self.0.binary_search(&block).is_ok()
    }

    /// Remembers `block`.
    pub fn insert(&mut self, block: u16) -> Result<(), TooManyBadBlocks> {
        match self.0.binary_search(&block) {
            Ok(_) => Ok(()),
            Err(_) if block >= LOG_START && self.is_full() => Err(TooManyBadBlocks),
            Err(place) => self.0.insert(place, block).map_err(|_| TooManyBadBlocks),
        }
    }

    /// Whether no other block of the log can be remembered.
    pub fn is_full(&self) -> bool {
        self.0.len() >= BAD_BLOCKS.saturating_sub(LOG_START.into())
    }

    /// How many are in `blocks`.
    pub fn count(&self, blocks: core::ops::Range<u16>) -> u16 {
        let counted = self.0.iter().filter(|block| blocks.contains(block));
        counted.fold(0, |count: u16, _| count.wrapping_add(1))
    }

    /// Their numbers, ascending.
    pub fn as_slice(&self) -> &[u16] {
        &self.0
    }
}

/// What must be known before the log is read.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Superblock {
    /// Which save this is: the highest counts.
    pub number: u32,
    /// How often the log was erased: records of other epochs are not of this log.
    pub epoch: u16,
    /// The newest boot that wrote to the log; its number is not used again.
    pub boot: u32,
    /// Where that boot began.
    pub first_block: u16,
    /// The block with the newest records when it began; 0 for none.
    pub block_before: u16,
    /// The unit is in FLIGHT.
    pub flight: bool,
    /// Packets are being recorded.
    pub recording: bool,
    /// Derived frames are on.
    pub derived: bool,
    /// The launch rail.
    pub rail: Rail,
    /// The launch site.
    pub site: site::Told,
    /// Blocks that are not used.
    pub bad: BadBlocks,
}

/// Why bytes are not a superblock.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SuperblockError {
    /// Damaged, or something else.
    Damaged,
    /// Written by a newer firmware.
    Newer(u8),
}

/// Its 256 bytes.
pub fn encode(superblock: &Superblock) -> RecordBytes {
    let mut bytes = [0; RECORD_BYTES];
    let mut put = |at: usize, field: &[u8]| {
        let place = bytes.iter_mut().skip(at);
        place.zip(field).for_each(|(slot, byte)| *slot = *byte);
    };
    put(0, &MAGIC);
    put(
        4,
        &[
            VERSION,
            u8::from(superblock.flight) | u8::from(superblock.recording) << 1 | u8::from(superblock.derived) << 2,
        ],
    );
    put(6, &superblock.epoch.to_le_bytes());
    put(8, &superblock.number.to_le_bytes());
    put(12, &superblock.boot.to_le_bytes());
    put(16, &superblock.first_block.to_le_bytes());
    put(BLOCK_BEFORE, &superblock.block_before.to_le_bytes());
    put(RAIL, &superblock.rail.bytes());
    put(SITE, superblock.site.bytes());
    put(18, &(superblock.bad.0.len() as u16).to_le_bytes());
    let mut at = LIST;
    for block in &superblock.bad.0 {
        put(at, &block.to_le_bytes());
        at = at.wrapping_add(2);
    }
    let crc = CRC.checksum(&bytes[..CHECKED]);
    bytes[CHECKED..].copy_from_slice(&crc.to_le_bytes());
    bytes
}

/// The superblock in these bytes.
pub fn decode(bytes: &RecordBytes) -> Result<Superblock, SuperblockError> {
    if bytes[..4] != MAGIC || bytes[CHECKED..] != CRC.checksum(&bytes[..CHECKED]).to_le_bytes() {
        return Err(SuperblockError::Damaged);
    }
    if bytes[4] > VERSION {
        return Err(SuperblockError::Newer(bytes[4]));
    }
    let word = |at: usize| u16::from_le_bytes([bytes[at], bytes[at + 1]]);
    let long = |at: usize| u32::from(word(at)) | u32::from(word(at + 2)) << 16;
    let mut bad = BadBlocks::default();
    let count = usize::from(word(18));
    if count > BAD_BLOCKS {
        return Err(SuperblockError::Damaged);
    }
    for index in 0..count {
        let block = word(LIST + 2 * index);
        if let Err(place) = bad.0.binary_search(&block) {
            bad.0.insert(place, block).map_err(|_| SuperblockError::Damaged)?;
        }
    }
    Ok(Superblock {
        number: long(8),
        epoch: word(6),
        boot: long(12),
        first_block: word(16),
        block_before: word(BLOCK_BEFORE),
        flight: bytes[5] & 1 != 0,
        recording: bytes[5] & 2 != 0,
        derived: bytes[5] & 4 != 0,
        rail: Rail::of_bytes(bytes[RAIL..CHECKED].first_chunk().copied().unwrap_or_default()),
        site: site::Told::of_bytes(bytes[SITE..BLOCK_BEFORE].first_chunk().copied().unwrap_or_default()),
        bad,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn superblock() -> Superblock {
        let mut bad = BadBlocks::default();
        for block in [4000, 1, 77, 77] {
            bad.insert(block).expect("room");
        }
        Superblock {
            number: 0x0001_0002,
            epoch: 5,
            boot: 0x0003_0004,
            first_block: 99,
            block_before: 98,
            flight: true,
            recording: false,
            derived: true,
            rail: Rail::of_bytes([1, 2, 3, 4, 5, 6]),
            site: site::Told::of_bytes(core::array::from_fn(|place| place as u8 + 1)),
            bad,
        }
    }

    #[test]
    fn a_superblock_says_what_it_was_given() {
        assert_eq!(decode(&encode(&superblock())), Ok(superblock()));
        assert_eq!(superblock().bad.as_slice(), [1, 77, 4000]);
    }

    #[test]
    fn a_full_list_of_bad_blocks_is_kept_and_refuses_another_of_the_log() {
        let mut full = superblock();
        full.bad = BadBlocks(Vec::from_iter(LOG_START..BAD_BLOCKS as u16));
        assert_eq!(full.bad.insert(500), Err(TooManyBadBlocks));
        assert_eq!(decode(&encode(&full)), Ok(full.clone()));
        for home in 0..LOG_START {
            assert_eq!(full.bad.insert(home), Ok(()));
        }
        assert_eq!(full.bad.as_slice().len(), BAD_BLOCKS);
        assert_eq!(decode(&encode(&full)), Ok(full));
    }

    #[test]
    fn every_one_bit_error_is_refused() {
        for bit in 0..8 * RECORD_BYTES {
            let mut bytes = encode(&superblock());
            bytes[bit / 8] ^= 1 << (bit % 8);
            assert!(decode(&bytes).is_err(), "bit {bit}");
        }
    }

    #[test]
    fn a_newer_version_is_named() {
        let mut bytes = encode(&superblock());
        bytes[4] = 9;
        let crc = CRC.checksum(&bytes[..CHECKED]);
        bytes[CHECKED..].copy_from_slice(&crc.to_le_bytes());
        assert_eq!(decode(&bytes), Err(SuperblockError::Newer(9)));
    }
}
