//! A flight of any length in a fixed number of bins: what a plot can show of it.
//!
//! In: packets by number, with the interval since the one before where it is known. Out: [`Bin`]s of equal length in
//! packets, each with the least and most count of every channel, the sensors that failed or stood at the end of their range, packets missed, and flags.
//! A new packet beyond the last bin merges bins in pairs, so memory is bounded (about 1 MiB) and a short flight keeps
//! one packet a bin. A peak is never lost, only known less sharply in time.

use emems::sample::Reading;

use packets::{
    channel::{self, CHANNEL_COUNT, Reach},
    reach,
};

/// Bins at most: as many stretches as a plot that zooms holds of a layer, eight minutes of flight packet for packet.
pub const MOST_BINS: usize = 2400;

/// Least and most of something.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range<T> {
    /// Least.
    pub least: T,
    /// Most.
    pub most: T,
}

impl<T: Copy + PartialOrd> Range<T> {
    /// Of one value.
    pub fn of(value: T) -> Self {
        Range {
            least: value,
            most: value,
        }
    }

    /// Of both, if there is either.
    pub fn join(one: Option<Self>, other: Option<Self>) -> Option<Self> {
        match (one, other) {
            (Some(one), Some(other)) => Some(Range {
                least: if other.least < one.least {
                    other.least
                } else {
                    one.least
                },
                most: if other.most > one.most { other.most } else { one.most },
            }),
            (one, other) => one.or(other),
        }
    }
}

/// Some consecutive packets.
#[derive(Clone, Debug, PartialEq)]
pub struct Bin {
    /// Packets received.
    pub packets: u32,
    /// Packets missed just before one of them.
    pub missed: u32,
    /// Counts of each channel; `None` if it was never read.
    pub counts: [Option<Range<i16>>; CHANNEL_COUNT],
    /// Sensors that failed in any of them, one bit each.
    pub failed: u16,
    /// Sensors that stood at the end of their range in any of them, one bit each.
    pub clipped: u16,
    /// \[s\] time from the packet before to each of them, where no packet was missed between.
    pub interval_s: Option<Range<f64>>,
    /// Lift-off was asserted in any of them.
    pub lift_off: bool,
    /// Micro-gravity was asserted in any of them.
    pub micro_g: bool,
}

impl Bin {
    const EMPTY: Bin = Bin {
        packets: 0,
        missed: 0,
        counts: [None; CHANNEL_COUNT],
        failed: 0,
        clipped: 0,
        interval_s: None,
        lift_off: false,
        micro_g: false,
    };

    fn join(&mut self, other: &Bin) {
        self.packets = self.packets.saturating_add(other.packets);
        self.missed = self.missed.saturating_add(other.missed);
        for (mine, others) in self.counts.iter_mut().zip(&other.counts) {
            *mine = Range::join(*mine, *others);
        }
        self.failed |= other.failed;
        self.clipped |= other.clipped;
        self.interval_s = Range::join(self.interval_s, other.interval_s);
        self.lift_off |= other.lift_off;
        self.micro_g |= other.micro_g;
    }
}

/// The bins of a flight so far.
#[derive(Clone, Debug)]
pub struct Envelope {
    first: u64,
    width: u64,
    bins: Vec<Bin>,
}

impl Default for Envelope {
    fn default() -> Self {
        Envelope {
            first: 0,
            width: 1,
            bins: Vec::new(),
        }
    }
}

impl Envelope {
    /// Adds packet `number`, never less than those before it. Packets that count as missed stand between it and the one
    /// before.
    pub fn add(&mut self, number: u64, reading: &Reading, missed: u32, interval_s: Option<f64>) {
        if self.bins.is_empty() {
            self.first = number;
        }
        let ahead = number.saturating_sub(self.first);
        while ahead / self.width >= MOST_BINS as u64 {
            self.halve();
        }
        // Less than MOST_BINS after the loop.
        let index = (ahead / self.width) as usize;
        while self.bins.len() <= index {
            self.bins.push(Bin::EMPTY);
        }
        if let Some(bin) = self.bins.get_mut(index) {
            bin.join(&Bin {
                packets: 1,
                missed,
                counts: channel::counts(&reach::without_impossible(*reading)).map(|value| value.map(Range::of)),
                failed: reading.errors.0,
                clipped: reach::sensors(reading, Reach::End),
                interval_s: interval_s.map(Range::of),
                lift_off: reading.lift_off,
                micro_g: reading.micro_g,
            });
        }
    }

    /// The bins, oldest first.
    pub fn bins(&self) -> &[Bin] {
        &self.bins
    }

    /// Packets a bin covers.
    pub fn packets_per_bin(&self) -> u64 {
        self.width
    }

    /// Packet number in the middle of a bin.
    pub fn middle(&self, index: usize) -> f64 {
        (self.first + index as u64 * self.width) as f64 + 0.5 * (self.width - 1) as f64
    }

    fn halve(&mut self) {
        self.width *= 2;
        self.bins = self
            .bins
            .chunks(2)
            .map(|pair| {
                let mut joined = Bin::EMPTY;
                pair.iter().for_each(|bin| joined.join(bin));
                joined
            })
            .collect();
    }
}

#[cfg(test)]
mod tests {
    use emems::sample::NOT_READ;

    use super::*;

    const G1: usize = 24;

    fn reading(gyro: i16) -> Reading {
        Reading {
            gyro: [gyro; 4],
            ..Reading::unread(0)
        }
    }

    fn g1(bin: &Bin) -> Option<(i16, i16)> {
        bin.counts[G1].map(|range| (range.least, range.most))
    }

    #[test]
    fn a_short_flight_keeps_one_packet_a_bin() {
        let mut envelope = Envelope::default();
        envelope.add(100, &reading(5), 0, None);
        envelope.add(102, &reading(NOT_READ), 1, Some(0.2));
        let [first, gap, last] = envelope.bins() else {
            panic!("{:?}", envelope.bins())
        };
        assert_eq!((g1(first), envelope.middle(0)), (Some((5, 5)), 100.0));
        assert_eq!(gap, &Bin::EMPTY);
        assert_eq!((g1(last), last.missed, envelope.middle(2)), (None, 1, 102.0));
    }

    #[test]
    fn a_peak_survives_a_day() {
        const DAY_AT_5_HZ: u64 = 432_000;
        let mut envelope = Envelope::default();
        for number in 0..DAY_AT_5_HZ {
            envelope.add(number, &reading(if number == 77_777 { 8000 } else { -3 }), 0, None);
        }
        assert_eq!(envelope.packets_per_bin(), 256);
        let index = 77_777 / 256;
        assert_eq!(g1(&envelope.bins()[index]), Some((-3, 8000)));
        assert_eq!(g1(&envelope.bins()[index + 1]), Some((-3, -3)));
        let packets: u32 = envelope.bins().iter().map(|bin| bin.packets).sum();
        assert_eq!(u64::from(packets), DAY_AT_5_HZ);
    }

    #[test]
    fn memory_is_bounded_however_far_numbers_jump() {
        let mut envelope = Envelope::default();
        for number in [0, 1, 1 << 20, 1 << 40] {
            envelope.add(number, &reading(1), 0, None);
        }
        assert!(envelope.bins().len() <= MOST_BINS);
    }
}
