//! What a start costs the log: pages, and no block for good. Short starts without end, cut or not, lose nothing and leave
//! room; before they were carried on, the 97th start of a chip of 100 blocks found it full.

use std::collections::BTreeSet;

use embassy_futures::block_on;
use emems::flight_log::{LOG_START, Status};
use host_tests::recorder::{Flown, campaign, draws, log, nothing_lost};
use twin::part::nand::{Cells, TEARS};

const BLOCKS: u16 = 100;

fn status(chip: &mut Cells) -> Status {
    chip.power_on();
    let mut log = log(chip);
    block_on(log.mount()).expect("mounts");
    log.status()
}

/// Blocks that are used or were passed over.
fn blocks_used(chip: &mut Cells) -> u32 {
    status(chip).used.div_ceil(32)
}

/// A start takes the pages of its records and of its header; a block that is carried on is left with four pages to spare, and
/// one block may hold what another repeats.
#[test]
fn starts_without_end_cost_pages_and_no_block() {
    for records in [1, 2, 5, 11] {
        let mut flown = Flown::on(Cells::new(BLOCKS, &[9], 1));
        let starts = 1_000 / (records + 1);
        for _ in 0..starts {
            flown.boot(records, None);
        }
        let used = blocks_used(&mut flown.chip);
        let pages = starts * (records + 1);
        println!("{starts} starts of {records} records: {used} blocks, {pages} pages");
        // The last start of a block may leave as much room as a start takes.
        assert!(used <= 3 + pages / (32 - 4 - records), "{records}: {used}");
        assert_eq!(nothing_lost(flown).acknowledged, u64::from(starts * records));
    }
}

/// Starts that record nothing write nothing.
#[test]
fn starts_without_a_record_cost_nothing() {
    let mut flown = Flown::on(Cells::new(BLOCKS, &[], 1));
    flown.boot(3, None);
    let before = (flown.chip.operations, status(&mut flown.chip));
    for _ in 0..200 {
        flown.boot(0, None);
    }
    assert_eq!((flown.chip.operations, status(&mut flown.chip)), before);
}

/// Every start is cut, at any operation of its beginning or soon after, in any way.
#[test]
fn starts_cut_one_after_the_other_lose_nothing_and_leave_room() {
    const STARTS: u64 = 60;
    let tally = campaign(500, |flight| {
        let mut draw = draws(11, flight);
        let mut flown = Flown::on(Cells::new(BLOCKS, &[6, 17], flight));
        flown.boot(draw(40) as u32, None);
        for _ in 0..STARTS {
            let tear = TEARS[draw(TEARS.len() as u64) as usize];
            flown.boot(1 + draw(6) as u32, Some((1 + draw(40), tear)));
        }
        flown.boot(8, None);
        // Half of the cuts strike while the superblock is saved or a block copied, and those may cost a block.
        let used = blocks_used(&mut flown.chip);
        assert!(used < 75, "{used} blocks");
        flown.judge(&BTreeSet::new())
    });
    assert!(tally.is_clean() && tally.cuts > 5_000, "{tally:?}");
}

/// The same with wrong bits in one read of twenty, and with a block that wears out.
#[test]
fn short_starts_on_a_chip_that_wears_out_lose_nothing() {
    let tally = campaign(300, |flight| {
        let mut draw = draws(12, flight);
        let mut chip = Cells::new(60, &[], flight);
        chip.befalls.flips_per_thousand = 50;
        for _ in 0..3 {
            let wear = host_tests::recorder::WEARS[draw(4) as usize];
            chip.befalls.worn.push((draw(60) as u16, draw(60) as u32, wear));
        }
        let mut flown = Flown::on(chip);
        for _ in 0..40 {
            let tear = TEARS[draw(TEARS.len() as u64) as usize];
            let cut = (draw(2) == 0).then_some((1 + draw(40), tear));
            flown.boot(1 + draw(6) as u32, cut);
        }
        flown.boot(8, None);
        flown.judge(&BTreeSet::new())
    });
    assert!(tally.is_clean() && tally.cuts > 1_500, "{tally:?}");
}

/// Any page of the two blocks that take turns may be lost: that costs the newest record at most.
#[test]
fn a_page_lost_of_a_start_that_was_carried_on_costs_at_most_the_newest_record() {
    let flown = || {
        let mut flown = Flown::on(Cells::new(20, &[], 3));
        [4, 3, 2, 5].into_iter().for_each(|records| flown.boot(records, None));
        flown
    };
    let newest = flown().acknowledged.last_key_value().map(|(key, _)| *key);
    for block in LOG_START..LOG_START + 3 {
        for page in 0..32 {
            let mut lost = flown();
            lost.chip.destroy(emems::nand::PageAddress { block, page });
            lost.boot(3, None);
            lost.boot(2, None);
            let tally = lost.judge(&newest.into_iter().collect());
            assert!(tally.is_clean(), "block {block} page {page}: {tally:?}");
        }
    }
}

/// More bad blocks than the superblock remembers cost their own pages and nothing else.
#[test]
fn bad_blocks_beyond_those_that_are_remembered_do_not_stop_the_recorder() {
    let marked: Vec<u16> = (0..200).map(|index| 5 + 2 * index).collect();
    let mut flown = Flown::on(Cells::new(500, &marked, 1));
    for wear in host_tests::recorder::WEARS {
        let block = 430 + 2 * flown.chip.befalls.worn.len() as u16;
        flown.chip.befalls.worn.push((block, 3, wear));
    }
    let mut records = 0;
    for start in 0..40 {
        flown.boot(100 + start, None);
        records += 100 + start;
    }
    let status = status(&mut flown.chip);
    assert!(status.more_bad_blocks, "{status:?}");
    assert_eq!(nothing_lost(flown).acknowledged, u64::from(records));
}
