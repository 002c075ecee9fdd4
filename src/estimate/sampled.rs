//! A vector of a cycle as the filter takes it: value, white variance, instant.
//!
//! In: a [`Sample`]'s slot times, what redundancy made of its axes, their white noise. Out: [`Sampled`], for whole vectors
//! only. What is systematic is the filter's own business.

use super::Estimator;
use crate::{
    calibration::{Axis, Set},
    kalman::Sampled,
    redundancy::{Known, Solution},
    sample::{Kind, NO_SLOT, Sample},
};

/// Bits of twelve axes.
const ALL_AXES: u16 = 0xFFF;

impl Estimator {
    /// A whole vector at the mean of its sensors' slot times, with its white noise: what is systematic is the filter's own
    /// business.
    pub(super) fn sampled(&self, sample: &Sample, kind: Kind, solution: &Solution) -> Option<Sampled> {
        if solution.known != Known::All {
            return None;
        }
        let slots_us = sample.slots_of(kind);
        let (mean_us, variance) = if solution.used == ALL_AXES {
            let sum_us = slots_us
                .iter()
                .fold(0, |sum: u64, slot_us| sum.saturating_add((*slot_us).into()));
            (sum_us / 4, self.white[usize::from(kind == Kind::Magnetometer)])
        } else {
            let (mut sum_us, mut sensors) = (0_u64, 0_u64);
            let mut used = solution.used;
            for slot_us in slots_us {
                if used & 0b111 != 0 && *slot_us != NO_SLOT {
                    sum_us = sum_us.saturating_add((*slot_us).into());
                    sensors = sensors.saturating_add(1);
                }
                used >>= 3;
            }
            let mean_us = sum_us.checked_div(sensors).unwrap_or_default();
            (mean_us, white(self.set.axes(kind), solution.used))
        };
        Some(Sampled {
            value_b: solution.vector_b,
            variance,
            scatter: 0.0,
            at_us: sample.start_us.saturating_add(mean_us),
        })
    }
}

/// [`white`] of all axes of force and of field.
#[inline(never)]
pub(super) fn whites(set: &Set) -> [f32; 2] {
    [white(&set.acc, ALL_AXES), white(&set.mag, ALL_AXES)]
}

/// White variance of a component of the mean over these axes: plates are rotations, so each tells a third of a component.
fn white(axes: &[Axis], used: u16) -> f32 {
    let (mut sum, mut left) = (0.0, used);
    for axis in axes {
        if left & 1 == 1 {
            sum += axis.noise * axis.noise;
        }
        left >>= 1;
    }
    let count = used.count_ones() as f32;
    3.0 * sum / (count * count)
}
