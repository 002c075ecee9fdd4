//! A raw image of the recorder's NAND, as tables or as a folder.
//!
//! In: an image that [`recorder::log::is_image`] knows. Out: the newest epoch's records and a line for each boot, gap and
//! damage; a page whose attitude is at the launch site that the unit's latest start took. Refuses what is larger than a chip, and a log of a newer format.

use std::{io::Write, path::Path};

use attitude::told;
use logs::{digest::Digest, folder::Folder};
use packets::stream::Bytes5To8;
use recorder::{
    log::{self, LIMIT, Log},
    parquet, recover, table,
};

use super::{DecodeError, finish, input::Input, place, stem};

/// \[us\] from packet to packet where no header of a boot is left to say it.
const PERIOD_US: u32 = 200_000;

/// The log in an image, of which `head` was read already.
pub fn log(mut input: Input, mut head: Vec<u8>) -> Result<Log, DecodeError> {
    // One byte more than there may be, so that more is noticed.
    head.extend(input.first(LIMIT + 1 - head.len() as u64)?);
    log::read(&head).map_err(|source| DecodeError::Image {
        path: input.path,
        source,
    })
}

/// Rows, and remarks.
pub fn to_text(log: &Log, counts: bool, rows: &mut dyn Write, remarks: &mut dyn Write) -> Result<(), DecodeError> {
    writeln!(rows, "{}", table::header())?;
    for (key, entry) in log.packets_of(false) {
        writeln!(rows, "{}", table::row(*key, entry, !counts))?;
    }
    rows.flush()?;
    Ok(recover::write_remarks(log, false, remarks)?)
}

/// The folder of its packets as of a stream, with what only a log has: every column in Parquet, and its gaps.
pub fn to_folder(log: &Log, name: &str, parent: &Path, json: bool) -> Result<(), DecodeError> {
    let period_us = log
        .headers
        .values()
        .next_back()
        .map_or(PERIOD_US, |header| header.period_us.max(1_000));
    let stem = stem(name);
    let cycle_s = f64::from(period_us) * 1e-6;
    let mut folder = Folder::create(parent, stem, cycle_s)?;
    let site = told::site(log);
    let mut digest = Digest::new(Bytes5To8::Errors, cycle_s, &place(site));
    for (_, entry) in log.packets_of(false) {
        folder.entries(&digest.push(None, &entry.packet))?;
    }
    let mut remarks = Vec::new();
    recover::write_remarks(log, false, &mut remarks)?;
    for line in String::from_utf8_lossy(&remarks).lines() {
        folder.remark(line)?;
    }
    parquet::create(&folder.path().join("records.parquet"), log.packets_of(false), true)?;
    finish(folder, digest, site, [stem, name], json)
}

#[cfg(test)]
mod tests {
    use embassy_futures::block_on;
    use emems::{
        flight_log::{
            FlightLog, LOG_START,
            record::{self, BootHeader},
        },
        health::Health,
        nand::PageAddress,
        packet::encode,
        sample::{NO_SLOT, Reading, SENSOR_COUNT},
    };
    use twin::part::nand::Cells;

    use super::*;

    /// A raw image with two boots of records, one of which is lost.
    fn nand() -> Vec<u8> {
        let mut chip = Cells::new(20, &[], 1);
        // The first boot fills a block: a shorter one would be copied by the next, and a lost page would lose nothing.
        for (boot, records) in [40, 20].into_iter().enumerate() {
            let mut log = FlightLog::new(&mut chip, BootHeader::default());
            block_on(async {
                log.mount().await.expect("mounts");
                for counter in 0..records {
                    let entry = record::Entry {
                        start_us: 200_000 * u64::from(counter),
                        packet: encode(&Reading::unread(40 * boot as u16 + counter)),
                        slots_us: [NO_SLOT; SENSOR_COUNT],
                        flight: true,
                        health: Health(0),
                        estimate: None,
                    };
                    log.append(&entry).await.expect("appends");
                }
            });
        }
        for page in [7, 8] {
            chip.destroy(PageAddress { block: LOG_START, page });
        }
        chip.image()
    }

    #[test]
    fn a_raw_image_is_recognised_and_its_gap_is_listed() {
        let place = tempfile::tempdir().expect("temporary folder");
        let file = place.path().join("nand.bin");
        std::fs::write(&file, nand()).expect("write");
        let mut input = Input::open(&file).expect("open");
        let head = input.first(crate::decode::HEAD).expect("a beginning");
        assert!(log::is_image(&head));
        let log = super::log(input, head).expect("an image");
        let (mut rows, mut remarks) = (Vec::new(), Vec::new());
        to_text(&log, true, &mut rows, &mut remarks).expect("written");
        let rows = String::from_utf8(rows).expect("text");
        assert_eq!(rows.lines().count(), 1 + 59, "{rows}");
        let remarks = String::from_utf8(remarks).expect("text");
        assert!(
            remarks.contains("boot 1: records 6 to 6 are missing, after"),
            "{remarks}"
        );
        to_folder(&log, "nand.bin", place.path(), false).expect("a folder");
        for name in ["counts.csv", "si.csv", "log.txt", "index.html", "records.parquet"] {
            let length = std::fs::metadata(place.path().join("nand").join(name)).map(|file| file.len());
            assert!(length.is_ok_and(|length| length > 100), "{name}");
        }
    }

    #[test]
    fn text_of_any_kind_is_no_image() {
        let stream = encode(&Reading::unread(2)).repeat(2_000);
        assert!(!log::is_image(&stream));
        assert!(!log::is_image(&[0xFF; 528 * 100]) && !log::is_image(&[0; 528 * 100]));
    }
}
