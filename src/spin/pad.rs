//! What standing on the pad tells of each sensor for itself: the gyros' biases, and what the accelerometers disagree by.
//!
//! In: cycles before lift-off. Out: the mean rate of each gyro with its variance, and of each accelerometer axis the mean of what
//! it has beyond the force that all of them found. A vector of three gives neither: four gyros have one bias more, twelve
//! accelerometers nine, and in the spin each of them is used for itself.
//!
//! A cycle in which a gyro moves begins the means afresh: rails are set up, and payloads handled.

use crate::{
    calibration::Set,
    geometry::{PLATES, TRIAD_AXES},
    increments::Increments,
};

/// \[counts\] a gyro at rest stays within so much of a packet's period: 20 samples of 2.7 counts leave ten once in a day.
const LARGEST_SPREAD: i16 = 40;

/// \[counts\] by how much a period's mean may be off the mean of all: 2.7/sqrt(20) is 0.6.
const LARGEST_CHANGE: f32 = 5.0;

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
        (self.cycles >= 5.0).then(|| noise * noise / (20.0 * self.cycles) + CHANGED * CHANGED)
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
