//! Where a start goes on, and what a status says of it.

use super::*;
use crate::flight_log::carry::Course;

/// A first boot in block 4, whose records a second one copies to block 5, of which `after` operations come to be.
fn begun(records: u32, after: u32) -> Chip {
    let mut chip = Chip::new(BLOCKS);
    chip.start(records);
    chip.start_cut(1, after);
    chip
}

fn course(chip: &mut Chip) -> Course {
    chip.mounted().course().expect("reads")
}

fn from(block: u16, into: Option<u16>) -> Course {
    Course {
        from: Some(block),
        copies: true,
        into,
    }
}

/// Three operations save the superblock, the fourth erases the block; then come four pages of copies, the header and the record.
/// Until the last copy the next start goes on in the same block, and takes no other; from the header on the other may be taken.
/// In between the newest record stands in the last page of both, which a cut may have torn: both stay.
#[test]
fn the_start_after_one_that_was_cut_goes_on_in_its_block() {
    for after in 3..=7 {
        assert_eq!(course(&mut begun(3, after)), from(4, Some(5)), "{after}");
    }
    assert_eq!(course(&mut begun(3, 8)), from(5, None));
    assert_eq!(course(&mut begun(3, 9)), from(5, Some(4)));
    // Cut before the first copy without end: still the same two blocks.
    let mut chip = begun(3, 3);
    for start in 0..20 {
        chip.start_cut(1, 3 + start % 2);
    }
    assert!(chip.mounted().status().used <= 2 * 32);
}

/// However many starts are cut while they copy, and wherever: the block with the records stays the one to go on from, and no other
/// is taken. But for the second operation, which leaves one copy of a save: that is doubtful, and ends the turns.
#[test]
fn starts_cut_while_they_copy_cost_no_block() {
    let sure = || (0..=7).filter(|after| *after != 2);
    for first in sure() {
        for second in sure() {
            for third in sure() {
                let mut chip = begun(3, first);
                chip.start_cut(1, second);
                chip.start_cut(1, third);
                assert_eq!(course(&mut chip).from, Some(4), "{first} {second} {third}");
                chip.start(1);
                assert!(chip.mounted().status().used <= 2 * 32, "{first} {second} {third}");
                assert_eq!(chip.packets(0).len(), 4);
            }
        }
    }
}

/// Only copies and the header of the boot that began there may be in it: a record of its own, or a header of another boot, is
/// nowhere else.
#[test]
fn a_block_with_anything_of_its_own_is_not_only_begun() {
    let is_only_begun = |chip: &mut Chip| {
        let mut log = chip.mounted();
        log.is_only_begun(5, 4).expect("reads")
    };
    assert!(is_only_begun(&mut begun(3, 4)));
    let mut header_of_it = begun(3, 4);
    header_of_it.write((5, 0), (0, 2), [&header(2), &header(2)]);
    assert!(is_only_begun(&mut header_of_it));
    for other in [packet(2, 1), header(0), packet(1, 9), packet(3, 1)] {
        let mut other_there = begun(3, 4);
        other_there.write((5, 0), (0, 2), [&other, &other]);
        assert!(!is_only_begun(&mut other_there), "{:?}", record::key(&other));
    }
}

/// A block that failed, or that the maker marked, is not written again, whichever of the two it is.
#[test]
fn a_bad_block_does_not_take_turns() {
    // The block of the second boot fails at its first page, and the power goes before another is taken.
    let mut failed = Chip::new(BLOCKS);
    failed.start(3);
    failed.failing.push((5, 0));
    failed.start_cut(1, 3 + 1 + 1 + 2);
    assert!(failed.mounted().superblock.bad.contains(5));
    assert_eq!(course(&mut failed), from(4, None));
    // The block of the first boot fails at its second page: its header stays there, and the boot goes on in another block.
    let mut first_failed = Chip::new(BLOCKS);
    first_failed.failing.push((4, 1));
    first_failed.start(1);
    assert!(first_failed.mounted().superblock.bad.contains(4));
    assert_eq!(course(&mut first_failed).into, None);
    // Marks.
    for (block, page) in [(4, 0), (4, 1), (5, 0), (5, 1)] {
        for after in [4, 9] {
            let mut marked = begun(3, after);
            marked.mark(block, page);
            assert_eq!(course(&mut marked).into, None, "{block} {page} {after}");
        }
    }
    // And none takes a block that no save names.
    let mut other = begun(3, 9);
    let mut superblock = other.mounted().superblock.clone();
    (superblock.first_block, superblock.number) = (5, superblock.number + 1);
    superblock.block_before = 0;
    other.pages.retain(|(block, _), _| *block >= LOG_START);
    other.save(&superblock);
    assert_eq!(course(&mut other), from(5, None));
}

