//! Numbers for tests, drawn from a seed: the same in each run.

use nalgebra::{Matrix3, UnitQuaternion, Vector3};

/// Draws without end (SplitMix64).
pub(crate) struct Draws(u64);

impl Draws {
    pub(crate) fn of(seed: u64) -> Self {
        Draws(seed)
    }

    /// Below `end`.
    pub(crate) fn below(&mut self, end: u64) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (self.0 ^ self.0 >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ z >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
        (z ^ z >> 31) % end
    }

    /// Evenly between both.
    pub(crate) fn within(&mut self, least: f32, most: f32) -> f32 {
        least + (most - least) * (self.below(1 << 20) as f32 / (1 << 20) as f32)
    }

    /// One of these.
    pub(crate) fn one_of<T: Copy, const N: usize>(&mut self, these: [T; N]) -> T {
        these[self.below(N as u64) as usize]
    }

    /// Each component up to `most`, either way.
    pub(crate) fn vector(&mut self, most: f32) -> Vector3<f32> {
        Vector3::from_fn(|_, _| self.within(-most, most))
    }

    pub(crate) fn attitude(&mut self) -> UnitQuaternion<f32> {
        UnitQuaternion::from_euler_angles(self.within(-3.0, 3.0), self.within(-1.5, 1.5), self.within(-3.0, 3.0))
    }

    pub(crate) fn dcm(&mut self) -> Matrix3<f32> {
        self.attitude().to_rotation_matrix().into_inner()
    }

    /// Symmetric and positive definite, its diagonal around `scale`.
    pub(crate) fn covariance(&mut self, scale: f32) -> Matrix3<f32> {
        let root = Matrix3::from_fn(|row, column| self.within(-0.3, 0.3) + f32::from(u8::from(row == column)));
        root * root.transpose() * scale
    }
}

/// Whether two numbers are the same to `relative` of the larger one, or to `absolute`.
pub(crate) fn near(found: f32, expected: f64, relative: f64, absolute: f64) -> bool {
    let (found, off) = (f64::from(found), (f64::from(found) - expected).abs());
    off <= absolute || off <= relative * found.abs().max(expected.abs())
}
