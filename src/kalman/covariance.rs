//! The covariance of the error state: over a window, and after a scalar.
//!
//! Error state: attitude 3 \[rad, in n\] and velocity 2 \[m/s, north and east\], which are driven; bias 3 \[rad/s\] and gyro
//! matrix 9 \[1, row by row\], which drive them. It is kept in those blocks: how each state goes with the twelve drivers,
//! and the driven among themselves. So every product over a window is one of rows of twelve.
//!
//! Over a window `x <- F x` as [`Passage`] has it, `P <- F P F' + Q`.
//!
//! A scalar `z = h x + noise` updates in Joseph's form, `P <- (1 - k h) P (1 - k h)' + k r k'`. With `p = P h'`,
//! `s = h p + r` and `k = p/s` its terms collect to `P - k p' - p k' + s k k'`, and that to `P - k u' - u k'` with
//! `u = p - k s/2`: the same for any `k`, so an error of `k` is of second order in it, where the short `P - k p'` goes
//! indefinite in f32. What is above the diagonal is mirrored below it.

use nalgebra::{Matrix3, SMatrix, Vector3};

use super::{
    Params,
    joseph::{Seen, interleaved, take_off, take_off_four},
    passage::Passage,
    square,
    state::{DRIVEN, DRIVERS, GYRO_MATRIX, STATES, State, VELOCITY, are_finite, dot},
};
use crate::geometry::PLATES;

/// Floors of the variances: below them f32 rounding of the sums above is no longer small beside them. Attitude \[rad^2\]
/// (0.002 deg), velocity, bias, gyro matrix.
const FLOORS: [f32; 4] = [1e-9, 1e-8, 1e-13, 1e-11];

/// Covariance of the error state.
#[derive(Clone, Debug, PartialEq)]
pub struct Covariance {
    /// Driven with driven.
    driven: [[f32; DRIVEN]; DRIVEN],
    /// Driven with drivers.
    across: [[f32; DRIVERS]; DRIVEN],
    /// Drivers with drivers.
    drivers: [[f32; DRIVERS]; DRIVERS],
}

impl Covariance {
    /// Nothing known of the attitude; bias and matrix as the parameters have them.
    pub fn new(params: &Params) -> Self {
        let mut p = Covariance {
            driven: [[0.0; DRIVEN]; DRIVEN],
            across: [[0.0; DRIVERS]; DRIVEN],
            drivers: [[0.0; DRIVERS]; DRIVERS],
        };
        for k in 0..DRIVEN {
            let sd = if k < VELOCITY {
                core::f32::consts::PI
            } else {
                params.velocity_sd
            };
            p.driven[k][k] = square(sd);
        }
        for k in 0..DRIVERS {
            p.drivers[k][k] = square(if k < GYRO_MATRIX {
                params.bias_sd
            } else {
                params.gyro_matrix_sd
            });
        }
        p
    }

    /// All of it: attitude, velocity, bias, gyro matrix.
    pub fn matrix(&self) -> SMatrix<f32, STATES, STATES> {
        SMatrix::from_fn(
            |row, column| match (row.checked_sub(DRIVEN), column.checked_sub(DRIVEN)) {
                (None, None) => self.driven[row][column],
                (None, Some(driver)) => self.across[row][driver],
                (Some(driver), None) => self.across[column][driver],
                (Some(row), Some(column)) => self.drivers[row][column],
            },
        )
    }

    /// [rad^2] of the attitude, in n.
    pub fn attitude(&self) -> Matrix3<f32> {
        Matrix3::from_fn(|row, column| self.driven[row][column])
    }

    /// [rad^2/s^2] of the bias, in b.
    pub fn bias(&self) -> Matrix3<f32> {
        Matrix3::from_fn(|row, column| self.drivers[row][column])
    }

    /// [rad^2] variance of the attitude about the axis of n that is known least.
    pub(super) fn worst(&self) -> f32 {
        let [north, east, down, ..] = [0, 1, 2].map(|k| self.driven[k][k]);
        let level = if north > east { north } else { east };
        if level > down { level } else { down }
    }

    /// The column of a driver.
    pub(super) fn of_driver(&self, driver: usize) -> State {
        State {
            driven: self.across.map(|row| row[driver]),
            drivers: self.drivers[driver],
        }
    }

