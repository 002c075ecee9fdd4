//! A page of the log: two records, the code that corrects them, and a tag that says where the page belongs.
//!
//! In: the record to keep, the one before it, and the page's address. Out: 528 bytes, and back. The second half repeats
//! the record before: a page that is lost takes only the newest record with it, and each page is programmed once.
//!
//! | column | |
//! |---|---|
//! | 0-255 | half A: a record |
//! | 256-511 | half B: the record kept before it |
//! | 512-514, 518-520 | Hamming codes of A and B ([`ecc`]) |
//! | 515-516 | boot, lower half |
//! | 517 | FFh always: the bad mark |
//! | 521-522, 523-524 | epoch; block |
//! | 525-526 | CRC-16/CCITT-FALSE of kind, boot, epoch, block and the page in its block |
//! | 527 | format version, times sixteen, plus kind (1 log, 2 superblock, 3 calibration set) |
//!
//! The tag names the page's own block and is checked against where it was read: a chip with a stuck address line answers
//! with another block's pages. Its code corrects one wrong bit, so one torn tag in
//! a thousand fits by chance: a newer format is refused on the superblock's word alone, whose CRC-32 does not.

use crc::{CRC_16_IBM_3740, Crc};

use super::record::{RECORD_BYTES, RecordBytes};
use crate::nand::{
    PageAddress, PageBytes, SPARE_BYTES, SpareBytes,
    ecc::{self, Uncorrectable},
};

/// The version this code writes and reads.
pub const FORMAT: u8 = 1;

/// Zero bits that an erased page may show: worn or disturbed cells, two for each half and the spare.
const STRAY_ZEROS: u32 = 6;

const CRC: Crc<u16> = Crc::<u16>::new(&CRC_16_IBM_3740);

/// What a page is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
pub enum PageKind {
    /// Records.
    Log = 1,
    /// The superblock.
    Superblock = 2,
    /// A calibration set.
    Set = 3,
}

/// Where a page belongs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
pub struct Tag {
    /// What it is for.
    pub kind: PageKind,
    /// The log's epoch.
    pub epoch: u16,
    /// The boot that wrote it, lower half.
    pub boot: u16,
}

/// What a spare area says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
pub enum Stamp {
    /// Nothing: the page was not programmed, or none of it came to be.
    Blank,
    /// A page of ours, in its place.
    Ours(Tag),
    /// A page of ours that belongs to this block: an address line or a program went astray.
    Astray(Tag, u16),
    /// Torn, damaged, of another format, or somebody else's.
    Garbage,
}

/// Columns of the tag's nine bytes, from the start of the spare area.
const TAG: [usize; 9] = [3, 4, 9, 10, 11, 12, 13, 14, 15];
/// Columns of the codes of both halves.
const CODES: [usize; 2] = [0, 6];

/// Writes both records and their codes into `page`; [`address`] makes it whole.
pub fn compose(page: &mut PageBytes, a: &RecordBytes, b: &RecordBytes) {
    page.fill(0xFF);
    let (halves, spare) = page.as_chunks_mut::<RECORD_BYTES>();
    for ((half, record), at) in halves.iter_mut().zip([a, b]).zip(CODES) {
        *half = *record;
        let code = spare.iter_mut().skip(at).zip(ecc::code(record));
        code.for_each(|(slot, byte)| *slot = byte);
    }
}

/// Writes the tag of the page at `at` into a composed page.
pub fn address(page: &mut PageBytes, at: PageAddress, tag: Tag) {
    let mut bytes = [0; TAG.len()];
    bytes[0..2].copy_from_slice(&tag.boot.to_le_bytes());
    bytes[2..4].copy_from_slice(&tag.epoch.to_le_bytes());
    bytes[4..6].copy_from_slice(&at.block.to_le_bytes());
    bytes[8] = version_and_kind(tag.kind);
    let crc = check(&bytes, at.page);
    bytes[6..8].copy_from_slice(&crc.to_le_bytes());
    let (_, spare) = page.as_chunks_mut::<RECORD_BYTES>();
    for (column, byte) in TAG.into_iter().zip(bytes) {
        if let Some(slot) = spare.get_mut(column) {
            *slot = byte;
        }
    }
}

