//! What happened between two packets: the gyros' rates, integrated with coning correction, and specific force.
//!
//! In: the four gyros in counts and the instant of each fast sample; the accelerometers in counts at a few instants. Out,
//! once a cycle: the rotation increment of b, when it ended, for each gyro the integral, smallest and largest count and how
//! many samples, and in [`slices`]; and each reading of the accelerometers with the rotation up to it ([`forces`]).
//!
//! A 5 Hz filter on single rate samples loses what happened between them; on increments it loses nothing. The increment
//! is a rotation vector: `phi = sum d_k + 1/2 sum (a_{k-1} + d_{k-1}/6) x d_k` with `d_k` the angle of interval `k`
//! (trapezoid) and `a_{k-1}` the sum before it (P. Savage, "Strapdown inertial navigation integration algorithm design,
//! part 1", J. Guid. Control Dyn. 21(1), 1998, Eq 48: coning of the accumulated angle plus the two-sample term).
//! Without the second sum a coning motion is mistaken for no motion at all along the cone's axis.
//!
//! Refuses intervals that are not later than the one before or longer than [`LONGEST_INTERVAL_S`]: they count as gaps.
//! With fewer than three gyros there is no rate: the interval is a gap too.

pub mod forces;
pub mod slices;

use nalgebra::{SMatrix, Vector3, Vector4};

use crate::{geometry::rate_from_gyros, sample::NOT_READ};

use slices::Slicer;

pub use forces::{Force, Forces};
pub use slices::{SLICES, Slice};

/// \[s\] an interval longer than this is a gap: rates between its ends are not known.
pub const LONGEST_INTERVAL_S: f32 = 0.1;

/// What came between one cycle and the next.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
pub struct Increments {
    /// \[rad\] rotation vector of b over the cycle, in b.
    pub angle_b: [f32; 3],
    /// \[us\] time the increment covers; shorter than the cycle by its gaps.
    pub covered_us: u32,
    /// \[us\] instant of the newest fast sample, since the unit's clock started: the increment's end. 0 before the first.
    pub end_us: u64,
    /// Each gyro.
    pub gyro: [GyroCycle; 4],
    /// The accelerometers, oldest reading first.
    pub forces: Forces,
    /// The gyros slice by slice, oldest first.
    pub slices: [Slice; SLICES],
}

/// One gyro over a cycle.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
pub struct GyroCycle {
    /// [counts s] integral of the rate.
    pub integral_counts_s: f32,
    /// \[counts\] smallest sample; [`NOT_READ`] without samples.
    pub least: i16,
    /// \[counts\] largest sample; [`NOT_READ`] without samples.
    pub most: i16,
    /// Samples.
    pub count: u8,
}

impl GyroCycle {
    /// No samples.
    pub const NONE: GyroCycle = GyroCycle {
        integral_counts_s: 0.0,
        least: NOT_READ,
        most: NOT_READ,
        count: 0,
    };
}

impl Increments {
    /// Nothing came.
    pub const NONE: Increments = Increments {
        angle_b: [0.0; 3],
        covered_us: 0,
        end_us: 0,
        gyro: [GyroCycle::NONE; 4],
        forces: [Force::NONE; forces::READINGS],
        slices: [Slice::NONE; SLICES],
    };
}

/// The running integration.
#[derive(Clone, Debug)]
pub struct Integrator {
    rad_s_per_count: f32,
    sum: Increments,
    coning_b: Vector3<f32>,
    last_angle_b: Vector3<f32>,
    last: Option<Fast>,
    present: u8,
    rate_from_counts: Option<SMatrix<f32, 3, 4>>,
    slicer: Slicer,
}

/// One fast sample of the four gyros.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
pub struct Fast {
    /// \[us\] when.
    pub at_us: u64,
    /// \[counts\] each gyro; [`NOT_READ`] where it was not read.
    pub counts: [i16; 4],
}

impl Integrator {
    /// An integration of nothing yet, of gyros with `rad_s_per_count` [rad/s] a count.
    pub fn new(rad_s_per_count: f32) -> Self {
        Integrator {
            rad_s_per_count,
            sum: Increments::NONE,
            coning_b: Vector3::zeros(),
            last_angle_b: Vector3::zeros(),
            last: None,
            present: 0,
            rate_from_counts: None,
            slicer: Slicer::EMPTY,
        }
    }

