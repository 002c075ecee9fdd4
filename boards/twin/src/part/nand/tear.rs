//! What a power cut leaves of a program or erase.
//!
//! In: the cells before, what was to become of them, how it tears. Out: the cells after, and which of them are between
//! two states. Fractions and kinds after the power-cut tests of the flash file systems (littlefs, UBI), widened: a part
//! may be cut before anything happened, after everything did, and anywhere between.

use rand_xoshiro::{Xoshiro256PlusPlus, rand_core::Rng};

/// How an operation tears.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tear {
    /// It had not begun.
    Nothing,
    /// 2 % of the cells changed.
    Few,
    /// Half of them.
    Half,
    /// 99.5 % of them.
    Most,
    /// The first half of what it covers is whole, the rest untouched.
    FirstHalf,
    /// All but the last sixteen bytes: of a page, its main area only.
    MainOnly,
    /// The last sixteen bytes only: of a page, its spare area.
    SpareOnly,
    /// Everything, but nobody was told.
    Unacknowledged,
    /// Everything, it seems; but some cells changed barely and will read either way.
    Weak,
}

/// Every way.
pub const TEARS: [Tear; 9] = [
    Tear::Nothing,
    Tear::Few,
    Tear::Half,
    Tear::Most,
    Tear::FirstHalf,
    Tear::MainOnly,
    Tear::SpareOnly,
    Tear::Unacknowledged,
    Tear::Weak,
];

/// Of the cells that were to change, how many are left between two states, per thousand.
const UNSTABLE: u32 = 50;
/// The same for [`Tear::Weak`].
const WEAK: u32 = 5;
/// Spare bytes.
const TAIL: usize = 16;

impl Tear {
    /// Whether byte `at` of `length` is changed, bit by bit: chances per thousand that it changes, and that it is then,
    /// or stays, unstable.
    fn chances(self, at: usize, length: usize) -> (u32, u32) {
        let whole = |changed: bool| (1000 * u32::from(changed), 0);
        match self {
            Tear::Nothing => (0, 0),
            Tear::Few => (20, UNSTABLE),
            Tear::Half => (500, UNSTABLE),
            Tear::Most => (995, UNSTABLE),
            Tear::FirstHalf => whole(at < length / 2),
            Tear::MainOnly => whole(at < length - TAIL),
            Tear::SpareOnly => whole(at >= length - TAIL),
            Tear::Unacknowledged => (1000, 0),
            Tear::Weak => (1000, WEAK),
        }
    }

    /// Programs `bytes` into `cells`, which begin at bit `start` of their block.
    pub fn program(
        self,
        cells: &mut [u8],
        bytes: &[u8],
        start: u32,
        unstable: &mut Vec<u32>,
        random: &mut Xoshiro256PlusPlus,
    ) {
        let length = cells.len();
        for (at, (cell, byte)) in cells.iter_mut().zip(bytes).enumerate() {
            let to_change = *cell & !byte;
            let changed = self.change(at, length, start, to_change, unstable, random);
            *cell &= !changed;
        }
    }

    /// Erases `cells`, a block.
    pub fn erase(self, cells: &mut [u8], unstable: &mut Vec<u32>, random: &mut Xoshiro256PlusPlus) {
        let length = cells.len();
        for (at, cell) in cells.iter_mut().enumerate() {
            let to_change = !*cell;
            *cell |= self.change(at, length, 0, to_change, unstable, random);
        }
    }

    /// Which of the bits of `to_change` change.
    fn change(
        self,
        at: usize,
        length: usize,
        start: u32,
        to_change: u8,
        unstable: &mut Vec<u32>,
        random: &mut Xoshiro256PlusPlus,
    ) -> u8 {
        let (change, stay_between) = self.chances(at, length);
        if to_change == 0 || change == 0 {
            return 0;
        }
        if (change, stay_between) == (1000, 0) {
            return to_change;
        }
        let mut changed = 0;
        for bit in (0..8).filter(|bit| to_change >> bit & 1 == 1) {
            let drawn = random.next_u64();
            if (drawn as u32 % 1000) < change {
                changed |= 1 << bit;
            }
            if ((drawn >> 32) as u32 % 1000) < stay_between {
                unstable.push(start + 8 * at as u32 + bit);
            }
        }
        changed
    }
}
