//! What a log holds of each cycle: what the unit's estimation was given, and what it made of it.
//!
//! In: packets as `ground/packets` reads them, with derived frames or without. Out: one [`Cycle`] a packet, for
//! `emems::estimate`, which flies. With a derived frame a cycle is bit for bit what the unit had. Without, its time is the
//! packet's number times the period, slot times are those of a unit whose sensors all answer, specific force is the packet's
//! reading alone, and each gyro's integral is the mean of two samples times the time between them, a period at most: the
//! rest is a gap.

use emems::{
    derived::Derived,
    geometry::rate_from_gyros,
    increments::{Force, GyroCycle, Increments, SLICES, Slice, forces::READINGS},
    sample::{NOT_READ, Reading, SENSOR_COUNT, Sample},
    unit::Settings,
};
use nalgebra::{Vector3, Vector4};
use packets::stream::{Item, sequence::Sequence};

/// \[us\] from one slot to the next where every sensor answers: sixteen within 4.2 ms.
const SLOT_US: u32 = 260;
/// \[us\] from the start of a cycle to the middle of its gyros' slots.
const GYROS_US: u64 = 2_500;

/// One cycle.
#[derive(Clone, Debug)]
pub struct Cycle {
    /// What was measured, and when.
    pub sample: Sample,
    /// The gyros since the cycle before.
    pub increments: Increments,
    /// The unit's own frame of it, if it came.
    pub sent: Option<Box<Derived>>,
}

/// Cycles in the order the packets came. A derived frame comes before its packet or after it, so a packet's cycle is
/// complete when the next packet is there.
#[derive(Debug)]
pub struct Cycles {
    settings: Settings,
    sequence: Sequence,
    packet: Option<Reading>,
    /// The frame of `packet`.
    derived: Option<Box<Derived>>,
    /// A frame whose packet has not come yet.
    ahead: Option<Box<Derived>>,
    /// \[us\] the unit's clock at packet number zero.
    epoch_us: i64,
    /// When the gyros were last read \[us\], and their counts.
    last: Option<(u64, [i16; 4])>,
}

impl Cycles {
    /// Of a unit with these settings.
    pub fn new(settings: Settings) -> Self {
        Cycles {
            settings,
            sequence: Sequence::default(),
            packet: None,
            derived: None,
            ahead: None,
            // The unit's clock begins before its first cycle, so that no slot is before zero.
            epoch_us: settings.period_ms as i64 * 1000,
            last: None,
        }
    }

    /// The cycle that an item completes, if it does.
    pub fn take(&mut self, item: &Item) -> Option<Cycle> {
        match item {
            Item::Derived { derived, .. } => {
                let of_this = self.packet.is_some_and(|packet| packet.counter == derived.counter);
                *(if of_this { &mut self.derived } else { &mut self.ahead }) = Some(derived.clone());
                None
            }
            Item::Packet { reading, .. } => {
                let cycle = self.finish();
                self.derived = self.ahead.take().filter(|derived| derived.counter == reading.counter);
                self.packet = Some(*reading);
                cycle
            }
            Item::Line { .. } | Item::Reject(_) => None,
        }
    }

    /// The cycle of the last packet.
    pub fn finish(&mut self) -> Option<Cycle> {
        let reading = self.packet.take()?;
        let sent = self.derived.take();
        let period_us = self.settings.period_ms * 1000;
        let number_us = (self.sequence.number(reading.counter).0 * period_us) as i64;
        if let Some(frame) = &sent {
            self.epoch_us = frame.start_us as i64 - number_us;
        }
        let start_us = number_us.saturating_add(self.epoch_us).max(0) as u64;
        let between = self.between(&reading, start_us);
        Some(Cycle {
            sample: Sample {
                reading,
                start_us,
                slots_us: match &sent {
                    Some(frame) => frame.slots_us,
                    None => core::array::from_fn::<u32, SENSOR_COUNT, _>(|slot| SLOT_US * slot as u32),
                },
            },
            increments: sent.as_ref().map_or(between, |frame| frame.increments),
            sent,
        })
    }

    /// The gyros since the packet before, by their two samples.
    fn between(&mut self, reading: &Reading, start_us: u64) -> Increments {
        let end_us = start_us + GYROS_US;
        let last = self.last.replace((end_us, reading.gyro));
        let since_us = last.map_or(0, |(last_us, _)| end_us.saturating_sub(last_us));
        let covered_us = since_us.min(self.settings.period_ms * 1000) as u32;
        let before = last.map_or([NOT_READ; 4], |(_, counts)| counts);
        let gyro = core::array::from_fn(|k| channel(before[k], reading.gyro[k], covered_us));
        let present = (0..4).filter(|k| gyro[*k].count > 0).fold(0, |bits, k| bits | 1 << k);
        let matrix = rate_from_gyros(present);
        let integrals = Vector4::from(gyro.map(|channel| channel.integral_counts_s));
        let angle_b: Vector3<f32> = matrix.unwrap_or_default() * integrals;
        Increments {
            angle_b: (angle_b * self.settings.rate.deg_s_per_count().to_radians()).into(),
            covered_us: if matrix.is_some() { covered_us } else { 0 },
            end_us,
            gyro,
            forces: [Force::NONE; READINGS],
            slices: [Slice::NONE; SLICES],
        }
    }
}

