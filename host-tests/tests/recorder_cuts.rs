//! The flight log under power cuts: every operation, every way to tear, one after another and at random.
//!
//! Each campaign flies twice: a share of it without asking, all of it among the long tests. The share cuts at every operation in every
//! way, with fewer seeds. A million runs take some 20 minutes of two cores:
//! `EMEMS_RUNS=1000000 cargo host-test --test recorder_cuts many_cuts -- --nocapture --ignored`, with `EMEMS_SEED` to go elsewhere.
//! A run that is not clean is printed with its number, from which everything in it is drawn.

use std::collections::BTreeSet;

use emems::nand::{PAGES_PER_BLOCK, PageAddress};
use host_tests::recorder::{Flown, WEARS, campaign, draws};
use twin::part::nand::{Cells, TEARS, Tear};

/// Blocks of the chip of a short flight: four for the superblock, room for a block each boot and the records.
const BLOCKS: u16 = 18;

/// Records of a short flight: four blocks and a half.
const RECORDS: u32 = 150;

/// Records of a flight cut twice: two blocks and a bit.
const RECORDS_OF_PAIRS: u32 = 70;

/// Operations of a boot besides its records: superblock, header, erases, with a margin that only adds flights without
/// a cut.
const MORE_OPERATIONS: u64 = 15;

fn asked(name: &str, otherwise: u64) -> u64 {
    let value = std::env::var(name).ok().and_then(|text| text.parse().ok());
    let value = value.unwrap_or(otherwise);
    println!("{name}={value}");
    value
}

/// A chip with some records of an earlier boot, so that there is something to lose.
fn used(seed: u64) -> Flown {
    let mut flown = Flown::on(Cells::new(BLOCKS, &[1, 6], seed));
    flown.boot(5 + seed as u32 % 40, None);
    flown
}

/// A cut at each operation, in each way, on chips of so many seeds.
fn one_cut(seeds: u64) {
    let operations = u64::from(RECORDS) + MORE_OPERATIONS;
    let tears = TEARS.len() as u64;
    let tally = campaign(operations * tears * seeds, |flight| {
        let tear = TEARS[(flight % tears) as usize];
        let after = 1 + flight / tears % operations;
        let mut flown = used(flight / tears / operations);
        flown.boot(RECORDS, Some((after, tear)));
        flown.boot(8, None);
        flown.judge(&BTreeSet::new())
    });
    // Each record is at least one operation, so a cut at any of the first ones strikes.
    let cuts = tally.runs * u64::from(RECORDS) / operations;
    tally.check(1_150 * seeds, cuts, cuts / 2);
}

/// Two cuts: the first at each operation, the second at each soon after it, in so many pairs of ways for each way of the first.
fn two_cuts(pairs: u64) {
    let operations = u64::from(RECORDS_OF_PAIRS) + MORE_OPERATIONS;
    let (tears, soon) = (TEARS.len() as u64, 12);
    let tally = campaign(operations * soon * tears * pairs, |flight| {
        let mut draw = draws(asked_once(), flight);
        let first = TEARS[(flight % tears) as usize];
        let second = TEARS[draw(tears) as usize];
        let after = 1 + flight / tears % operations;
        let then = 1 + flight / tears / operations % soon;
        let mut flown = Flown::on(Cells::new(BLOCKS, &[5], flight));
        flown.boot(RECORDS_OF_PAIRS, Some((after, first)));
        flown.boot(RECORDS_OF_PAIRS, Some((then, second)));
        flown.boot(8, None);
        flown.judge(&BTreeSet::new())
    });
    // The second comes within the first records of its boot and strikes always.
    let cuts = tally.runs + tally.runs * u64::from(RECORDS_OF_PAIRS) / operations;
    tally.check(8_000 * pairs, cuts, cuts / 2);
}

fn asked_once() -> u64 {
    static SEED: std::sync::OnceLock<u64> = std::sync::OnceLock::new();
    *SEED.get_or_init(|| asked("EMEMS_SEED", 1))
}

