//! The recorder's NAND on the host: latch cycles to the plant's part, each in its time.

use std::{cell::RefCell, rc::Rc};

use emems::nand::k9f1208::NandBus;

use super::{clock, plight::Plight};
use crate::{
    part::nand::{CYCLE, latch::K9f1208},
    plant::Plant,
    run::End,
};

/// The chip's pins.
pub struct NandPins(pub Rc<RefCell<Plant>>, pub Rc<Plight>);

impl NandPins {
    /// One latch cycle; the processor does nothing else meanwhile.
    fn cycle<T>(&self, act: impl FnOnce(&mut K9f1208, u64) -> T) -> T {
        self.1.serve(End::Nand);
        clock::spend(CYCLE);
        act(&mut self.0.borrow_mut().nand, clock::since_power_on())
    }
}

impl NandBus for NandPins {
    fn command(&mut self, byte: u8) {
        self.cycle(|part, now| part.command(byte, now));
    }

    fn address(&mut self, byte: u8) {
        self.cycle(|part, now| part.address(byte, now));
    }

    fn write(&mut self, bytes: &[u8]) {
        for byte in bytes {
            self.cycle(|part, now| part.write(*byte, now));
        }
    }

    fn read(&mut self, bytes: &mut [u8]) {
        for byte in bytes {
            *byte = self.cycle(K9f1208::read);
        }
    }

    fn protect(&mut self, on: bool) {
        self.0.borrow_mut().nand.protect(on, clock::since_power_on());
    }

    fn power_good(&mut self) -> bool {
        self.0.borrow_mut().power_good()
    }
}
