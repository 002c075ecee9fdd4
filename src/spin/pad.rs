//! What standing on the pad tells of each sensor for itself: the gyros' biases, and what the accelerometers disagree by.
//!
//! In: cycles before lift-off. Out: the mean rate of each gyro with its variance, and of each accelerometer axis the mean of what
//! it has beyond the force that all of them found. A vector of three gives neither: four gyros have one bias more, twelve
//! accelerometers nine, and in the spin each of them is used for itself. And what the twelve disagree by says how far the force of all
//! is off, better than a set that fits every unit.
//!
//! A cycle in which a gyro moves begins the means afresh: rails are set up, and payloads handled.

use nalgebra::ComplexField;

use crate::{
    calibration::Set,
    geometry::{PLATES, TRIAD_AXES},
    increments::Increments,
};

/// \[counts\] a gyro at rest stays within so much of a packet's period: 20 samples of 2.7 counts leave ten once in a day.
const LARGEST_SPREAD: i16 = 40;

/// \[counts\] by how much a period's mean may be off the mean of all: 2.7/sqrt(20) is 0.6.
const LARGEST_CHANGE: f32 = 5.0;

/// Cycles that make a mean.
const LEAST: f32 = 5.0;

/// Cycles after which the means forget: a quarter of an hour at 5 Hz; slower changes of a bias are followed.
const MOST: f32 = 4_500.0;

/// [rad/s] what a bias may have changed by since: temperature, and a minute of instability.
const CHANGED: f32 = 1.5e-5;

/// Means over the cycles at rest.
#[derive(Clone, Copy, Debug)]
pub struct Pad {
    /// [rad/s] each gyro.
    pub rate: [f32; PLATES],
    /// [m/s2] each accelerometer axis beyond the force found.
    pub force: [f32; TRIAD_AXES],
    /// [m/s2] force along x_b.
    pub along_x: f32,
    /// Cycles in the means.
    pub cycles: f32,
    counts: [f32; PLATES],
}

impl Pad {
    /// Nothing yet.
    pub const EMPTY: Pad = Pad {
        rate: [0.0; PLATES],
        force: [0.0; TRIAD_AXES],
        along_x: 0.0,
        cycles: 0.0,
        counts: [0.0; PLATES],
    };

    /// [rad2/s2] variance of each gyro's mean; `None` before there is one.
    pub fn rate_variance(&self, set: &Set) -> Option<f32> {
        let noise = set.gyro[0].noise;
        // Twenty samples a cycle.
        (self.cycles >= LEAST).then(|| noise * noise / (20.0 * self.cycles) + CHANGED * CHANGED)
    }

    /// [m/s2] what a component of the force that all accelerometers find is off by, standard deviation; `None` before it is known.
    ///
    /// Twelve axes whose errors are their own, of one variance `s`, leave `9 s` of squares beside the three components found, and a
    /// component, the mean of four plates, has `s / 4` of it. A variance that is itself found of nine squares gives errors by
    /// Student's distribution, whose variance is `9 / 7` of that. It holds in any attitude: the sum over the axes of what gravity
    /// makes of scale and direction does not depend on where it points, since their squared cosines add up to four.
    pub fn force_sd(&self) -> Option<f32> {
        const LEFT: f32 = (TRIAD_AXES - 3) as f32;
        let squares: f32 = self.force.iter().map(|beyond| beyond * beyond).sum();
        let known = self.cycles >= LEAST && squares > 0.0;
        known.then(|| ComplexField::sqrt(squares / (4.0 * (LEFT - 2.0))))
    }

    /// Takes a cycle: its gyros, and if all accelerometers were used the force along x_b and what each axis had beyond it.
    pub fn take(
        &mut self,
        set: &Set,
        above_c: &[f32; PLATES],
        increments: &Increments,
        force: Option<(f32, [f32; TRIAD_AXES])>,
    ) {
        let covered_s = increments.covered_us as f32 * 1e-6;
        if covered_s <= 0.0 || increments.gyro.iter().any(|gyro| gyro.count < 10) {
            return;
        }
        let counts = increments.gyro.map(|gyro| gyro.integral_counts_s / covered_s);
        let spread = |least: i16, most: i16| i32::from(most) - i32::from(least) > i32::from(LARGEST_SPREAD);
        let moved = increments.gyro.iter().any(|gyro| spread(gyro.least, gyro.most));
        let changed = |(now, mean): (&f32, &f32)| (now - mean).abs() > LARGEST_CHANGE || now.is_nan();
        if moved || (self.cycles > 0.0 && counts.iter().zip(&self.counts).any(changed)) {
            *self = Pad::EMPTY;
            return;
        }
        if self.cycles < MOST {
            self.cycles += 1.0;
        }
        let part = 1.0 / self.cycles;
        for k in 0..PLATES {
            self.counts[k] += (counts[k] - self.counts[k]) * part;
            let axis = &set.gyro[k];
            self.rate[k] = axis.scale_at(above_c[k]) * (self.counts[k] - axis.bias_counts_at(above_c[k]));
        }
        if let Some((along_x, beyond)) = force {
            self.along_x += (along_x - self.along_x) * part;
            for (mean, now) in self.force.iter_mut().zip(beyond) {
                *mean += (now - *mean) * part;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        calibration::{Ranges, Set},
        geometry::triad_axes_b,
        increments::{Fast, Integrator},
        unit::Settings,
    };
    use nalgebra::Vector3;

    /// The mean of how far off the force is, over units whose axes are off by numbers of one deviation, is what is said of it.
    #[test]
    fn what_the_accelerometers_disagree_by_says_how_far_the_force_is_off() {
        const UNITS: u32 = 400;
        const OFF: f32 = 0.05;
        let set = Set::nominal(Ranges::of(&Settings::NOMINAL));
        let mut integrator = Integrator::new(1.0);
        (0..=20).for_each(|sample| {
            integrator.add(Fast {
                at_us: 10_000 * sample,
                counts: [0; PLATES],
            });
        });
        let still = integrator.take();
        let mut random = 1_u32;
        let mut uniform = || {
            random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (random >> 8) as f32 / (1 << 24) as f32 - 0.5
        };
        let (mut said, mut was) = (0.0, 0.0);
        for _ in 0..UNITS {
            // Twelve uniform numbers have a variance of one.
            let off: [f32; TRIAD_AXES] = core::array::from_fn(|_| OFF * (0..12).map(|_| uniform()).sum::<f32>());
            let axes_b = triad_axes_b();
            let mean_b: Vector3<f32> = axes_b
                .iter()
                .zip(off)
                .map(|(axis_b, off)| axis_b * off)
                .sum::<Vector3<f32>>()
                / 4.0;
            let beyond = core::array::from_fn(|k| off[k] - axes_b[k].dot(&mean_b));
            let mut pad = Pad::EMPTY;
            assert_eq!(pad.force_sd(), None);
            (0..10).for_each(|_| pad.take(&set, &[0.0; PLATES], &still, Some((0.0, beyond))));
            said += pad.force_sd().map_or(0.0, |sd| sd * sd);
            was += mean_b.norm_squared() / 3.0;
        }
        let ratio = said / was;
        // 9/7, and two deviations of a mean over 400 units of three components.
        assert!((ratio - 9.0 / 7.0).abs() < 0.15, "{ratio}");
    }
}