/// What the spare area of the page at `at` says.
pub fn stamp(spare: &SpareBytes, at: PageAddress) -> Stamp {
    if zeros(spare) <= STRAY_ZEROS / 3 {
        return Stamp::Blank;
    }
    let mut bytes = TAG.map(|column| spare.get(column).copied().unwrap_or(0xFF));
    if !fits(&bytes, at.page) {
        // The CRC-16 tells any two single-bit errors in nine bytes apart (its distance is 4 up to 4 KiB).
        let Some(bit) = (0..8 * TAG.len()).find(|bit| fits(&flipped(bytes, *bit), at.page)) else {
            return Stamp::Garbage;
        };
        bytes = flipped(bytes, bit);
    }
    let kind = [PageKind::Log, PageKind::Superblock, PageKind::Set]
        .into_iter()
        .find(|kind| bytes[8] == version_and_kind(*kind));
    let Some(kind) = kind else {
        return Stamp::Garbage;
    };
    let tag = Tag {
        kind,
        boot: u16::from_le_bytes([bytes[0], bytes[1]]),
        epoch: u16::from_le_bytes([bytes[2], bytes[3]]),
    };
    match u16::from_le_bytes([bytes[4], bytes[5]]) {
        block if block == at.block => Stamp::Ours(tag),
        block => Stamp::Astray(tag, block),
    }
}

/// The spare area of a page.
pub fn spare(page: &PageBytes) -> &SpareBytes {
    page.last_chunk().unwrap_or(&[0; SPARE_BYTES])
}

/// Whether nothing was programmed.
pub fn is_blank(page: &PageBytes) -> bool {
    zeros(page) <= STRAY_ZEROS
}

/// Puts both halves right; for each, how many bits were wrong.
pub fn correct(page: &mut PageBytes) -> [Result<u32, Uncorrectable>; 2] {
    let (halves, spare) = page.as_chunks_mut::<RECORD_BYTES>();
    let code = |at: usize| {
        spare
            .get(at..)
            .and_then(<[u8]>::first_chunk)
            .copied()
            .unwrap_or_default()
    };
    let mut halves = halves.iter_mut().zip(CODES);
    core::array::from_fn(|_| match halves.next() {
        Some((half, at)) => ecc::correct(half, code(at)),
        None => Err(Uncorrectable),
    })
}

/// Half 0 or 1 of a page.
pub fn record(page: &PageBytes, half: usize) -> &RecordBytes {
    let (halves, _) = page.as_chunks();
    halves.get(half).unwrap_or(&[0; RECORD_BYTES])
}

fn version_and_kind(kind: PageKind) -> u8 {
    FORMAT << 4 | kind as u8
}

/// Bits that are zero. A word at a time: without an instruction that counts them, it takes as long as a byte.
fn zeros(bytes: &[u8]) -> u32 {
    let (words, rest) = bytes.as_chunks();
    let words = words.iter().map(|word| u32::from_ne_bytes(*word).count_zeros());
    let rest = rest.iter().map(|byte| byte.count_zeros());
    words.chain(rest).fold(0, u32::wrapping_add)
}

fn flipped(mut bytes: [u8; TAG.len()], bit: usize) -> [u8; TAG.len()] {
    if let Some(byte) = bytes.get_mut(bit / 8) {
        *byte ^= 1 << (bit % 8);
    }
    bytes
}

/// Whether the checksum fits.
fn fits(bytes: &[u8; TAG.len()], page: u8) -> bool {
    bytes[6..8] == check(bytes, page).to_le_bytes()
}

