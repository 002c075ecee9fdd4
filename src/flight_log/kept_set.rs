//! The calibration set that is kept: in the last four blocks of the chip, two good ones in turn.
//!
//! In: the bytes of a set, or none to forget it. Out: the bytes kept last. Each keeping erases the block after the one with
//! the newest set and fills it: the pages of the set, and the same again. Both halves of a page hold the same piece. Cut
//! anywhere, the block before still holds the set before: the new one counts when each of its pieces is there, and the
//! highest number counts.
//!
//! | bytes of a piece | |
//! |---|---|
//! | 0-3 | `eMKS` |
//! | 4, 5 | version, which piece |
//! | 6-7 | bytes in all; 0: no set is kept |
//! | 8-11 | number of the keeping |
//! | 12-251 | 240 bytes, the last piece filled up with zeros |
//! | 252-255 | CRC-32 (ISO-HDLC) of bytes 0 to 251 |
//!
//! Neither an erase of the log nor its growth touches these blocks. Where an older firmware has let the log grow into all of them,
//! keeping is refused ([`LogError::Full`]) until the log is erased; reading goes on.

use super::{
    FlightLog, LogError,
    page::{self, PageKind},
    record::{RECORD_BYTES, RecordBytes},
};
use crate::{
    checksum::CRC,
    nand::{Nand, NandError, PAGES_PER_BLOCK, PageAddress},
};

/// Blocks at the end of the chip that the log leaves alone.
pub(super) const SET_BLOCKS: u16 = 4;

/// Bytes of the longest content.
pub const LONGEST: usize = PIECE * MOST_PIECES;

const MAGIC: [u8; 4] = *b"eMKS";
const VERSION: u8 = 1;
const HEAD: usize = 12;
const CHECKED: usize = RECORD_BYTES - 4;
const PIECE: usize = CHECKED - HEAD;
/// Twice these fit a block.
const MOST_PIECES: usize = 16;
const _: () = assert!(2 * MOST_PIECES <= PAGES_PER_BLOCK as usize);

/// What a piece says of itself.
#[derive(Clone, Copy, PartialEq, Eq)]
struct Piece {
    number: u32,
    length: usize,
    piece: u8,
}

fn encode(number: u32, piece: u8, content: &[u8]) -> RecordBytes {
    let mut bytes = [0; RECORD_BYTES];
    bytes[..4].copy_from_slice(&MAGIC);
    (bytes[4], bytes[5]) = (VERSION, piece);
    bytes[6..8].copy_from_slice(&(content.len() as u16).to_le_bytes());
    bytes[8..HEAD].copy_from_slice(&number.to_le_bytes());
    let part = content.chunks(PIECE).nth(usize::from(piece)).unwrap_or_default();
    bytes[HEAD..HEAD + part.len()].copy_from_slice(part);
    let crc = CRC.checksum(&bytes[..CHECKED]);
    bytes[CHECKED..].copy_from_slice(&crc.to_le_bytes());
    bytes
}

fn decode(bytes: &RecordBytes) -> Option<Piece> {
    let found = Piece {
        number: u32::from_le_bytes([bytes[8], bytes[9], bytes[10], bytes[11]]),
        length: usize::from(u16::from_le_bytes([bytes[6], bytes[7]])),
        piece: bytes[5],
    };
    let crc = CRC.checksum(&bytes[..CHECKED]).to_le_bytes();
    let whole = bytes[..4] == MAGIC && bytes[4] == VERSION && bytes[CHECKED..] == crc;
    (whole && found.piece < pieces(found.length) && found.length <= LONGEST).then_some(found)
}

/// Pieces of a content; one says that there is none.
fn pieces(length: usize) -> u8 {
    length.div_ceil(PIECE).max(1) as u8
}

impl<N: Nand> FlightLog<N> {
    /// The first block behind the log.
    pub(super) fn log_end(&self) -> u16 {
        self.chip.blocks().saturating_sub(SET_BLOCKS)
    }

