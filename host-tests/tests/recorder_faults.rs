//! What may befall the recorder besides a cut, and where each row of the catalogue of flash and power faults is tested.
//!
//! | row | fault | test |
//! |---|---|---|
//! | F1, F2 | cut at any operation, torn in nine ways | `recorder_cuts`: a_cut_at_any_operation_in_any_way_loses_nothing |
//! | F3 | bits that read differently each time | f03 below |
//! | F4 | cut inside an erase | `recorder_erase`: f04 |
//! | F5 | second cut soon after the first | `recorder_cuts`: a_second_cut_soon_after_the_first_loses_nothing |
//! | F6 | up to twelve cuts | `recorder_cuts`: many_cuts_with_flips_and_blocks_that_wear_out_lose_nothing |
//! | F7 | cut anywhere in G_MA | `recorder_erase`: f07, once and twice |
//! | F8 | reset in FLIGHT | `recorder_unit`: f08; on the image `boards/emulated/tests/recorder.rs`: cuts_at_random_instants |
//! | F9 | power cut in FLIGHT, RAM lost | `recorder_unit`: f09, with lift-off and without; on the image as F8 |
//! | F10 | factory bad blocks | f10 below |
//! | F11 | blocks that wear out | f11 below |
//! | F12 | a wrong bit in each half page | f12 below |
//! | F13 | a page that is lost | f13 below |
//! | F14 | pages that answer for others | f14 below |
//! | F15 | dead or absent chip | f15 below; `recorder_unit`: f15 |
//! | F16 | full | f16 below; `recorder_unit`: f16 |
//! | F17 | superblocks lost, foreign, newer | `recorder_superblock`: f17 |
//! | F18 | arbitrary image | `recorder_superblock`: f18; the fuzz target `flight_log` |
//! | F19 | dump interrupted | `recorder_unit`: f19 |
//! | F20 | brown-out | `recorder_unit`: f20; on the image a_failing_supply_begins_no_operation |
//! | F21 | a million reads | f21 below |

use std::collections::BTreeSet;

use embassy_futures::block_on;
use emems::{
    flight_log::{FlightLog, LOG_START, LogError, Status, record::BootHeader},
    nand::{NandError, PAGES_PER_BLOCK, PageAddress},
};
use host_tests::recorder::{Flown, campaign, entry, log, nothing_lost, read_all, three_boots};
use twin::part::nand::{Break, Cells, Tear, Wear};

const BLOCKS: u16 = 24;

/// F3: the torn page of an unacknowledged record reads one way now and another way then.
#[test]
fn f03_a_torn_record_comes_back_as_itself_or_not_at_all() {
    let tally = campaign(2_000, |seed| {
        let mut flown = Flown::on(Cells::new(BLOCKS, &[], seed));
        flown.boot(40, Some((20 + seed % 20, [Tear::Weak, Tear::Most][seed as usize % 2])));
        for _ in 0..4 {
            flown.boot(0, None);
            flown.boot(2, None);
        }
        flown.judge(&BTreeSet::new())
    });
    tally.check(2_000, 2_000, 1_000);
}

/// F10: factory marks, block 0 excepted as the data sheet has it, are known before anything is erased.
#[test]
fn f10_marked_blocks_are_neither_written_nor_erased_and_their_marks_stay() {
    let marked: Vec<u16> = (0..80).map(|index| 1 + 51 * index).collect();
    let mut flown = Flown::on(Cells::new(4096, &marked, 1));
    flown.boot(3_000, None);
    let status = {
        let mut log = log(&mut flown.chip);
        block_on(log.mount()).expect("mounts");
        log.status()
    };
    assert_eq!(status.bad_blocks, 80);
    assert_eq!(
        status.capacity,
        (4096 - 4 - 4 - 79) * 32,
        "79 of the 80 are in the log's part"
    );
    nothing_lost(flown);
}