/// Checksum over kind, boot, epoch, block and page.
fn check(bytes: &[u8; TAG.len()], page: u8) -> u16 {
    let mut digest = CRC.digest();
    digest.update(&bytes[8..]);
    digest.update(&bytes[..6]);
    digest.update(&[page]);
    digest.finalize()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::nand::{BAD_MARK, MAIN_BYTES};

    const AT: PageAddress = PageAddress { block: 77, page: 9 };
    const TAG_OF_LOG: Tag = Tag {
        kind: PageKind::Log,
        epoch: 4,
        boot: 0xABCD,
    };

    fn page() -> PageBytes {
        let mut page = [0; crate::nand::PAGE_BYTES];
        compose(&mut page, &[0x3C; RECORD_BYTES], &[0x55; RECORD_BYTES]);
        address(&mut page, AT, TAG_OF_LOG);
        page
    }

    #[test]
    fn a_page_gives_back_its_halves_and_says_where_it_belongs() {
        let mut flipped = page();
        flipped[10] ^= 1;
        assert_eq!(correct(&mut flipped), [Ok(1), Ok(0)]);
        assert_eq!(record(&flipped, 0), &[0x3C; RECORD_BYTES]);
        assert_eq!(record(&flipped, 1), &[0x55; RECORD_BYTES]);
        assert_eq!(stamp(spare(&page()), AT), Stamp::Ours(TAG_OF_LOG));
        assert_eq!(page()[MAIN_BYTES + BAD_MARK], 0xFF, "the bad mark stays clear");
    }

    #[test]
    fn a_page_read_elsewhere_is_known_to_be_astray() {
        let elsewhere = PageAddress { block: 79, ..AT };
        assert_eq!(stamp(spare(&page()), elsewhere), Stamp::Astray(TAG_OF_LOG, 77));
        let other_page = PageAddress { page: 10, ..AT };
        assert_eq!(stamp(spare(&page()), other_page), Stamp::Garbage);
    }

    #[test]
    fn one_wrong_bit_anywhere_in_the_spare_area_costs_nothing() {
        for bit in 0..8 * SPARE_BYTES {
            let mut page = page();
            page[MAIN_BYTES + bit / 8] ^= 1 << (bit % 8);
            assert_eq!(stamp(spare(&page), AT), Stamp::Ours(TAG_OF_LOG), "bit {bit}");
            assert!(correct(&mut page).iter().all(Result::is_ok), "bit {bit}");
        }
    }

    #[test]
    fn an_erased_page_is_blank_even_with_a_weak_cell_in_each_part() {
        let mut page = [0xFF; crate::nand::PAGE_BYTES];
        for at in [3, 300, 520] {
            page[at] = 0xF7;
        }
        assert!(is_blank(&page));
        assert_eq!(stamp(spare(&page), AT), Stamp::Blank);
        assert_eq!(stamp(&[0; SPARE_BYTES], AT), Stamp::Garbage);
    }

    /// A spare area torn so that a few bits came to be is no blank one: the search for the head ends at a blank page.
    #[test]
    fn a_spare_area_with_more_than_stray_zeros_is_not_blank() {
        let torn = |zeros: usize| {
            let mut spare = [0xFF; SPARE_BYTES];
            spare[1..=zeros].fill(0xFE);
            stamp(&spare, AT)
        };
        assert_eq!((torn(2), torn(3)), (Stamp::Blank, Stamp::Garbage));
    }

    /// A firmware of a later format tells these pages by it: what is written must be what the first page says.
    #[test]
    fn format_and_kind_stand_in_the_last_column() {
        assert_eq!(page()[527], 0x11);
        for (kind, byte) in [(PageKind::Superblock, 0x12), (PageKind::Set, 0x13)] {
            let mut page = page();
            address(&mut page, AT, Tag { kind, ..TAG_OF_LOG });
            assert_eq!(page[527], byte);
        }
    }

    #[test]
    fn a_page_of_another_format_is_not_ours() {
        let mut bytes = TAG.map(|column| spare(&page())[column]);
        bytes[8] = 0x21;
        let crc = check(&bytes, AT.page).to_le_bytes();
        bytes[6..8].copy_from_slice(&crc);
        let mut other = *spare(&page());
        for (column, byte) in TAG.into_iter().zip(bytes) {
            other[column] = byte;
        }
        assert_eq!(stamp(&other, AT), Stamp::Garbage);
    }
}
