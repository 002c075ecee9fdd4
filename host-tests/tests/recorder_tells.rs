//! What the flight log says of itself: its newest record, its fill, an erase under way, and that it is no longer sure.

use std::cell::Cell;

use embassy_futures::block_on;
use emems::{
    flight_log::{FlightLog, LOG_START, LogError, record, record::BootHeader},
    nand::{Nand, NandError, PAGES_PER_BLOCK, PageAddress, PageBytes, SpareBytes},
};
use host_tests::recorder::{entry, log, three_boots};
use twin::part::nand::Cells;

const BLOCKS: u16 = 24;

/// The attitude goes on from the newest record of the boot before. A new chip has none, and a boot that has begun to write has
/// its own: neither may be taken for it.
#[test]
fn the_newest_record_is_that_of_the_boot_before_and_of_no_other() {
    let mut chip = Cells::new(BLOCKS, &[], 1);
    let mut empty = log(&mut chip);
    block_on(async {
        empty.mount().await.expect("mounts");
        assert_eq!(empty.newest(), None);
        empty.append(&entry(0)).await.expect("appends");
        assert_eq!(empty.newest(), None);
    });
    let mut flown = three_boots(BLOCKS, 1);
    let before = *flown.acknowledged.last_key_value().expect("a record").0;
    let mut again = log(&mut flown.chip);
    block_on(async {
        again.mount().await.expect("mounts");
        assert_eq!(again.newest().and_then(|bytes| record::key(bytes).ok()), Some(before));
        again.append(&entry(93)).await.expect("appends");
        assert_eq!(again.newest(), None);
    });
}

/// G_ST tells how many blocks are left to erase, and the ground waits for none before it lets the unit fly.
#[test]
fn an_erase_says_what_is_left_of_it_until_it_is_done() {
    let mut flown = three_boots(BLOCKS, 1);
    let mut log = log(&mut flown.chip);
    block_on(async {
        log.mount().await.expect("mounts");
        assert_eq!(log.status().erasing, None);
        log.start_erase().await.expect("begins");
        let mut left = log.status().erasing.expect("under way");
        while log.free_time().await.expect("erases") {
            let now = log.status().erasing.expect("under way");
            assert!(now < left, "{now} of {left}");
            left = now;
        }
        assert_eq!((log.status().erasing, log.status().used), (None, 0));
    });
}

/// A dump beyond the last page is refused by the log, and not asked of the chip.
#[test]
fn a_page_beyond_the_chip_is_refused() {
    let mut flown = three_boots(BLOCKS, 1);
    let mut log = log(&mut flown.chip);
    block_on(log.mount()).expect("mounts");
    let pages = u32::from(BLOCKS - LOG_START) * u32::from(PAGES_PER_BLOCK);
    assert!(log.read(pages - 1).is_ok());
    assert_eq!(log.read(pages), Err(LogError::Full));
}

/// A chip that does nothing while it is told to.
struct Failing<'a> {
    chip: Cells,
    fails: &'a Cell<bool>,
}

impl Failing<'_> {
    fn now(&self) -> Result<(), NandError> {
        if self.fails.get() {
            Err(NandError::Timeout)
        } else {
            Ok(())
        }
    }
}

impl Nand for Failing<'_> {
    fn blocks(&self) -> u16 {
        self.chip.blocks()
    }
    async fn identify(&mut self) -> Result<(), NandError> {
        self.now()?;
        self.chip.identify().await
    }
    fn read(&mut self, at: PageAddress, bytes: &mut PageBytes) -> Result<(), NandError> {
        self.now()?;
        Nand::read(&mut self.chip, at, bytes)
    }
    fn read_spare(&mut self, at: PageAddress, bytes: &mut SpareBytes) -> Result<(), NandError> {
        self.now()?;
        Nand::read_spare(&mut self.chip, at, bytes)
    }
    async fn program(&mut self, at: PageAddress, bytes: &PageBytes) -> Result<(), NandError> {
        self.now()?;
        Nand::program(&mut self.chip, at, bytes).await
    }
    async fn erase(&mut self, block: u16) -> Result<(), NandError> {
        self.now()?;
        Nand::erase(&mut self.chip, block).await
    }
}

/// A page may be half programmed when its chip fails, and a page is programmed once: nothing more is written, not even by a chip
/// that works again, before a mount has looked.
#[test]
fn after_a_failure_of_the_chip_nothing_is_written_before_a_mount() {
    let fails = Cell::new(false);
    let chip = Cells::new(BLOCKS, &[], 1);
    let mut log = FlightLog::new(Failing { chip, fails: &fails }, BootHeader::default());
    block_on(async {
        log.mount().await.expect("mounts");
        log.append(&entry(0)).await.expect("appends");
        fails.set(true);
        assert_eq!(log.append(&entry(1)).await, Err(LogError::Nand(NandError::Timeout)));
        fails.set(false);
        assert_eq!(log.append(&entry(2)).await, Err(LogError::NotMounted));
        assert_eq!(log.free_time().await, Err(LogError::NotMounted));
        log.mount().await.expect("mounts");
        log.append(&entry(3)).await.expect("appends");
    });
}

/// A block that was erased ahead holds nothing: the fill is that of the records.
#[test]
fn a_block_erased_ahead_is_not_counted_as_used() {
    let mut chip = Cells::new(BLOCKS, &[], 1);
    let mut log = log(&mut chip);
    block_on(async {
        log.mount().await.expect("mounts");
        log.append(&entry(0)).await.expect("appends");
        let used = log.status().used;
        while log.free_time().await.expect("erases") {}
        assert_eq!(log.status().used, used);
        log.append(&entry(1)).await.expect("appends");
        assert_eq!(log.status().used, used + 1);
    });
}
