//! The field's samples of a window, added up so that hard iron can be taken off afterwards, and their mean.

use nalgebra::{ComplexField, Matrix3, Vector3};

use super::{Params, at_least, square};

/// Part of the spread of specific force that its mean over the first window may still hold.
pub(super) const START_SPREAD: f32 = 0.2;

/// Sums of the field's samples.
#[derive(Clone, Copy, Debug)]
pub struct FieldSums {
    /// Samples.
    pub count: f32,
    /// \[uT\] in n.
    pub total_n: Vector3<f32>,
    /// \[uT\] in b.
    pub total_b: Vector3<f32>,
    /// Attitude matrices that took b to n.
    pub turned: Matrix3<f32>,
    squares: f32,
    variance: f32,
}

/// The mean field of a window without hard iron.
#[derive(Clone, Copy, Debug)]
pub struct MeanField {
    /// \[uT\] in n.
    pub mag_n: Vector3<f32>,
    /// [uT^2] mean square distance of the samples from it.
    pub spread: f32,
    /// [uT^2] variance of a component by what moved or turned within the window, were all of it noise, and by what is not
    /// known of the iron.
    pub white: f32,
    /// [uT^2] of it, by what is not known of the iron.
    pub iron: f32,
}

impl FieldSums {
    /// No samples.
    pub const NONE: FieldSums = FieldSums {
        count: 0.0,
        total_n: Vector3::new(0.0, 0.0, 0.0),
        total_b: Vector3::new(0.0, 0.0, 0.0),
        turned: Matrix3::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
        squares: 0.0,
        variance: 0.0,
    };

    /// A sample, and the matrix that takes it to n.
    pub fn take(&mut self, mag_b: &Vector3<f32>, dcm_nb: &Matrix3<f32>, variance: f32) {
        self.count += 1.0;
        self.total_n += dcm_nb * mag_b;
        self.total_b += mag_b;
        self.turned += dcm_nb;
        self.squares += mag_b.norm_squared();
        self.variance += variance;
    }

    /// In axes of n that are turned.
    pub fn turn_axes(&mut self, turned: &Matrix3<f32>) {
        self.total_n = turned * self.total_n;
        self.turned = turned * self.turned;
    }

    /// Unless the field was not sampled.
    pub fn if_any(&self) -> Option<&FieldSums> {
        (self.count > 0.0).then_some(self)
    }

    /// Without `iron_b` \[uT\]; there must be samples.
    pub fn mean(&self, iron_b: &Vector3<f32>) -> MeanField {
        let mag_n = (self.total_n - self.turned * iron_b) / self.count;
        let squares = (self.squares - 2.0 * iron_b.dot(&self.total_b)) / self.count + iron_b.norm_squared();
        let noise = self.variance / self.count;
        let spread = at_least(0.0, squares - mag_n.norm_squared() - 3.0 * noise);
        MeanField {
            mag_n,
            spread,
            white: (spread + noise) / self.count,
            iron: 0.0,
        }
    }
}

impl MeanField {
    /// [uT^2] variance of a component of the mean in a window like others.
    pub fn unrest(&self, params: &Params) -> f32 {
        square(params.field_spread) * self.spread + self.white
    }

    /// \[rad\] of its direction at the start, `disturbance` being the square of what is seen of one.
    pub fn direction_sd(&self, params: &Params, disturbance: f32) -> f32 {
        let unrest = (START_SPREAD * self.spread + self.white) / self.mag_n.norm_squared().max(f32::MIN_POSITIVE);
        let disturbed = square(params.disturbance) * disturbance;
        ComplexField::sqrt(square(params.start_field_sd) + disturbed + unrest)
    }
}
