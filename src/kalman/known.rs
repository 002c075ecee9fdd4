//! What another filter hands over, and taking it.
//!
//! In: attitude, rate, bias and their covariance at the gyros' latest true instant, what the gyros see of a spin about x_b beyond
//! it, and the iron, which turned with the spin. Out: this filter, going on from there. What it knows of the rest of the gyro matrix
//! and of the field stays; what it had gathered and not used is dropped.

use nalgebra::{Matrix3, SMatrix, UnitQuaternion, Vector2, Vector3};

use super::{Covariance, Filter, pending::Pending, spell::Spell, state::GYRO_MATRIX, window::Window};
use crate::geometry::PLATES;

/// Attitude and bias, and how well they are known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Known {
    /// Attitude.
    pub q_nb: UnitQuaternion<f32>,
    /// [rad/s] rate in b.
    pub rate_b: Vector3<f32>,
    /// [rad/s] gyro bias in b.
    pub bias_b: Vector3<f32>,
    /// Covariance of the attitude's error (\[rad\], in n) and of the bias (\[rad/s\], in b).
    pub covariance: SMatrix<f32, 6, 6>,
    /// \[1\] first column of the gyro matrix: the rate that a rate of one about x_b is taken for, beyond itself.
    pub sees_spin_b: Vector3<f32>,
    /// \[1\] variance of each of its components.
    pub sees_spin_variance: Vector3<f32>,
    /// \[uT\] hard iron in b.
    pub iron_b: Vector3<f32>,
    /// \[uT2\] its covariance.
    pub iron_covariance: Matrix3<f32>,
}

impl Filter {
    /// Goes on from what is known when the gyros' newest sample was stamped `at_us`.
    pub fn go_on(&mut self, at_us: u64, known: &Known) {
        self.q_nb = known.q_nb;
        self.bias_b = known.bias_b;
        self.rate_b = known.rate_b;
        self.velocity_n = Vector2::zeros();
        self.pending = Pending::nothing();
        self.covariance.take_over(&known.covariance, self.params.velocity_sd);
        for row in 0..3 {
            let driver = GYRO_MATRIX + 3 * row;
            let change = known.sees_spin_b[row] - self.gyro_matrix[(row, 0)];
            if let Some(with_it) = self.covariance.learn_driver(driver, known.sees_spin_variance[row]) {
                self.gyro_matrix += Matrix3::from_row_slice(&with_it[GYRO_MATRIX..]) * change;
            }
        }
        self.iron.take_over(known.iron_b, &known.iron_covariance);
        self.window = Window::EMPTY;
        self.gyro_b = None;
        self.last_us = Some(at_us);
        self.silent_s = 0.0;
        self.rejected_s = [0.0; 2];
        self.spell = Spell::default();
        self.contradicted = None;
        self.rested = false;
        self.going = None;
        self.aligned = true;
        self.settlements = self.settlements.wrapping_add(1);
        self.keep_finite();
    }

    /// What is known of the gyros beforehand: each one's scale and direction are off by themselves, with these standard deviations, and
    /// the rate is made of all by `least_squares`. So the elements of the matrix go together: with directions alone its trace is
    /// zero, if the axes are those of a tetrahedron, and what the spin shows of one column tells of the others.
    ///
    /// ```text
    /// M = sum a_k d_k',  cov d_k = direction^2 (1 - n_k n_k') + scale^2 n_k n_k'
    /// ```
    #[inline(never)]
    pub fn know_gyros(
        &mut self,
        least_squares: &SMatrix<f32, 3, PLATES>,
        axes_b: &[Vector3<f32>; PLATES],
        sd: [f32; 2],
    ) {
        self.covariance.know_gyros(least_squares, axes_b, sd);
    }

    /// Forgets all but its parameters.
    pub fn forget(&mut self) {
        self.begin_anew();
    }
}

impl Covariance {
    /// Attitude and bias are known with this covariance, and independent of the rest.
    fn take_over(&mut self, covariance: &SMatrix<f32, 6, 6>, velocity_sd: f32) {
        self.align(&covariance.fixed_view::<3, 3>(0, 0).into_owned());
        self.forget_velocity(velocity_sd);
        self.set_bias(covariance);
    }
}