/// A gyro between two samples; nothing where one was not read.
fn channel(before: i16, now: i16, covered_us: u32) -> GyroCycle {
    if before == NOT_READ || now == NOT_READ {
        return GyroCycle {
            integral_counts_s: 0.0,
            least: NOT_READ,
            most: NOT_READ,
            count: 0,
        };
    }
    GyroCycle {
        integral_counts_s: (f32::from(before) + f32::from(now)) * 0.5e-6 * covered_us as f32,
        least: before.min(now),
        most: before.max(now),
        count: 2,
    }
}

#[cfg(test)]
mod tests {
    use emems::sample::{Errors, NO_SLOT};

    use super::*;

    /// Table 4.2's mean of the gyros, rounded to counts: -200 deg/s about y.
    fn turning(counter: u16) -> Reading {
        Reading {
            errors: Errors(0),
            gyro: [-4, 2204, -2275, 5],
            ..Reading::unread(counter)
        }
    }

    fn cycles(items: &[Item]) -> Vec<Cycle> {
        let mut cycles = Cycles::new(Settings::NOMINAL);
        let mut all: Vec<Cycle> = items.iter().filter_map(|item| cycles.take(item)).collect();
        all.extend(cycles.finish());
        all
    }

    fn packet(reading: Reading) -> Item {
        Item::Packet { offset: 0, reading }
    }

    #[test]
    fn two_packets_are_a_rotation_of_the_time_between_them() {
        let all = cycles(&[packet(turning(1)), packet(turning(2))]);
        assert_eq!(all[0].increments.covered_us, 0);
        let second = &all[1];
        assert_eq!(
            (second.sample.start_us, second.increments.covered_us),
            (600_000, 200_000)
        );
        // MT on Table 4.2: (-1.614, -199.672, 1.596) deg/s; half a count of each gyro.
        let expected = Vector3::new(-1.614_f32, -199.672, 1.596).map(f32::to_radians) * 0.2;
        assert!((Vector3::from(second.increments.angle_b) - expected).norm() < 2e-4);
    }

    #[test]
    fn lost_packets_are_a_gap_and_a_gyro_not_read_has_no_part() {
        let mut lacking = turning(9);
        lacking.gyro[0] = NOT_READ;
        let all = cycles(&[packet(turning(1)), packet(lacking)]);
        assert_eq!(all[1].sample.start_us - all[0].sample.start_us, 1_600_000);
        assert_eq!(all[1].increments.covered_us, 200_000);
        assert_eq!(all[1].increments.gyro.map(|gyro| gyro.count), [0, 2, 2, 2]);
        let mut two = turning(2);
        two.gyro[..2].fill(NOT_READ);
        assert_eq!(cycles(&[packet(turning(1)), packet(two)])[1].increments.covered_us, 0);
    }

    fn frame(counter: u16) -> Item {
        let derived = Derived {
            counter,
            start_us: 1_000_000 + 200_000 * u64::from(counter),
            increments: Increments {
                covered_us: 190_000,
                ..Increments::NONE
            },
            ..Derived::NONE
        };
        Item::Derived {
            offset: 0,
            derived: Box::new(derived),
        }
    }

    #[test]
    fn a_derived_frame_is_used_before_its_packet_and_after_it() {
        let check = |items: [Item; 4]| {
            let all = cycles(&items);
            assert_eq!(all.len(), 2);
            for cycle in all {
                assert_eq!(cycle.increments.covered_us, 190_000);
                let at_us = 1_000_000 + 200_000 * u64::from(cycle.sample.reading.counter);
                assert_eq!((cycle.sample.start_us, cycle.sample.slots_us[0]), (at_us, NO_SLOT));
                assert!(cycle.sent.is_some());
            }
        };
        let (one, two) = (packet(turning(1)), packet(turning(2)));
        check([one.clone(), frame(1), two.clone(), frame(2)]);
        check([frame(1), one, frame(2), two]);
    }

    #[test]
    fn cycles_without_a_frame_lie_on_the_clock_of_those_with_one() {
        let all = cycles(&[packet(turning(1)), frame(1), packet(turning(2)), packet(turning(3))]);
        assert_eq!(all[2].sample.start_us, 1_600_000);
    }
}
