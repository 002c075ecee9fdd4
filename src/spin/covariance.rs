//! The covariance of the spin phase's error state, and one scalar after the other.
//!
//! In: how the state moves over a short step, and what a scalar sees of it. Out: the covariance, and what the scalars since
//! the last correction add up to. Joseph's form as in [`crate::kalman`]: with `p = P h'`, `s = h p + r`, `k = p/s` and
//! `u = p - k s/2`, `P <- P - k u' - u k'`.
//!
//! Two errors that are not estimated are considered: `phi`, of variance one and independent of the noises, with `C = E[x phi']`, what
//! a scalar sees of them being `g` (S. F. Schmidt, "Application of state-space methods to navigation problems", Advances in Control
//! Systems 3, 1966): `p = P h' + C g'`, `s = h p + g (C' h' + g') + r`, and `C <- C - k (h C + g)`.
//!
//! Refuses a scalar beyond its gate, or one that is not a number, and says by how much it was.

use nalgebra::{Matrix3, SMatrix, Vector3};

/// Error states.
pub const STATES: usize = 25;
/// \[rad\] attitude, a rotation vector in n: `q_true = q(a) q_nb`.
pub const ATTITUDE: usize = 0;
/// \[rad/s\] rate about x_b.
pub const SPIN: usize = 3;
/// \[rad/s2\] its derivative.
pub const SPIN_UP: usize = 4;
/// \[rad/s\] rate across the spin, two axes that do not spin.
pub const ACROSS: usize = 5;
/// \[rad/s2\] its derivative.
pub const ACROSS_UP: usize = 7;
/// \[rad/s\] bias of each gyro.
pub const BIAS: usize = 9;
/// \[1\] what each gyro sees of the spin beyond its axis: scale and misalignment.
pub const SEES_SPIN: usize = 13;
/// \[uT\] hard iron that all magnetometers share, in b.
pub const IRON: usize = 17;
/// \[1\] by how much longer all levers are.
pub const LEVER: usize = 20;
/// \[rad/s for each g\] by how much force along the spin axis moves each gyro's bias, against that on the pad.
pub const BY_LOAD: usize = 21;

/// What a scalar sees: some states and how much of each.
pub type Row<'a> = &'a [(usize, f32)];

/// Errors that are considered.
pub const CONSIDERED: usize = 2;

/// Covariance and pending correction.
#[derive(Clone, Debug)]
pub struct Covariance {
    p: [[f32; STATES]; STATES],
    /// What the states have in common with each error that is considered.
    with_considered: [[f32; STATES]; CONSIDERED],
    /// The error state that the scalars since the last correction found.
    pub error: [f32; STATES],
}

/// Floors of the variances: below them f32 rounding is no longer small. Attitude 0.002 deg, rates 1e-5 rad/s, their derivatives,
/// bias 1e-6 rad/s, 1e-5, 1e-3 uT, 1e-5.
fn floor(state: usize) -> f32 {
    match state {
        ATTITUDE..SPIN => 1e-9,
        SPIN | ACROSS | 6 => 1e-10,
        SPIN_UP | ACROSS_UP | 8 => 1e-6,
        BIAS..SEES_SPIN => 1e-12,
        IRON..LEVER => 1e-6,
        LEVER => 1e-10,
        // A gyro that is told to feel no force stays so.
        BY_LOAD..STATES => 0.0,
        _ => 1e-10,
    }
}

impl Covariance {
    /// Independent states with these variances.
    pub fn of(variances: &[f32; STATES]) -> Self {
        let mut p = [[0.0; STATES]; STATES];
        for ((k, row), variance) in (0..STATES).zip(&mut p).zip(variances) {
            if let Some(own) = row.get_mut(k) {
                *own = *variance;
            }
        }
        Covariance {
            p,
            with_considered: [[0.0; STATES]; CONSIDERED],
            error: [0.0; STATES],
        }
    }

    /// A block of three states, both ways.
    pub fn set_block(&mut self, at: usize, block: &Matrix3<f32>) {
        for row in 0..3 {
            for column in 0..3 {
                self.p[at + row][at + column] = block[(row, column)];
            }
        }
    }

    /// What the attitude has in common with the last of the errors that are considered.
    pub fn set_considered(&mut self, with_attitude: &Vector3<f32>) {
        self.with_considered = [[0.0; STATES]; CONSIDERED];
        let [.., last] = &mut self.with_considered;
        last[..SPIN].copy_from_slice(with_attitude.as_slice());
    }

    /// All of it.
    #[cfg(test)]
    pub fn set(&mut self, p: &SMatrix<f32, STATES, STATES>) {
        for (row, of) in self.p.iter_mut().enumerate() {
            for (column, element) in of.iter_mut().enumerate() {
                *element = p[(row, column)];
            }
        }
    }

