//! A reading of the accelerometers: what they disagree by is the rate's.
//!
//! In: twelve axes. Out: the state corrected by the [`forces`]' equations, what these equations usually leave, and whether they are
//! a surprise: an ignition, a yo-yo. The force itself moves the gyros' biases.

use nalgebra::Vector3;

use super::{
    GATE, Spin,
    covariance::{ACROSS, ACROSS_UP, Covariance, LEVER, SPIN, SPIN_UP},
    forces::{self, Believed, EQUATIONS},
    motion::SURPRISED_WALK,
    seconds_between, square,
};
use crate::{
    calibration::Set,
    geometry::PLATES,
    sensor::lis331hh::{CODES, STANDARD_GRAVITY},
};

/// \[s\] by how much the ages of two accelerometers' conversions differ: uniform over 20 ms.
const FORCE_AGE_S: f32 = 0.006;
/// Of the mean square of a vibration, what two conversions do not share whose ages are each uniform over the 20 ms from one to the
/// next: a tone of `f` keeps `sinc^2(20 ms f)` in common, in the mean over all tones that are not folded, up to 50 Hz, 0.45.
const NOT_SHARED: f32 = 0.55;
/// What the square of a second difference of white noise is, of a vector of three: `3 (1 + 4 + 1)` variances.
const OF_SECOND_DIFFERENCE: f32 = 18.0;
/// Of how many readings a vibration is the mean: a part of three squares alone is too often small by chance, and its level changes
/// within some readings.
const SHAKEN: f32 = 2.0;
/// \[s\] how long a surprise lasts.
const SURPRISED_S: f32 = 0.6;
/// Mean square of the force equations' residuals, over what they should be, that is a surprise.
const SURPRISE: f32 = 4.0;
/// Of how many readings the force equations' usual residual is the mean.
const USUAL: f32 = 20.0;
/// \[counts\] an accelerometer that has a value.
const WITHIN: core::ops::Range<i16> = *CODES.start() + 1..*CODES.end();

impl Spin {
    pub(super) fn take_force(&mut self, set: &Set, acc_p: &[[i16; 3]; PLATES]) {
        let mut used = 0;
        let counts = acc_p.as_flattened();
        let along = core::array::from_fn(|k| {
            if !WITHIN.contains(&counts[k]) {
                return 0.0;
            }
            used |= 1 << k;
            set.acc[k].value(counts[k], 0.0) - self.force_rest[k]
        });
        let [y_b, z_b] = self.across_b();
        let rate_b = self.rate_b();
        let turned_b = Vector3::new(0.0, rate_b.z, -rate_b.y) * self.spin;
        let believed = Believed {
            rate_b,
            rate_dot_b: Vector3::new(self.spin_up, 0.0, 0.0) + self.turning_b(self.across_up) + turned_b,
            across_b: [y_b, z_b],
            lever: self.lever,
        };
        let changing = self.spin * self.spin_up * 0.045;
        let mut reading = forces::Reading {
            along,
            used,
            variance: square(2.0 * FORCE_AGE_S * 2.0 * changing),
        };
        let Some(first) = forces::equations(set, &reading, &believed) else {
            return;
        };
        let found = match self.force.replace((self.at_us, first.force_b)) {
            Some((before_us, before_b)) if before_us < self.at_us => {
                let dt_s = seconds_between(before_us, self.at_us);
                let change = (first.force_b - before_b).norm() / dt_s;
                reading.variance += square(FORCE_AGE_S * change) + self.shakes(first.force_b - before_b);
                forces::equations(set, &reading, &believed).unwrap_or(first)
            }
            _ => first,
        };
        let rows = |k: usize| -> [(usize, f32); forces::SEEN] {
            let [spin, spin_up, y, z, y_up, z_up, lever] = found.rows[k];
            [
                (SPIN, spin),
                (SPIN_UP, spin_up),
                (ACROSS, y),
                (ACROSS + 1, z),
                (ACROSS_UP, y_up),
                (ACROSS_UP + 1, z_up),
                (LEVER, lever),
            ]
        };
        let scale = if self.usual > 1.0 { self.usual } else { 1.0 };
        let count = found.count.min(EQUATIONS);
        let off = |covariance: &Covariance| {
            let each = (0..count).map(|k| covariance.look(&rows(k), found.residuals[k], scale).0);
            each.sum::<f32>() / count as f32
        };
        let mean = off(&self.covariance);
        // What is usual is learnt of what is no surprise.
        let surprising = if self.seen { f32::MAX } else { SURPRISE };
        let shown = scale * mean.min(SURPRISE);
        self.usual += (shown - self.usual) * (1.0 / USUAL);
        if mean > surprising && self.surprised_s <= 0.0 {
            self.surprised_s = SURPRISED_S;
            self.covariance.open(SPIN_UP, square(SURPRISED_WALK) * 0.1);
            self.covariance.open(SPIN, square(SURPRISED_WALK * 0.02));
            // What a change of the spin does not explain is one of the rate across it.
            if off(&self.covariance) > surprising {
                for axis in 0..2 {
                    self.covariance.open(ACROSS_UP + axis, square(1.0));
                    self.covariance.open(ACROSS + axis, square(0.05));
                }
            }
        }
        // A reading that contradicts itself weighs less.
        let left = off(&self.covariance);
        let scale = if left > 1.0 { scale * left } else { scale };
        for k in 0..count {
            self.covariance.update(&rows(k), found.residuals[k], scale, GATE);
        }
    }

