//! A cycle's readings in the order of their instants.
//!
//! In: what a cycle brought, each reading with its slot, or with its place before the end of the increments. Out: the state carried
//! to each and corrected by it. The instant is the stamp less what the sensor is late by.
//!
//! Leaves out what is stamped more than [`FAR_US`] from the state.

use super::Spin;
use crate::{
    calibration::{Measured, Set},
    geometry::PLATES,
    increments::{Increments, SLICES, forces::READINGS},
    sample::{Kind, NO_SLOT, Sample},
};

/// What a cycle brought, in the order of its instants.
#[derive(Clone, Copy, Debug)]
enum Event {
    /// A slice of the gyros.
    Slice(usize),
    /// A reading of the accelerometers before the packet's.
    Force(usize),
    /// The packet's.
    Forces,
    /// The field of a plate.
    Field(usize),
}

/// Most events of a cycle.
const EVENTS: usize = SLICES + READINGS + 1 + PLATES;
/// \[us\] what is stamped later is not of this flight.
const FAR_US: u64 = 2_000_000;
/// \[s\] longest time without a slice.
const LONGEST_GAP_S: f32 = 1.0;

impl Spin {
    /// Takes a cycle, its axes as `measured`. Whether it can go on.
    #[inline(never)]
    pub fn take(&mut self, set: &Set, sample: &Sample, measured: &Measured, increments: &Increments) -> bool {
        let delays = self.surroundings.delays;
        let mut events: heapless::Vec<(u64, Event), EVENTS> = heapless::Vec::new();
        let mut note = |at_us: u64, late_s: f32, event: Event| {
            let at_us = at_us.saturating_sub((late_s * 1e6) as u64);
            let near = at_us.abs_diff(self.at_us) < FAR_US;
            if near {
                let place = events.iter().position(|(other_us, _)| *other_us > at_us);
                let _ = events.insert(place.unwrap_or(events.len()), (at_us, event));
            }
        };
        for (k, slice) in increments
            .slices
            .iter()
            .enumerate()
            .filter(|(_, slice)| !slice.is_none())
        {
            let back_us = u64::from(slice.before_us) + u64::from(slice.lasts_us) / 2;
            note(
                increments.end_us.saturating_sub(back_us),
                delays.gyro_s,
                Event::Slice(k),
            );
        }
        let began_us = increments.end_us.saturating_sub(increments.covered_us.into());
        for (k, force) in increments
            .forces
            .iter()
            .enumerate()
            .filter(|(_, force)| !force.is_none())
        {
            let since_us = u64::from(force.covered_us).saturating_add(force.after_us.into());
            note(began_us.saturating_add(since_us), delays.acc_s, Event::Force(k));
        }
        let slots_us = sample.slots_of(Kind::Accelerometer);
        let (sum_us, slots) = slots_us
            .iter()
            .filter(|slot_us| **slot_us != NO_SLOT)
            .fold((0_u64, 0_u64), |(sum, count), slot_us| {
                (sum.saturating_add((*slot_us).into()), count.saturating_add(1))
            });
        if let Some(mean_us) = u64::checked_div(sum_us, slots) {
            note(sample.start_us.saturating_add(mean_us), delays.acc_s, Event::Forces);
        }
        for (plate, slot_us) in sample.slots_of(Kind::Magnetometer).iter().enumerate() {
            if *slot_us != NO_SLOT {
                note(
                    sample.start_us.saturating_add((*slot_us).into()),
                    delays.mag_s,
                    Event::Field(plate),
                );
            }
        }
        let mut of_field = [0_u8; 2];
        for (at_us, event) in &events {
            self.carry(*at_us);
            match *event {
                Event::Slice(k) => {
                    self.slice_us = *at_us;
                    self.take_slice(
                        set,
                        measured,
                        &increments.slices[k].quarters,
                        increments.slices[k].lasts_us,
                    );
                }
                Event::Force(k) => self.take_force(set, &increments.forces[k].acc_p),
                Event::Forces => self.take_force(set, &sample.reading.acc_p),
                Event::Field(plate) => {
                    if let Some(taken) = self.take_field(set, measured, plate) {
                        let count = &mut of_field[usize::from(taken)];
                        *count = count.saturating_add(1);
                    }
                }
            }
            self.correct();
        }
        self.give_back();
        self.mind_the_gate(of_field);
        let end_us = increments.end_us;
        let gap_s = end_us.saturating_sub(self.slice_us) as f32 * 1e-6;
        self.covariance.keep_sound() && self.is_finite() && gap_s < LONGEST_GAP_S
    }
}
