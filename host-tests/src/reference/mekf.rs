//! The multiplicative filter in f64: dense matrices, `F P F' + Q`, vector updates with the full Joseph form.
//!
//! The model of `emems::kalman`, for data without gates, rest, learning or iron: attitude error in n, bias, gyro matrix,
//! velocity; windows of `params.window_s`; two updates a window, velocity and field.

use emems::kalman::{Params, Step};
use nalgebra::{Matrix2, Matrix3, SMatrix, SVector, UnitQuaternion, Vector2, Vector3};

const N: usize = 17;

/// State and the sums of the running window.
pub struct Mekf {
    /// Attitude.
    pub q_nb: UnitQuaternion<f64>,
    /// [rad/s] bias.
    pub bias_b: Vector3<f64>,
    /// Gyro matrix.
    pub gyro_matrix: Matrix3<f64>,
    /// Covariance.
    pub covariance: SMatrix<f64, N, N>,
    velocity_n: Vector2<f64>,
    params: Params,
    /// Transition over the window so far.
    transition: SMatrix<f64, N, N>,
    mean_transition: SMatrix<f64, N, N>,
    angle_variance: f64,
    duration_s: f64,
    acc: (f64, Vector3<f64>, f64, f64),
    mag: (f64, Vector3<f64>, f64, f64),
    /// Samples of specific force in n: the last two of the window before, and all of the window.
    acc_before_n: Vec<Vector3<f64>>,
    acc_n: Vec<Vector3<f64>>,
    rate_b: Option<Vector3<f64>>,
}

impl Mekf {
    /// From an attitude with this variance \[rad^2\] about each axis.
    pub fn new(params: Params, q_nb: UnitQuaternion<f64>, variance: f64) -> Self {
        let mut covariance = SMatrix::zeros();
        for index in 0..N {
            covariance[(index, index)] = match index {
                0..3 => variance,
                3..6 => f64::from(params.bias_sd).powi(2),
                6..15 => f64::from(params.gyro_matrix_sd).powi(2),
                _ => f64::from(params.velocity_sd).powi(2),
            };
        }
        Mekf {
            q_nb,
            bias_b: Vector3::zeros(),
            gyro_matrix: Matrix3::zeros(),
            covariance,
            velocity_n: Vector2::zeros(),
            params,
            transition: SMatrix::identity(),
            mean_transition: SMatrix::zeros(),
            angle_variance: 0.0,
            duration_s: 0.0,
            acc: (0.0, Vector3::zeros(), 0.0, 0.0),
            mag: (0.0, Vector3::zeros(), 0.0, 0.0),
            acc_before_n: Vec::new(),
            acc_n: Vec::new(),
            rate_b: None,
        }
    }

    /// Takes a step.
    pub fn step(&mut self, step: &Step) {
        let dt_s = f64::from(step.covered_s);
        let gyro: Vector3<f64> = step.angle_b.cast();
        let turned = gyro - self.gyro_matrix * gyro - self.bias_b * dt_s;
        let earth: Vector3<f64> = self.params.earth_rate_n.cast();
        let began_b = self.rate_b.replace(step.rate_b.cast());
        let (ended_nb, mean) = self.through(&gyro, began_b, &step.rate_b.cast(), dt_s);
        let moved_n = mean * (gyro - turned) + earth * dt_s;
        self.q_nb = UnitQuaternion::from_scaled_axis(-moved_n) * ended_nb;
        let after = self.q_nb.to_rotation_matrix().into_inner();
        let mut f = SMatrix::<f64, N, N>::identity();
        for row in 0..3 {
            for axis in 0..3 {
                f[(row, 3 + axis)] = -mean[(row, axis)] * dt_s;
                for about in 0..3 {
                    f[(row, 6 + 3 * axis + about)] = -mean[(row, axis)] * gyro[about];
                }
            }
        }
        // The wrong vertical turns gravity into velocity, by the attitude error at the step's end, where it is sampled.
        let mut fall = SMatrix::<f64, N, N>::identity();
        fall[(15, 1)] = -f64::from(self.params.gravity) * dt_s;
        fall[(16, 0)] = -fall[(15, 1)];
        self.transition = fall * f * self.transition;
        self.mean_transition += self.transition * dt_s;
        self.angle_variance += f64::from(step.angle_variance)
            + f64::from(self.params.angle_noise).powi(2) * dt_s
            + f64::from(self.params.turn_noise).powi(2) * turned.norm();
        self.duration_s += dt_s;
        for (sum, sampled) in [(&mut self.acc, step.acc), (&mut self.mag, step.mag)] {
            if let Some(sampled) = sampled {
                let value_n = after * sampled.value_b.cast::<f64>();
                sum.0 += 1.0;
                sum.1 += value_n;
                sum.2 += value_n.norm_squared();
                sum.3 += f64::from(sampled.variance);
            }
        }
        if let Some(acc) = step.acc {
            self.acc_n.push(after * acc.value_b.cast::<f64>());
        }
        if self.duration_s >= f64::from(self.params.window_s) - 5e-4 {
            self.close();
        }
    }

