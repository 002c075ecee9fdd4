//! Vectors of the error state's kind, in the blocks the covariance is kept in.
//!
//! Driven: attitude 3 \[rad, in n\] and velocity 2 \[m/s, north and east\]. Drivers: bias 3 \[rad/s\] and gyro matrix 9 \[1,
//! row by row\].

use nalgebra::Vector3;

/// States that are driven: attitude 3, velocity 2.
pub const DRIVEN: usize = 5;
/// States that drive them: bias 3, gyro matrix 9.
pub const DRIVERS: usize = 12;
/// Error states.
pub const STATES: usize = DRIVEN + DRIVERS;
/// First of the velocity among the driven.
pub const VELOCITY: usize = 3;
/// First of the gyro matrix among the drivers.
pub const GYRO_MATRIX: usize = 3;

/// A vector of the error state's kind: an error, what a scalar sees, a column of the covariance.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct State {
    /// Attitude, velocity.
    pub driven: [f32; DRIVEN],
    /// Bias, gyro matrix.
    pub drivers: [f32; DRIVERS],
}

impl State {
    /// Nothing.
    pub const ZERO: State = State {
        driven: [0.0; DRIVEN],
        drivers: [0.0; DRIVERS],
    };

    /// Becomes as another one.
    ///
    /// Not inlined: for a copy within one structure the compiler calls what copies what may overlap, at a hundred instructions.
    #[inline(never)]
    pub fn become_as(&mut self, other: &State) {
        self.driven = other.driven;
        self.drivers = other.drivers;
    }

    /// Scalar product.
    ///
    /// Not inlined, so that a [`Row`] which sees one state alone is: most do.
    #[inline(never)]
    pub fn dot(&self, other: &State) -> f32 {
        dot(&self.driven, &other.driven) + dot(&self.drivers, &other.drivers)
    }

    /// Three, each times its factor.
    pub fn combined([a, b, c]: &[State; 3], factors: &Vector3<f32>) -> Self {
        let [x, y, z] = [factors.x, factors.y, factors.z];
        State {
            driven: core::array::from_fn(|k| a.driven[k] * x + b.driven[k] * y + c.driven[k] * z),
            drivers: core::array::from_fn(|k| a.drivers[k] * x + b.drivers[k] * y + c.drivers[k] * z),
        }
    }

    /// Adds `factor` times another.
    pub fn add(&mut self, other: &State, factor: f32) {
        for (sum, part) in self.driven.iter_mut().zip(&other.driven) {
            *sum += part * factor;
        }
        for (sum, part) in self.drivers.iter_mut().zip(&other.drivers) {
            *sum += part * factor;
        }
    }

    /// Adds two, each times its factor, the first one first.
    pub fn add_two(&mut self, [a, b]: [&State; 2], [x, y]: [f32; 2]) {
        for k in 0..DRIVEN {
            self.driven[k] = self.driven[k] + a.driven[k] * x + b.driven[k] * y;
        }
        for k in 0..DRIVERS {
            self.drivers[k] = self.drivers[k] + a.drivers[k] * x + b.drivers[k] * y;
        }
    }
}

/// What a scalar sees of the error state.
#[derive(Clone, Copy, Debug)]
pub(super) enum Row<'a> {
    /// A component of the velocity alone.
    Velocity(usize),
    /// A driver alone.
    Driver(usize),
    /// All of it.
    Of(&'a State),
}

impl Row<'_> {
    /// What it sees of this one.
    #[inline]
    pub fn of(&self, state: &State) -> f32 {
        match *self {
            Row::Velocity(axis) => {
                let [.., to_north, to_east] = state.driven;
                if axis == 0 { to_north } else { to_east }
            }
            Row::Driver(k) => state.drivers[k],
            Row::Of(row) => row.dot(state),
        }
    }
}

/// Sum of products.
pub(super) fn dot<const N: usize>(a: &[f32; N], b: &[f32; N]) -> f32 {
    a.iter().zip(b).fold(0.0, |sum, (a, b)| sum + a * b)
}

/// Whether all are: nought times a number is nought, and times anything else is not a number.
pub(super) fn are_finite(numbers: &[f32]) -> bool {
    numbers.iter().fold(0.0, |sum, number| sum + number * 0.0) == 0.0
}
