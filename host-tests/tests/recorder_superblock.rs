//! The flight log on chips that hold something else than it wrote: superblocks lost or of a newer format, foreign
//! content, arbitrary images (fault catalogue F17, F18).

use embassy_futures::block_on;
use emems::{
    flight_log::{
        LOG_START, LogError, Resumed, page,
        record::Entry,
        superblock::{self, Superblock},
    },
    mode::{Cause, Change, Mode},
    nand::{PAGES_PER_BLOCK, PageAddress},
};
use host_tests::recorder::{entry, log, nothing_lost, three_boots};
use twin::part::nand::Cells;

const BLOCKS: u16 = 24;

/// \[ns\] what a mount may take of the time of a chip of full size; these are smaller.
const MOUNT_WORST: u64 = 100_000_000;

/// F17: superblocks of all kinds.
#[test]
fn f17_a_lost_superblock_is_replaced_by_its_copy_or_by_a_scan() {
    // Each page of the superblock's blocks, one at a time, then all of them.
    let pages: Vec<_> = (0..LOG_START)
        .flat_map(|block| (0..8).map(move |page| (block, page)))
        .collect();
    for (block, page) in &pages {
        let mut flown = three_boots(BLOCKS, 7);
        flown.chip.destroy(PageAddress {
            block: *block,
            page: *page,
        });
        flown.boot(3, None);
        nothing_lost(flown);
    }
    let mut lost = three_boots(BLOCKS, 7);
    for (block, page) in pages {
        lost.chip.destroy(PageAddress { block, page });
    }
    lost.boot(3, None);
    assert_eq!(nothing_lost(lost).acknowledged, 96);
}

/// The pages of the newest save of the superblock.
fn newest_save(chip: &mut Cells) -> Vec<PageAddress> {
    let pages = (0..LOG_START).flat_map(|block| (0..PAGES_PER_BLOCK).map(move |page| PageAddress { block, page }));
    let saves = pages.filter_map(|at| {
        let mut bytes = chip.read(at);
        page::correct(&mut bytes)[0].ok()?;
        Some((superblock::decode(page::record(&bytes, 0)).ok()?.number, at))
    });
    let saves: Vec<_> = saves.collect();
    let newest = saves.iter().map(|(number, _)| *number).max();
    let of_it = saves.iter().filter(|(number, _)| Some(*number) == newest);
    of_it.map(|(_, at)| *at).collect()
}

/// F17: of the superblock only an older save is left, with the mode as it was before: the newest record tells it, be it
/// a packet or the change itself.
#[test]
fn f17_the_mode_of_an_older_save_gives_way_to_that_of_the_newest_record() {
    for (flight, change, packet) in [
        (true, true, true),
        (true, true, false),
        (true, false, true),
        (false, true, false),
    ] {
        let mut chip = Cells::new(BLOCKS, &[], 3);
        let mut recorded = log(&mut chip);
        let mode = |flight| Resumed {
            flight,
            recording: flight,
            derived: false,
            ..Resumed::default()
        };
        let in_mode = |flight, id| Entry { flight, ..entry(id) };
        block_on(async {
            recorded.mount().await.expect("a new chip");
            recorded.keep_mode(mode(!flight)).await.expect("a save");
            recorded.append(&in_mode(!flight, 1)).await.expect("a record");
            recorded.keep_mode(mode(flight)).await.expect("a save");
            if change {
                let mode = if flight { Mode::Flight } else { Mode::Wait };
                let (recording, cause) = (flight, Cause::Command);
                let change = Change {
                    at_us: 2,
                    mode,
                    recording,
                    cause,
                };
                recorded.note(&change).await.expect("a record");
            }
            if packet {
                recorded.append(&in_mode(flight, 3)).await.expect("a record");
            }
        });
        drop(recorded);
        let lost = newest_save(&mut chip);
        assert_eq!(lost.len(), 2, "both copies of a save");
        for at in lost {
            chip.destroy(at);
        }
        chip.power_on();
        let resumed = block_on(log(&mut chip).mount());
        assert_eq!(resumed, Ok(mode(flight)), "{change} {packet}");
    }
}