    /// Takes a fast sample.
    pub fn add(&mut self, fast: Fast) {
        for (channel, counts) in self.sum.gyro.iter_mut().zip(fast.counts) {
            channel.note(counts);
        }
        self.sum.end_us = fast.at_us;
        let Some(last) = self.last.replace(fast) else { return };
        self.slicer.add(&last, &fast);
        let dt_s = fast.at_us.saturating_sub(last.at_us) as f32 * 1e-6;
        if dt_s <= 0.0 || dt_s > LONGEST_INTERVAL_S {
            return;
        }
        let mut mean_counts = Vector4::zeros();
        let mut present = 0;
        for (plate, (now, before)) in fast.counts.into_iter().zip(last.counts).enumerate() {
            if now != NOT_READ && before != NOT_READ {
                present |= 1 << plate;
                mean_counts[plate] = 0.5 * (f32::from(now) + f32::from(before));
                self.sum.gyro[plate].integral_counts_s += mean_counts[plate] * dt_s;
            }
        }
        if present != self.present {
            self.present = present;
            self.rate_from_counts = rate_from_gyros(present).map(|matrix| matrix * self.rad_s_per_count);
        }
        if let Some(rate_from_counts) = self.rate_from_counts {
            self.rotate(rate_from_counts * mean_counts * dt_s);
            let lasted_us = fast.at_us.saturating_sub(last.at_us) as u32;
            self.sum.covered_us = self.sum.covered_us.saturating_add(lasted_us);
        }
    }

    fn rotate(&mut self, angle_b: Vector3<f32>) {
        let before_b = Vector3::from(self.sum.angle_b);
        self.coning_b += (before_b + self.last_angle_b / 6.0).cross(&angle_b) / 2.0;
        self.last_angle_b = angle_b;
        self.sum.angle_b = (before_b + angle_b).into();
    }

    /// Takes a reading of the accelerometers, `at_us` \[us\] in the mean, and says what it is in the increments; `None` for
    /// one too many, which is left out.
    pub fn force(&mut self, at_us: u64, acc_p: [[i16; 3]; 4]) -> Option<Force> {
        let angle_b = (Vector3::from(self.sum.angle_b) + self.coning_b).into();
        let after_us = at_us.saturating_sub(self.sum.end_us) as u32;
        let covered_us = self.sum.covered_us;
        let free = self.sum.forces.iter_mut().find(|force| force.is_none())?;
        *free = Force {
            acc_p,
            angle_b,
            covered_us,
            after_us,
        };
        Some(*free)
    }

    /// What came since it was last asked; the next interval begins where this one ended.
    pub fn take(&mut self) -> Increments {
        let end_us = self.sum.end_us;
        let mut taken = core::mem::replace(
            &mut self.sum,
            Increments {
                end_us,
                ..Increments::NONE
            },
        );
        taken.angle_b = (Vector3::from(taken.angle_b) + core::mem::take(&mut self.coning_b)).into();
        taken.slices = self.slicer.take(end_us);
        taken
    }
}