/// No start uses the number of one that was cut, whatever of it came to be.
#[test]
fn a_start_in_the_block_of_one_that_was_cut_has_a_number_of_its_own() {
    for after in 3..=7 {
        let mut chip = begun(3, after);
        let counted = chip.mounted().superblock.boot;
        chip.start(1);
        assert_eq!(chip.packets(0).last().map(|key| key.boot), Some(counted + 1), "{after}");
        assert_eq!(chip.mounted().superblock.first_block, 5, "{after}");
    }
}

/// An erase saves the superblock: the first record after it does so again only if it does not begin where that says.
#[test]
fn the_first_record_of_an_erased_log_saves_only_what_is_new() {
    let began = |bad: bool| {
        let mut chip = Chip::new(BLOCKS);
        chip.start(3);
        let mut log = chip.mounted();
        block_on(log.start_erase()).expect("erased");
        if bad {
            log.remember_bad(LOG_START);
        }
        let before = log.chip.programmed;
        block_on(log.append(&entry())).expect("there is room");
        let pages = log.chip.programmed - before;
        (pages, chip.mounted().superblock.first_block)
    };
    // The header, its repetition and the record.
    assert_eq!(began(false), (3, LOG_START));
    assert_eq!(began(true), (2 + 3, LOG_START + 1));
}

/// What a status says is used holds all pages with records, whichever of two blocks the head is in.
#[test]
fn pages_from_those_used_on_are_blank() {
    let mut chip = Chip::new(BLOCKS);
    for start in 0..12 {
        let mut log = chip.mounted();
        for _ in 0..1 + start % 5 {
            block_on(log.append(&entry())).expect("there is room");
            let used = log.status().used;
            let end = LOG_START + (used / 32) as u16;
            let beyond = log.chip.pages.range((end, (used % 32) as u8)..(BLOCKS - 4, 0)).count();
            assert_eq!(beyond, 0, "{start}: {used}");
            block_on(log.free_time()).expect("works");
            assert_eq!(log.status().used, used, "erased ahead of time");
        }
    }
}

/// A start that fails before it has copied what it carries on leaves the log as full as it was.
#[test]
fn a_start_that_fails_uses_no_less() {
    let mut chip = begun(3, 9);
    let used = chip.mounted().status().used;
    assert_eq!(course(&mut chip), from(5, Some(4)));
    chip.silent = Some((chip.erased.len() + 1, 5));
    let mut log = chip.log();
    block_on(log.mount()).expect("mounts");
    assert_eq!(block_on(log.append(&entry())), Err(LogError::Nand(NandError::Timeout)));
    assert_eq!(log.status().used, used);
}

/// A boot begins with its header, twice where there is no record before it; nothing else than records is ever written. A unit that
/// is described anew says so before its next record.
#[test]
fn a_boot_begins_with_its_header_and_a_new_description_comes_before_the_next_record() {
    let mut chip = Chip::new(BLOCKS);
    let mut log = chip.mounted();
    assert!(!log.is_begun());
    block_on(log.append(&entry())).expect("there is room");
    assert!(log.is_begun());
    let other = BootHeader {
        period_us: 77,
        ..BootHeader::default()
    };
    log.describe(other);
    for _ in 0..2 {
        block_on(log.append(&entry())).expect("there is room");
    }
    let mut headers = Vec::new();
    for (page, bytes) in chip.pages.range((LOG_START, 0)..(BLOCKS - 4, 0)) {
        for half in 0..2 {
            let (key, content) = record::decode(page::record(bytes, half)).expect("a record");
            if let record::Content::Header(header) = content {
                headers.push((page.1, half, key.seq, header.period_us));
            }
        }
    }
    // Its page and the repetition in the second and third; then the new one after the first record, and its repetition.
    assert_eq!(
        headers,
        [
            (0, 0, 0, 0),
            (0, 1, 0, 0),
            (1, 0, 0, 0),
            (1, 1, 0, 0),
            (2, 1, 0, 0),
            (3, 0, 2, 77),
            (4, 1, 2, 77)
        ]
    );
}
