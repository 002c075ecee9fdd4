//! A raw image or a dump on the ground: it is refused, or gives packets that can be told, with gaps in order.
//!
//! The bytes are the file. After a first byte of `~` they are records, two a page of an image, whose checksums, codes and
//! tags are put right here, so that what lies behind them is reached too.

use emems::{
    flight_log::{
        page::{self, PageKind, Tag},
        record::{RECORD_BYTES, RecordBytes},
    },
    nand::{PAGE_BYTES, PAGES_PER_BLOCK, PageAddress},
};
use recorder::log;

const CRC: crc::Crc<u32> = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC);

fn put_right(record: &RecordBytes) -> RecordBytes {
    let mut record = *record;
    if let Some((content, checksum)) = record.split_last_chunk_mut::<4>() {
        *checksum = CRC.checksum(content).to_le_bytes();
    }
    record
}

fn image(records: &[u8]) -> Vec<u8> {
    let mut image = Vec::new();
    let tag = Tag {
        kind: PageKind::Log,
        epoch: 0,
        boot: 1,
    };
    for (number, pair) in records.as_chunks::<RECORD_BYTES>().0.chunks(2).enumerate() {
        let mut bytes = [0; PAGE_BYTES];
        let [a, b] = [&pair[0], &pair[pair.len() - 1]].map(put_right);
        let per_block = usize::from(PAGES_PER_BLOCK);
        let at = PageAddress {
            block: (number / per_block) as u16,
            page: (number % per_block) as u8,
        };
        page::compose(&mut bytes, &a, &b);
        page::address(&mut bytes, at, tag);
        image.extend(bytes);
    }
    image
}

/// The target.
pub fn recover(bytes: &[u8]) {
    let file = bytes.strip_prefix(b"~").map_or_else(|| bytes.to_vec(), image);
    let Ok(log) = log::read(&file) else { return };
    for gap in log.gaps() {
        assert!(gap.first.seq <= gap.last, "records {} to {}", gap.first.seq, gap.last);
    }
    assert!(log.packets_of(false).count() <= log.packets_of(true).count());
    let mut remarks = Vec::new();
    recorder::recover::write_remarks(&log, true, &mut remarks).expect("memory can be written");
    for (key, entry) in log.packets_of(true) {
        for si in [false, true] {
            assert!(!recorder::table::row(*key, entry, si).contains('\n'));
        }
    }
}
