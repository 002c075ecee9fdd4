//! A gyro in its place: itself, dead, babbling or frozen.
//!
//! Frames in, frames out, as of the [`Adis16265`] behind it unless a fault speaks for it: the lines of a dead one
//! float and read 0x0000, a babbling one answers noise, a frozen one what it answered first to the same frame.

use std::collections::BTreeMap;

use crate::part::{Nanos, SpiPart, adis16265::Adis16265, signal::Noise};

/// One of the four gyros.
pub struct Gyro {
    part: Adis16265,
    silent: bool,
    babbling: bool,
    /// Answers since it froze, by the frame they answer.
    frozen: Option<BTreeMap<u16, u16>>,
    asked: u16,
    noise: Noise,
    /// Words it did not give, gave at random, and gave again.
    struck: [u64; 3],
}

impl Gyro {
    pub(super) fn new(part: Adis16265, noise: Noise) -> Self {
        Gyro {
            part,
            silent: false,
            babbling: false,
            frozen: None,
            asked: 0,
            noise,
            struck: [0; 3],
        }
    }

    /// \[ns\] when its latest frame ended, 0 before the first.
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

    /// Answers each frame as it did first from now on (`true`), or is itself again.
    pub(super) fn freeze(&mut self, frozen: bool) {
        self.frozen = frozen.then(BTreeMap::new);
    }

    /// How often each fault did something, by name.
    pub(super) fn struck(&self) -> [(&'static str, u64); 3] {
        let [silent, garbage, frozen] = self.struck;
        [("silent", silent), ("garbage", garbage), ("frozen", frozen)]
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
            self.struck[0] += 1;
            return 0x0000;
        }
        let answer = self.part.transfer(mosi, now);
        let asked = std::mem::replace(&mut self.asked, mosi);
        if self.babbling {
            self.struck[1] += 1;
            return self.noise.word(self.struck[1]);
        }
        let Some(frozen) = &mut self.frozen else {
            return answer;
        };
        self.struck[2] += 1;
        *frozen.entry(asked).or_insert(answer)
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