/// F17: a log of a newer format is refused by its number and left alone.
#[test]
fn f17_a_newer_format_is_named_and_left_alone() {
    let mut flown = three_boots(BLOCKS, 1);
    let mut image = flown.chip.image();
    let newest = superblock::encode(&Superblock::default());
    let mut newer = newest;
    newer[4] = 7;
    let crc = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC).checksum(&newer[..252]);
    newer[252..].copy_from_slice(&crc.to_le_bytes());
    image[..256].copy_from_slice(&newer);
    image[512..515].copy_from_slice(&emems::nand::ecc::code(&newer));
    let mut chip = Cells::of_image(BLOCKS, &image, 1);
    assert_eq!(block_on(log(&mut chip).mount()), Err(LogError::Newer(7)));
    assert_eq!(chip.operations, 0);
    flown.chip.power_on();
}

/// F17: what is no log is refused until an erase is asked for.
#[test]
fn f17_foreign_content_is_left_alone_until_it_is_erased_by_command() {
    let image: Vec<u8> = (0..u32::from(BLOCKS) * 32 * 528)
        .map(|at| if at % 528 == 517 { 0xFF } else { at as u8 })
        .collect();
    let mut chip = Cells::of_image(BLOCKS, &image, 1);
    let mut log = log(&mut chip);
    block_on(async {
        assert_eq!(log.mount().await, Err(LogError::Foreign));
        assert_eq!(log.append(&entry(1)).await, Err(LogError::NotMounted));
        assert_eq!(log.start_erase().await, Ok(()));
        assert!(log.append(&entry(1)).await.is_ok());
    });
}

/// F18 in part: all ones, all zeros.
#[test]
fn f18_an_empty_chip_is_a_new_log_and_a_dead_one_is_not() {
    let mut new = Cells::new(BLOCKS, &[], 1);
    assert!(block_on(log(&mut new).mount()).is_ok());
    let zeros = vec![0; 528 * 32 * 200];
    let mut dead = Cells::of_image(200, &zeros, 1);
    assert_eq!(block_on(log(&mut dead).mount()), Err(LogError::Worn));
}

/// F18: arbitrary images: no panic, no endless loop, and a mount within its figure (of this chip's size).
#[test]
fn f18_arbitrary_images_are_mounted_read_and_appended_to_in_bounded_time() {
    let mut valid = three_boots(BLOCKS, 1);
    valid.boot(20, None);
    let valid = valid.chip.image();
    for seed in 0..1_500 {
        let mut draw = host_tests::recorder::draws(7, seed);
        let mut image = match seed % 3 {
            // Random bytes; the mark's column is clear, or every block would be marked bad.
            0 => (0..valid.len()).map(|_| draw(256) as u8).collect(),
            1 => valid.clone(),
            _ => vec![[0x00, 0xFF, 0x5A][draw(3) as usize]; valid.len()],
        };
        for _ in 0..draw(400) {
            // Pages copied elsewhere, and bytes changed.
            let (from, to) = (528 * draw(640) as usize, 528 * draw(640) as usize);
            image.copy_within(from..from + 528, to);
            let at = draw(valid.len() as u64) as usize;
            image[at] = draw(256) as u8;
        }
        if draw(2) == 0 {
            image.chunks_mut(528).for_each(|page| page[517] = 0xFF);
        }
        let mut chip = Cells::of_image(BLOCKS, &image, seed);
        let mut log = log(&mut chip);
        let mounted = block_on(log.mount());
        for number in 0..700 {
            let _ = log.read(number);
        }
        for id in 0..5 {
            let _ = block_on(log.append(&entry(id)));
        }
        let _ = block_on(log.start_erase());
        let _ = block_on(log.append(&entry(6)));
        drop(log);
        assert!(
            chip.time < 700 * 60_000 + MOUNT_WORST,
            "image {seed}: {mounted:?} {} ns",
            chip.time
        );
    }
}
