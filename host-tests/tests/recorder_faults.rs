//! What may befall the recorder besides a cut, one named test each (fault catalogue F3, F7, F10 to F18, F20, F21).

use std::collections::BTreeSet;

use embassy_futures::block_on;
use emems::{
    flight_log::{
        FlightLog, LOG_START, LogError,
        record::BootHeader,
        superblock::{self, Superblock},
    },
    nand::{NandError, PAGES_PER_BLOCK, PageAddress},
};
use host_tests::recorder::{Flown, Tally, campaign, entry, read_all};
use twin::part::nand::{Break, Cells, TEARS, Tear, Wear};

const BLOCKS: u16 = 20;

/// [ns] what a mount may take of the chip's time after a clean end, and at worst.
const MOUNT_CLEAN: u64 = 2_000_000;
const MOUNT_WORST: u64 = 100_000_000;
/// [ns] what an append may take.
const APPEND: u64 = 1_500_000;

fn log(chip: &mut Cells) -> FlightLog<&mut Cells> {
    FlightLog::new(chip, BootHeader::default())
}

/// A chip with three boots of records.
fn flown(seed: u64) -> Flown {
    let mut flown = Flown::on(Cells::new(BLOCKS, &[], seed));
    for records in [40, 3, 50] {
        flown.boot(records, None);
    }
    flown
}

fn nothing_lost(mut flown: Flown) -> Tally {
    let tally = flown.judge(&BTreeSet::new());
    assert!(tally.is_clean(), "{tally:?} {:?}", flown.chip.breaks);
    tally
}

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
    assert!(tally.is_clean());
}

/// F7: the old log is whole or gone, wherever an erase was cut.
#[test]
fn f07_a_cut_erase_leaves_the_old_log_or_none() {
    const RECORDS: usize = 40 + 3 + 50;
    let operations = 25;
    for flight in 0..operations * TEARS.len() as u64 * 10 {
        let mut flown = flown(flight);
        flown.chip.befalls.cut = Some((
            flown.chip.operations + 1 + flight % operations,
            TEARS[(flight / operations) as usize % TEARS.len()],
        ));
        let told = block_on(async {
            let mut log = log(&mut flown.chip);
            log.mount().await?;
            let told = log.start_erase().await;
            while told.is_ok() && log.free_time().await? {}
            told
        });
        let erased = told.is_ok() || flown.chip.operations > 0 && told.is_err() && !flown.chip.off;
        // Whichever it is, it stays that: through mounts, and through what a next boot writes.
        for _ in 0..3 {
            flown.chip.power_on();
            let mut log = log(&mut flown.chip);
            let kept = block_on(async {
                log.mount().await.expect("mounts");
                log.status().last.is_some()
            });
            if kept {
                let mut wrong = 0;
                let found = read_all(&mut flown.chip, &mut wrong);
                assert_eq!(
                    (found.len(), wrong),
                    (RECORDS, 0),
                    "flight {flight}: the old log is not whole"
                );
                assert!(
                    !erased || told.is_err(),
                    "flight {flight}: an erase that was acknowledged is undone"
                );
            }
        }
        flown.boot(5, None);
        assert_eq!(flown.chip.breaks, [], "flight {flight}");
    }
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
        (4096 - 4 - 79) * 32,
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
            let tally = flown.judge(&BTreeSet::new());
            assert!(
                tally.is_clean() && tally.acknowledged == 200,
                "{wear:?} {after}: {tally:?}"
            );
            assert!(known <= 2, "{wear:?} {after}");
        }
    }
}

