//! The flight log on an arbitrary chip: mounted, read, appended to and erased without a panic and in bounded time of the
//! chip.
//!
//! The input is a list of edits of a chip: the first byte chooses one that was flown, is blank, zero or text. An edit may put
//! code and checksum of its half page right, so that what lies behind them is reached too.
use std::sync::OnceLock;

use embassy_futures::block_on;
use emems::{
    flight_log::{
        FlightLog,
        record::{BootHeader, Entry, RECORD_BYTES},
    },
    health::Health,
    nand::{MAIN_BYTES, PAGE_BYTES, PAGES_PER_BLOCK, ecc},
    packet,
    sample::{Reading, SENSOR_COUNT},
};
use twin::part::nand::Cells;

const BLOCKS: u16 = 16;
const PAGES: usize = BLOCKS as usize * PAGES_PER_BLOCK as usize;
/// Page, column, kind, four bytes.
const EDIT_BYTES: usize = 8;
const CRC: crc::Crc<u32> = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC);
/// Where the codes of both halves stand in a page.
const CODES: [usize; 2] = [MAIN_BYTES, MAIN_BYTES + 6];

/// \[ns\] of the chip's time: 100 ms for a mount of a chip of full size, and for each page read, appended or erased here 60 us,
/// 1.5 ms with superblock and retired blocks, 3 ms.
const LIMIT: u64 = 100_000_000 + PAGES as u64 * 60_000 + 6 * 4 * 20_000_000;

fn entry(counter: u16) -> Entry {
    Entry {
        start_us: counter.into(),
        packet: packet::encode(&Reading::unread(counter)),
        slots_us: [8; SENSOR_COUNT],
        flight: true,
        health: Health(0),
        estimate: None,
    }
}

/// A chip with three boots, an erase, and a boot.
fn flown() -> &'static [u8] {
    static FLOWN: OnceLock<Vec<u8>> = OnceLock::new();
    FLOWN.get_or_init(|| {
        let mut chip = Cells::new(BLOCKS, &[7], 1);
        for records in [40, 3, 50, 5] {
            let mut log = FlightLog::new(&mut chip, BootHeader::default());
            block_on(async {
                log.mount().await.expect("mounts");
                if records == 5 {
                    log.start_erase().await.expect("erases");
                }
                for counter in 0..records {
                    log.append(&entry(counter)).await.expect("appends");
                }
            });
        }
        chip.image()
    })
}

fn edit(image: &mut [u8], edit: &[u8; EDIT_BYTES]) {
    let [low, high, column, kind, new @ ..] = *edit;
    let page = usize::from(u16::from_le_bytes([low, high])) % PAGES;
    let start = page * PAGE_BYTES;
    if kind & 1 != 0 {
        // A page that stands in another's place.
        let from = usize::from(u16::from_le_bytes([new[0], new[1]])) % PAGES * PAGE_BYTES;
        return image.copy_within(from..from + PAGE_BYTES, start);
    }
    let column = (usize::from(column) | usize::from(kind & 2) << 7) + usize::from(kind & 4 != 0) * 256;
    for (offset, byte) in new.into_iter().enumerate() {
        image[start + (column + offset) % PAGE_BYTES] = byte;
    }
    if kind & 8 != 0 {
        for half in 0..2 {
            let first = start + RECORD_BYTES * half;
            let checked = first + RECORD_BYTES - 4;
            let crc = CRC.checksum(&image[first..checked]).to_le_bytes();
            image[checked..checked + 4].copy_from_slice(&crc);
            let bytes: [u8; RECORD_BYTES] = image[first..first + RECORD_BYTES].try_into().expect("a half");
            image[start + CODES[half]..start + CODES[half] + 3].copy_from_slice(&ecc::code(&bytes));
        }
    }
}

/// The target.
pub fn flight_log(bytes: &[u8]) {
    let Some((choice, edits)) = bytes.split_first() else {
        return;
    };
    let mut image = match choice % 4 {
        0 => vec![0; flown().len()],
        1 => vec![0xFF; flown().len()],
        2 => (0..flown().len()).map(|at| b'@' + (at % 31) as u8).collect(),
        _ => flown().to_vec(),
    };
    for one in edits.as_chunks::<EDIT_BYTES>().0 {
        edit(&mut image, one);
    }
    let mut chip = Cells::of_image(BLOCKS, &image, 1);
    let mut log = FlightLog::new(&mut chip, BootHeader::default());
    block_on(async {
        let _ = log.mount().await;
        let used = log.status().used;
        for number in 0..used.min(PAGES as u32) {
            let _ = log.read(number);
        }
        for counter in 0..3 {
            let _ = log.append(&entry(counter)).await;
            let _ = log.free_time().await;
        }
        let _ = log.start_erase().await;
        let _ = log.append(&entry(4)).await;
    });
    drop(log);
    assert!(chip.time < LIMIT, "{} ns", chip.time);
}