impl GyroCycle {
    fn note(&mut self, counts: i16) {
        if counts == NOT_READ {
            return;
        }
        let first = self.count == 0;
        self.least = if first { counts } else { self.least.min(counts) };
        self.most = if first { counts } else { self.most.max(counts) };
        self.count = self.count.saturating_add(1);
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{ComplexField, UnitQuaternion};

    use super::*;
    use crate::geometry::gyro_axes_b;

    /// The 320 deg/s range.
    const RAD_S_PER_COUNT: f32 = 0.07326 * core::f32::consts::PI / 180.0;

    fn counts(omega_b: Vector3<f32>) -> [i16; 4] {
        let gyro = gyro_axes_b() * omega_b / RAD_S_PER_COUNT;
        core::array::from_fn(|plate| ComplexField::round(gyro[plate]) as i16)
    }

    #[test]
    fn the_same_counts_in_a_quarter_of_the_range_are_a_quarter_of_the_angle() {
        let turned = |rad_s_per_count| {
            let mut integrator = Integrator::new(rad_s_per_count);
            for at_us in [0, 10_000] {
                integrator.add(Fast {
                    at_us,
                    counts: [0, 0, 0, 400],
                });
            }
            integrator.take().angle_b[2]
        };
        assert_eq!(turned(RAD_S_PER_COUNT), 4.0 * turned(RAD_S_PER_COUNT / 4.0));
        assert!(turned(RAD_S_PER_COUNT) > 0.0);
    }

    #[test]
    fn a_constant_rate_gives_rate_times_time() {
        let mut integrator = Integrator::new(RAD_S_PER_COUNT);
        let omega_b = Vector3::new(0.5, -1.0, 2.0);
        for sample in 0..21 {
            integrator.add(Fast {
                at_us: 10_000 * sample,
                counts: counts(omega_b),
            });
        }
        let increments = integrator.take();
        // Half a count on each gyro over 0.2 s.
        let rounding = RAD_S_PER_COUNT * 0.2;
        assert!((Vector3::from(increments.angle_b) - omega_b * 0.2).norm() < rounding);
        assert_eq!((increments.covered_us, increments.gyro[3].count), (200_000, 21));
        assert_eq!(increments.gyro[3].least, increments.gyro[3].most);
    }

    /// Half-angle 10 deg, 1 Hz: the body's axis sweeps a cone, and a body that does not spin along it seems to turn.
    fn coned(corrected: bool) -> f32 {
        const HALF_ANGLE: f32 = 0.175;
        const OMEGA: f32 = core::f32::consts::TAU;
        let attitude = |t_s: f32| {
            let axis = Vector3::new(ComplexField::cos(OMEGA * t_s), ComplexField::sin(OMEGA * t_s), 0.0);
            UnitQuaternion::from_scaled_axis(axis * HALF_ANGLE)
        };
        let rate_b = |t_s: f32| {
            let (sin, cos) = (ComplexField::sin(HALF_ANGLE), ComplexField::cos(HALF_ANGLE));
            let (sin_t, cos_t) = (ComplexField::sin(OMEGA * t_s), ComplexField::cos(OMEGA * t_s));
            OMEGA * Vector3::new(-sin * sin_t, sin * cos_t, -(1.0 - cos))
        };
        let mut integrator = Integrator::new(RAD_S_PER_COUNT);
        let mut found = attitude(0.0);
        for sample in 0..=1000 {
            let at_us = 10_000 * sample;
            integrator.add(Fast {
                at_us,
                counts: counts(rate_b(at_us as f32 * 1e-6)),
            });
            if sample > 0 && sample % 20 == 0 {
                let coning_b = integrator.coning_b;
                let angle_b = Vector3::from(integrator.take().angle_b);
                found *= UnitQuaternion::from_scaled_axis(if corrected { angle_b } else { angle_b - coning_b });
            }
        }
        found.angle_to(&attitude(10.0))
    }

    #[test]
    fn coning_is_followed_and_would_not_be_without_the_correction() {
        // Half a count for ten seconds: the rate along the cone's axis is constant, so its rounding adds up.
        let rounding = 0.5 * RAD_S_PER_COUNT * 10.0;
        assert!(coned(true) < rounding, "{}", coned(true));
        assert!(coned(false) > 10.0 * rounding, "{}", coned(false));
    }

    #[test]
    fn a_reading_of_force_has_the_turn_up_to_it_and_the_time_since() {
        let mut integrator = Integrator::new(RAD_S_PER_COUNT);
        let omega_b = Vector3::new(0.5, -1.0, 2.0);
        let add = |integrator: &mut Integrator, at_us: u64| {
            integrator.add(Fast {
                at_us,
                counts: counts(omega_b),
            });
        };
        (0..7).for_each(|sample| add(&mut integrator, 10_000 * sample));
        for read_us in [64_000, 66_000, 68_000] {
            integrator.force(read_us, [[1; 3]; 4]);
        }
        add(&mut integrator, 70_000);
        let increments = integrator.take();
        let [first, second] = increments.forces;
        assert_eq!(
            (first.covered_us, first.after_us, second.after_us),
            (60_000, 4_000, 6_000)
        );
        assert!((Vector3::from(first.angle_b) - omega_b * 0.06).norm() < RAD_S_PER_COUNT * 0.06);
        assert_eq!(integrator.take().forces, [Force::NONE; forces::READINGS]);
    }

    #[test]
    fn gaps_and_time_going_back_are_not_integrated() {
        let mut integrator = Integrator::new(RAD_S_PER_COUNT);
        let omega_b = Vector3::new(0.0, 0.0, 1.0);
        for at_us in [0, 10_000, 5_000, 15_000, 600_000, 610_000] {
            integrator.add(Fast {
                at_us,
                counts: counts(omega_b),
            });
        }
        assert_eq!(integrator.take().covered_us, 30_000);
    }

    #[test]
    fn one_silent_gyro_costs_nothing_and_two_make_a_gap() {
        let mut integrator = Integrator::new(RAD_S_PER_COUNT);
        let omega_b = Vector3::new(0.3, 0.2, 1.0);
        let mut three = counts(omega_b);
        three[1] = NOT_READ;
        let mut two = three;
        two[2] = NOT_READ;
        for (sample, counts) in [three, three, two, two].into_iter().enumerate() {
            integrator.add(Fast {
                at_us: 10_000 * sample as u64,
                counts,
            });
        }
        let increments = integrator.take();
        assert_eq!((increments.covered_us, increments.gyro[1].count), (10_000, 0));
        assert_eq!(increments.gyro[1].least, NOT_READ);
        assert!((Vector3::from(increments.angle_b) - omega_b * 0.01).norm() < 0.01 * RAD_S_PER_COUNT);
    }
}
