//! An erase of the whole log under power cuts (fault catalogue F4, F7): the old log is whole or the log is empty, once
//! acknowledged it is empty, and no block is used whose erase was cut.
//!
//! The verdict on each run is the judge's, on the raw chip, and that of a dump: what the log itself gives out is exactly
//! what was acknowledged in the epoch that counts.

use std::collections::BTreeSet;

use embassy_futures::block_on;
use emems::flight_log::{
    LOG_START, LogError, Resumed,
    record::{self, Content},
};
use host_tests::recorder::{Flown, Tally, campaign, log, three_boots};
use twin::part::nand::{Cells, TEARS, Tear};

const BLOCKS: u16 = 24;

/// Operations of an erase: the superblock's erase and two pages, sixteen blocks; and a margin of runs without a cut.
const OPERATIONS: u64 = 3 + 16 + MARGIN;
const MARGIN: u64 = 3;

/// One operation in so many finds old records to tear: the superblock's two pages and the five blocks that three boots have
/// used, of nineteen, in seven ways of nine. A second erase finds fewer.
const OLD_ONES: u64 = 6;

/// Seeds of each cut and way to tear.
const SEEDS: u64 = 20;

/// G_MA, with all of its free time, cut at operation `after` from now; whether it was acknowledged. The unit is in WAIT then, and
/// has told the log so: where a save of the superblock is in doubt the newest record tells the mode, here that of a flight.
fn erase(flown: &mut Flown, after: u64, tear: Tear) -> bool {
    flown.chip.power_on();
    flown.chip.befalls.cut = Some((flown.chip.operations + after, tear));
    let mut log = log(&mut flown.chip);
    let ordered = block_on(async {
        let mounted = log.mount().await;
        let ordered: Result<(), LogError> = match mounted {
            Ok(_) => match log.keep_mode(Resumed::default()).await {
                Ok(()) => log.start_erase().await,
                unsaved => unsaved,
            },
            Err(error) => Err(error),
        };
        while ordered.is_ok() && log.free_time().await.is_ok_and(|more| more) {}
        ordered.is_ok()
    });
    flown.cuts += u64::from(flown.chip.off);
    ordered
}

/// Packet records as a dump of the log gives them.
fn dumped(chip: &mut Cells) -> BTreeSet<u64> {
    let mut log = log(chip);
    block_on(async {
        log.mount().await.expect("mounts");
        let mut dumped = BTreeSet::new();
        for page in 0..log.status().used {
            for record in log.read(page).expect("reads").into_iter().flatten() {
                if let Ok((_, Content::Packet(entry))) = record::decode(record) {
                    dumped.insert(entry.start_us);
                }
            }
        }
        dumped
    })
}

/// What is left, after mounts that write nothing and two boots that do; `erased`: it was acknowledged.
fn verdict(mut flown: Flown, erased: bool) -> Tally {
    for _ in 0..3 {
        flown.boot(0, None);
    }
    flown.boot(5, None);
    flown.boot(100, None);
    let epoch = flown.acknowledged.last_key_value().map_or(0, |(key, _)| key.epoch);
    // Of older epochs there may be anything on the chip; none of it may be in the log. A record that a cut kept from being
    // acknowledged may.
    let older = flown.acknowledged.extract_if(.., |key, _| key.epoch != epoch);
    let older: BTreeSet<u64> = older.map(|(_, id)| id.into()).collect();
    let kept: BTreeSet<u64> = flown.acknowledged.values().map(|id| u64::from(*id)).collect();
    flown.chip.power_on();
    let dumped = dumped(&mut flown.chip);
    let amiss = (kept.difference(&dumped).count() + dumped.intersection(&older).count()) as u64;
    let mut tally = flown.judge(&BTreeSet::new());
    tally.wrong += amiss + u64::from(erased && epoch == 0);
    tally
}

#[test]
fn f07_a_cut_at_any_operation_of_an_erase_leaves_the_old_log_or_none() {
    let tears = TEARS.len() as u64;
    let tally = campaign(OPERATIONS * tears * SEEDS, |flight| {
        let tear = TEARS[(flight % tears) as usize];
        let after = 1 + flight / tears % OPERATIONS;
        let mut flown = three_boots(BLOCKS, flight / tears / OPERATIONS);
        let erased = erase(&mut flown, after, tear);
        verdict(flown, erased)
    });
    let cuts = tally.runs * (OPERATIONS - MARGIN) / OPERATIONS;
    tally.check(3_900, cuts, cuts / OLD_ONES);
}

/// Two cuts: each pair of operations, each way of the first, so many chips.
fn ordered_again(chips: u64) {
    let tears = TEARS.len() as u64;
    let tally = campaign(OPERATIONS * OPERATIONS * tears * chips, |flight| {
        let first = TEARS[(flight % tears) as usize];
        let second = TEARS[(flight / 7 % tears) as usize];
        let after = 1 + flight / tears % OPERATIONS;
        let then = 1 + flight / tears / OPERATIONS % OPERATIONS;
        let mut flown = three_boots(BLOCKS, flight);
        let once = erase(&mut flown, after, first);
        let twice = erase(&mut flown, then, second);
        verdict(flown, once || twice)
    });
    let cuts = 2 * tally.runs * (OPERATIONS - MARGIN) / OPERATIONS;
    tally.check(4_000 * chips, cuts, cuts / OLD_ONES / 2);
}

#[test]
fn f07_an_erase_ordered_again_after_a_cut_and_cut_again_leaves_the_old_log_or_none() {
    ordered_again(1);
}

/// A cut at each operation of a flight after an erase, in each way, on so many chips.
fn used_after_an_erase(chips: u64) {
    // An erased log whose blocks still hold the old one: each is erased just before its first page.
    const APPENDED: u32 = 100;
    let operations = u64::from(APPENDED) + 12;
    let tears = TEARS.len() as u64;
    let tally = campaign(operations * tears * chips, |flight| {
        let tear = TEARS[(flight % tears) as usize];
        let after = 1 + flight / tears % operations;
        let mut flown = three_boots(BLOCKS, flight);
        flown.chip.power_on();
        let mut log = log(&mut flown.chip);
        block_on(async {
            log.mount().await.expect("mounts");
            log.start_erase().await.expect("erases");
        });
        flown.boot(APPENDED, Some((after, tear)));
        verdict(flown, true)
    });
    let cuts = tally.runs * u64::from(APPENDED) / operations;
    tally.check(1_000 * chips, cuts, cuts / 2);
}

#[test]
fn f04_a_block_whose_erase_was_cut_is_erased_again_before_it_is_used() {
    used_after_an_erase(1);
}

/// The verdict is no rubber stamp.
#[test]
fn a_log_half_erased_and_an_erase_that_is_undone_are_found_out() {
    let mut half = three_boots(BLOCKS, 1);
    half.chip.erase(LOG_START + 1);
    assert!(verdict(half, false).lost > 0);
    assert_eq!(verdict(three_boots(BLOCKS, 1), true).wrong, 1);
}

/// What takes more than six seconds of a core: the campaigns at full length.
mod long {
    #[test]
    #[ignore = "takes more than six seconds: cargo host-test-long runs it"]
    fn f07_an_erase_ordered_again_after_a_cut_and_cut_again_leaves_the_old_log_or_none() {
        super::ordered_again(3);
    }

    #[test]
    #[ignore = "takes more than six seconds: cargo host-test-long runs it"]
    fn f04_a_block_whose_erase_was_cut_is_erased_again_before_it_is_used() {
        super::used_after_an_erase(4);
    }
}
