//! What a window gathers, and what it says when it closes.
//!
//! In: each step's attitude, increment and samples in n. Out: how gyro errors turned into attitude error (`drive`), and
//! [`Means`]: velocity gained, mean specific force and field in n, their spreads, and whether the unit was at rest.

use nalgebra::{ComplexField, Matrix3, Vector2, Vector3};

use super::{
    Params, at_least,
    field_sums::{FieldSums, START_SPREAD},
    innovation::Noise,
    square,
    state::DRIVERS,
    step::{BEYOND_NOISE, Sampled},
};
use crate::root::root;

/// Running sums.
#[derive(Clone, Debug)]
pub struct Window {
    /// \[s\] so far, gaps included.
    pub duration_s: f32,
    /// Attitude error by bias \[s\] and matrix \[rad\]: `-integral dcm_nb (1, gyro)`.
    pub drive: [[f32; DRIVERS]; 3],
    /// Its integral over the window, whose mean is what a mean over the window saw of it.
    pub drive_integral: [[f32; DRIVERS]; 3],
    /// [rad^2] white variance of the attitude about each axis.
    pub angle_variance: f32,
    /// [rad^2] of it, the noise of the gyros' samples.
    pub gyro_variance: f32,
    covered_s: f32,
    angle_b: Vector3<f32>,
    rate_square: f32,
    acc: Sum,
    far_from_one_g: bool,
    /// [m/s2] by how much specific force exceeded one g in the seconds before.
    excess_before: f32,
    mag: FieldSums,
}

/// Sum of a vector's samples.
#[derive(Clone, Copy, Debug)]
struct Sum {
    count: f32,
    total_n: Vector3<f32>,
    squares: f32,
    variance: f32,
    /// Sum of how far the readings scatter that each sample is the mean of.
    scatter: f32,
    /// Sum of the squares of what each sample is off the line through the two before it, in variances of a sample.
    unforeseen: f32,
    /// The two samples before, the latest first, be they of the window before.
    before_n: [Option<Vector3<f32>>; 2],
    /// The last sample of the window before.
    began_n: Option<Vector3<f32>>,
}

impl Sum {
    const NONE: Sum = Sum {
        count: 0.0,
        total_n: Vector3::new(0.0, 0.0, 0.0),
        squares: 0.0,
        variance: 0.0,
        scatter: 0.0,
        unforeseen: 0.0,
        before_n: [None; 2],
        began_n: None,
    };

    fn take(&mut self, sample_n: &Vector3<f32>, variance: f32, scatter: f32) {
        self.count += 1.0;
        self.total_n += sample_n;
        if let [Some(last_n), Some(last_but_one_n)] = self.before_n {
            self.unforeseen += (sample_n - last_n * 2.0 + last_but_one_n).norm_squared() / 6.0;
        }
        self.before_n = [Some(*sample_n), self.before_n[0]];
        self.squares += sample_n.norm_squared();
        self.variance += variance;
        self.scatter += scatter;
    }

    fn mean(&self) -> Vector3<f32> {
        self.total_n / self.count
    }

    /// Mean white variance of a component.
    fn noise(&self) -> f32 {
        self.variance / self.count
    }

    /// Mean square distance from the mean, all axes, without the samples' own noise; with what a sample that is a mean hides.
    fn spread(&self) -> f32 {
        at_least(
            0.0,
            self.squares / self.count - self.mean().norm_squared() - 3.0 * self.noise(),
        ) + self.scatter / self.count
    }

    /// Variance of a component of a sample: the sensor's, or that of what moved too fast for the samples if it shows
    /// beside it.
    fn missed(&self) -> f32 {
        let unforeseen = self.unforeseen / (3.0 * self.count);
        let noise = self.noise();
        if unforeseen > BEYOND_NOISE * noise {
            unforeseen
        } else {
            noise
        }
    }

    /// Mean by trapezoids over the whole window: of the samples at its two ends half each.
    fn integral_mean(&self) -> Vector3<f32> {
        match (self.began_n, self.before_n[0]) {
            (Some(began_n), Some(ended_n)) => self.mean() + (began_n - ended_n) / (2.0 * self.count),
            _ => self.mean(),
        }
    }
}