    /// The column of a driven state.
    pub(super) fn of_driven(&self, driven: usize) -> State {
        State {
            driven: self.driven[driven],
            drivers: self.across[driven],
        }
    }

    /// Times a vector that is one at a driven state and `drivers` at the drivers.
    ///
    /// Not inlined: from where the whole filter begins, an element is too far for an offset of the FPU's loads.
    #[inline(never)]
    fn times(&self, driven: usize, drivers: &[f32; DRIVERS], product: &mut State) {
        // A copy stays in registers.
        let drivers = *drivers;
        for k in 0..DRIVEN {
            product.driven[k] = self.driven[driven][k] + dot(&self.across[k], &drivers);
        }
        for k in 0..DRIVERS {
            product.drivers[k] = self.across[driven][k] + dot(&self.drivers[k], &drivers);
        }
    }

    /// `P h'` at the end of the window for each axis of n as a mean over the window sees it, still without passage:
    /// the covariance at its start times `(1 on the axis, B' on the drivers)`.
    pub(super) fn means_seen(&self, passage: &Passage, seen: &mut [State; 3]) {
        for (axis, (drive, seen)) in passage.mean_drive.iter().zip(seen).enumerate() {
            self.times(axis, drive, seen);
        }
    }

    /// Over a window. `velocity` is the velocity's columns at its end, which are what its scalars see ([`Passage::carry`]);
    /// `None` where nothing is known of it any more.
    pub(super) fn predict(&mut self, passage: &Passage, velocity: Option<&[State; 2]>) {
        // The true horizontal force is left out of F: it is known only as well as its noisy samples, and a filter that
        // believes them sees heading in the noise.
        for (k, drive) in passage.drive.iter().enumerate() {
            self.gain(k, drive, &passage.drive);
            self.driven[k][k] += passage.angle_variance;
        }
        for (k, column) in (VELOCITY..).zip(velocity.into_iter().flatten()) {
            self.across[k] = column.drivers;
            for (row, part) in self.driven.iter_mut().zip(&column.driven) {
                row[k] = *part;
            }
        }
        mirror(&mut self.driven);
        if velocity.is_none() {
            self.forget_velocity(passage.velocity_sd);
        }
        self.drift(&passage.walks);
    }

    /// Axis `k` of the attitude gains `drive` times the drivers: with those, and in the upper triangle with the other axes,
    /// old and new.
    fn gain(&mut self, k: usize, drive: &[f32; DRIVERS], drives: &[[f32; DRIVERS]; 3]) {
        let old = self.across[k];
        for (row, other) in self.driven.iter_mut().zip(drives).take(k + 1) {
            row[k] += dot(&old, other);
        }
        let row = *drive;
        for (sum, column) in self.across[k].iter_mut().zip(&self.drivers) {
            *sum += dot(column, &row);
        }
        let new = self.across[k];
        for (sum, other) in self.driven[k].iter_mut().zip(drives).skip(k) {
            *sum += dot(&new, other);
        }
    }

    /// Random walks of bias and gyro matrix.
    pub(super) fn drift(&mut self, walks: &[f32; 2]) {
        for k in 0..DRIVERS {
            self.drivers[k][k] += walks[usize::from(k >= GYRO_MATRIX)];
        }
    }

    /// After a scalar, or after one and then another: Joseph's form.
    #[inline(never)]
    pub(super) fn update(&mut self, first: &Seen, second: &Seen) {
        let ([k, u], [k_2, u_2]) = (first.pulls(), second.pulls());
        let driven = interleaved(&k.driven, &u.driven, &k_2.driven, &u_2.driven);
        let drivers = interleaved(&k.drivers, &u.drivers, &k_2.drivers, &u_2.drivers);
        take_off(&mut self.driven, &driven, &driven);
        let (fours, last) = self.across.as_chunks_mut::<4>();
        let (of_fours, of_last) = driven.as_chunks::<4>();
        for (four, of_four) in fours.iter_mut().zip(of_fours) {
            take_off_four(four, *of_four, &drivers, 0);
        }
        take_off(last, of_last, &drivers);
        // The upper triangle.
        let fours = self.drivers.as_chunks_mut::<4>().0.iter_mut();
        for (n, (four, of_four)) in fours.zip(drivers.as_chunks::<4>().0).enumerate() {
            take_off_four(four, *of_four, &drivers, n.wrapping_mul(4));
        }
        mirror(&mut self.driven);
        mirror(&mut self.drivers);
    }

