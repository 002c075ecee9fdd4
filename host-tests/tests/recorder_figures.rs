//! What the flight log takes: time of the chip, RAM, and room.

use embassy_futures::block_on;
use emems::{
    flight_log::{FlightLog, Status, record::BootHeader},
    nand::{NandError, PageAddress},
};
use host_tests::recorder::{Flown, entry, log};
use twin::part::nand::Cells;

/// \[ns\] what a mount may take of the chip's time after a clean end, and at worst.
const MOUNT_CLEAN: u64 = 2_000_000;
const MOUNT_WORST: u64 = 100_000_000;
/// \[ns\] what an append may take.
const APPEND: u64 = 1_500_000;
/// Records of a chip with as many bad blocks as its data sheet allows, all 80 of them in the log's part: four blocks are the
/// superblock's, four the kept calibration set's.
const RECORDS: u32 = (4096 - 4 - 4 - 80) * 32;

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

/// \[ns\] appends after the first of a boot, with or without free time between them: the slowest, and all.
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
    fn read(&mut self, at: PageAddress, bytes: &mut emems::nand::PageBytes) -> Result<(), NandError> {
        let done = emems::nand::Nand::read(self.chip, at, bytes);
        self.clock.set(self.chip.time);
        done
    }
    fn read_spare(&mut self, at: PageAddress, bytes: &mut emems::nand::SpareBytes) -> Result<(), NandError> {
        let done = emems::nand::Nand::read_spare(self.chip, at, bytes);
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
    let mut chip = Cells::new(20, &[], 1);
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

/// Room, as the status line has it: in flight a page is a record, but for two of each boot.
#[test]
fn the_log_holds_seven_hours_at_5_hz_and_42_minutes_at_50() {
    let marked: Vec<u16> = (0..80).map(|index| 5 + 51 * index).collect();
    let mut chip = Cells::new(4096, &marked, 1);
    let mut log = log(&mut chip);
    block_on(log.mount()).expect("mounts");
    let status = log.status();
    println!(
        "{} records: {} min at 5 Hz, {} min at 50 Hz",
        status.capacity,
        status.minutes_left(200),
        status.minutes_left(20)
    );
    assert_eq!(status.capacity, RECORDS);
    assert_eq!((status.minutes_left(200), status.minutes_left(20)), (427, 42));
    let full = Status {
        used: status.capacity,
        ..status
    };
    assert_eq!(full.minutes_left(20), 0);
}