    /// Of the states from `row` on with those from `column` on.
    pub fn block<const R: usize, const C: usize>(&self, row: usize, column: usize) -> SMatrix<f32, R, C> {
        SMatrix::from_fn(|r, c| self.p[row + r][column + c])
    }

    /// Of one state.
    pub fn variance(&self, state: usize) -> f32 {
        self.p[state][state]
    }

    /// What is kept over a reset, and in which order: of the attitude all, of the others their variances.
    pub fn each_kept(&mut self, visit: &mut dyn FnMut(&mut f32)) {
        for row in 0..SPIN {
            for column in row..SPIN {
                visit(&mut self.p[row][column]);
                self.p[column][row] = self.p[row][column];
            }
        }
        for state in SPIN..STATES {
            visit(&mut self.p[state][state]);
        }
    }

    /// More is unknown of a state.
    pub fn open(&mut self, state: usize, variance: f32) {
        self.p[state][state] += variance;
    }

    /// More is unknown of the attitude.
    pub fn open_attitude(&mut self, covariance_n: &Matrix3<f32>) {
        for row in 0..3 {
            for column in 0..3 {
                self.p[row][column] += covariance_n[(row, column)];
            }
        }
    }

    /// `P <- S P S'`, where of the attitude `a` beyond what the rate across it says of it, `a - by_rate u`, the part `less` is taken off.
    pub fn lessen_attitude(&mut self, less: &Matrix3<f32>, by_rate: &SMatrix<f32, 3, 2>) {
        let with_rate = less * by_rate;
        let taken = |attitude: [f32; 3], [y, z]: [f32; 2]| {
            less * Vector3::from(attitude) - with_rate * nalgebra::Vector2::new(y, z)
        };
        for column in 0..STATES {
            let of = |row: usize| self.p[row][column];
            let taken = taken([of(0), of(1), of(2)], [of(ACROSS), of(ACROSS + 1)]);
            for axis in 0..3 {
                self.p[axis][column] -= taken[axis];
            }
        }
        for row in self.p.iter_mut().chain(&mut self.with_considered) {
            let taken = taken([row[0], row[1], row[2]], [row[ACROSS], row[ACROSS + 1]]);
            for axis in 0..3 {
                row[axis] -= taken[axis];
            }
        }
    }

    /// Over a step of `dt_s`: the attitude gains the rates' errors along `axes_n` (x_b and the two axes across that do not
    /// spin, in n), the rates gain those of their derivatives.
    pub fn predict(&mut self, axes_n: &[Vector3<f32>; 3], dt_s: f32) {
        let half = 0.5 * dt_s;
        let [x, y, z] = axes_n;
        // By rows, `P <- F P`; then the same by columns.
        let sources = [SPIN, ACROSS, ACROSS + 1];
        let [with_spin, with_y, with_z] = sources.map(|k| self.p[k]);
        let [with_spin_up, with_y_up, with_z_up] = [SPIN_UP, ACROSS_UP, ACROSS_UP + 1].map(|k| self.p[k]);
        for column in 0..STATES {
            let gained = [
                dt_s * (with_spin[column] + half * with_spin_up[column]),
                dt_s * (with_y[column] + half * with_y_up[column]),
                dt_s * (with_z[column] + half * with_z_up[column]),
            ];
            for axis in 0..3 {
                self.p[axis][column] += x[axis] * gained[0] + y[axis] * gained[1] + z[axis] * gained[2];
            }
            self.p[SPIN][column] += dt_s * with_spin_up[column];
            self.p[ACROSS][column] += dt_s * with_y_up[column];
            self.p[ACROSS + 1][column] += dt_s * with_z_up[column];
        }
        for row in self.p.iter_mut().chain(&mut self.with_considered) {
            let gained = [
                dt_s * (row[SPIN] + half * row[SPIN_UP]),
                dt_s * (row[ACROSS] + half * row[ACROSS_UP]),
                dt_s * (row[ACROSS + 1] + half * row[ACROSS_UP + 1]),
            ];
            for axis in 0..3 {
                row[axis] += x[axis] * gained[0] + y[axis] * gained[1] + z[axis] * gained[2];
            }
            row[SPIN] += dt_s * row[SPIN_UP];
            row[ACROSS] += dt_s * row[ACROSS_UP];
            row[ACROSS + 1] += dt_s * row[ACROSS_UP + 1];
        }
    }

    /// Variance of what a scalar sees.
    pub fn along(&self, row: Row) -> f32 {
        let of = |&(i, a): &(usize, f32)| -> f32 { row.iter().map(|&(j, b)| a * b * self.of_both(i, j)).sum() };
        row.iter().map(of).sum()
    }

    fn of_both(&self, i: usize, j: usize) -> f32 {
        self.p.get(i).and_then(|row| row.get(j)).copied().unwrap_or_default()
    }