/// One cut to twelve, on chips with flipped bits and worn blocks.
fn many_cuts(runs: u64) {
    let runs = asked("EMEMS_RUNS", runs);
    let tally = campaign(runs, |flight| {
        let mut draw = draws(asked_once(), flight);
        let blocks = 40;
        let mut chip = Cells::new(blocks, &[draw(blocks.into()) as u16 / 8 * 8 + 7], flight);
        chip.befalls.flips_per_thousand = 50;
        for _ in 0..draw(4) {
            let wear = WEARS[draw(4) as usize];
            let worn = (draw(blocks.into()) as u16, draw(60) as u32, wear);
            chip.befalls.worn.push(worn);
        }
        let mut flown = Flown::on(chip);
        for _ in 0..1 + draw(12) {
            let tear = TEARS[draw(TEARS.len() as u64) as usize];
            flown.boot(60, Some((1 + draw(50), tear)));
        }
        flown.boot(8, None);
        flown.judge(&BTreeSet::new())
    });
    // One to twelve cuts a run, each within the first 50 operations of a boot of 60 records.
    tally.check(runs, 6 * runs, 3 * runs);
}

/// A cut, and later one page destroyed.
fn one_page(runs: u64) {
    let runs = asked("EMEMS_RUNS", runs);
    let tally = campaign(runs, |flight| {
        let mut draw = draws(asked_once(), flight);
        let mut flown = used(flight);
        let tear = TEARS[draw(TEARS.len() as u64) as usize];
        flown.boot(RECORDS_OF_PAIRS, Some((1 + draw(70), tear)));
        flown.boot(1 + draw(9) as u32, None);
        let newest = flown.acknowledged.last_key_value().map(|(key, _)| *key);
        let page = draw(u64::from(PAGES_PER_BLOCK)) as u8;
        let block = 4 + draw(u64::from(BLOCKS) - 4) as u16;
        if ![1, 6].contains(&block) {
            flown.chip.destroy(PageAddress { block, page });
        }
        flown.judge(&newest.into_iter().collect())
    });
    tally.check(runs, runs, runs / 2);
}

#[test]
fn a_cut_at_any_operation_in_any_way_loses_nothing() {
    one_cut(2);
}

#[test]
fn a_second_cut_soon_after_the_first_loses_nothing() {
    two_cuts(1);
}

#[test]
fn many_cuts_with_flips_and_blocks_that_wear_out_lose_nothing() {
    many_cuts(2_000);
}

#[test]
fn one_page_destroyed_after_a_cut_takes_at_most_the_newest_record_with_it() {
    one_page(2_000);
}

/// The check is no rubber stamp: a campaign whose cuts do not strike, or tear nothing, is refused.
#[test]
fn a_campaign_in_which_nothing_is_cut_or_torn_is_refused() {
    let whole = campaign(100, |flight| {
        let mut flown = used(flight);
        flown.boot(RECORDS, None);
        flown.judge(&BTreeSet::new())
    });
    let uncut = std::panic::catch_unwind(|| whole.check(100, 90, 45)).expect_err("no cut struck");
    assert!(said(&*uncut).contains("cuts struck"), "{}", said(&*uncut));
    let untorn = campaign(100, |flight| {
        let mut flown = used(flight);
        flown.boot(RECORDS, Some((1 + flight, Tear::Unacknowledged)));
        flown.judge(&BTreeSet::new())
    });
    let untorn = std::panic::catch_unwind(|| untorn.check(100, 90, 45)).expect_err("nothing was torn");
    assert!(said(&*untorn).contains("tear nothing"), "{}", said(&*untorn));
}

fn said(panic: &(dyn std::any::Any + Send)) -> &str {
    panic.downcast_ref::<String>().map_or("", String::as_str)
}

/// What takes more than six seconds of a core: the campaigns at full length.
mod long {
    #[test]
    #[ignore = "takes more than six seconds: cargo host-test-long runs it"]
    fn a_cut_at_any_operation_in_any_way_loses_nothing() {
        super::one_cut(20);
    }

    #[test]
    #[ignore = "takes more than six seconds: cargo host-test-long runs it"]
    fn a_second_cut_soon_after_the_first_loses_nothing() {
        super::two_cuts(5);
    }

    #[test]
    #[ignore = "takes more than six seconds: cargo host-test-long runs it"]
    fn many_cuts_with_flips_and_blocks_that_wear_out_lose_nothing() {
        super::many_cuts(20_000);
    }

    #[test]
    #[ignore = "takes more than six seconds: cargo host-test-long runs it"]
    fn one_page_destroyed_after_a_cut_takes_at_most_the_newest_record_with_it() {
        super::one_page(20_000);
    }
}
