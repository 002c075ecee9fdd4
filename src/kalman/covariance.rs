//! The covariance of the error state: over a window, and after a scalar.
//!
//! Error state: attitude 3 \[rad, in n\], bias 3 \[rad/s\], gyro matrix 9 \[1, row by row\], velocity 2 \[m/s, north and
//! east\]. Over a window `x <- F x` with `a <- a + A (b, M)`, `v <- v + T (a x f)_h` for `f = (0, 0, -g)` and the mean `a`; only these
//! blocks of F differ from the identity and nothing else is multiplied. The true horizontal force is left out of F: it is
//! known only as well as its noisy samples, and a filter that believes them sees heading in the noise.
//!
//! A scalar `z = h x + noise` updates in Joseph's form, `P <- (1 - k h) P (1 - k h)' + k r k'`. With `p = P h'`,
//! `s = h p + r` and `k = p/s` its terms collect to `P - k p' - p k' + s k k'`, summed in that order and kept symmetric by
//! construction: the short `P - k p'` goes indefinite in f32.

use nalgebra::{Matrix3, SMatrix, SVector};

use super::{
    Params, square,
    window::{DRIVERS, Means, Window},
};

/// Error states.
pub const STATES: usize = 17;
/// First of the bias.
pub const BIAS: usize = 3;
/// First of the gyro matrix.
pub const GYRO_MATRIX: usize = 6;
/// First of the velocity.
pub const VELOCITY: usize = 15;

/// What bias and gyro matrix drive: attitude and velocity.
const DRIVEN: [usize; 5] = [0, 1, 2, VELOCITY, VELOCITY + 1];

/// Floors of the variances: below them f32 rounding of the sums above is no longer small beside them. Attitude \[rad^2\]
/// (0.002 deg), bias, gyro matrix, velocity.
const FLOORS: [f32; 4] = [1e-9, 1e-13, 1e-11, 1e-8];

/// Covariance of the error state.
#[derive(Clone, Debug, PartialEq)]
pub struct Covariance(pub SMatrix<f32, STATES, STATES>);

/// What a scalar sees of the error state.
pub struct Seen {
    /// `p = P h'`.
    pub column: SVector<f32, STATES>,
    /// `s = h P h' + r`.
    pub variance: f32,
}

impl Covariance {
    /// Nothing known of the attitude; bias and matrix as the parameters have them.
    pub fn new(params: &Params) -> Self {
        let mut p = SMatrix::zeros();
        for index in 0..STATES {
            p[(index, index)] = square(match index {
                0..BIAS => core::f32::consts::PI,
                BIAS..GYRO_MATRIX => params.bias_sd,
                GYRO_MATRIX..VELOCITY => params.gyro_matrix_sd,
                _ => params.velocity_sd,
            });
        }
        Covariance(p)
    }

    /// [rad^2] of the attitude, in n.
    pub fn attitude(&self) -> Matrix3<f32> {
        self.0.fixed_view::<3, 3>(0, 0).into()
    }

    /// [rad^2/s^2] of the bias, in b.
    pub fn bias(&self) -> Matrix3<f32> {
        self.0.fixed_view::<3, 3>(BIAS, BIAS).into()
    }

    /// Over a window.
    pub(super) fn predict(&mut self, params: &Params, window: &Window, means: &Means) {
        // v_N loses g T a_E, v_E gains g T a_N: first with the attitude error before the window, then with what the
        // gyros' errors added to it on average.
        let tilt = params.gravity * means.vertical_s;
        self.add_row(VELOCITY, 1, -tilt);
        self.add_row(VELOCITY + 1, 0, tilt);
        let row = |of: &SMatrix<f32, 3, DRIVERS>, axis: usize, factor: f32| {
            core::array::from_fn(|driver| of[(axis, driver)] * factor)
        };
        self.drive(&[
            row(&window.drive, 0, 1.0),
            row(&window.drive, 1, 1.0),
            row(&window.drive, 2, 1.0),
            row(&window.mean_drive, 1, -tilt),
            row(&window.mean_drive, 0, tilt),
        ]);
        self.wander(window.angle_variance, tilt);
        self.drift(params, means.duration_s);
        for axis in VELOCITY..STATES {
            self.0[(axis, axis)] += means.velocity_change_variance;
        }
    }

    /// The attitude's random walk by `variance` over the window, and what it does to the velocity meanwhile: the mean of
    /// a walk has a third of the variance of its end, and half of it in common with it.
    fn wander(&mut self, variance: f32, tilt: f32) {
        for axis in 0..BIAS {
            self.0[(axis, axis)] += variance;
        }
        for (velocity, axis, tilt) in [(VELOCITY, 1, -tilt), (VELOCITY + 1, 0, tilt)] {
            self.0[(velocity, velocity)] += tilt * tilt * variance / 3.0;
            self.0[(velocity, axis)] += tilt * variance / 2.0;
            self.0[(axis, velocity)] = self.0[(velocity, axis)];
        }
    }