    /// Attitude known afresh with this covariance \[rad^2\], in n, and independent of the rest.
    pub(super) fn align(&mut self, covariance_n: &Matrix3<f32>) {
        for k in 0..VELOCITY {
            self.forget_driven(k, 0.0);
        }
        for row in 0..VELOCITY {
            for column in 0..VELOCITY {
                self.driven[row][column] = covariance_n[(row, column)];
            }
        }
    }

    /// The bias known with the lower right of this, and together with the attitude by its upper right.
    pub(super) fn set_bias(&mut self, covariance: &SMatrix<f32, 6, 6>) {
        for k in 0..GYRO_MATRIX {
            self.forget_driver(k, 0.0);
        }
        for row in 0..3 {
            for column in 0..GYRO_MATRIX {
                self.across[row][column] = covariance[(row, 3 + column)];
                self.drivers[row][column] = covariance[(3 + row, 3 + column)];
            }
        }
    }

    /// The gyro matrix as it is before anything was seen of it: each gyro's own scale and direction, through the least squares that
    /// make a rate of all. See [`super::Filter::know_gyros`].
    pub(super) fn know_gyros(
        &mut self,
        least_squares: &SMatrix<f32, 3, PLATES>,
        axes_b: &[Vector3<f32>; PLATES],
        [scale, direction]: [f32; 2],
    ) {
        let (across, more_along) = (square(direction), square(scale) - square(direction));
        for row in &mut self.drivers[GYRO_MATRIX..] {
            row[GYRO_MATRIX..].fill(0.0);
        }
        let parts = <[[f32; 3]; PLATES]>::from(*least_squares);
        let axes = axes_b.map(<[f32; 3]>::from);
        for (part, axis) in parts.iter().zip(&axes) {
            // Of each element of the matrix: what least squares make of this gyro, and its axis.
            let elements: [(f32, f32, usize); 9] = core::array::from_fn(|k| (part[k / 3], axis[k % 3], k % 3));
            for (row, (a, n, column)) in self.drivers.iter_mut().skip(GYRO_MATRIX).zip(&elements) {
                for (sum, (a_2, n_2, column_2)) in row.iter_mut().skip(GYRO_MATRIX).zip(&elements) {
                    let same = if column == column_2 { across } else { 0.0 };
                    *sum += a * a_2 * (same + more_along * n * n_2);
                }
            }
        }
    }

    /// A driver is known with this variance, and what goes with it is known better too: `P <- P - p p' (p_k - v)/p_k^2`, `p` its
    /// column. By how much each driver changes for a change of one of it; `None` if it was known as well.
    pub(super) fn learn_driver(&mut self, driver: usize, variance: f32) -> Option<[f32; DRIVERS]> {
        let drivers = *self.drivers.get(driver)?;
        let before = *drivers.get(driver)?;
        let better = variance < before;
        if !better {
            return None;
        }
        let mut driven = [0.0; DRIVEN];
        for (element, row) in driven.iter_mut().zip(&self.across) {
            *element = *row.get(driver)?;
        }
        let column = State { driven, drivers };
        let seen = Seen {
            column,
            variance: before * before / (before - variance),
        };
        self.update(&seen, &Seen::NOTHING);
        Some(column.drivers.map(|part| part / before))
    }

    /// Nothing known of the attitude.
    pub(super) fn forget_attitude(&mut self) {
        let unknown = square(core::f32::consts::PI);
        self.align(&Matrix3::from_diagonal_element(unknown));
    }

    /// Bias known to `sd` [rad/s] only.
    pub(super) fn forget_bias(&mut self, sd: f32) {
        for k in 0..GYRO_MATRIX {
            self.forget_driver(k, sd * sd);
        }
    }

    /// Velocity known to `sd` [m/s] only.
    pub(super) fn forget_velocity(&mut self, sd: f32) {
        for k in VELOCITY..DRIVEN {
            self.forget_driven(k, sd * sd);
        }
    }

