use emems::nand::Nand;

use super::*;

const AT: PageAddress = PageAddress { block: 3, page: 0 };
const NEXT: PageAddress = PageAddress { block: 3, page: 1 };

fn page(fill: u8) -> PageBytes {
    let mut page = [fill; PAGE_BYTES];
    page[MAIN_BYTES + BAD_MARK] = 0xFF;
    page
}

fn erased() -> Cells {
    let mut cells = Cells::new(8, &[5], 1);
    assert_eq!(cells.erase(3), Outcome::Done);
    cells
}

#[test]
fn a_programmed_page_reads_back_until_it_is_erased() {
    let mut cells = erased();
    assert_eq!(cells.program(AT, &page(0x5A)), Outcome::Done);
    assert_eq!(cells.read(AT), page(0x5A));
    assert_eq!(cells.erase(3), Outcome::Done);
    assert_eq!(cells.read(AT), [0xFF; PAGE_BYTES]);
    assert_eq!(cells.breaks, []);
}

#[test]
fn every_break_of_a_rule_is_kept() {
    let mut cells = erased();
    cells.program(NEXT, &page(0));
    cells.program(NEXT, &page(0));
    cells.program(AT, &page(0));
    cells.program(PageAddress { block: 5, page: 0 }, &page(0));
    cells.erase(5);
    cells.program(PageAddress { block: 3, page: 2 }, &[0; PAGE_BYTES]);
    assert_eq!(
        cells.breaks,
        [
            Break::ProgrammedTwice(NEXT),
            Break::OutOfOrder(AT),
            Break::MarkedBad(5),
            Break::MarkedBad(5),
            Break::MarkWritten(PageAddress { block: 3, page: 2 }),
        ]
    );
}

#[test]
fn a_torn_page_spoils_its_block_until_it_is_erased() {
    for tear in TEARS {
        let mut cells = erased();
        cells.befalls.cut = Some((2, tear));
        assert_eq!(cells.program(AT, &page(0)), Outcome::Cut);
        assert!(cells.off);
        cells.power_on();
        cells.program(NEXT, &page(0));
        assert_eq!(cells.breaks, [Break::NotErased(NEXT)], "{tear:?}");
    }
}

#[test]
fn tears_leave_what_they_say() {
    let after = |tear| {
        let mut cells = erased();
        cells.befalls.cut = Some((2, tear));
        cells.program(AT, &page(0));
        let zeros = |bytes: &[u8]| bytes.iter().map(|byte| byte.count_zeros()).sum::<u32>();
        let read = cells.read(AT);
        (zeros(&read[..MAIN_BYTES]), zeros(&read[MAIN_BYTES..]))
    };
    assert_eq!(after(Tear::Nothing), (0, 0));
    assert_eq!(after(Tear::MainOnly), (4096, 0));
    assert_eq!(after(Tear::SpareOnly), (0, 120));
    assert_eq!(after(Tear::Unacknowledged), (4096, 120));
    assert!((1_800..2_300).contains(&after(Tear::Half).0));
    assert!((1..300).contains(&after(Tear::Few).0));
    assert!((3_800..4_096).contains(&after(Tear::Most).0));
}

#[test]
fn cells_between_two_states_read_differently_each_time() {
    let mut cells = erased();
    cells.befalls.cut = Some((2, Tear::Half));
    cells.program(AT, &page(0));
    let first = cells.read(AT);
    assert!((0..10).any(|_| cells.read(AT) != first));
}

#[test]
fn worn_blocks_fail_aloud_or_in_silence() {
    let mut cells = erased();
    cells.befalls.worn = vec![(3, 1, Wear::ProgramFails), (4, 0, Wear::EraseDoesNothing)];
    assert_eq!(cells.program(AT, &page(0)), Outcome::Failed);
    assert_eq!(cells.erase(4), Outcome::Done);
    cells.befalls.worn = vec![(3, 0, Wear::ProgramDoesNothing)];
    assert_eq!(cells.erase(3), Outcome::Done);
    assert_eq!(cells.program(AT, &page(0)), Outcome::Done);
    assert_eq!(cells.read(AT), [0xFF; PAGE_BYTES]);
}

#[test]
fn the_chip_behind_its_latches_is_the_chip() {
    use emems::nand::k9f1208::{self, NandBus};
    /// Every cycle takes its time, and so does a wait.
    struct Pins {
        part: latch::K9f1208,
        now: Nanos,
    }
    struct Wires<'a>(&'a std::cell::RefCell<Pins>);
    impl NandBus for Wires<'_> {
        fn command(&mut self, byte: u8) {
            self.0.borrow_mut().tick().command(byte);
        }
        fn address(&mut self, byte: u8) {
            self.0.borrow_mut().tick().address(byte);
        }
        fn write(&mut self, bytes: &[u8]) {
            bytes.iter().for_each(|byte| self.0.borrow_mut().tick().write(*byte));
        }
        fn read(&mut self, bytes: &mut [u8]) {
            bytes
                .iter_mut()
                .for_each(|byte| *byte = self.0.borrow_mut().tick().read());
        }
        fn protect(&mut self, on: bool) {
            let mut pins = self.0.borrow_mut();
            let now = pins.now;
            pins.part.protect(on, now);
        }
        fn power_good(&mut self) -> bool {
            true
        }
    }
    impl Pins {
        fn tick(&mut self) -> &mut Self {
            self.now += CYCLE;
            self
        }
        fn command(&mut self, byte: u8) {
            self.part.command(byte, self.now);
        }
        fn address(&mut self, byte: u8) {
            self.part.address(byte, self.now);
        }
        fn write(&mut self, byte: u8) {
            self.part.write(byte, self.now);
        }
        fn read(&mut self) -> u8 {
            self.part.read(self.now)
        }
    }
    struct Wait<'a>(&'a std::cell::RefCell<Pins>);
    impl embedded_hal_async::delay::DelayNs for Wait<'_> {
        async fn delay_ns(&mut self, ns: u32) {
            self.0.borrow_mut().now += Nanos::from(ns);
        }
    }
    let pins = std::cell::RefCell::new(Pins {
        part: latch::K9f1208::new(Cells::new(4096, &[], 1)),
        now: 0,
    });
    let mut chip = k9f1208::K9f1208::new(Wires(&pins), Wait(&pins));
    let far = PageAddress { block: 4000, page: 31 };
    embassy_futures::block_on(async {
        assert_eq!(chip.identify().await, Ok(()));
        assert_eq!(chip.erase(4000).await, Ok(()));
        assert_eq!(chip.program(far, &page(0x3C)).await, Ok(()));
        let (mut whole, mut spare) = ([0; PAGE_BYTES], [0; 16]);
        assert_eq!(chip.read(far, &mut whole).await, Ok(()));
        assert_eq!(whole, page(0x3C));
        assert_eq!(chip.read_spare(far, &mut spare).await, Ok(()));
        assert_eq!(spare, page(0x3C)[MAIN_BYTES..]);
    });
    assert_eq!(pins.borrow_mut().part.cells.read(far), page(0x3C));
    pins.borrow_mut().part.cells.befalls.dead = true;
    embassy_futures::block_on(async {
        let before = pins.borrow().now;
        assert_eq!(chip.erase(4000).await, Err(emems::nand::NandError::Timeout));
        assert!(
            pins.borrow().now - before <= 11_000_000,
            "an erase is given up after 10 ms"
        );
    });
}
