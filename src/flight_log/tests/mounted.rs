//! What a mount finds.

use core::{
    future::Future,
    pin::pin,
    task::{Context, Waker},
};

use super::*;
use crate::flight_log::{
    mount::{Found, UNSEEN_BOOTS},
    superblock::BAD_BLOCKS,
};

/// What a mount has found: the two newest packet records, newest first, and the newest block.
fn found(chip: &mut Chip) -> ([Option<Key>; 2], Option<u16>) {
    let log = chip.mounted();
    let key = |bytes: &RecordBytes| record::key(bytes).ok();
    let (last, second) = (key(&log.last), key(&log.second));
    let keys = match log.carried {
        0 => [None, None],
        1 => [last, None],
        _ => [last, second],
    };
    (keys, log.newest_block)
}

/// The two newest packet records of the chip, which is read from end to end, are those that a mount finds. The second one may be
/// an older one where the next start copies the whole block.
fn finds_the_two_newest(chip: &mut Chip, what: &str) {
    let packets = chip.packets(0);
    let mut newest = packets.iter().rev().copied();
    let expected = [newest.next(), newest.next()];
    let (found, newest_block) = found(chip);
    let mut log = chip.mounted();
    let copies = newest_block.is_some() && log.course().expect("reads").copies;
    assert_eq!(found[0], expected[0], "{what}");
    assert_eq!(usize::from(log.carried), packets.len().min(2), "{what}");
    assert!(
        found[1] == expected[1] || copies && found[1] < found[0],
        "{what}: {found:?}"
    );
    let at_us = expected[0].map(|key| (key, 0));
    assert_eq!(log.status().last, at_us, "{what}");
}

/// For every length of the log and every position of its head.
#[test]
fn the_two_newest_records_are_found_wherever_the_head_is() {
    for boots in [&[70][..], &[1, 1, 1, 1], &[3, 9, 2, 30, 1, 2], &[28, 27, 40, 1]] {
        let mut chip = Chip::new(BLOCKS);
        for records in boots {
            let mut log = chip.mounted();
            for _ in 0..*records {
                block_on(log.append(&entry())).expect("there is room");
                let head = log.head.map_or(0, |head| head.page);
                let chip = &mut *log.chip;
                finds_the_two_newest(chip, "after a record");
                // The newest page has lost what it repeats: the page before has it. The first pages of a boot have the only copies.
                if head > COPIES_AND_TWO {
                    let mut lost = chip.clone();
                    let pages = lost.pages.range((LOG_START, 0)..(BLOCKS - 4, 0));
                    let newest = packet_of(chip.packets(0).last().copied());
                    let mut of_it = pages
                        .filter(|(_, bytes)| *page::record(bytes, 0) == newest)
                        .map(|(at, _)| *at);
                    let at = of_it.next_back();
                    lost.pages.get_mut(&at.expect("its page")).expect("is there")[256..512].fill(0);
                    finds_the_two_newest(&mut lost, "after a loss");
                }
            }
        }
    }
}

/// Pages of a boot that repeat what was before it, and two of its own.
const COPIES_AND_TWO: u8 = 4;

fn packet_of(key: Option<Key>) -> RecordBytes {
    key.map_or([0; record::RECORD_BYTES], |key| record::encode_entry(key, &entry()))
}

