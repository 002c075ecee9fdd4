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

use nalgebra::{Matrix3, SMatrix};

use super::{
    Params,
    passage::Passage,
    square,
    state::{DRIVEN, DRIVERS, GYRO_MATRIX, STATES, State, VELOCITY, are_finite, dot},
};

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

/// What a scalar saw of it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Seen {
    /// `p = P h'`.
    pub column: State,
    /// `s = h P h' + r`.
    pub variance: f32,
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
    pub(super) fn times(&self, driven: usize, drivers: &[f32; DRIVERS], product: &mut State) {
        // A copy stays in registers.
        let drivers = *drivers;
        let parts = self.driven[driven].iter().zip(&self.across);
        for (sum, (own, row)) in product.driven.iter_mut().zip(parts) {
            *sum = own + dot(row, &drivers);
        }
        let parts = self.across[driven].iter().zip(&self.drivers);
        for (sum, (own, row)) in product.drivers.iter_mut().zip(parts) {
            *sum = own + dot(row, &drivers);
        }
    }

    /// Over a window: attitude and bias, gyro matrix. The velocity has [`Covariance::predict_velocity`] after it.
    pub(super) fn predict_attitude(&mut self, passage: &Passage) {
        // The true horizontal force is left out of F: it is known only as well as its noisy samples, and a filter that
        // believes them sees heading in the noise.
        let tilt = passage.tilt;
        self.add_driven(VELOCITY, 1, -tilt);
        self.add_driven(VELOCITY + 1, 0, tilt);
        for (k, drive) in passage.drives().iter().enumerate().take(VELOCITY) {
            self.gain(k, drive, passage);
        }
    }

    /// Over a window: the rest of it.
    pub(super) fn predict_velocity(&mut self, passage: &Passage) {
        for (k, drive) in passage.drives().iter().enumerate().skip(VELOCITY) {
            self.gain(k, drive, passage);
        }
        mirror(&mut self.driven);
        self.wander(passage);
        self.drift(&passage.walks);
    }

    /// Driven state `k` gains `drive` times the drivers: with those, and in the upper triangle with the other driven, old
    /// and new.
    fn gain(&mut self, k: usize, drive: &[f32; DRIVERS], passage: &Passage) {
        let drives = passage.drives();
        let old = self.across[k];
        for (l, other) in drives.iter().enumerate().take(k + 1) {
            self.driven[l][k] += dot(&old, other);
        }
        let row = *drive;
        for (sum, column) in self.across[k].iter_mut().zip(&self.drivers) {
            *sum += dot(column, &row);
        }
        let new = self.across[k];
        for (l, other) in drives.iter().enumerate().skip(k) {
            self.driven[k][l] += dot(&new, other);
        }
    }

    /// The attitude's random walk over the window, what it does to the velocity meanwhile, and the velocity's own.
    fn wander(&mut self, passage: &Passage) {
        for axis in 0..VELOCITY {
            self.driven[axis][axis] += passage.angle_variance;
        }
        for (velocity, axis, both) in [(VELOCITY, 1, -passage.both), (VELOCITY + 1, 0, passage.both)] {
            self.driven[velocity][velocity] += passage.velocity_variance;
            self.driven[velocity][axis] += both;
            self.driven[axis][velocity] += both;
        }
        if passage.velocity_lost {
            self.forget_velocity(passage.velocity_sd);
        }
    }

    /// Random walks of bias and gyro matrix.
    pub(super) fn drift(&mut self, walks: &[f32; 2]) {
        for k in 0..DRIVERS {
            self.drivers[k][k] += walks[usize::from(k >= GYRO_MATRIX)];
        }
    }

    /// Driven state `row` gains `factor` times `of`.
    fn add_driven(&mut self, row: usize, of: usize, factor: f32) {
        let source = self.of_driven(of);
        for (sum, part) in self.across[row].iter_mut().zip(&source.drivers) {
            *sum += factor * part;
        }
        let own = self.driven[row][row] + factor * (2.0 * self.driven[row][of] + factor * self.driven[of][of]);
        for column in 0..DRIVEN {
            let sum = self.driven[row][column] + factor * source.driven[column];
            self.driven[row][column] = sum;
            self.driven[column][row] = sum;
        }
        self.driven[row][row] = own;
    }

    /// After a scalar: Joseph's form.
    pub(super) fn update(&mut self, seen: &Seen) {
        let p = &seen.column;
        let (per_variance, half) = (1.0 / seen.variance, 0.5 * seen.variance);
        let mut gain = State::default();
        gain.add(p, per_variance);
        let mut rest = *p;
        rest.add(&gain, -half);
        let (driven, drivers) = ([&gain.driven, &rest.driven], [&gain.drivers, &rest.drivers]);
        for (k, row) in self.driven.iter_mut().enumerate() {
            take_off(row, driven.map(|part| part[k]), driven);
        }
        let (fours, last) = self.across.as_chunks_mut::<4>();
        for (n, four) in fours.iter_mut().enumerate() {
            take_off_four(four, driven.map(|part| fours_of(part, n)), drivers);
        }
        for row in last {
            take_off(row, driven.map(|part| part[DRIVEN - 1]), drivers);
        }
        for (n, four) in self.drivers.as_chunks_mut::<4>().0.iter_mut().enumerate() {
            take_off_four(four, drivers.map(|part| fours_of(part, n)), drivers);
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

    fn forget_driver(&mut self, k: usize, variance: f32) {
        for row in self.across.iter_mut().chain(&mut self.drivers) {
            row[k] = 0.0;
        }
        self.drivers[k] = [0.0; DRIVERS];
        self.drivers[k][k] = variance;
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

    pub(super) fn is_finite(&self) -> bool {
        let [driven, across, drivers] = [
            self.driven.as_flattened(),
            self.across.as_flattened(),
            self.drivers.as_flattened(),
        ];
        are_finite(driven) && are_finite(across) && are_finite(drivers)
    }
}

/// The `n`-th four of them.
fn fours_of<const N: usize>(parts: &[f32; N], n: usize) -> [f32; 4] {
    parts.as_chunks::<4>().0.get(n).copied().unwrap_or_default()
}

/// Takes `k u' + u k'` off a row: `[k, u]` for the row and for its columns.
fn take_off<const N: usize>(row: &mut [f32; N], [k, u]: [f32; 2], [k_c, u_c]: [&[f32; N]; 2]) {
    for ((element, x), y) in row.iter_mut().zip(u_c).zip(k_c) {
        *element = *element - k * x - u * y;
    }
}

/// The same of four rows, so that what belongs to a column is loaded once for four.
#[inline(never)]
fn take_off_four<const N: usize>([a, b, c, d]: &mut [[f32; N]; 4], [k, u]: [[f32; 4]; 2], [k_c, u_c]: [&[f32; N]; 2]) {
    for column in 0..N {
        let (x, y) = (u_c[column], k_c[column]);
        a[column] = a[column] - k[0] * x - u[0] * y;
        b[column] = b[column] - k[1] * x - u[1] * y;
        c[column] = c[column] - k[2] * x - u[2] * y;
        d[column] = d[column] - k[3] * x - u[3] * y;
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