    /// How far a residual is off in variances, `r` being its noise's; and the residual after the scalars before it.
    pub fn look(&self, row: Row, residual: f32, r: f32) -> (f32, f32) {
        let known = |&(i, a): &(usize, f32)| a * self.error.get(i).copied().unwrap_or_default();
        let left = residual - row.iter().map(known).sum::<f32>();
        (left * left / (self.along(row) + r), left)
    }

    /// Takes a scalar with white variance `r`. By how many times its variance it was off, squared; used only up to `gate`.
    pub fn update(&mut self, row: Row, residual: f32, r: f32, gate: f32) -> f32 {
        self.consider(row, &[0.0; CONSIDERED], residual, r, gate)
    }

    /// The same of a scalar that sees so much of each error that is considered.
    #[inline(never)]
    pub fn consider(&mut self, row: Row, sees: &[f32; CONSIDERED], residual: f32, r: f32, gate: f32) -> f32 {
        let mut column = [0.0; STATES];
        for &(i, a) in row {
            for (sum, part) in column.iter_mut().zip(&self.p[i]) {
                *sum += a * part;
            }
        }
        let (mut s, mut left) = (r, residual);
        // h C + g
        let mut in_common = *sees;
        for ((in_common, sees), with) in in_common.iter_mut().zip(sees).zip(&self.with_considered) {
            for &(i, a) in row {
                *in_common += a * with.get(i).copied().unwrap_or_default();
            }
            // Gyros and force see nothing of it, and are most of a packet's scalars.
            if *sees != 0.0 {
                for (sum, part) in column.iter_mut().zip(with) {
                    *sum += sees * part;
                }
                s += sees * *in_common;
            }
        }
        for &(i, a) in row {
            s += a * column[i];
            left -= a * self.error[i];
        }
        let off = left * left / s;
        // Not greater, so that NaN is refused too.
        if !(s > 0.0 && off <= gate) {
            return off;
        }
        let by_s = 1.0 / s;
        let gain = column.map(|part| part * by_s);
        for (error, gain) in self.error.iter_mut().zip(&gain) {
            *error += gain * left;
        }
        for (with, in_common) in self.with_considered.iter_mut().zip(in_common) {
            for (with, gain) in with.iter_mut().zip(&gain) {
                *with -= gain * in_common;
            }
        }
        let half = 0.5 * s;
        let mut rest = column;
        for (rest, gain) in rest.iter_mut().zip(&gain) {
            *rest -= half * gain;
        }
        for i in 0..STATES {
            let (k, u) = (gain[i], rest[i]);
            for j in i..STATES {
                self.p[i][j] -= k * rest[j] + u * gain[j];
            }
        }
        for i in 1..STATES {
            let (above, below) = self.p.split_at_mut(i);
            for (below, above) in below[0].iter_mut().zip(above) {
                *below = above[i];
            }
        }
        off
    }

    /// Holds the variances at their floors. Whether all is finite.
    pub fn keep_sound(&mut self) -> bool {
        for (k, row) in self.p.iter_mut().enumerate() {
            let least = floor(k);
            if row[k] < least {
                row[k] = least;
            }
        }
        let sum = self
            .p
            .as_flattened()
            .iter()
            .chain(self.with_considered.as_flattened())
            .fold(0.0, |sum, element| sum + element * 0.0);
        sum == 0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// \[rad2\] variance of an angle after many readings that are all off by one error of this deviation.
    fn after_readings(prior: f32, considered_sd: f32) -> f32 {
        let mut variances = [1e-6; STATES];
        variances[ATTITUDE] = prior;
        let mut covariance = Covariance::of(&variances);
        for _ in 0..10_000 {
            covariance.consider(&[(ATTITUDE, 1.0)], &[considered_sd, 0.0], 0.0, 1e-2, f32::MAX);
        }
        covariance.variance(ATTITUDE)
    }

    /// Readings with a common error of a deviation of 0.1 leave that error, or what was known before if it is better.
    #[test]
    fn an_error_that_is_the_same_in_all_readings_stays() {
        let told = after_readings(1.0, 0.1);
        assert!((0.009..0.011).contains(&told), "{told}");
        let known = after_readings(0.0001, 0.1);
        assert!((0.000_09..0.000_101).contains(&known), "{known}");
        let without = after_readings(1.0, 0.0);
        assert!(without < 2e-6, "{without}");
    }

    /// What the attitude has in common with it from the start is not counted twice.
    #[test]
    fn a_heading_that_has_the_same_error_learns_nothing_of_it() {
        let mut variances = [1e-6; STATES];
        variances[ATTITUDE + 2] = 0.01;
        let mut covariance = Covariance::of(&variances);
        covariance.set_considered(&Vector3::new(0.0, 0.0, 0.1));
        covariance.consider(&[(ATTITUDE + 2, 1.0)], &[0.0, -0.1], 0.0, 1e-2, f32::MAX);
        let left = covariance.variance(ATTITUDE + 2);
        assert!((left - 0.01).abs() < 1e-6, "{left}");
    }
}