/// Two blocks take turns, and the newer one has only some copies yet: the mode is that of the newest record in either.
#[test]
fn the_mode_is_that_of_the_newest_record_in_either_block() {
    for newest_first in [false, true] {
        let mut chip = chip(5, 4, 2);
        let in_flight = |seq: u32, flight: bool| {
            let entry = Entry { flight, ..entry() };
            record::encode_entry(Key { epoch: 0, boot: 1, seq }, &entry)
        };
        let (whole, part) = if newest_first { (5, 4) } else { (4, 5) };
        for seq in 1..=3 {
            let record = in_flight(seq, seq == 3);
            chip.write((whole, seq as u8), (0, 1), [&record, &in_flight(seq - 1, false)]);
            if seq < 3 {
                chip.write((part, seq as u8), (0, 1), [&record, &in_flight(seq - 1, false)]);
            }
        }
        let mut log = chip.log();
        log.find_superblock().expect("reads");
        let told = log.find_newest(5, Found::Sure).expect("reads");
        assert_eq!(
            told.map(|(key, flight, _)| (key.seq, flight)),
            Some((3, true)),
            "{newest_first}"
        );
        assert_eq!(log.carried, 2);
        assert_eq!(record::key(&log.second).map(|key| key.seq), Ok(2));
    }
}

/// And after every start that was cut after any of its operations, and one more after that.
#[test]
fn the_two_newest_records_are_found_after_starts_that_were_cut() {
    for before in [0, 1, 2, 27, 40] {
        for first in 0..12 {
            for second in [0, 2, 4, 5, 9] {
                let mut chip = Chip::new(BLOCKS);
                chip.start(before);
                chip.start_cut(3, first);
                finds_the_two_newest(&mut chip, "cut once");
                chip.start_cut(3, second);
                finds_the_two_newest(&mut chip, &std::format!("{before} {first} {second}: cut twice"));
                let boots = chip.packets(0).last().map_or(0, |key| key.boot);
                chip.start(1);
                finds_the_two_newest(&mut chip, "recorded again");
                let last = chip.packets(0).last().copied().expect("a record");
                assert!(last.boot > boots, "a boot has a number of its own: {last:?}");
            }
        }
    }
}

/// With its superblock lost, whole or but for an old save, a log goes on counting from its highest boot: no key comes twice.
#[test]
fn without_its_superblock_a_log_counts_on_from_its_highest_boot() {
    for boots in 1..=60 {
        for old_save in [false, true] {
            let mut chip = Chip::new(BLOCKS);
            chip.start(1);
            let saved: Vec<_> = chip
                .pages
                .range(..(LOG_START, 0))
                .map(|(at, page)| (*at, *page))
                .collect();
            (1..boots).for_each(|_| chip.start(1));
            let before = chip.packets(0);
            chip.pages.retain(|(block, _), _| *block >= LOG_START);
            if old_save {
                chip.pages.extend(saved);
                // What is torn behind it may have been a newer one.
                chip.at(0, 0).fill(0);
            }
            assert_eq!(found(&mut chip).0[0], before.last().copied(), "{boots} {old_save}");
            chip.start(1);
            let after = chip.packets(0);
            assert_eq!(after.len(), before.len() + 1, "{boots}");
            let [newest, last] = [&before, &after].map(|keys| keys.last().map_or(0, |key| key.boot));
            assert_eq!((newest, last), (boots, boots + UNSEEN_BOOTS + 1), "{boots} {old_save}");
        }
    }
}

/// A mount that is sure reads some pages and not every block; so does one of a log that was erased.
#[test]
fn a_mount_looks_at_few_blocks_unless_it_has_to_look_at_all() {
    let mut chip = Chip::new(1_000);
    for records in [40, 3, 50, 700] {
        chip.start(records);
    }
    let reads = |chip: &mut Chip| {
        chip.reads.set(0);
        chip.mounted();
        chip.reads.get()
    };
    assert!(reads(&mut chip) < 200, "{}", reads(&mut chip));
    block_on(chip.mounted().start_erase()).expect("erased");
    assert!(reads(&mut chip) < 200, "{}", reads(&mut chip));
    assert_eq!(found(&mut chip), ([None; 2], None));
}