/// F12: one wrong bit in each 256 bytes of every read.
#[test]
fn f12_a_wrong_bit_in_every_half_page_costs_nothing_and_is_counted() {
    let mut flown = flown(1);
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
    let whole = flown(3);
    let newest = whole.acknowledged.last_key_value().map(|(key, _)| *key);
    for block in LOG_START..BLOCKS {
        for page in 0..PAGES_PER_BLOCK {
            let mut flown = flown(3);
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
    }
    for astray in 5..60 {
        let mut flown = Flown::on(Cells::new(64, &[], 1));
        flown.chip.befalls.astray = Some((astray, 9));
        flown.boot(60, None);
        flown.boot(10, None);
        let tally = flown.judge(&BTreeSet::new());
        assert_eq!((tally.lost, tally.wrong), (0, 0), "operation {astray}");
    }
}

/// F15: busy for ever, or not there: an error in bounded time, with its name.
#[test]
fn f15_a_dead_or_absent_chip_is_an_error_with_a_name() {
    let mut chip = Cells::new(BLOCKS, &[], 1);
    chip.befalls.absent = true;
    let absent = block_on(log(&mut chip).mount());
    assert_eq!(absent, Err(LogError::Nand(NandError::WrongId([0xFF, 0xFF]))));
    let mut flown = flown(1);
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

/// F17: superblocks of all kinds.
#[test]
fn f17_a_lost_superblock_is_replaced_by_its_copy_or_by_a_scan() {
    // Each page of the superblock's blocks, one at a time, then all of them.
    let pages: Vec<_> = (0..LOG_START)
        .flat_map(|block| (0..8).map(move |page| (block, page)))
        .collect();
    for (block, page) in &pages {
        let mut flown = flown(7);
        flown.chip.destroy(PageAddress {
            block: *block,
            page: *page,
        });
        flown.boot(3, None);
        nothing_lost(flown);
    }
    let mut lost = flown(7);
    for (block, page) in pages {
        lost.chip.destroy(PageAddress { block, page });
    }
    lost.boot(3, None);
    assert_eq!(nothing_lost(lost).acknowledged, 96);
}

/// F17: a log of a newer format is refused by its number and left alone.
#[test]
fn f17_a_newer_format_is_named_and_left_alone() {
    let mut flown = flown(1);
    let mut image = flown.chip.image();
    let newest = superblock::encode(&Superblock::default());
    let mut newer = newest;
    newer[4] = 7;
    let crc = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC).checksum(&newer[..252]);
    newer[252..].copy_from_slice(&crc.to_le_bytes());
    image[..256].copy_from_slice(&newer);
    image[512..515].copy_from_slice(&emems::nand::ecc::code(&newer));
    let mut chip = Cells::of_image(BLOCKS, &image, 1);
    assert_eq!(block_on(log(&mut chip).mount()), Err(LogError::Newer(7)));
    assert_eq!(chip.operations, 0);
    flown.chip.power_on();
}

/// F17: what is no log is refused until an erase is asked for.
#[test]
fn f17_foreign_content_is_left_alone_until_it_is_erased_by_command() {
    let image: Vec<u8> = (0..u32::from(BLOCKS) * 32 * 528)
        .map(|at| if at % 528 == 517 { 0xFF } else { at as u8 })
        .collect();
    let mut chip = Cells::of_image(BLOCKS, &image, 1);
    let mut log = log(&mut chip);
    block_on(async {
        assert_eq!(log.mount().await, Err(LogError::Foreign));
        assert_eq!(log.append(&entry(1)).await, Err(LogError::NotMounted));
        assert_eq!(log.start_erase().await, Ok(()));
        assert!(log.append(&entry(1)).await.is_ok());
    });
}

/// F18 in part: all ones, all zeros.
#[test]
fn f18_an_empty_chip_is_a_new_log_and_a_dead_one_is_not() {
    let mut new = Cells::new(BLOCKS, &[], 1);
    assert!(block_on(log(&mut new).mount()).is_ok());
    let zeros = vec![0; 528 * 32 * 200];
    let mut dead = Cells::of_image(200, &zeros, 1);
    assert_eq!(block_on(log(&mut dead).mount()), Err(LogError::Worn));
}

/// F18: arbitrary images: no panic, no endless loop, and a mount within its figure (of this chip's size).
#[test]
fn f18_arbitrary_images_are_mounted_read_and_appended_to_in_bounded_time() {
    let mut valid = flown(1);
    valid.boot(20, None);
    let valid = valid.chip.image();
    for seed in 0..1_500 {
        let mut draw = host_tests::recorder::draws(7, seed);
        let mut image = match seed % 3 {
            // Random bytes; the mark's column is clear, or every block would be marked bad.
            0 => (0..valid.len()).map(|_| draw(256) as u8).collect(),
            1 => valid.clone(),
            _ => vec![[0x00, 0xFF, 0x5A][draw(3) as usize]; valid.len()],
        };
        for _ in 0..draw(400) {
            // Pages copied elsewhere, and bytes changed.
            let (from, to) = (528 * draw(640) as usize, 528 * draw(640) as usize);
            image.copy_within(from..from + 528, to);
            let at = draw(valid.len() as u64) as usize;
            image[at] = draw(256) as u8;
        }
        if draw(2) == 0 {
            image.chunks_mut(528).for_each(|page| page[517] = 0xFF);
        }
        let mut chip = Cells::of_image(BLOCKS, &image, seed);
        let mut log = log(&mut chip);
        let mounted = block_on(log.mount());
        for number in 0..700 {
            let _ = block_on(log.read(number));
        }
        for id in 0..5 {
            let _ = block_on(log.append(&entry(id)));
        }
        let _ = block_on(log.start_erase());
        let _ = block_on(log.append(&entry(6)));
        drop(log);
        assert!(
            chip.time < 700 * 60_000 + MOUNT_WORST,
            "image {seed}: {mounted:?} {} ns",
            chip.time
        );
    }
}

/// F21: a million reads of every block.
#[test]
fn f21_a_million_reads_cost_corrected_bits_and_no_record() {
    let mut flown = flown(1);
    flown.chip.befalls.disturbed_after = Some(250_000);
    for block in 0..BLOCKS {
        *flown.chip.reads_mut(block) = 1_000_000;
    }
    flown.boot(20, None);
    let status = {
        let mut log = log(&mut flown.chip);
        block_on(log.mount()).expect("mounts");
        for number in 0..log.status().used {
            block_on(log.read(number)).expect("reads");
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
    let mut lost = flown(1);
    for page in 4..7 {
        lost.chip.destroy(PageAddress { block: LOG_START, page });
    }
    assert_eq!(lost.judge(&BTreeSet::new()).lost, 2);
    let mut other = flown(1);
    let key = *other.acknowledged.first_key_value().expect("a record").0;
    other.acknowledged.insert(key, 77);
    assert_eq!(other.judge(&BTreeSet::new()).lost, 1);
    let mut broken = flown(1);
    let at = PageAddress {
        block: LOG_START,
        page: 0,
    };
    broken.chip.program(at, &[0xFF; 528]);
    assert_eq!(broken.chip.breaks, [Break::ProgrammedTwice(at)]);
}

/// Chip time of mounts and appends on a chip of full size, a third full.
#[test]
fn the_chips_time_stays_within_its_figures() {
    let marked: Vec<u16> = (0..80).map(|index| 5 + 51 * index).collect();
    let mut flown = Flown::on(Cells::new(4096, &marked, 1));
    for _ in 0..4 {
        flown.boot(10_000, None);
    }
    let mount = |chip: &mut Cells| {
        let before = chip.time;
        block_on(log(chip).mount()).expect("mounts");
        chip.time - before
    };
    let clean = mount(&mut flown.chip);
    let (slowest, _) = appends(&mut flown.chip.clone(), 3_000, true);
    let (_, total) = appends(&mut flown.chip.clone(), 3_000, false);
    for page in 0..4 {
        flown.chip.destroy(PageAddress { block: 0, page });
        flown.chip.destroy(PageAddress { block: 2, page });
    }
    let worst = mount(&mut flown.chip);
    let rate = 3_000 * 1_000_000_000 / total;
    println!("mount {clean} ns clean, {worst} ns at worst; append {slowest} ns at most; {rate} records a second");
    assert!(clean <= MOUNT_CLEAN && worst <= MOUNT_WORST, "{clean} {worst}");
    assert!(slowest <= APPEND, "{slowest}");
    assert!(rate >= 200, "{rate}");
}

/// [ns] appends after the first of a boot, with or without free time between them: the slowest, and all.
fn appends(chip: &mut Cells, count: u32, free_time: bool) -> (u64, u64) {
    let clock = std::cell::Cell::new(0);
    let mut log = FlightLog::new(Clocked { chip, clock: &clock }, BootHeader::default());
    block_on(async {
        log.mount().await.expect("mounts");
        log.append(&entry(60_000)).await.expect("appends");
        let (begun, mut slowest) = (clock.get(), 0);
        for id in 0..count {
            if free_time {
                log.free_time().await.expect("free time");
            }
            let before = clock.get();
            log.append(&entry(60_001 + id)).await.expect("appends");
            slowest = slowest.max(clock.get() - before);
        }
        (slowest, clock.get() - begun)
    })
}

/// A chip that shows its time while a log has it.
struct Clocked<'a> {
    chip: &'a mut Cells,
    clock: &'a std::cell::Cell<u64>,
}

impl emems::nand::Nand for Clocked<'_> {
    fn blocks(&self) -> u16 {
        self.chip.block_count()
    }
    async fn identify(&mut self) -> Result<(), NandError> {
        Ok(())
    }
    async fn read(&mut self, at: PageAddress, bytes: &mut emems::nand::PageBytes) -> Result<(), NandError> {
        let done = emems::nand::Nand::read(self.chip, at, bytes).await;
        self.clock.set(self.chip.time);
        done
    }
    async fn read_spare(&mut self, at: PageAddress, bytes: &mut emems::nand::SpareBytes) -> Result<(), NandError> {
        let done = emems::nand::Nand::read_spare(self.chip, at, bytes).await;
        self.clock.set(self.chip.time);
        done
    }
    async fn program(&mut self, at: PageAddress, bytes: &emems::nand::PageBytes) -> Result<(), NandError> {
        let done = emems::nand::Nand::program(self.chip, at, bytes).await;
        self.clock.set(self.chip.time);
        done
    }
    async fn erase(&mut self, block: u16) -> Result<(), NandError> {
        let done = emems::nand::Nand::erase(self.chip, block).await;
        self.clock.set(self.chip.time);
        done
    }
}

/// RAM of the log and of its longest call.
#[test]
fn the_log_takes_at_most_four_kilobytes() {
    let mut chip = Cells::new(BLOCKS, &[], 1);
    let of_log = size_of::<FlightLog<()>>();
    let mut log = log(&mut chip);
    let one = entry(1);
    let mount = size_of_val(&log.mount());
    let append = size_of_val(&log.append(&one));
    let erase = size_of_val(&log.start_erase());
    let free_time = size_of_val(&log.free_time());
    let calls = [mount, append, erase, free_time];
    let most = calls.into_iter().max().unwrap_or(0);
    println!("{of_log} bytes, its calls {calls:?} on a host");
    assert!(of_log + most <= 4096, "{of_log} + {calls:?}");
}