    /// Attitude and velocity gain `drive` times bias and gyro matrix.
    fn drive(&mut self, drive: &[[f32; DRIVERS]; DRIVEN.len()]) {
        let p: &mut [[f32; STATES]; STATES] = &mut self.0.data.0;
        let dot = |a: &[f32], b: &[f32; DRIVERS]| a.iter().zip(b).fold(0.0, |sum, (a, b)| sum + a * b);
        let gained = drive.map(|drive| p.map(|column| dot(&column[BIAS..VELOCITY], &drive)));
        let own = |k: usize, l: usize| dot(&gained[k][BIAS..VELOCITY], &drive[l]);
        for (k, row) in DRIVEN.into_iter().enumerate() {
            for column in BIAS..VELOCITY {
                let sum = p[row][column] + gained[k][column];
                p[row][column] = sum;
                p[column][row] = sum;
            }
            for (l, column) in DRIVEN.into_iter().enumerate().skip(k) {
                let both = if k == l {
                    own(k, k)
                } else {
                    0.5 * (own(k, l) + own(l, k))
                };
                let sum = p[row][column] + gained[k][column] + gained[l][row] + both;
                p[row][column] = sum;
                p[column][row] = sum;
            }
        }
    }

    fn drift(&mut self, params: &Params, duration_s: f32) {
        for index in BIAS..VELOCITY {
            let walk = if index < GYRO_MATRIX {
                params.bias_walk
            } else {
                params.gyro_matrix_walk
            };
            self.0[(index, index)] += walk * walk * duration_s;
        }
    }

    /// Row and column `row` gain `factor` times those of `of`.
    fn add_row(&mut self, row: usize, of: usize, factor: f32) {
        let p = &mut self.0;
        let own = p[(row, row)] + factor * (2.0 * p[(row, of)] + factor * p[(of, of)]);
        for column in 0..STATES {
            let sum = p[(row, column)] + factor * p[(of, column)];
            p[(row, column)] = sum;
            p[(column, row)] = sum;
        }
        p[(row, row)] = own;
    }

    /// What a scalar with these factors on the error state and noise `variance` sees.
    pub(super) fn seen(&self, rows: &[(usize, f32)], variance: f32) -> Seen {
        let mut column = [0.0; STATES];
        for (index, factor) in rows {
            for (sum, element) in column.iter_mut().zip(&self.0.data.0[*index]) {
                *sum += element * factor;
            }
        }
        let explained: f32 = rows.iter().map(|(index, factor)| column[*index] * factor).sum();
        Seen {
            column: SVector::from(column),
            variance: explained + variance,
        }
    }

    /// After a scalar: Joseph's form, by columns of the upper triangle; the lower one is its mirror image.
    pub(super) fn update(&mut self, seen: &Seen) {
        let p: &[f32; STATES] = &seen.column.data.0[0];
        let gain = p.map(|p| p / seen.variance);
        let spread = gain.map(|gain| gain * seen.variance);
        let columns: &mut [[f32; STATES]; STATES] = &mut self.0.data.0;
        for column in 0..STATES {
            let (gain_c, p_c) = (gain[column], p[column]);
            for row in 0..=column {
                let cross = gain[row] * p_c + p[row] * gain_c;
                let sum = columns[column][row] - cross + spread[row] * gain_c;
                columns[column][row] = sum;
                columns[row][column] = sum;
            }
        }
    }

    /// Attitude known afresh with this covariance \[rad^2\], in n, and independent of the rest.
    pub(super) fn align(&mut self, covariance_n: &Matrix3<f32>) {
        for index in 0..BIAS {
            self.forget(index, 0.0);
        }
        self.0.fixed_view_mut::<3, 3>(0, 0).copy_from(covariance_n);
    }

    /// Nothing known of the attitude.
    pub(super) fn forget_attitude(&mut self) {
        let unknown = square(core::f32::consts::PI);
        self.align(&Matrix3::from_diagonal_element(unknown));
    }

    /// Bias known to `sd` [rad/s] only.
    pub(super) fn forget_bias(&mut self, sd: f32) {
        for index in BIAS..GYRO_MATRIX {
            self.forget(index, sd * sd);
        }
    }

    /// Velocity known to `sd` [m/s] only.
    pub(super) fn forget_velocity(&mut self, sd: f32) {
        for index in VELOCITY..STATES {
            self.forget(index, sd * sd);
        }
    }

    /// `since_s` [s] later, with nothing heard in between.
    pub(super) fn age(&mut self, params: &Params, since_s: f32) {
        self.drift(params, since_s);
        let start = Covariance::new(params);
        for index in 0..STATES {
            let most = start.0[(index, index)];
            if self.0[(index, index)] >= most {
                self.forget(index, most);
            }
        }
    }

    fn forget(&mut self, index: usize, variance: f32) {
        self.0.fill_row(index, 0.0);
        self.0.fill_column(index, 0.0);
        self.0[(index, index)] = variance;
    }

    /// Raises what fell below its floor. `false` if a variance had become negative: rounding has won.
    pub(super) fn keep_bounds(&mut self) -> bool {
        let mut sound = true;
        for index in 0..STATES {
            let floor = FLOORS[match index {
                0..BIAS => 0,
                BIAS..GYRO_MATRIX => 1,
                GYRO_MATRIX..VELOCITY => 2,
                _ => 3,
            }];
            let variance = &mut self.0[(index, index)];
            // A state that is switched off stands at exactly zero.
            sound &= *variance >= 0.0;
            if *variance != 0.0 && *variance < floor {
                *variance = floor;
            }
        }
        sound
    }

    pub(super) fn is_finite(&self) -> bool {
        self.0.iter().all(|element| element.is_finite())
    }
}