/// The same log, mounted again, knows what another one knows that is mounted then.
#[test]
fn mounting_again_forgets_what_was() {
    let mut chip = Chip::new(BLOCKS);
    chip.start(3);
    let mut log = chip.mounted();
    for _ in 0..5 {
        block_on(log.append(&entry())).expect("there is room");
    }
    block_on(log.start_erase()).expect("erased");
    block_on(log.mount()).expect("mounts");
    let again = (
        (log.opened, log.begun, log.head, log.ahead, log.erase_next),
        (log.next_block, log.seq, log.carried, log.newest_block, log.home),
        (log.superblock.clone(), log.status().last),
    );
    let mut fresh = chip.log();
    block_on(fresh.mount()).expect("mounts");
    let log = fresh;
    let afresh = (
        (log.opened, log.begun, log.head, log.ahead, log.erase_next),
        (log.next_block, log.seq, log.carried, log.newest_block, log.home),
        (log.superblock.clone(), log.status().last),
    );
    assert_eq!(again, afresh);
}

/// A chip whose superblock says that the newest boot began in `first` and went on from `before`.
fn chip(first_block: u16, block_before: u16, boot: u32) -> Chip {
    let mut chip = Chip::new(BLOCKS);
    chip.save(&superblock(first_block, block_before, boot));
    chip
}

fn superblock(first_block: u16, block_before: u16, boot: u32) -> Superblock {
    Superblock {
        number: 1,
        boot,
        first_block,
        block_before,
        ..Superblock::default()
    }
}

/// A block with a header and packets 1 to `last` of a boot.
fn fill(chip: &mut Chip, block: u16, boot: u32, last: u32) {
    chip.write((block, 0), (0, boot), [&header(boot), &header(boot)]);
    for seq in 1..=last {
        let before = if seq > 1 { packet(boot, seq - 1) } else { header(boot) };
        chip.write((block, seq as u8), (0, boot), [&packet(boot, seq), &before]);
    }
}

/// The search for the head, without looking at every block.
fn searched(chip: &mut Chip) -> Option<u16> {
    let mut log = chip.log();
    log.find_superblock().expect("reads");
    log.search_head().expect("reads")
}

#[test]
fn the_head_is_the_last_block_of_the_newest_boot_wherever_bad_ones_lie() {
    for last in 6..20 {
        for bad in 0..20 {
            let mut chip = chip(6, 0, 3);
            let mut superblock = superblock(6, 0, 3);
            // Every second, third, ... block from the seventh on is bad.
            let bad: Vec<u16> = (7..last).filter(|block| bad > 0 && block % (bad + 1) == 0).collect();
            for block in &bad {
                superblock.bad.insert(*block).expect("room");
            }
            chip.save(&superblock);
            for block in (6..=last).filter(|block| !bad.contains(block)) {
                fill(&mut chip, block, 3, 2);
            }
            let expected = (6..=last).rev().find(|block| !bad.contains(block));
            assert_eq!(searched(&mut chip), expected, "{bad:?} {last}");
        }
    }
}

/// A boot that left nothing: the head is the block it went on from, or the next one below that is live and not bad.
#[test]
fn where_the_newest_boot_left_nothing_the_head_is_below() {
    let mut there = chip(9, 5, 3);
    fill(&mut there, 5, 2, 3);
    assert_eq!(searched(&mut there), Some(5));
    // The block it went on from holds nothing any more, or there was none.
    for before in [0, 5] {
        let mut gone = chip(9, before, 3);
        fill(&mut gone, 7, 2, 3);
        fill(&mut gone, 6, 2, 3);
        assert_eq!(searched(&mut gone), Some(7), "{before}");
        let mut superblock = superblock(9, before, 3);
        superblock.bad.insert(7).expect("room");
        gone.save(&superblock);
        assert_eq!(searched(&mut gone), Some(6), "{before}");
    }
}

/// Where the search finds none every block is looked at, if there may be records.
#[test]
fn a_log_far_below_the_newest_boot_is_found_all_the_same() {
    let mut chip = chip(19, 0, 3);
    fill(&mut chip, 6, 2, 3);
    assert_eq!(searched(&mut chip), None);
    finds_the_two_newest(&mut chip, "far below");
    assert_eq!(found(&mut chip).1, Some(6));
}

