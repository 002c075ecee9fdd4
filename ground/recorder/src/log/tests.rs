use embassy_futures::block_on;
use emems::{
    flight_log::{FlightLog, LOG_START},
    health::Health,
    packet,
    sample::{Reading, SENSOR_COUNT},
};
use proptest::prelude::*;
use twin::part::nand::{Cells, Tear};

use super::*;

const BLOCKS: u16 = 16;

fn entry(counter: u16) -> Entry {
    Entry {
        start_us: u64::from(counter) * 200_000,
        packet: packet::encode(&Reading::unread(counter)),
        slots_us: [8; SENSOR_COUNT],
        flight: true,
        health: Health(0),
        estimate: None,
    }
}

/// A chip with these boots, so many records each; the last is cut.
fn chip(boots: &[u16]) -> Cells {
    let mut chip = Cells::new(BLOCKS, &[], 1);
    let mut counter = 0;
    for records in boots {
        let mut log = FlightLog::new(&mut chip, BootHeader::default());
        block_on(async {
            log.mount().await.expect("mounts");
            for _ in 0..*records {
                log.append(&entry(counter)).await.expect("appends");
                counter += 1;
            }
        });
    }
    chip
}

fn counters(log: &Log) -> Vec<u16> {
    let counter = |entry: &Entry| packet::decode(&entry.packet).expect("a packet").counter;
    log.packets.values().map(counter).collect()
}

#[test]
fn an_image_gives_every_record_once_and_no_gap() {
    let image = chip(&[40, 3, 7]).image();
    assert!(is_image(&image));
    let log = read(&image).expect("an image");
    assert_eq!(counters(&log), (0..50).collect::<Vec<_>>());
    assert_eq!(
        (log.headers.len(), log.newest_epoch(), log.gaps()),
        (3, Some(0), vec![])
    );
    assert!(matches!(log.superblock, InSuperblock::Save(_)), "{:?}", log.superblock);
    assert_eq!(log.damage.lost, 0);
}

#[test]
fn records_of_an_erased_epoch_are_found_until_they_are_overwritten() {
    let mut chip = chip(&[40]);
    let mut log = FlightLog::new(&mut chip, BootHeader::default());
    block_on(async {
        log.mount().await.expect("mounts");
        log.start_erase().await.expect("erases");
        log.append(&entry(900)).await.expect("appends");
    });
    let log = read(&chip.image()).expect("an image");
    assert_eq!(log.newest_epoch(), Some(1));
    let old = log.packets.keys().filter(|key| key.epoch == 0).count();
    // The first block was used again: thirty of the forty records stood there, and the next page repeats one.
    assert_eq!(old, 11);
}

#[test]
fn two_lost_pages_in_a_row_are_one_gap_and_are_named() {
    let mut chip = chip(&[20]);
    for page in [5, 6] {
        chip.destroy(PageAddress { block: LOG_START, page });
    }
    let log = read(&chip.image()).expect("an image");
    let gap = Gap {
        // Pages 5 and 6 hold records 4 and 5; page 7 repeats 5.
        first: Key {
            epoch: 0,
            boot: 1,
            seq: 4,
        },
        last: 4,
        after_us: Some(400_000),
    };
    assert_eq!(log.gaps(), [gap]);
    assert!(log.damage.lost > 0);
}

#[test]
fn a_torn_page_is_damage_and_no_record() {
    let mut chip = chip(&[5]);
    chip.befalls.cut = Some((chip.operations + 8, Tear::Half));
    let mut log = FlightLog::new(&mut chip, BootHeader::default());
    let _ = block_on(async {
        log.mount().await?;
        for counter in 5..20 {
            log.append(&entry(counter)).await?;
        }
        Ok::<_, emems::flight_log::LogError>(())
    });
    let log = read(&chip.image()).expect("an image");
    assert!(log.packets.len() >= 5 && log.damage.lost > 0 && log.damage.conflicts.is_empty());
}

#[test]
fn a_dump_gives_what_the_image_gives() {
    let mut chip = chip(&[40, 3]);
    let of_image = read(&chip.image()).expect("an image");
    let mut stream = b">G_Ml ok: WAIT\r\n".to_vec();
    let mut log = FlightLog::new(&mut chip, BootHeader::default());
    block_on(async {
        log.mount().await.expect("mounts");
        for number in 0..log.status().used {
            for record in log.read(number).expect("reads").into_iter().flatten() {
                stream.extend(record::packet(record).into_iter().flatten());
                stream.extend(dump::encode(number, record));
            }
        }
    });
    let of_dump = read(&stream).expect("a dump");
    assert_eq!((of_dump.packets, of_dump.headers), (of_image.packets, of_image.headers));
}

#[test]
fn a_file_larger_than_a_chip_is_refused() {
    let many = vec![0xFF; LIMIT as usize + 1];
    assert_eq!(read(&many), Err(LogError::TooLarge(LIMIT + 1)));
}

proptest! {
    #[test]
    fn any_bytes_are_read_without_a_panic(bytes in proptest::collection::vec(any::<u8>(), 0..8_000)) {
        let _ = read(&bytes);
    }

    #[test]
    fn any_damage_to_an_image_yields_true_records_or_none(
        at in proptest::collection::vec((0..usize::from(BLOCKS) * 32 * 528, any::<u8>()), 0..300)
    ) {
        let mut image = chip(&[40, 3]).image();
        for (at, byte) in at {
            image[at] = byte;
        }
        if let Ok(log) = read(&image) {
            for entry in log.packets.values() {
                let counter = packet::decode(&entry.packet).expect("a packet").counter;
                prop_assert_eq!(entry, &self::entry(counter));
            }
        }
    }
}