/// What a window measured.
#[derive(Clone, Copy, Debug, Default)]
pub struct Means {
    /// \[s\] it lasted.
    pub duration_s: f32,
    /// [rad/s] mean of the gyros, in b.
    pub rate_b: Vector3<f32>,
    /// [rad^2/s^2] variance of each of its components, by the noise of the gyros' samples.
    pub rate_variance: f32,
    /// The unit was at rest.
    pub rest: bool,
    /// [m/s2] mean specific force, in n.
    pub acc_n: Vector3<f32>,
    /// Mean specific force is near one g.
    pub near_one_g: bool,
    /// Specific force may be used for the vertical.
    pub vertical: bool,
    /// \[s\] for which it tells velocity: zero unless `vertical`.
    pub vertical_s: f32,
    /// [m/s] velocity gained, north and east.
    pub velocity_change_n: Vector2<f32>,
    /// [m2/s2] its variance.
    pub velocity_change_variance: f32,
    /// [m2/s2] how far from zero the velocity itself may be.
    pub velocity_variance: f32,
    /// \[rad2\] white variance of the attitude about each axis.
    pub angle_variance: f32,
    /// \[rad2\] of the direction of mean specific force as the vertical.
    pub tilt_variance: f32,
    acc_spread: f32,
    /// [m/s2] by how much specific force exceeded one g for seconds.
    excess: f32,
}

/// The mean specific force of a window is taken for the vertical within this part of one g: a second of hard shaking
/// stays within it, a climb or a fall does not.
const MEAN_NEAR_ONE_G: f32 = 0.2;

/// What may be left of shaking in that mean: so much of its root mean square.
const SHAKEN: f32 = 0.2;

/// \[s\] over which specific force that goes on exceeding one g is no motion: nothing that is bounded gains height for so long.
/// It is vibration that the samples fold down, and folds down across the vertical as well.
const EXCESS_S: f32 = 3.0;

/// After lift-off every sample must be within this part of one g.
const SAMPLE_NEAR_ONE_G: f32 = 0.1;

/// \[rad\] error of the first vertical found: half a degree of accelerometer bias and as much of everything else.
const START_TILT_SD: f32 = 0.0175;

impl Window {
    /// Nothing gathered yet. A constant: a value that is made first is then copied here, word by word.
    pub const EMPTY: Window = Window {
        duration_s: 0.0,
        drive: [[0.0; DRIVERS]; 3],
        drive_integral: [[0.0; DRIVERS]; 3],
        angle_variance: 0.0,
        gyro_variance: 0.0,
        covered_s: 0.0,
        angle_b: Vector3::new(0.0, 0.0, 0.0),
        rate_square: 0.0,
        acc: Sum::NONE,
        far_from_one_g: false,
        excess_before: 0.0,
        mag: FieldSums::NONE,
    };

    /// A step: mean attitude over it, what the gyros saw, and the variance it adds.
    pub fn turn(&mut self, dcm_nb: &Matrix3<f32>, gyro_b: &Vector3<f32>, covered_s: f32, gap_s: f32, variance: f32) {
        self.duration_s += covered_s + gap_s;
        self.covered_s += covered_s;
        self.angle_variance += variance;
        self.angle_b += gyro_b;
        if covered_s > 0.0 {
            self.rate_square += gyro_b.norm_squared() / covered_s;
        }
        // Samples are taken at the ends of steps.
        let lasted_s = covered_s + gap_s;
        let add = |(sum, integral): (&mut f32, &mut f32), gained: f32| {
            *sum -= gained;
            *integral += *sum * lasted_s;
        };
        let rows = <[[f32; 3]; 3]>::from(dcm_nb.transpose());
        for ((drive, integral), row) in self.drive.iter_mut().zip(&mut self.drive_integral).zip(rows) {
            let (bias, matrix) = drive.split_at_mut(3);
            let (bias_integral, matrix_integral) = integral.split_at_mut(3);
            for (both, part) in bias.iter_mut().zip(bias_integral).zip(row) {
                add(both, part * covered_s);
            }
            for (both, k) in matrix.iter_mut().zip(matrix_integral).zip(0..9) {
                add(both, row[k / 3] * gyro_b[k % 3]);
            }
        }
    }

    /// A sample of specific force, in n.
    pub fn take_acc(&mut self, acc_n: &Vector3<f32>, sampled: &Sampled, gravity: f32) {
        self.far_from_one_g |= !is_near(acc_n, gravity, SAMPLE_NEAR_ONE_G);
        self.acc.take(acc_n, sampled.variance, sampled.scatter);
    }

    /// Becomes the window that follows this one, whose means are these, in the same axes.
    pub fn follow(&mut self, means: &Means) {
        let before_n = self.acc.before_n;
        *self = Window::EMPTY;
        self.acc.before_n = before_n;
        self.acc.began_n = before_n[0];
        self.excess_before = means.excess;
    }

    /// [m/s2] by how much specific force exceeds one g, this window included.
    fn excess(&self, params: &Params) -> f32 {
        if self.acc.count <= 0.0 {
            return 0.0;
        }
        let part = (self.duration_s / EXCESS_S).min(1.0);
        let now = root(self.acc.integral_mean().norm_squared()) - params.gravity;
        self.excess_before + (now - self.excess_before) * part
    }

