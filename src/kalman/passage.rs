//! What a window did to the error state.
//!
//! In: the window's drive and its means. Out: `F` and `Q` applied to vectors; `super::Covariance` applies them to itself.
//! With `A` the drive, `B` its mean over the window and `T` the tilt, `x <- F x` is
//!
//! ```text
//! a <- a + A d        v <- v + T ((a + B d) x f)_h,  f = (0, 0, -1)        d <- d
//! ```
//!
//! for attitude `a`, velocity `v` and drivers `d` (bias, gyro matrix): the velocity gains what the mean attitude error
//! makes of gravity. A mean over the window sees `a - A d + B d` of the state at its end, so `F'` of what it sees is `r`
//! on the attitude and `B' r` on the drivers.

use nalgebra::Vector3;

use super::{
    Params, at_least, square,
    state::{DRIVEN, DRIVERS, GYRO_MATRIX, Row, State, VELOCITY, dot},
    window::{Means, Window},
};

/// The passage from the start of a window to its end.
#[derive(Clone, Debug, Default)]
pub(super) struct Passage {
    /// Attitude error by bias \[s\] and matrix \[rad\], a row for each axis of n: `-integral dcm_nb (1, gyro)`.
    pub drive: [[f32; DRIVERS]; 3],
    /// Its mean over the window.
    pub mean_drive: [[f32; DRIVERS]; 3],
    /// Velocity by the drivers, north and east: the tilt times the mean drive across it.
    tilting: [[f32; DRIVERS]; 2],
    /// [m/s] velocity gained by an attitude error of one.
    pub tilt: f32,
    /// [rad^2] the attitude's random walk.
    pub angle_variance: f32,
    /// [rad m/s] what velocity and tilt have of it in common.
    pub both: f32,
    /// [m2/s2] the velocity's random walk.
    pub velocity_variance: f32,
    /// Random walks of bias and of gyro matrix.
    pub walks: [f32; 2],
    /// The velocity is not known any more ...
    pub velocity_lost: bool,
    /// [m/s] ... but to this.
    pub velocity_sd: f32,
}

/// Variances that bias and gyro matrix gain by walking for so long \[s\].
pub(super) fn walks(params: &Params, duration_s: f32) -> [f32; 2] {
    [params.bias_walk, params.gyro_matrix_walk].map(|walk| square(walk) * duration_s)
}

impl Passage {
    /// Becomes that of a window.
    pub fn become_of(&mut self, params: &Params, window: &Window, means: &Means) {
        let tilt = params.gravity * means.vertical_s;
        let variance = window.angle_variance;
        self.drive = window.drive;
        let per_second = 1.0 / at_least(f32::MIN_POSITIVE, window.duration_s);
        for (mean, integral) in self.mean_drive.iter_mut().zip(&window.drive_integral) {
            for (mean, integral) in mean.iter_mut().zip(integral) {
                *mean = integral * per_second;
            }
        }
        let [north, east, _] = &self.mean_drive;
        self.tilting = [east.map(|part| part * -tilt), north.map(|part| part * tilt)];
        self.tilt = tilt;
        self.angle_variance = variance;
        // The mean of a walk has a third of the variance of its end, and half of it in common with it.
        self.both = tilt * variance / 2.0;
        self.velocity_variance = tilt * tilt * variance / 3.0 + means.velocity_change_variance;
        self.walks = walks(params, means.duration_s);
        self.velocity_lost = !means.vertical;
        self.velocity_sd = params.velocity_sd;
    }

    /// What the drivers make of each driven state.
    pub fn drives(&self) -> [&[f32; DRIVERS]; DRIVEN] {
        let ([north, east, down], [to_north, to_east]) = (&self.drive, &self.tilting);
        [north, east, down, to_north, to_east]
    }

    /// What a mean over the window sees of the error state at its end, if at any instant it sees `row_n` of the attitude
    /// error: less of what the gyros' errors added than there is.
    pub fn mean_row(&self, row_n: &Vector3<f32>) -> State {
        let [x, y, z] = [row_n.x, row_n.y, row_n.z];
        let missed = |axis: usize, driver: usize| self.mean_drive[axis][driver] - self.drive[axis][driver];
        State {
            driven: [x, y, z, 0.0, 0.0],
            drivers: core::array::from_fn(|k| x * missed(0, k) + y * missed(1, k) + z * missed(2, k)),
        }
    }

    /// Makes `P h'` at the end, for a row `h` there, of `P F' h'` at the start.
    pub fn carry(&self, start: &State, row: &Row, column: &mut State) {
        // A copy stays in registers.
        let along = start.drivers;
        column.drivers = along;
        let drives = start.driven.iter().zip(self.drives());
        for (sum, (start, drive)) in column.driven.iter_mut().zip(drives) {
            *sum = start + dot(drive, &along);
        }
        let [north, east, ..] = start.driven;
        column.driven[VELOCITY] -= self.tilt * east;
        column.driven[VELOCITY + 1] += self.tilt * north;
        self.add_noise(column, row);
        if self.velocity_lost {
            column.driven[VELOCITY..].fill(0.0);
        }
    }

    /// `Q h'`.
    fn add_noise(&self, column: &mut State, row: &Row) {
        let (noise, both) = (self.angle_variance, self.both);
        let [bias, matrix] = self.walks;
        match *row {
            Row::Velocity(axis) => {
                let [north, east, .., to_north, to_east] = &mut column.driven;
                let (velocity, tilt) = if axis == 0 { (to_north, east) } else { (to_east, north) };
                *velocity += self.velocity_variance;
                *tilt += if axis == 0 { -both } else { both };
            }
            Row::Driver(k) => column.drivers[k] += if k < GYRO_MATRIX { bias } else { matrix },
            // No row of the whole sees the velocity.
            Row::Of(row) => {
                let [north, east, down, ..] = row.driven;
                let noises = [noise * north, noise * east, noise * down, -both * east, both * north];
                for (sum, noise) in column.driven.iter_mut().zip(noises) {
                    *sum += noise;
                }
                let (along_bias, along_matrix) = column.drivers.split_at_mut(GYRO_MATRIX);
                for (sum, row) in along_bias.iter_mut().zip(&row.drivers) {
                    *sum += bias * row;
                }
                for (sum, row) in along_matrix.iter_mut().zip(&row.drivers[GYRO_MATRIX..]) {
                    *sum += matrix * row;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests;
