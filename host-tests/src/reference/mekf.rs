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
        }
    }

    /// Takes a step.
    pub fn step(&mut self, step: &Step) {
        let dt_s = f64::from(step.covered_s);
        let gyro: Vector3<f64> = step.angle_b.cast();
        let turned = gyro - self.gyro_matrix * gyro - self.bias_b * dt_s;
        let earth: Vector3<f64> = self.params.earth_rate_n.cast();
        let before = self.q_nb.to_rotation_matrix().into_inner();
        self.q_nb =
            UnitQuaternion::from_scaled_axis(earth * -dt_s) * self.q_nb * UnitQuaternion::from_scaled_axis(turned);
        let after = self.q_nb.to_rotation_matrix().into_inner();
        let mean = (before + after) / 2.0;
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
        if self.duration_s >= f64::from(self.params.window_s) - 5e-4 {
            self.close();
        }
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
            q[(index, index)] += t_s * t_s * (square(p.acc_error) + (acc_noise + 0.5 * acc_spread) / acc_n);
        }
        self.covariance = f * self.covariance * f.transpose() + q;
        self.velocity_n += acc.xy() * t_s;
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
        self.q_nb = UnitQuaternion::from_scaled_axis(small) * self.q_nb;
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
