//! The unit's driver on the part's latches: what it does to cells, how long it waits, and what WP# and the supply do to it.

use std::cell::RefCell;

use embassy_futures::block_on;
use emems::nand::{
    Nand, NandError,
    k9f1208::{self, NandBus},
};

use super::{super::latch, *};

/// The part and what its wires see. Every cycle takes its time, and so does a wait.
struct Pins {
    part: latch::K9f1208,
    now: Nanos,
    supply_good: bool,
    /// WP# is not wired.
    protected_for_good: bool,
    /// When WP# is drawn by somebody else, and the supply fails with it.
    fails_at: Option<Nanos>,
    /// The supply is good again as soon as it has failed.
    returns: bool,
    /// Nobody draws WP# when it fails.
    unprotected: bool,
}

impl Pins {
    fn new() -> RefCell<Pins> {
        RefCell::new(Pins {
            part: latch::K9f1208::new(Cells::new(4096, &[], 1)),
            now: 0,
            supply_good: true,
            protected_for_good: false,
            fails_at: None,
            returns: false,
            unprotected: false,
        })
    }

    fn wait(&mut self, time: Nanos) {
        let end = self.now + time;
        if let Some(at) = self.fails_at.take_if(|at| *at <= end) {
            self.supply_good = self.returns;
            if !self.unprotected {
                self.part.protect(true, at.max(self.now));
            }
        }
        self.now = end;
    }

    fn cycle<T>(&mut self, act: impl FnOnce(&mut latch::K9f1208, Nanos) -> T) -> T {
        self.wait(CYCLE);
        act(&mut self.part, self.now)
    }
}

struct Wires<'a>(&'a RefCell<Pins>);

impl NandBus for Wires<'_> {
    fn command(&mut self, byte: u8) {
        self.0.borrow_mut().cycle(|part, now| part.command(byte, now));
    }
    fn address(&mut self, byte: u8) {
        self.0.borrow_mut().cycle(|part, now| part.address(byte, now));
    }
    fn write(&mut self, bytes: &[u8]) {
        for byte in bytes {
            self.0.borrow_mut().cycle(|part, now| part.write(*byte, now));
        }
    }
    fn read(&mut self, bytes: &mut [u8]) {
        bytes.fill_with(|| self.0.borrow_mut().cycle(latch::K9f1208::read));
    }
    fn protect(&mut self, on: bool) {
        let mut pins = self.0.borrow_mut();
        let (now, on) = (pins.now, on || pins.protected_for_good);
        pins.part.protect(on, now);
    }
    fn power_good(&mut self) -> bool {
        self.0.borrow().supply_good
    }
}

struct Wait<'a>(&'a RefCell<Pins>);

impl embedded_hal_async::delay::DelayNs for Wait<'_> {
    async fn delay_ns(&mut self, ns: u32) {
        self.0.borrow_mut().wait(Nanos::from(ns));
    }
}

fn driver(pins: &RefCell<Pins>) -> k9f1208::K9f1208<Wires<'_>, Wait<'_>> {
    k9f1208::K9f1208::new(Wires(pins), Wait(pins))
}

const FAR: PageAddress = PageAddress { block: 4000, page: 31 };

#[test]
fn the_chip_behind_its_latches_is_the_chip() {
    let pins = Pins::new();
    let mut chip = driver(&pins);
    block_on(async {
        assert_eq!(chip.identify().await, Ok(()));
        assert_eq!(chip.erase(4000).await, Ok(()));
        assert_eq!(chip.program(FAR, &page(0x3C)).await, Ok(()));
    });
    let (mut whole, mut spare) = ([0; PAGE_BYTES], [0; 16]);
    assert_eq!(chip.read(FAR, &mut whole), Ok(()));
    assert_eq!(whole, page(0x3C));
    assert_eq!(chip.read_spare(FAR, &mut spare), Ok(()));
    assert_eq!(spare, page(0x3C)[MAIN_BYTES..]);
    assert_eq!(pins.borrow_mut().part.cells.read(FAR), page(0x3C));
    assert!(pins.borrow().part.is_protected());
    // WP# is high for tWW before a command.
    assert_eq!(pins.borrow().part.cells.breaks, []);
}