/// F11: a block that fails aloud or in silence costs no record, and is remembered.
#[test]
fn f11_a_block_that_wears_out_costs_no_record() {
    for wear in [
        Wear::ProgramFails,
        Wear::EraseFails,
        Wear::ProgramDoesNothing,
        Wear::EraseDoesNothing,
    ] {
        let mut struck = 0;
        for after in 0..40 {
            let mut flown = Flown::on(Cells::new(BLOCKS, &[], after));
            flown.chip.befalls.worn = vec![(LOG_START + 1, after as u32, wear), (0, 2, wear)];
            flown.boot(100, None);
            flown.boot(100, None);
            let known = {
                let mut log = log(&mut flown.chip);
                block_on(log.mount()).expect("mounts");
                log.status().bad_blocks
            };
            let failed = flown.chip.worn.len();
            struck += failed;
            let tally = flown.judge(&BTreeSet::new());
            assert!(
                tally.is_clean() && tally.acknowledged == 200,
                "{wear:?} {after}: {tally:?}"
            );
            // A block that a mount of its own finds in the superblock is remembered for good. An erase that does nothing
            // is only noticed where there was something to erase.
            match wear {
                Wear::EraseDoesNothing => {
                    assert!(usize::from(known) <= failed, "{wear:?} {after}: {known} of {failed}")
                }
                _ => assert_eq!(usize::from(known), failed, "{wear:?} {after}"),
            }
        }
        assert!(struck > 0, "{wear:?} never struck");
    }
}

/// F12: one wrong bit in each 256 bytes of every read.
#[test]
fn f12_a_wrong_bit_in_every_half_page_costs_nothing_and_is_counted() {
    let mut flown = three_boots(BLOCKS, 1);
    flown.chip.befalls.flips_per_thousand = 1000;
    flown.boot(100, None);
    let corrected = {
        let mut log = log(&mut flown.chip);
        block_on(log.mount()).expect("mounts");
        log.status().corrected
    };
    assert!(corrected > 0);
    nothing_lost(flown);
}

/// F13: a page that is lost, any one of them: only the newest record may be.
#[test]
fn f13_any_lost_page_costs_at_most_the_newest_record() {
    let whole = three_boots(BLOCKS, 3);
    let newest = whole.acknowledged.last_key_value().map(|(key, _)| *key);
    for block in LOG_START..BLOCKS {
        for page in 0..PAGES_PER_BLOCK {
            let mut flown = three_boots(BLOCKS, 3);
            flown.chip.destroy(PageAddress { block, page });
            let lost = flown.judge(&newest.into_iter().collect());
            assert!(lost.is_clean(), "block {block} page {page}: {lost:?}");
        }
    }
}

/// F14: an address line stuck, or one program gone astray.
#[test]
fn f14_pages_that_answer_for_others_are_noticed_and_never_erased() {
    for bit in 8..10 {
        let mut flown = Flown::on(Cells::new(64, &[], 1));
        flown.chip.befalls.stuck_row_bit = Some(bit);
        flown.boot(600, None);
        let mut wrong = 0;
        let found = read_all(&mut flown.chip, &mut wrong);
        let kept = flown.acknowledged.iter().all(|(key, id)| found.get(key) == Some(id));
        assert!(
            kept && wrong == 0,
            "bit {bit}: {} of {}",
            found.len(),
            flown.acknowledged.len()
        );
        assert!(
            mounted(&mut flown).astray,
            "bit {bit}: nobody says that pages are astray"
        );
    }
    let (mut strayed, mut told) = (0, 0);
    for astray in 5..60 {
        let mut flown = Flown::on(Cells::new(64, &[], 1));
        flown.chip.befalls.astray = Some((astray, 9));
        flown.boot(60, None);
        flown.boot(10, None);
        let tally = flown.judge(&BTreeSet::new());
        assert_eq!((tally.lost, tally.wrong), (0, 0), "operation {astray}");
        let status = mounted(&mut flown);
        strayed += flown.chip.strayed;
        told += u64::from(flown.chip.strayed > 0 && (status.astray || status.bad_blocks > 0));
    }
    // The read-back misses it where it should be: its block is given up and the record written elsewhere.
    assert!(strayed > 40 && told == strayed, "{told} of {strayed} were noticed");
}

