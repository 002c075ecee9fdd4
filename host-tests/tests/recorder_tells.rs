//! What the flight log says of itself: its newest record, its fill, an erase under way, and that it is no longer sure.

use std::cell::Cell;

use embassy_futures::block_on;
use emems::{
    flight_log::{
        FlightLog, LOG_START, LogError, Resumed,
        page::{self, Stamp},
        record,
        record::BootHeader,
    },
    nand::{Nand, NandError, PAGES_PER_BLOCK, PageAddress, PageBytes, SpareBytes, ecc},
};
use host_tests::recorder::{Flown, entry, log, read_all, three_boots};
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

/// The last pages of a boot may be torn, and read so once more and then never again: what begins the next boot has both records
/// that they held. Whatever that boot did, and wherever in its block it ended.
#[test]
fn the_two_newest_records_of_the_boot_before_outlast_its_pages() {
    for records in [1, 2, 3, 20, 27, 28, 29, 30, 31, 32, 60, 61] {
        let mut flown = Flown::on(Cells::new(BLOCKS, &[], 1));
        flown.boot(records, None);
        flown.boot(1, None);
        for block in LOG_START..BLOCKS {
            for page in 0..PAGES_PER_BLOCK {
                let at = PageAddress { block, page };
                let stamp = page::stamp(page::spare(&flown.chip.read(at)), at);
                if matches!(stamp, Stamp::Ours(tag) if tag.boot == 1) {
                    flown.chip.destroy(at);
                }
            }
        }
        let mut wrong = 0;
        let found = read_all(&mut flown.chip, &mut wrong);
        let newest = flown.acknowledged.iter().rev().take(3);
        for (key, id) in newest {
            assert_eq!(found.get(key), Some(id), "{records} records: {key:?}");
        }
        assert_eq!(wrong, 0);
    }
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

/// An erase takes effect at once: what its blocks still hold until their turn comes is of the log before.
#[test]
fn what_an_erase_has_not_reached_yet_is_read_no_more() {
    let mut flown = three_boots(BLOCKS, 1);
    let mut log = log(&mut flown.chip);
    block_on(async {
        log.mount().await.expect("mounts");
        assert!(log.read(0).expect("reads").iter().all(Option::is_some));
        log.start_erase().await.expect("begins");
        assert_eq!(log.read(0), Ok([None; 2]));
    });
}

/// A block lasts some 100,000 erases (K9F1208U0M data sheet): a save of the superblock takes two pages, and an erase only where
/// its block is full.
#[test]
fn a_block_of_the_superblock_is_erased_after_sixteen_saves() {
    let (erases, fails, spoils) = Default::default();
    let mut log = FlightLog::new(chip(&erases, &fails, &spoils), BootHeader::default());
    block_on(async {
        log.mount().await.expect("mounts");
        for save in 0..64 {
            let flight = save % 2 == 0;
            let mode = Resumed {
                flight,
                ..Resumed::default()
            };
            log.keep_mode(mode).await.expect("saves");
        }
        assert_eq!(erases.get(), 4);
        assert_eq!(log.mount().await.map(|mode| mode.flight), Ok(false));
    });
}

/// Where the halves of a page begin, and their codes.
const HALVES: [(usize, usize); 2] = [(0, 512), (256, 518)];

/// More wrong bits in a half than its code corrects.
fn damaged(page: &mut PageBytes, half: usize) {
    page[HALVES[half].0 + 9] ^= 0b11;
}

/// Another half than was given, whole in itself.
fn exchanged(page: &mut PageBytes, half: usize) {
    let (at, code) = HALVES[half];
    let other = [0x3C; 256];
    page[at..at + 256].copy_from_slice(&other);
    page[code..code + 3].copy_from_slice(&ecc::code(&other));
}

/// What may become of a page while the chip reports success.
const SPOILT: [fn(&mut PageBytes); 5] = [
    |page| damaged(page, 0),
    |page| damaged(page, 1),
    |page| exchanged(page, 0),
    |page| exchanged(page, 1),
    // Its tag.
    |page| page[521..525].fill(0x3C),
];

/// A chip reports success for what it did not keep. Each page is read back, all of it: half a page is one copy less of a record
/// that was acknowledged, and a page without its tag is found by nobody.
#[test]
fn a_page_that_does_not_hold_what_it_was_given_is_written_elsewhere_and_its_block_retired() {
    for spoil in SPOILT {
        let (erases, fails, spoils) = Default::default();
        let mut log = FlightLog::new(chip(&erases, &fails, &spoils), BootHeader::default());
        block_on(async {
            log.mount().await.expect("mounts");
            log.append(&entry(0)).await.expect("appends");
            log.append(&entry(1)).await.expect("appends");
            spoils.set(Some(spoil));
            log.append(&entry(2)).await.expect("appends");
            assert_eq!(log.status().bad_blocks, 1);
        });
    }
}

/// So with the superblock; its tag is not looked at there, since its checksum says more.
#[test]
fn a_superblock_that_is_not_what_was_saved_is_saved_elsewhere() {
    for spoil in &SPOILT[..4] {
        let (erases, fails, spoils) = Default::default();
        let mut log = FlightLog::new(chip(&erases, &fails, &spoils), BootHeader::default());
        block_on(async {
            log.mount().await.expect("mounts");
            log.append(&entry(0)).await.expect("appends");
            spoils.set(Some(*spoil));
            let (flight, recording) = (true, true);
            let mode = Resumed {
                flight,
                recording,
                ..Resumed::default()
            };
            log.keep_mode(mode).await.expect("saves");
            assert_eq!(log.status().bad_blocks, 1);
            assert_eq!(log.mount().await, Ok(mode));
        });
    }
}

/// A chip that counts its erases, does nothing while it is told to, and spoils the next page if it is told how.
struct Failing<'a> {
    chip: Cells,
    erases: &'a Cell<u32>,
    fails: &'a Cell<bool>,
    spoils: &'a Cell<Option<fn(&mut PageBytes)>>,
}

fn chip<'a>(erases: &'a Cell<u32>, fails: &'a Cell<bool>, spoils: &'a Cell<Option<fn(&mut PageBytes)>>) -> Failing<'a> {
    let chip = Cells::new(BLOCKS, &[], 1);
    Failing {
        chip,
        erases,
        fails,
        spoils,
    }
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
        let mut bytes = *bytes;
        if let Some(spoil) = self.spoils.take() {
            spoil(&mut bytes);
        }
        Nand::program(&mut self.chip, at, &bytes).await
    }
    async fn erase(&mut self, block: u16) -> Result<(), NandError> {
        self.now()?;
        self.erases.set(self.erases.get() + 1);
        Nand::erase(&mut self.chip, block).await
    }
}

/// A page may be half programmed when its chip fails, and a page is programmed once: nothing more is written, not even by a chip
/// that works again, before a mount has looked.
#[test]
fn after_a_failure_of_the_chip_nothing_is_written_before_a_mount() {
    let (erases, fails, spoils) = Default::default();
    let mut log = FlightLog::new(chip(&erases, &fails, &spoils), BootHeader::default());
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