    /// A sample of the field.
    pub fn take_mag(&mut self, mag_b: &Vector3<f32>, dcm_nb: &Matrix3<f32>, variance: f32) {
        self.mag.take(mag_b, dcm_nb, variance);
    }

    /// What it gathered in n, in axes that are turned.
    pub fn turn_axes(&mut self, turned: &Matrix3<f32>) {
        let acc = &mut self.acc;
        let [last_n, last_but_one_n] = &mut acc.before_n;
        for vector_n in [last_n, last_but_one_n, &mut acc.began_n] {
            *vector_n = vector_n.map(|vector_n| turned * vector_n);
        }
        if self.duration_s <= 0.0 {
            return;
        }
        for drive in [&mut self.drive, &mut self.drive_integral] {
            let old = *drive;
            for (axis, row) in drive.iter_mut().enumerate() {
                for (k, part) in row.iter_mut().enumerate() {
                    *part =
                        turned[(axis, 0)] * old[0][k] + turned[(axis, 1)] * old[1][k] + turned[(axis, 2)] * old[2][k];
                }
            }
        }
        acc.total_n = turned * acc.total_n;
        self.mag.turn_axes(turned);
    }

    /// The field.
    pub fn field(&self) -> &FieldSums {
        &self.mag
    }

    /// What it all says.
    pub fn means(&self, params: &Params, lift_off: bool) -> Means {
        let covered_s = at_least(f32::MIN_POSITIVE, self.covered_s);
        let rate_b = self.angle_b / covered_s;
        let rate_spread = self.rate_square / covered_s - rate_b.norm_squared();
        let sampled = self.acc.count > 0.0;
        let acc_n = if sampled { self.acc.mean() } else { Vector3::zeros() };
        let (acc_spread, gained_n, missed) = if sampled {
            let missed = self.acc.missed() / self.acc.count;
            (self.acc.spread(), self.acc.integral_mean(), missed)
        } else {
            (0.0, Vector3::zeros(), 0.0)
        };
        let near_one_g = sampled
            && ComplexField::abs(root(acc_n.norm_squared()) - params.gravity)
                < MEAN_NEAR_ONE_G * params.gravity + SHAKEN * root(acc_spread);
        let vertical = near_one_g && !(lift_off && self.far_from_one_g);
        let vertical_s = if vertical { self.duration_s } else { 0.0 };
        let rest = !lift_off
            && near_one_g
            && rate_b.norm_squared() < square(params.rest.rate)
            && rate_spread < square(params.rest.rate_spread)
            && acc_spread < square(params.rest.acc_spread);
        let moving = square(params.velocity_sd) + square(params.velocity_per_spread_s) * acc_spread;
        // In flight what a window has beyond one g that is far from it is thrust or drag, and no vibration. The re-entry's 10 g would
        // be remembered for twenty seconds of the parachute.
        let excess = if lift_off && !vertical {
            0.0
        } else {
            self.excess(params)
        };
        let tilt_variance = (START_SPREAD + 1.0 / at_least(1.0, self.acc.count)) * acc_spread / square(params.gravity);
        Means {
            duration_s: self.duration_s,
            rate_b,
            rate_variance: self.gyro_variance / square(covered_s),
            rest,
            acc_n,
            near_one_g,
            vertical,
            vertical_s,
            velocity_change_n: gained_n.xy() * vertical_s,
            velocity_change_variance: square(vertical_s)
                * (square(params.acc_error)
                    + square(params.acc_scale_error) * acc_spread
                    + square(params.acc_excess * excess)
                    + missed),
            velocity_variance: if rest { square(params.velocity_rest_sd) } else { moving },
            angle_variance: self.angle_variance,
            tilt_variance: square(START_TILT_SD) + tilt_variance,
            acc_spread,
            excess,
        }
    }
}

impl Means {
    /// [m/s] velocity at the start.
    pub fn start_velocity_sd(&self, params: &Params) -> f32 {
        let known = Noise::lasting(square(params.velocity_sd), params.velocity_lasts_s, self.duration_s);
        ComplexField::sqrt(known.lasting + 0.1 * self.acc_spread)
    }
}

/// Whether a specific force is within this part of one g; no root is needed for that.
fn is_near(acc_n: &Vector3<f32>, gravity: f32, part: f32) -> bool {
    let (least, most) = ((1.0 - part) * gravity, (1.0 + part) * gravity);
    let squared = acc_n.norm_squared();
    squared > least * least && squared < most * most
}

#[cfg(test)]
mod tests;
