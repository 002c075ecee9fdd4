//! The peer: `sequential-storage`'s queue under pairs of cuts, on its own NOR model with its own rules.
//!
//! Its model cuts after any byte, with whole bytes only: no torn words, no unstable bits, no half erases, so it is the
//! milder of the two. What it loses is printed beside what is asked of the flight log in `recorder_cuts`; the figure is
//! the peer's and no requirement of ours.

use std::collections::BTreeSet;

use embassy_futures::block_on;
use sequential_storage::{
    cache::Cache,
    mock_flash::{MockFlashBase, WriteCountCheck},
    queue::{QueueConfig, QueueStorage},
};

/// Six pages of 64 words of four bytes.
type Flash = MockFlashBase<6, 4, 64>;

/// Values that fit without an erase.
const VALUES: u64 = 40;

#[test]
fn pairs_of_cuts_on_the_peer() {
    let (mut runs, mut acknowledged, mut lost) = (0_u64, 0_u64, 0_u64);
    for first in 0..900 {
        for second in 0..48 {
            let mut flash = Flash::new(WriteCountCheck::Twice, None, true);
            let mut kept = BTreeSet::new();
            let mut next = 0;
            for cut in [Some(first), Some(second), None] {
                flash.bytes_until_shutoff = cut;
                let mut queue =
                    QueueStorage::new(flash, QueueConfig::new(Flash::FULL_FLASH_RANGE), Cache::new_uncached());
                for _ in 0..if cut.is_some() { VALUES } else { 2 } {
                    let pushed = block_on(queue.push(&u64::to_le_bytes(next), false));
                    if pushed.is_ok() {
                        kept.insert(next);
                    }
                    next += 1;
                    if pushed.is_err() {
                        break;
                    }
                }
                flash = queue.destroy().0;
            }
            let mut queue = QueueStorage::new(flash, QueueConfig::new(Flash::FULL_FLASH_RANGE), Cache::new_uncached());
            let mut found = BTreeSet::new();
            block_on(async {
                let Ok(mut values) = queue.iter().await else { return };
                let mut buffer = [0; 64];
                while let Ok(Some(value)) = values.next(&mut buffer).await {
                    if let Ok(bytes) = <[u8; 8]>::try_from(&value[..]) {
                        found.insert(u64::from_le_bytes(bytes));
                    }
                }
            });
            runs += 1;
            acknowledged += kept.len() as u64;
            lost += kept.difference(&found).count() as u64;
        }
    }
    println!("sequential-storage 8: {runs} runs of two cuts, {acknowledged} values acknowledged, {lost} lost");
    assert!(runs == 43_200 && acknowledged > runs);
}