    /// With nothing heard for as long as makes these walks.
    pub(super) fn age(&mut self, params: &Params, walks: &[f32; 2]) {
        self.drift(walks);
        let start = Covariance::new(params);
        for k in 0..DRIVEN {
            if self.driven[k][k] >= start.driven[k][k] {
                self.forget_driven(k, start.driven[k][k]);
            }
        }
        for k in 0..DRIVERS {
            if self.drivers[k][k] >= start.drivers[k][k] {
                self.forget_driver(k, start.drivers[k][k]);
            }
        }
    }

    fn forget_driven(&mut self, k: usize, variance: f32) {
        for row in &mut self.driven {
            row[k] = 0.0;
        }
        self.driven[k] = [0.0; DRIVEN];
        self.across[k] = [0.0; DRIVERS];
        self.driven[k][k] = variance;
    }

    pub(super) fn forget_driver(&mut self, k: usize, variance: f32) {
        let column = self.across.iter_mut().chain(&mut self.drivers);
        column
            .filter_map(|row| row.get_mut(k))
            .for_each(|element| *element = 0.0);
        if let Some(row) = self.drivers.get_mut(k) {
            *row = [0.0; DRIVERS];
            row.iter_mut().skip(k).take(1).for_each(|own| *own = variance);
        }
    }

    /// Raises what fell below its floor. `false` if a variance had become negative: rounding has won.
    pub(super) fn keep_bounds(&mut self) -> bool {
        let [attitude, velocity, bias, gyro_matrix] = FLOORS;
        let mut sound = true;
        let mut keep = |variance: &mut f32, floor: f32| {
            // A state that is switched off stands at exactly zero.
            sound &= *variance >= 0.0;
            if *variance != 0.0 && *variance < floor {
                *variance = floor;
            }
        };
        for (k, row) in self.driven.iter_mut().enumerate() {
            keep(&mut row[k], if k < VELOCITY { attitude } else { velocity });
        }
        for (k, row) in self.drivers.iter_mut().enumerate() {
            keep(&mut row[k], if k < GYRO_MATRIX { bias } else { gyro_matrix });
        }
        sound
    }

    /// What is kept of it over a reset: all but the velocity, from the diagonals to the right.
    pub(super) fn each_kept(&mut self, visit: &mut dyn FnMut(&mut f32)) {
        for (row, numbers) in self.driven.iter_mut().enumerate().take(VELOCITY) {
            numbers.iter_mut().take(VELOCITY).skip(row).for_each(&mut *visit);
        }
        for numbers in self.across.iter_mut().take(VELOCITY) {
            numbers.iter_mut().for_each(&mut *visit);
        }
        for (row, numbers) in self.drivers.iter_mut().enumerate() {
            numbers.iter_mut().skip(row).for_each(&mut *visit);
        }
    }

    /// What stands on the other side of the diagonals follows from what was kept; the velocity is known to `velocity_sd`
    /// \[m/s\] only, and the variance of each axis of the attitude grows by `variance` \[rad^2\].
    pub(super) fn go_on(&mut self, velocity_sd: f32, variance: f32) {
        mirror(&mut self.driven);
        mirror(&mut self.drivers);
        self.forget_velocity(velocity_sd);
        for k in 0..VELOCITY {
            self.driven[k][k] += variance;
        }
    }

    /// Each component of the bias known to its own deviation [rad/s] only.
    pub(super) fn know_bias(&mut self, sd: &[f32; GYRO_MATRIX]) {
        for (k, sd) in sd.iter().enumerate() {
            self.forget_driver(k, sd * sd);
        }
    }

    pub(super) fn is_finite(&self) -> bool {
        let [driven, across, drivers] = [
            self.driven.as_flattened(),
            self.across.as_flattened(),
            self.drivers.as_flattened(),
        ];
        are_finite(driven) && are_finite(across) && are_finite(drivers)
    }
}

/// The lower triangle after the upper one.
fn mirror<const N: usize>(block: &mut [[f32; N]]) {
    for row in 1..block.len() {
        let (above, below) = block.split_at_mut(row);
        if let Some(below) = below.first_mut() {
            for (below, above) in below.iter_mut().zip(above) {
                *below = above[row];
            }
        }
    }
}

#[cfg(test)]
mod tests;
