//! A gyro in its place: itself, dead, or babbling.
//!
//! Frames in, frames out, as of the [`Adis16265`] behind it unless a fault speaks for it: the lines of a dead one
//! float and read 0x0000, a babbling one answers noise.

use crate::part::{Nanos, SpiPart, adis16265::Adis16265, signal::Noise};

/// One of the four gyros.
pub struct Gyro {
    part: Adis16265,
    silent: bool,
    babbling: bool,
    babble: Noise,
    babbled: u64,
}

impl Gyro {
    pub(super) fn new(part: Adis16265, babble: Noise) -> Self {
        Gyro {
            part,
            silent: false,
            babbling: false,
            babble,
            babbled: 0,
        }
    }

    /// [ns] when its latest frame ended, 0 before the first.
    pub fn latest_frame(&self) -> Nanos {
        self.part.latest_frame()
    }

    /// Dead (`true`), or back with its power-on registers.
    pub(super) fn silence(&mut self, silent: bool, now: Nanos) {
        self.silent = silent;
        if !silent {
            self.part.power_on(now);
        }
    }

    /// Answers noise (`true`), or is itself again.
    pub(super) fn babble(&mut self, babbling: bool) {
        self.babbling = babbling;
    }
}

impl SpiPart for Gyro {
    fn select(&mut self, now: Nanos) {
        if !self.silent {
            self.part.select(now);
        }
    }

    fn transfer(&mut self, mosi: u16, now: Nanos) -> u16 {
        if self.silent {
            return 0x0000;
        }
        let answer = self.part.transfer(mosi, now);
        if !self.babbling {
            return answer;
        }
        self.babbled += 1;
        self.babble.word(self.babbled)
    }

    fn deselect(&mut self, now: Nanos) {
        if !self.silent {
            self.part.deselect(now);
        }
    }

    fn power_on(&mut self, now: Nanos) {
        self.part.power_on(now);
    }
}
