//! Each gyro between two packets, in slices of a fiftieth of a second.
//!
//! At three turns a second an axis across the spin turns by 216 deg in a packet's period: its integral over the period
//! tells hardly anything. In a slice it turns by 22 deg. A gyro that touched the end of its range in a slice gives no value
//! there, but on which side it was; it is the others' turn, and its own again when it comes back.
//!
//! In: fast samples. Out: for each slice the mean rate of each gyro by trapezoids, as four times counts, which is a whole number
//! for two intervals and fits 16 bits (4 x 4368).

use super::{Fast, LONGEST_INTERVAL_S};
use crate::{geometry::PLATES, sample::NOT_READ, sensor::adis16265::RANGE_COUNTS};

/// Slices between two packets at most: at 5 Hz there are ten. Of a longer period the latest have no place.
pub const SLICES: usize = 10;

/// \[us\] a slice ends with the first fast sample that makes it as long: two intervals at 100 Hz.
const SHORTEST_US: u64 = 15_000;

/// [counts/4] said of a gyro that touched the end of its range, with the sign of that end.
pub const BEYOND: i16 = i16::MAX;

/// The gyros over a slice.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
pub struct Slice {
    /// \[us\] from its end to the end of the increment that it is sent with.
    pub before_us: u32,
    /// \[us\] how long it is; 0 for none.
    pub lasts_us: u16,
    /// [counts/4] mean rate of each gyro; plus or minus [`BEYOND`], or [`NOT_READ`] where it missed a sample.
    pub quarters: [i16; PLATES],
}

impl Slice {
    /// No slice.
    pub const NONE: Slice = Slice {
        before_us: 0,
        lasts_us: 0,
        quarters: [NOT_READ; PLATES],
    };

    /// Whether there is none.
    pub fn is_none(&self) -> bool {
        self.lasts_us == 0
    }
}

/// The slice that is under way, and those that are complete.
#[derive(Clone, Copy, Debug)]
pub(super) struct Slicer {
    done: [Slice; SLICES],
    /// \[us\] end of each of them.
    ends_us: [u64; SLICES],
    count: usize,
    began_us: u64,
    intervals: i32,
    /// [counts/2] sum of the intervals' means.
    halves: [i32; PLATES],
    missed: u8,
    /// For each gyro the end of its range that it touched, as a sign.
    beyond: [i16; PLATES],
}

impl Slicer {
    pub const EMPTY: Slicer = Slicer {
        done: [Slice::NONE; SLICES],
        ends_us: [0; SLICES],
        count: 0,
        began_us: 0,
        intervals: 0,
        halves: [0; PLATES],
        missed: 0,
        beyond: [0; PLATES],
    };

    /// An interval between two fast samples.
    pub fn add(&mut self, last: &Fast, now: &Fast) {
        let interval_us = now.at_us.saturating_sub(last.at_us);
        if interval_us == 0 || interval_us as f32 * 1e-6 > LONGEST_INTERVAL_S {
            self.restart(now.at_us);
            return;
        }
        if self.intervals == 0 {
            self.restart(last.at_us);
        }
        self.intervals = self.intervals.saturating_add(1);
        for (plate, (before, after)) in last.counts.into_iter().zip(now.counts).enumerate() {
            if before == NOT_READ || after == NOT_READ {
                self.missed |= 1 << plate;
                continue;
            }
            let both = i32::from(before).wrapping_add(after.into());
            self.halves[plate] = self.halves[plate].saturating_add(both);
            for counts in [before, after] {
                if counts.unsigned_abs() >= RANGE_COUNTS.unsigned_abs() {
                    self.beyond[plate] = counts.signum();
                }
            }
        }
        let lasts_us = now.at_us.saturating_sub(self.began_us);
        if lasts_us >= SHORTEST_US {
            self.close(now.at_us, lasts_us);
        }
    }

    fn close(&mut self, at_us: u64, lasts_us: u64) {
        if let (Some(slice), Some(end_us)) = (self.done.get_mut(self.count), self.ends_us.get_mut(self.count)) {
            *end_us = at_us;
            slice.lasts_us = lasts_us.min(u16::MAX.into()) as u16;
            for (plate, quarters) in slice.quarters.iter_mut().enumerate() {
                *quarters = if self.missed >> plate & 1 == 1 {
                    NOT_READ
                } else if self.beyond[plate] != 0 {
                    self.beyond[plate].wrapping_mul(BEYOND)
                } else {
                    let twice = self.halves[plate].saturating_mul(2);
                    twice.checked_div(self.intervals).unwrap_or(0) as i16
                };
            }
            self.count = self.count.saturating_add(1);
        }
        self.restart(at_us);
    }

    fn restart(&mut self, at_us: u64) {
        self.began_us = at_us;
        self.intervals = 0;
        self.halves = [0; PLATES];
        self.missed = 0;
        self.beyond = [0; PLATES];
    }

    /// The slices that are complete, as of the end of an increment.
    pub fn take(&mut self, end_us: u64) -> [Slice; SLICES] {
        let mut taken = core::mem::replace(&mut self.done, [Slice::NONE; SLICES]);
        for (slice, ended_us) in taken.iter_mut().zip(self.ends_us).take(self.count) {
            slice.before_us = end_us.saturating_sub(ended_us).min(u32::MAX.into()) as u32;
        }
        self.count = 0;
        taken
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sliced(counts: impl Fn(u64) -> [i16; 4]) -> [Slice; SLICES] {
        let mut slicer = Slicer::EMPTY;
        let fast = |sample: u64| Fast {
            at_us: 10_000 * sample,
            counts: counts(sample),
        };
        for sample in 1..=20 {
            slicer.add(&fast(sample - 1), &fast(sample));
        }
        slicer.take(200_000)
    }

    #[test]
    fn ten_slices_of_two_intervals_hold_the_mean_by_trapezoids() {
        let slices = sliced(|sample| [10 * sample as i16, -7, 4367, 0]);
        assert!(slices.iter().all(|slice| slice.lasts_us == 20_000));
        assert_eq!(slices[0].before_us, 180_000);
        assert_eq!(slices[9].before_us, 0);
        assert_eq!(slices[2].quarters, [4 * 50, -28, 4 * 4367, 0]);
    }

    #[test]
    fn a_gyro_at_its_stop_says_which_and_only_where_it_was() {
        let slices = sliced(|sample| {
            let stopped = (5..=7).contains(&sample);
            [
                if stopped { -4368 } else { 3 },
                1,
                1,
                if sample == 15 { NOT_READ } else { 1 },
            ]
        });
        let first: [i16; SLICES] = slices.map(|slice| slice.quarters[0]);
        assert_eq!(first[1..5], [12, -BEYOND, -BEYOND, 12]);
        assert_eq!(slices.map(|slice| slice.quarters[3])[6..9], [4, NOT_READ, 4]);
        assert!(slices.iter().all(|slice| slice.quarters[1] == 4));
    }

    #[test]
    fn a_gap_begins_a_slice_anew() {
        let mut slicer = Slicer::EMPTY;
        let fast = |at_us| Fast { at_us, counts: [1; 4] };
        slicer.add(&fast(0), &fast(10_000));
        slicer.add(&fast(10_000), &fast(400_000));
        slicer.add(&fast(400_000), &fast(410_000));
        assert_eq!(slicer.take(410_000), [Slice::NONE; SLICES]);
        slicer.add(&fast(410_000), &fast(420_000));
        let [slice, ..] = slicer.take(420_000);
        assert_eq!((slice.lasts_us, slice.quarters), (20_000, [4; 4]));
    }
}