    /// The set kept last, in `buffer`; empty if it was forgotten, `None` if none was ever kept.
    pub fn kept_set<'b>(&mut self, buffer: &'b mut [u8]) -> Result<Option<&'b [u8]>, LogError> {
        self.mounted()?;
        let found = self.newest_set(buffer)?;
        Ok(found.and_then(move |(_, newest)| buffer.get(..newest.length)))
    }

    /// Keeps a set; empty: none. `Ok` means it is durable.
    pub async fn keep_set(&mut self, content: &[u8], buffer: &mut [u8]) -> Result<(), LogError> {
        self.mounted()?;
        let outcome = self.try_keep_set(content, buffer).await;
        self.stop_if_unsure(&outcome);
        outcome
    }

    async fn try_keep_set(&mut self, content: &[u8], buffer: &mut [u8]) -> Result<(), LogError> {
        let newest = self.newest_set(buffer)?;
        let (before, number) = newest.map_or((self.log_end(), 0), |(block, piece)| (block, piece.number));
        let number = number.checked_add(1).ok_or(LogError::Worn)?;
        // From the block behind the newest one on, in turn.
        let behind = before.saturating_add(1)..self.chip.blocks();
        for block in behind.chain(self.log_end()..=before) {
            if newest.is_some_and(|(newest, _)| newest == block) || !self.may_hold_set(block)? {
                continue;
            }
            if self.erase(block).await? && self.fill_with_set(block, number, content).await? {
                return Ok(());
            }
        }
        Err(LogError::Full)
    }

    fn may_hold_set(&mut self, block: u16) -> Result<bool, LogError> {
        if self.superblock.bad.contains(block) || self.is_live(block)? {
            return Ok(false);
        }
        for page in 0..2 {
            if self.stamp(block, page)?.1 {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Whether all pages hold.
    async fn fill_with_set(&mut self, block: u16, number: u32, content: &[u8]) -> Result<bool, LogError> {
        let count = pieces(content.len());
        for page in 0..count.saturating_mul(2) {
            let at = PageAddress { block, page };
            let piece = page.checked_sub(count).unwrap_or(page);
            let bytes = encode(number, piece, content);
            page::compose(&mut self.page, &bytes, &bytes);
            let tag = self.tag(PageKind::Set);
            page::address(&mut self.page, at, tag);
            match self.program(at).await {
                Ok(true) => {}
                Ok(false) | Err(LogError::Nand(NandError::Failed)) => {
                    self.retire(block).await?;
                    return Ok(false);
                }
                Err(error) => return Err(error),
            }
        }
        Ok(true)
    }

    /// The block with the newest whole set, read into `buffer`.
    fn newest_set(&mut self, buffer: &mut [u8]) -> Result<Option<(u16, Piece)>, LogError> {
        let mut below = u32::MAX;
        // From the highest number down, until one is whole: as many as there are blocks.
        for _ in 0..SET_BLOCKS {
            let mut candidate: Option<(u16, Piece)> = None;
            for block in self.log_end()..self.chip.blocks() {
                let found = self.set_in(block)?;
                if let Some(found) = found.filter(|found| found.number < below)
                    && candidate.is_none_or(|(_, best)| best.number < found.number)
                {
                    candidate = Some((block, found));
                }
            }
            let Some((block, newest)) = candidate else {
                return Ok(None);
            };
            if self.read_set(block, newest, buffer)? {
                return Ok(Some((block, newest)));
            }
            below = newest.number;
        }
        Ok(None)
    }

    /// The set in a block, whole or not: of a block that was erased before there is one only.
    fn set_in(&mut self, block: u16) -> Result<Option<Piece>, LogError> {
        for page in 0..PAGES_PER_BLOCK {
            let at = PageAddress { block, page };
            self.chip.read(at, &mut self.back)?;
            if page::is_blank(&self.back) {
                break;
            }
            let found = self.piece_read();
            if found.is_some() {
                return Ok(found);
            }
        }
        Ok(None)
    }

    /// Reads a set's pieces from either copy; whether all are there.
    fn read_set(&mut self, block: u16, set: Piece, buffer: &mut [u8]) -> Result<bool, LogError> {
        let count = pieces(set.length);
        for piece in 0..count {
            let mut whole = false;
            for page in [piece, piece.saturating_add(count)] {
                let at = PageAddress { block, page };
                self.chip.read(at, &mut self.back)?;
                if self.piece_read() != Some(Piece { piece, ..set }) {
                    continue;
                }
                let from = usize::from(piece) * PIECE;
                let Some(part) = buffer.get_mut(from..set.length.min(from + PIECE)) else {
                    return Ok(false);
                };
                part.copy_from_slice(&page::record(&self.back, 0)[HEAD..HEAD + part.len()]);
                whole = true;
                break;
            }
            if !whole {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// The piece in the page that was read, put into its first half.
    fn piece_read(&mut self) -> Option<Piece> {
        let whole = page::correct(&mut self.back);
        let half = (0..2).find(|half| whole[*half].is_ok() && decode(page::record(&self.back, *half)).is_some())?;
        if half == 1 {
            self.back.copy_within(RECORD_BYTES..2 * RECORD_BYTES, 0);
        }
        decode(page::record(&self.back, 0))
    }
}

#[cfg(test)]
mod tests {
    use super::super::record::{BootHeader, Key, encode_header};
    use super::*;

    #[test]
    fn a_piece_says_what_it_was_given_and_no_wrong_bit_gets_through() {
        let content = [0x5A; 500];
        let bytes = encode(7, 2, &content);
        let found = decode(&bytes).expect("whole");
        assert!(
            found
                == Piece {
                    number: 7,
                    length: 500,
                    piece: 2
                }
        );
        assert_eq!(bytes[HEAD..HEAD + 20], content[480..]);
        assert!(decode(&encode(1, 0, &[])).is_some_and(|piece| piece.length == 0));
        assert!(decode(&encode(7, 3, &content)).is_none(), "500 bytes have three pieces");
        // Older firmware let the log grow into these blocks; its second record has the version's place and a checksum that fits.
        let key = Key {
            epoch: 0,
            boot: 1,
            seq: 1,
        };
        assert!(decode(&encode_header(key, &BootHeader::default())).is_none());
        for bit in 0..8 * RECORD_BYTES {
            let mut bytes = bytes;
            bytes[bit / 8] ^= 1 << (bit % 8);
            assert!(decode(&bytes).is_none(), "bit {bit}");
        }
    }
}