#[test]
fn a_chip_that_stays_busy_is_given_up_in_5_ms_and_an_erase_in_10() {
    let pins = Pins::new();
    let mut chip = driver(&pins);
    assert_eq!(block_on(chip.identify()), Ok(()));
    pins.borrow_mut().part.cells.befalls.dead = true;
    let took = |limit: Nanos, work: &mut dyn FnMut() -> Result<(), NandError>| {
        let before = pins.borrow().now;
        assert_eq!(work(), Err(NandError::Timeout));
        let took = pins.borrow().now - before;
        assert!(took <= limit + 200_000, "{took} ns of {limit}");
    };
    took(5_000_000, &mut || block_on(chip.program(FAR, &page(0))));
    took(10_000_000, &mut || block_on(chip.erase(4000)));
    took(5_000_000, &mut || block_on(chip.identify()));
    took(5_000_000, &mut || chip.read(FAR, &mut [0; PAGE_BYTES]));
}

/// tRST is up to 500 us after an erase. A part that is asked for its name before that does not answer.
#[test]
fn a_chip_that_gives_up_an_erase_is_waited_for_before_it_is_asked_who_it_is() {
    let pins = Pins::new();
    for byte in [0x60, 0xD0] {
        let mut wires = Wires(&pins);
        wires.protect(false);
        wires.0.borrow_mut().wait(1_000);
        wires.command(byte);
        if byte == 0x60 {
            (0..3).for_each(|_| wires.address(0));
        }
    }
    pins.borrow_mut().wait(100_000);
    assert_eq!(block_on(driver(&pins).identify()), Ok(()));
    assert!(pins.borrow().now > 500_000);
}

#[test]
fn a_write_protection_that_does_not_lift_is_named_and_nothing_is_begun() {
    let pins = Pins::new();
    pins.borrow_mut().protected_for_good = true;
    let mut chip = driver(&pins);
    assert_eq!(block_on(chip.erase(4000)), Err(NandError::Protected));
    assert_eq!(block_on(chip.program(FAR, &page(0))), Err(NandError::Protected));
    assert_eq!(pins.borrow().part.cells.operations, 0);
}

/// Drawn in the middle of an operation, by the voltage detector's interrupt: torn, but no worn block.
#[test]
fn write_protection_drawn_in_the_middle_is_a_failing_supply_and_no_failed_block() {
    for into in [0, 50_000, 190_000] {
        let pins = Pins::new();
        let mut chip = driver(&pins);
        assert_eq!(block_on(chip.erase(4000)), Ok(()));
        let begins = pins.borrow().now + 600 * CYCLE;
        pins.borrow_mut().fails_at = Some(begins + into);
        assert_eq!(
            block_on(chip.program(FAR, &page(0))),
            Err(NandError::PowerFailing),
            "{into}"
        );
        let operations = pins.borrow().part.cells.operations;
        assert_eq!(block_on(chip.erase(4000)), Err(NandError::PowerFailing));
        assert_eq!(pins.borrow().part.cells.operations, operations);
        // Back again, the block is as good as before.
        pins.borrow_mut().supply_good = true;
        assert_eq!(block_on(chip.erase(4000)), Ok(()));
        assert_eq!(block_on(chip.program(FAR, &page(0))), Ok(()));
    }
}

/// A dip that is over before the part is looked at: the supply is good again, and only the part's own status tells that it was
/// protected meanwhile. A block that is called worn for it is lost for good.
#[test]
fn a_dip_that_is_over_is_a_failing_supply_and_no_failed_block() {
    let pins = Pins::new();
    let mut chip = driver(&pins);
    assert_eq!(block_on(chip.erase(4000)), Ok(()));
    let begins = pins.borrow().now + 600 * CYCLE;
    pins.borrow_mut().fails_at = Some(begins + 50_000);
    pins.borrow_mut().returns = true;
    assert_eq!(block_on(chip.program(FAR, &page(0))), Err(NandError::PowerFailing));
}

/// The supply fails at the end of an operation, before anybody has drawn WP#: what is there cannot be trusted.
#[test]
fn a_supply_that_fails_without_protection_is_no_success() {
    let pins = Pins::new();
    let mut chip = driver(&pins);
    let begins = pins.borrow().now;
    pins.borrow_mut().unprotected = true;
    pins.borrow_mut().fails_at = Some(begins + 50_000);
    assert_eq!(block_on(chip.erase(4000)), Err(NandError::PowerFailing));
}