    /// [m2/s4] by what the accelerometers' unlike ages make them disagree in a vibration, from the change of the force since the reading
    /// before: a change that goes on is no vibration. From one reading to the next it turns many times, so that the change says
    /// little of how fast it is.
    fn shakes(&mut self, change_b: Vector3<f32>) -> f32 {
        let bend_b = change_b - self.changed_b.replace(change_b).unwrap_or(change_b);
        self.shaken += (bend_b.norm_squared() * (1.0 / OF_SECOND_DIFFERENCE) - self.shaken) * (1.0 / SHAKEN);
        NOT_SHARED * self.shaken
    }

    /// \[g\] force along x_b beyond that of the pad.
    pub(super) fn load(&self) -> f32 {
        self.force.map_or(0.0, |(_, force_b)| {
            (force_b.x - self.pad_force) * (1.0 / STANDARD_GRAVITY)
        })
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Matrix3, UnitQuaternion};

    use super::*;
    use crate::{
        calibration::Ranges,
        kalman::Delays,
        spin::{Start, Surroundings, pad::Pad},
        unit::Settings,
    };

    fn spin() -> Spin {
        let set = Set::nominal(Ranges::of(&Settings::NOMINAL));
        let start = Start {
            at_us: 0,
            q_nb: UnitQuaternion::identity(),
            covariance_n: Matrix3::identity(),
            rate_b: Vector3::zeros(),
            rate_sd: 0.1,
            bias_b: Vector3::zeros(),
            bias_variance: 1e-4,
            pad: &Pad::EMPTY,
            iron_b: Vector3::zeros(),
            iron_covariance: Matrix3::identity(),
            surroundings: Surroundings {
                field_n_ut: Vector3::x(),
                field_sd: 0.0,
                earth_rate_n: Vector3::zeros(),
                bias_per_g: 0.0,
                delays: Delays {
                    gyro_s: 0.0,
                    acc_s: 0.0,
                    mag_s: 0.0,
                },
            },
        };
        Spin::begin(&start, &set)
    }

    /// Mean of what readings of this force are said to disagree by.
    fn shaken(force_b: impl Fn(f32) -> Vector3<f32>) -> f32 {
        let mut spin = spin();
        let times_s = |k: usize| 0.2 * (k / 3) as f32 + [0.05, 0.12, 0.19][k % 3];
        let changes = (1..300).map(|k| force_b(times_s(k)) - force_b(times_s(k - 1)));
        changes.map(|change_b| spin.shakes(change_b)).sum::<f32>() / 299.0
    }

    #[test]
    fn a_vibration_is_seen_and_a_change_that_goes_on_is_none() {
        // Each component of a mean square of 25.
        let tones = |t_s: f32| {
            Vector3::from_fn(|axis, _| {
                let turned = core::f32::consts::TAU * [37.3, 41.9, 46.1][axis] * t_s;
                f32::sqrt(50.0) * f32::sin(turned)
            })
        };
        let seen = shaken(tones);
        assert!((0.7..1.3).contains(&(seen / (NOT_SHARED * 25.0))), "{seen}");
        // A motor's 100 m/s3; three readings a packet are not evenly spaced, by 0.01 s at most.
        let ramp = shaken(|t_s| Vector3::x() * (100.0 * t_s));
        assert!(ramp < NOT_SHARED * 1.0, "{ramp}");
    }
}