    /// Attitude at the end of a step and the mean matrix over it: Simpson's rule where the turn is long enough to matter.
    fn through(
        &self,
        angle_b: &Vector3<f64>,
        began_b: Option<Vector3<f64>>,
        ended_b: &Vector3<f64>,
        dt_s: f64,
    ) -> (UnitQuaternion<f64>, Matrix3<f64>) {
        let matrix = |q: UnitQuaternion<f64>| q.to_rotation_matrix().into_inner();
        let ended_nb = self.q_nb * UnitQuaternion::from_scaled_axis(*angle_b);
        let ends = matrix(self.q_nb) + matrix(ended_nb);
        if angle_b.norm() < 0.1 {
            return (ended_nb, ends / 2.0);
        }
        let bent_b = began_b.map_or(Vector3::zeros(), |began_b| {
            let swept = angle_b.cross(ended_b);
            (began_b - ended_b - swept / 2.0 - angle_b.cross(&swept) / 12.0) * dt_s / 8.0
        });
        let middle = matrix(self.q_nb * UnitQuaternion::from_scaled_axis(angle_b / 2.0 + bent_b));
        (ended_nb, (ends + middle * 4.0) / 6.0)
    }

    /// By trapezoids, and the variance of a sample: second differences where they show more than the sensor's noise.
    fn gained(&mut self, mean_n: Vector3<f64>, noise: f64) -> (Vector3<f64>, f64) {
        let samples = std::mem::take(&mut self.acc_n);
        let count = samples.len() as f64;
        let before = std::mem::take(&mut self.acc_before_n);
        let ended_n = samples[samples.len() - 1];
        let gained_n = before
            .last()
            .map_or(mean_n, |began_n| mean_n + (began_n - ended_n) / (2.0 * count));
        let all: Vec<_> = before.into_iter().chain(samples).collect();
        let off = |three: &[Vector3<f64>]| (three[2] - three[1] * 2.0 + three[0]).norm_squared() / 6.0;
        let unforeseen = all.windows(3).map(off).sum::<f64>() / (3.0 * count);
        self.acc_before_n = all[all.len() - 2..].to_vec();
        (gained_n, if unforeseen > 2.0 * noise { unforeseen } else { noise })
    }

