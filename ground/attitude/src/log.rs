//! A packet stream to the filter's steps, by nominal matrices (MT).
//!
//! In: packets as `ground/packets` reads them, with derived frames or without. Out: one [`Step`] a packet. Specific
//! force and field are the means over the plates that were read; the rate is the least-squares rate of the gyros
//! that were. With a derived frame the step has the integrated increment, what it covers, and each group's slot time;
//! without, the packet's time is its number times the cycle and the increment is the mean of two rates times it.
//!
//! Slot times of a group are averaged: four sensors lie within a millisecond.

use emems::{
    derived::{Derived, Health},
    geometry::{dcm_bp, rate_from_gyros},
    kalman::{Sampled, Step},
    sample::{NO_SLOT, NOT_READ, Reading},
};
use nalgebra::{Vector3, Vector4};
use packets::{
    channel::{ACC_LSB, GYRO_LSB, MAG_LSB_UT},
    stream::{
        Item,
        sequence::{CYCLE_S, Sequence},
    },
};

use crate::replay::Noise;

/// Slots of each group in reading order: accelerometers, magnetometers.
const ACC_SLOTS: std::ops::Range<usize> = 0..4;
const MAG_SLOTS: std::ops::Range<usize> = 4..8;

/// Noise of the unit's parts, per component of the mean over four plates: 4.6 mg and 2.7 gyro counts a sample (thesis
/// Tables 4.7 and 4.2), and half a magnetometer count of 0.092 uT with as much noise again.
pub const UNIT_NOISE: Noise = Noise {
    angle: 2.3e-6,
    acc: 5.1e-4,
    mag: 1e-3,
};

/// Steps in the order the packets came. A derived frame comes before its packet or after it, so a packet's step is
/// complete when the next packet is there.
#[derive(Debug, Default)]
pub struct Steps {
    sequence: Sequence,
    packet: Option<Reading>,
    /// The frame of `packet`.
    derived: Option<Derived>,
    /// A frame whose packet has not come yet.
    ahead: Option<Derived>,
    last: Option<(f64, Vector3<f64>)>,
}

impl Steps {
    /// The step that an item completes, if it does.
    pub fn take(&mut self, item: &Item) -> Option<Step> {
        match item {
            Item::Derived { derived, .. } => {
                let of_this = self.packet.is_some_and(|packet| packet.counter == derived.counter);
                *(if of_this { &mut self.derived } else { &mut self.ahead }) = Some(**derived);
                None
            }
            Item::Packet { reading, .. } => {
                let step = self.finish();
                self.derived = self.ahead.take().filter(|derived| derived.counter == reading.counter);
                self.packet = Some(*reading);
                step
            }
            Item::Reject(_) => None,
        }
    }

    /// The step of the last packet.
    pub fn finish(&mut self) -> Option<Step> {
        let reading = self.packet.take()?;
        let derived = self.derived.take();
        let (number, _) = self.sequence.number(reading.counter);
        self.step(&reading, number as f64 * CYCLE_S, derived)
    }

    fn step(&mut self, reading: &Reading, time_s: f64, derived: Option<Derived>) -> Option<Step> {
        let start_s = derived.map_or(time_s, |derived| derived.start_us as f64 * 1e-6);
        let rate_b = rate(reading)?;
        let (before_s, rate_before_b) = self
            .last
            .replace((start_s, rate_b))
            .unwrap_or((start_s - CYCLE_S, rate_b));
        let dt_s = (start_s - before_s).min(CYCLE_S);
        let (angle_b, covered_s) = match derived {
            Some(derived) if derived.increments.covered_us > 0 => {
                let covered_s = derived.increments.covered_us as f32 * 1e-6;
                (Vector3::from(derived.increments.angle_b), covered_s)
            }
            _ => (((rate_b + rate_before_b) * 0.5 * dt_s).cast(), dt_s as f32),
        };
        // The clock begins one cycle late, so that no slot is before it.
        let at_us = ((start_s + CYCLE_S) * 1e6) as u64;
        let slot_us = |slots: std::ops::Range<usize>| {
            let read = derived
                .iter()
                .flat_map(|derived| &derived.slots_us[slots.clone()])
                .filter(|slot| **slot != NO_SLOT);
            let (count, sum) = read.fold((0, 0), |(count, sum), slot| (count + 1, sum + u64::from(*slot)));
            at_us + u64::checked_div(sum, count).unwrap_or_default()
        };
        let sampled = |mean: Option<(Vector3<f64>, f64)>, variance: f32, slots| {
            mean.map(|(value, plates)| Sampled {
                value_b: value.cast(),
                variance: variance * (4.0 / plates) as f32,
                at_us: slot_us(slots),
            })
        };
        Some(Step {
            at_us,
            covered_s,
            angle_b,
            angle_variance: UNIT_NOISE.angle * covered_s,
            rate_b: rate_b.cast(),
            saturated: derived.is_some_and(|derived| derived.health.contains(Health::GYRO_SATURATED)),
            acc: sampled(mean_b(&reading.acc_p, ACC_LSB), UNIT_NOISE.acc, ACC_SLOTS),
            mag: sampled(mean_b(&reading.mag_p, MAG_LSB_UT), UNIT_NOISE.mag, MAG_SLOTS),
            lift_off: reading.lift_off,
        })
    }
}

