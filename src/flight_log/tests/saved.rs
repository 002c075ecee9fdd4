//! The superblock: which save counts, how sure that is, and where the next one goes. And the calibration set that is kept.

use super::*;
use crate::flight_log::{kept_set::LONGEST, mount::Found};

/// What a mount makes of the saves on the chip.
fn sure(chip: &mut Chip) -> bool {
    let mut log = chip.log();
    log.find_superblock().expect("reads") == Found::Sure
}

#[test]
fn a_clean_log_is_sure_of_its_superblock_and_its_boots_count_by_one() {
    let mut chip = Chip::new(BLOCKS);
    for boot in 1..60 {
        chip.start(1);
        assert!(sure(&mut chip), "{boot}");
        assert_eq!(chip.packets(0).last().map(|key| key.boot), Some(boot));
    }
}

/// A save is sure with both its copies whole, and nothing torn behind it or in another block that is used.
#[test]
fn what_may_hide_a_newer_save_makes_it_doubtful() {
    // As many saves as make each of the blocks the newest, with older ones before and behind it.
    (2..8).for_each(a_save_is_sure_with_nothing_torn);
}

fn a_save_is_sure_with_nothing_torn(starts: u32) {
    let saved = || {
        let mut chip = Chip::new(BLOCKS);
        (0..starts).for_each(|_| chip.start(1));
        chip
    };
    let home = {
        let mut chip = saved();
        let log = chip.mounted();
        log.home.0
    };
    assert!(sure(&mut saved()));
    let last = saved()
        .pages
        .range((home, 0)..(home + 1, 0))
        .next_back()
        .map(|((_, page), _)| *page);
    let last = last.expect("a save");
    // One copy of it is not there, or cannot be read.
    let mut one = saved();
    one.pages.remove(&(home, last));
    assert!(!sure(&mut one));
    let mut damaged = saved();
    damaged.at(home, last).fill(0);
    assert!(!sure(&mut damaged));
    // A page that cannot be read, behind it and in another of the blocks.
    for (block, page) in [(home, last + 1), ((home + 1) % LOG_START, 0)] {
        let mut torn = saved();
        torn.at(block, page).fill(0);
        assert!(!sure(&mut torn), "{block} {page}");
        // Of one the tag alone is whole.
        let mut tagged = saved();
        let tag = page::Tag {
            kind: PageKind::Superblock,
            epoch: 0,
            boot: 9,
        };
        tagged.at(block, page).fill(0x0F);
        page::address(tagged.at(block, page), PageAddress { block, page }, tag);
        assert!(!sure(&mut tagged), "{block} {page}");
    }
    // In a block that is not used any more it says nothing.
    let mut retired = saved();
    let other = (home + 1) % LOG_START;
    if other == 0 {
        // Where this test saves.
        return;
    }
    let mut superblock = retired.mounted().superblock.clone();
    superblock.number += 1;
    superblock.bad.insert(other).expect("room");
    retired.pages.retain(|(block, _), _| *block >= LOG_START);
    retired.save(&superblock);
    assert!(sure(&mut retired));
    let bad = superblock.bad.as_slice()[0];
    assert_ne!(bad, 0);
    retired.at(bad, 0).fill(0);
    assert!(sure(&mut retired));
}

/// A newer save that is lost may have counted boots: none of their numbers is used again, be there records or none.
#[test]
fn a_lost_save_costs_numbers_of_boots_and_uses_none_twice() {
    let boot = |chip: &mut Chip, epoch: u16| {
        chip.start(1);
        chip.packets(epoch).last().map_or(0, |key| key.boot)
    };
    // An erase is saved, and no record since.
    let mut erased = Chip::new(BLOCKS);
    erased.start(2);
    block_on(erased.mounted().start_erase()).expect("erased");
    let mut sure_of_it = erased.mounted().superblock.boot;
    let home = erased.mounted().home.0;
    let last = erased
        .pages
        .range((home, 0)..(home + 1, 0))
        .next_back()
        .map(|(at, _)| *at);
    erased.pages.remove(&last.expect("a save"));
    assert!(boot(&mut erased, 1) > sure_of_it + 1);
    // All saves are lost, and there are records.
    let mut lost = Chip::new(BLOCKS);
    (0..3).for_each(|_| lost.start(2));
    sure_of_it = lost.mounted().superblock.boot;
    lost.pages.retain(|(block, _), _| *block >= LOG_START);
    assert!(boot(&mut lost, 0) > sure_of_it + 1);
}

/// Where every other of the superblock's blocks has failed, the last one with a save is not erased for another try.
#[test]
fn the_last_save_is_kept_where_no_other_block_works() {
    let mut chip = Chip::new(BLOCKS);
    chip.start(1);
    let home = chip.mounted().home.0;
    for block in (0..LOG_START).filter(|block| *block != home) {
        chip.failing.push((block, 0));
    }
    let erased = chip.erased.len();
    let mut log = chip.mounted();
    assert_eq!(block_on(log.append(&entry())), Err(LogError::Worn));
    let others = (1..LOG_START).map(|step| (home + step) % LOG_START);
    assert_eq!(chip.erased[erased..], others.collect::<Vec<_>>());
    assert!(sure(&mut chip));
}

fn kept(chip: &mut Chip) -> Option<Vec<u8>> {
    let mut buffer = [0; LONGEST];
    chip.mounted().kept_set(&mut buffer).expect("reads").map(<[u8]>::to_vec)
}

fn keep(chip: &mut Chip, content: &[u8]) {
    let mut buffer = [0; LONGEST];
    block_on(chip.mounted().keep_set(content, &mut buffer)).expect("kept");
}

/// Both copies of a piece of the newest set are lost: the one before it counts, and of two that are torn the one before both.
#[test]
fn of_sets_that_are_torn_the_newest_whole_one_counts() {
    let sets: [Vec<u8>; 3] = [1_u8, 2, 3].map(|number| std::vec![number; 500]);
    let mut chip = Chip::new(BLOCKS);
    for set in &sets {
        keep(&mut chip, set);
    }
    // 500 bytes are three pieces: pages 0 to 2 and 3 to 5.
    for (number, set) in sets.iter().enumerate().rev() {
        assert_eq!(kept(&mut chip).as_ref(), Some(set));
        let block = BLOCKS - 3 + number as u16;
        for page in [1, 4] {
            chip.at(block, page).fill(0);
        }
    }
    assert_eq!(kept(&mut chip), None);
}

/// Three wrong bits look like one to the code of a half, which then puts a fourth one wrong. The checksum sees it, and the other
/// half is whole.
#[test]
fn a_half_that_the_code_takes_for_whole_gives_way_to_the_other() {
    let set = std::vec![7; 100];
    let mut chip = Chip::new(BLOCKS);
    keep(&mut chip, &set);
    let block = BLOCKS - 3;
    let flipped = |chip: &mut Chip, bits: [usize; 3]| {
        for page in [0, 1] {
            for bit in bits {
                chip.at(block, page)[bit / 8] ^= 1 << (bit % 8);
            }
        }
    };
    let mut struck = 0;
    for bit in 0..400 {
        let bits = [bit, bit + 900, bit + 1_500];
        flipped(&mut chip, bits);
        let mut read = *chip.at(block, 0);
        struck += u32::from(page::correct(&mut read)[0].is_ok());
        assert_eq!(kept(&mut chip).as_ref(), Some(&set), "{bits:?}");
        flipped(&mut chip, bits);
    }
    assert!(struck > 100, "{struck}");
}