    fn close(&mut self) {
        let t_s = std::mem::take(&mut self.duration_s);
        let p = self.params;
        let square = |x: f32| f64::from(x).powi(2);
        let mean = |sum: (f64, Vector3<f64>, f64, f64)| {
            let (mean, noise) = (sum.1 / sum.0, sum.3 / sum.0);
            (
                mean,
                (sum.2 / sum.0 - mean.norm_squared() - 3.0 * noise).max(0.0),
                noise,
                sum.0,
            )
        };
        let (acc, acc_spread, acc_noise, acc_n) =
            mean(std::mem::replace(&mut self.acc, (0.0, Vector3::zeros(), 0.0, 0.0)));
        let (mag, mag_spread, mag_noise, mag_n) =
            mean(std::mem::replace(&mut self.mag, (0.0, Vector3::zeros(), 0.0, 0.0)));
        let (gained_n, missed) = self.gained(acc, acc_noise);
        let f = std::mem::replace(&mut self.transition, SMatrix::identity());
        let mean_f = std::mem::replace(&mut self.mean_transition, SMatrix::zeros()) / t_s;
        let mut q = SMatrix::<f64, N, N>::zeros();
        for index in 3..15 {
            q[(index, index)] = t_s
                * if index < 6 {
                    square(p.bias_walk)
                } else {
                    square(p.gyro_matrix_walk)
                };
        }
        let angle_variance = std::mem::take(&mut self.angle_variance);
        for index in 0..3 {
            q[(index, index)] = angle_variance;
        }
        let fall = f64::from(p.gravity) * t_s;
        for (velocity, axis, fall) in [(15, 1, -fall), (16, 0, fall)] {
            q[(velocity, velocity)] += fall * fall * angle_variance / 3.0;
            q[(velocity, axis)] += fall * angle_variance / 2.0;
            q[(axis, velocity)] += fall * angle_variance / 2.0;
        }
        for index in 15..17 {
            q[(index, index)] += t_s * t_s * (square(p.acc_error) + missed / acc_n);
        }
        self.covariance = f * self.covariance * f.transpose() + q;
        self.velocity_n += gained_n.xy() * t_s;
        let mut error = SVector::<f64, N>::zeros();
        let mut h = SMatrix::<f64, 2, N>::zeros();
        h[(0, 15)] = 1.0;
        h[(1, 16)] = 1.0;
        let moving = square(p.velocity_sd) + square(p.velocity_per_spread_s) * acc_spread;
        self.update(&mut error, &h, -self.velocity_n, &Vector2::new(moving, moving));
        let field = p.field;
        let (norm, dip0) = (f64::from(field.norm_ut), f64::from(field.dip));
        let dip = mag.z.atan2(mag.x.hypot(mag.y));
        let disturbance = (mag.norm() / norm - 1.0).powi(2) + (dip - dip0).powi(2);
        let unrest = square(p.field_spread) * mag_spread + (mag_spread + mag_noise) / mag_n;
        let seen = square(p.disturbance) * disturbance + unrest / (norm * norm);
        let mut h = SMatrix::<f64, 2, N>::zeros();
        h[(0, 0)] = -dip0.sin();
        h[(0, 2)] = dip0.cos();
        h[(1, 1)] = -1.0;
        // The mean field saw the mean attitude of the window: the state carried back to its start and on to there.
        let h = h * mean_f * f.try_inverse().expect("a transition");
        let residual = Vector2::new(-dip0.cos() * mag.y.atan2(mag.x), dip0 - dip);
        let noise = Vector2::new(
            (f64::from(p.heading_sd) * dip0.cos()).powi(2) + seen,
            square(p.dip_sd) + seen,
        );
        self.update(&mut error, &h, residual, &noise);
        let small: Vector3<f64> = error.fixed_rows::<3>(0).into();
        let turned = UnitQuaternion::from_scaled_axis(small);
        self.q_nb = turned * self.q_nb;
        for before_n in &mut self.acc_before_n {
            *before_n = turned * *before_n;
        }
        self.bias_b += error.fixed_rows::<3>(3);
        for axis in 0..3 {
            for about in 0..3 {
                self.gyro_matrix[(axis, about)] += error[6 + 3 * axis + about];
            }
        }
        self.velocity_n += error.fixed_rows::<2>(15);
    }

    fn update(
        &mut self,
        error: &mut SVector<f64, N>,
        h: &SMatrix<f64, 2, N>,
        residual: Vector2<f64>,
        noise: &Vector2<f64>,
    ) {
        let r = Matrix2::from_diagonal(noise);
        let s = h * self.covariance * h.transpose() + r;
        let gain = self.covariance * h.transpose() * s.try_inverse().expect("noise is positive");
        *error += gain * (residual - h * *error);
        let short = SMatrix::<f64, N, N>::identity() - gain * h;
        self.covariance = short * self.covariance * short.transpose() + gain * r * gain.transpose();
    }
}