/// [rad/s] in b by the gyros that were read; `None` for fewer than three.
fn rate(reading: &Reading) -> Option<Vector3<f64>> {
    let present = (0..4)
        .filter(|plate| reading.gyro[*plate] != NOT_READ)
        .fold(0, |bits, plate| bits | 1 << plate);
    let counts = Vector4::from_fn(|plate, _| match reading.gyro[plate] {
        NOT_READ => 0.0,
        counts => f64::from(counts),
    });
    Some(rate_from_gyros(present)?.cast::<f64>() * counts * GYRO_LSB)
}

/// Mean in b over the plates whose three axes were read, and how many they were.
fn mean_b(counts_p: &[[i16; 3]; 4], lsb: f64) -> Option<(Vector3<f64>, f64)> {
    let read = counts_p
        .iter()
        .enumerate()
        .filter(|(_, axes)| !axes.contains(&NOT_READ));
    let (sum, plates) = read.fold((Vector3::zeros(), 0.0), |(sum, plates), (plate, axes)| {
        (
            sum + dcm_bp(plate).cast::<f64>() * Vector3::from(axes.map(f64::from)),
            plates + 1.0,
        )
    });
    (plates > 0.0).then(|| (sum * (lsb / plates), plates))
}

#[cfg(test)]
mod tests {
    use emems::increments::{Increments, Integrator};

    use super::*;

    /// Table 4.7's mean and Table 4.2's, rounded to counts, as one reading.
    fn golden() -> Reading {
        let mut reading = Reading::unread(1);
        reading.acc_p = [[-317, 4, -97], [-333, -4, -128], [-321, 11, -125], [2, 0, 348]];
        reading.mag_p = [[10, 20, 30]; 4];
        reading.gyro = [-4, 2204, -2275, 5];
        reading
    }

    #[test]
    fn the_printed_samples_give_the_golden_vectors() {
        // Specific force and rate in b by nominal matrices; half a count of each sensor.
        let (acc_b, plates) = mean_b(&golden().acc_p, ACC_LSB).expect("read");
        assert_eq!(plates, 4.0);
        assert!(
            (acc_b - Vector3::new(0.0747, 0.0052, -10.147)).norm() < 0.015,
            "{acc_b}"
        );
        let rate_deg = rate(&golden()).expect("read").map(f64::to_degrees);
        assert!(
            (rate_deg - Vector3::new(-1.614, -199.672, 1.596)).norm() < 0.05,
            "{rate_deg}"
        );
    }

    fn steps(readings: impl IntoIterator<Item = Reading>) -> Vec<Step> {
        let mut steps = Steps::default();
        let packets = readings.into_iter().map(|reading| Item::Packet { offset: 0, reading });
        let mut all: Vec<Step> = packets.filter_map(|item| steps.take(&item)).collect();
        all.extend(steps.finish());
        all
    }

    #[test]
    fn a_plate_that_was_not_read_is_left_out_and_its_share_of_noise_grows() {
        let mut lacking = golden();
        lacking.acc_p[1][2] = NOT_READ;
        let both = steps([lacking, Reading { counter: 2, ..golden() }]);
        let variance = |step: &Step| step.acc.expect("read").variance;
        assert!((variance(&both[0]) / variance(&both[1]) - 4.0 / 3.0).abs() < 1e-6);
        assert_eq!(both[1].at_us - both[0].at_us, 200_000);
    }

    #[test]
    fn a_derived_frame_is_used_before_its_packet_and_after_it() {
        let mut slots_us = [NO_SLOT; 16];
        slots_us[..8].copy_from_slice(&[100, 200, 300, 400, 1100, 1200, 1300, 1400]);
        let derived = |counter| Derived {
            counter,
            start_us: 200_000 * u64::from(counter),
            mode: emems::mode::Mode::Wait,
            health: Health::GYRO_SATURATED,
            cycle_us: 5_000,
            slots_us,
            increments: Increments {
                angle_b: [0.1, 0.2, 0.3],
                covered_us: 190_000,
                ..Integrator::new(1.0).take()
            },
            estimate: emems::estimate::Estimate::NOTHING,
            estimate_us: 0,
        };
        let packet = |counter| Item::Packet {
            offset: 0,
            reading: Reading { counter, ..golden() },
        };
        let frame = |counter| Item::Derived {
            offset: 0,
            derived: Box::new(derived(counter)),
        };
        let check = |items: [Item; 4]| {
            let mut steps = Steps::default();
            let mut all: Vec<Step> = items.iter().filter_map(|item| steps.take(item)).collect();
            all.extend(steps.finish());
            assert_eq!(all.len(), 2);
            for step in all {
                assert_eq!((step.angle_b.y, step.covered_s, step.saturated), (0.2, 0.19, true));
                assert_eq!(step.acc.expect("read").at_us - step.at_us, 250);
                assert_eq!(step.mag.expect("read").at_us - step.at_us, 1_250);
            }
        };
        check([packet(1), frame(1), packet(2), frame(2)]);
        check([frame(1), packet(1), frame(2), packet(2)]);
    }

    #[test]
    fn two_gyros_are_no_rate_and_the_packet_is_no_step() {
        let mut reading = golden();
        reading.gyro[..2].fill(NOT_READ);
        assert_eq!(steps([reading]), []);
    }
}
