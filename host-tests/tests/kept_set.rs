//! The calibration set that the chip keeps, under power cuts: cut anywhere and however, the old set is there or the new one, and
//! the log beside it is whole.

use embassy_futures::block_on;
use emems::{
    flight_log::{
        LogError,
        page::{self, PageKind, Tag},
    },
    nand::{PAGE_BYTES, PAGES_PER_BLOCK, PageAddress},
};
use host_tests::recorder::{Flown, Tally, campaign, log, nothing_lost, three_boots};
use twin::part::nand::{Break, Cells, TEARS, Tear, Wear};

const BLOCKS: u16 = 24;
const LONGEST: usize = 1136;
/// An erase and twice five pages; and a margin of runs without a cut.
const OPERATIONS: u64 = 11 + 3;
/// Seeds of each cut and way to tear.
const SEEDS: u64 = 20;

/// A set like any other bytes; every number gives another.
fn set(number: u8) -> Vec<u8> {
    (0..LONGEST).map(|at| (at as u8).wrapping_mul(31) ^ number).collect()
}

fn keep(chip: &mut Cells, content: &[u8], cut: Option<(u64, Tear)>) -> Result<(), LogError> {
    chip.power_on();
    chip.befalls.cut = cut.map(|(after, tear)| (chip.operations + after, tear));
    let mut log = log(chip);
    block_on(async {
        log.mount().await?;
        log.keep_set(content, &mut [0; LONGEST]).await
    })
}

fn kept(chip: &mut Cells) -> Option<Vec<u8>> {
    chip.power_on();
    let mut log = log(chip);
    block_on(async {
        log.mount().await.expect("mounts");
        let mut buffer = [0; LONGEST];
        log.kept_set(&mut buffer).expect("reads").map(<[u8]>::to_vec)
    })
}

#[test]
fn a_cut_anywhere_leaves_the_old_set_or_the_new_one_and_the_log() {
    let tears = TEARS.len() as u64;
    let total = campaign(OPERATIONS * tears * SEEDS, |run| {
        let (after, tear) = (1 + run % OPERATIONS, TEARS[(run / OPERATIONS % tears) as usize]);
        let mut flown = three_boots(BLOCKS, run / OPERATIONS / tears);
        // Sets before, so that blocks with older ones are erased.
        for number in 0..5 {
            keep(&mut flown.chip, &set(number), None).expect("kept");
        }
        // Forgetting is one page and its copy.
        let new = if run % 3 == 0 { Vec::new() } else { set(9) };
        let acknowledged = keep(&mut flown.chip, &new, Some((after, tear)));
        flown.cuts += u64::from(flown.chip.off);
        let found = kept(&mut flown.chip);
        let is_old = found.as_deref() == Some(&set(4));
        let is_new = found.as_deref() == Some(&new);
        let mut tally = judged(flown);
        tally.wrong += u64::from(!(is_new || is_old && acknowledged.is_err()));
        tally
    });
    assert!(total.is_clean(), "{total:?}");
    // Of the operations one in fourteen to three never comes, more where the set is forgotten.
    assert!(total.cuts > total.runs / 2 && total.cuts < total.runs, "{total:?}");
}

fn judged(flown: Flown) -> Tally {
    nothing_lost(flown)
}

#[test]
fn a_second_cut_while_it_is_kept_again_leaves_one_of_the_three() {
    for first in 1..=11 {
        for second in 1..=11 {
            let mut flown = three_boots(BLOCKS, first * 20 + second);
            keep(&mut flown.chip, &set(1), None).expect("kept");
            let tear = TEARS[(first + second) as usize % TEARS.len()];
            let _ = keep(&mut flown.chip, &set(2), Some((first, tear)));
            let _ = keep(&mut flown.chip, &set(3), Some((second, tear)));
            let found = kept(&mut flown.chip).expect("a set");
            assert!((1..=3).any(|number| found == set(number)), "{first} {second}");
            nothing_lost(flown);
        }
    }
}

/// Each piece stands four times on the chip; one of them is enough, be it a second half.
#[test]
fn a_set_of_whose_pages_one_half_each_is_damaged_is_whole() {
    for byte in [40, 300] {
        let mut flown = three_boots(BLOCKS, 1);
        keep(&mut flown.chip, &set(1), None).expect("kept");
        for block in BLOCKS - 4..BLOCKS {
            for page in 0..PAGES_PER_BLOCK {
                let at = PageAddress { block, page };
                let before = flown.chip.read(at);
                if page::is_blank(&before) {
                    continue;
                }
                // Programming again clears bits.
                let mut cleared = [0xFF; PAGE_BYTES];
                cleared[byte..byte + 8].fill(0);
                flown.chip.program(at, &cleared);
                let mut after = flown.chip.read(at);
                let _ = page::correct(&mut after);
                assert_ne!(page::record(&after, byte / 256), page::record(&before, byte / 256));
            }
        }
        assert_eq!(kept(&mut flown.chip), Some(set(1)));
    }
}

#[test]
fn nothing_is_kept_on_a_chip_that_was_never_asked_to() {
    assert_eq!(kept(&mut three_boots(BLOCKS, 1).chip), None);
    assert_eq!(kept(&mut Cells::new(BLOCKS, &[], 1)), None);
}

#[test]
fn bad_and_worn_blocks_are_passed_over() {
    let mut chip = Cells::new(BLOCKS, &[BLOCKS - 4, BLOCKS - 2], 1);
    for number in 0..6 {
        keep(&mut chip, &set(number), None).expect("kept");
        assert_eq!(kept(&mut chip), Some(set(number)));
    }
    assert!(
        !chip.breaks.iter().any(|broken| matches!(broken, Break::MarkedBad(_))),
        "{:?}",
        chip.breaks
    );
    assert!(chip.breaks.is_empty(), "{:?}", chip.breaks);
    let _ = Wear::ProgramFails;
}

/// A log of older firmware, which left these blocks to the records.
#[test]
fn live_records_in_these_blocks_are_not_erased() {
    let mut flown = three_boots(BLOCKS, 1);
    let tag = Tag {
        kind: PageKind::Log,
        epoch: 0,
        boot: 3,
    };
    for block in BLOCKS - 4..BLOCKS {
        let at = PageAddress { block, page: 0 };
        let mut bytes = [0; PAGE_BYTES];
        page::compose(&mut bytes, &[0; 256], &[0; 256]);
        page::address(&mut bytes, at, tag);
        flown.chip.program(at, &bytes);
    }
    let operations = flown.chip.operations;
    assert_eq!(keep(&mut flown.chip, &set(1), None), Err(LogError::Full));
    assert_eq!(flown.chip.operations, operations, "nothing was touched");
}