/// What a mount says.
fn mounted(flown: &mut Flown) -> Status {
    flown.chip.power_on();
    let mut log = log(&mut flown.chip);
    block_on(log.mount()).expect("mounts");
    log.status()
}

/// F15: busy for ever, or not there: an error in bounded time, with its name.
#[test]
fn f15_a_dead_or_absent_chip_is_an_error_with_a_name() {
    let mut chip = Cells::new(BLOCKS, &[], 1);
    chip.befalls.absent = true;
    let absent = block_on(log(&mut chip).mount());
    assert_eq!(absent, Err(LogError::Nand(NandError::WrongId([0xFF, 0xFF]))));
    let mut flown = three_boots(BLOCKS, 1);
    let mut chip = flown.chip.clone();
    let mut log = log(&mut flown.chip);
    block_on(async {
        log.mount().await.expect("mounts");
        log.append(&entry(1)).await.expect("appends");
    });
    chip.befalls.dead = true;
    let mut dead = FlightLog::new(&mut chip, BootHeader::default());
    assert_eq!(block_on(dead.mount()), Err(LogError::Nand(NandError::Timeout)));
    assert_eq!(block_on(dead.append(&entry(2))), Err(LogError::NotMounted));
}

/// F16: a full log says so, keeps everything, and takes nothing more.
#[test]
fn f16_a_full_log_stops_and_overwrites_nothing() {
    let mut flown = Flown::on(Cells::new(BLOCKS, &[9], 1));
    flown.boot(1_000, None);
    assert_eq!(flown.refused, 1, "it says that it is full");
    assert_eq!(flown.acknowledged.len(), 15 * 32 - 2, "every page but the header's two");
    flown.refused = 0;
    flown.boot(0, None);
    let mut log = log(&mut flown.chip);
    block_on(log.mount()).expect("mounts");
    assert_eq!(block_on(log.append(&entry(5_000))), Err(LogError::Full));
    assert_eq!(log.status().used, 16 * 32);
    nothing_lost(flown);
}

/// F21: a million reads of every block.
#[test]
fn f21_a_million_reads_cost_corrected_bits_and_no_record() {
    let mut flown = three_boots(BLOCKS, 1);
    flown.chip.befalls.disturbed_after = Some(250_000);
    for block in 0..BLOCKS {
        *flown.chip.reads_mut(block) = 1_000_000;
    }
    flown.boot(20, None);
    let status = {
        let mut log = log(&mut flown.chip);
        block_on(log.mount()).expect("mounts");
        for number in 0..log.status().used {
            log.read(number).expect("reads");
        }
        log.status()
    };
    assert!(status.corrected > 50, "{status:?}");
    assert_eq!(status.uncorrectable, 0, "{status:?}");
    nothing_lost(flown);
}

/// The judge is no rubber stamp: a log that lost, changed or repeated a record is found out.
#[test]
fn the_judge_finds_what_is_lost_and_what_is_wrong() {
    let mut lost = three_boots(BLOCKS, 1);
    for page in 4..7 {
        lost.chip.destroy(PageAddress { block: LOG_START, page });
    }
    assert_eq!(lost.judge(&BTreeSet::new()).lost, 2);
    let mut other = three_boots(BLOCKS, 1);
    let key = *other.acknowledged.first_key_value().expect("a record").0;
    other.acknowledged.insert(key, 77);
    assert_eq!(other.judge(&BTreeSet::new()).lost, 1);
    let mut broken = three_boots(BLOCKS, 1);
    let at = PageAddress {
        block: LOG_START,
        page: 0,
    };
    broken.chip.program(at, &[0xFF; 528]);
    assert_eq!(broken.chip.breaks, [Break::ProgrammedTwice(at)]);
}