/// Of the block the newest boot went on from nothing is left: the newest block is the head.
#[test]
fn the_newest_block_is_one_that_is_there() {
    let mut chip = chip(9, 5, 3);
    fill(&mut chip, 7, 2, 3);
    assert_eq!(found(&mut chip).1, Some(7));
    fill(&mut chip, 5, 2, 3);
    assert_eq!(found(&mut chip).1, Some(5));
    fill(&mut chip, 9, 3, 1);
    assert_eq!(found(&mut chip).1, Some(9));
}

/// With more bad blocks than are remembered the maker's mark tells, in whichever of the two pages it is.
#[test]
fn beyond_the_bad_blocks_that_are_remembered_the_mark_tells() {
    for page in [0, 1] {
        let mut chip = Chip::new(200);
        let mut superblock = superblock(150, 0, 3);
        for block in 4..BAD_BLOCKS as u16 {
            superblock.bad.insert(block).expect("room");
        }
        assert!(superblock.bad.is_full());
        chip.save(&superblock);
        chip.mark(150, page);
        chip.mark(151, page);
        fill(&mut chip, 152, 3, 2);
        assert_eq!(searched(&mut chip), Some(152), "page {page}");
    }
}

/// Without a superblock: the last block of the newest epoch, whatever order the blocks are in.
#[test]
fn a_scan_finds_the_last_block_of_the_newest_epoch() {
    let mut draw = 1_u32;
    for _ in 0..200 {
        let mut chip = Chip::new(BLOCKS);
        let mut expected = None;
        for block in LOG_START..BLOCKS - 4 {
            draw = draw.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let epoch = (draw >> 24) as u16 % 4;
            if epoch == 0 {
                continue;
            }
            let record = record::encode_entry(Key { epoch, boot: 1, seq: 1 }, &entry());
            chip.write((block, 0), (epoch, 1), [&record, &record]);
            expected = expected.max(Some((epoch, block)));
        }
        let mut log = chip.log();
        let head = block_on(log.scan(false)).expect("reads");
        assert_eq!(
            (log.superblock.epoch, head),
            expected.map_or((0, None), |(epoch, block)| (epoch, Some(block)))
        );
    }
}

/// While every block is looked at the rest of the unit has its chance every sixteen blocks.
#[test]
fn a_mount_that_takes_long_gives_way() {
    const OF_MANY: u16 = 160;
    for recorded in [false, true] {
        let mut chip = Chip::new(OF_MANY);
        if recorded {
            fill(&mut chip, 100, 2, 3);
        }
        let reads = chip.reads.clone();
        let mut log = chip.log();
        log.find_superblock().expect("reads");
        let mut scan = pin!(log.scan(false));
        let (mut before, mut chances) = (reads.get(), 0);
        let mut context = Context::from_waker(Waker::noop());
        while scan.as_mut().poll(&mut context).is_pending() {
            chances += 1;
            assert!(reads.get() - before <= 2 * 16, "{} reads", reads.get() - before);
            before = reads.get();
        }
        // Of a chip without any record the marks in second pages are read as well.
        let passes = if recorded { 1 } else { 2 };
        assert_eq!(chances, passes * OF_MANY / 16, "{recorded}");
        assert!(reads.get() - before <= 2 * 16);
    }
}

#[test]
fn what_the_log_cannot_do_is_said_with_what_to_do() {
    use std::string::ToString;

    let said = [
        (LogError::Nand(NandError::Timeout), NandError::Timeout.to_string()),
        (LogError::NotMounted, "not mounted".into()),
        (LogError::Newer(9), "log of newer format 9: update the firmware".into()),
        (
            LogError::Foreign,
            "NAND holds something else: G_MA makes it a log".into(),
        ),
        (LogError::Full, "full".into()),
        (LogError::Worn, "no block of the NAND can be written".into()),
    ];
    for (error, words) in said {
        assert_eq!(error.to_string(), words);
    }
}
