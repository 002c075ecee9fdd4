//! The direction of the nose, as it is measured from outside: two scalars across it.
//!
//! In: azimuth and elevation of x_b with their standard deviations, once for each attitude that was found. Out: the state with it, or
//! how far the two are apart. With the directions `e` across the measured one `d`, horizontal and up, and the nose `n` of the
//! attitude, an attitude error `a` makes of it `n + a x n`, so that
//!
//! ```text
//! e . (d - n) = (n x e) . a,    sd cos(elevation) sd_azimuth and sd_elevation
//! ```
//!
//! which holds on a rail that stands upright, too, where an azimuth says next to nothing. An error of the crew's lasts for as long as
//! the rail stands: it is one witness, and is asked once.
//!
//! Refuses a direction beyond [`super::Params::gate`] of what both are known to: then the attitude stays as it is.

use core::slice;

use nalgebra::{RealField, Vector3};

use super::{
    Filter, Quantity,
    innovation::{Noise, Scalar},
    joseph::Seen,
    square,
    state::{Row, State},
};
use crate::attitude::{dcm_nb, sin_cos};

/// Where the nose points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nose {
    /// \[rad\] east of north.
    pub azimuth: f32,
    /// \[rad\] above the horizontal.
    pub elevation: f32,
    /// \[rad\] standard deviation of the azimuth.
    pub azimuth_sd: f32,
    /// \[rad\] standard deviation of the elevation.
    pub elevation_sd: f32,
}

impl Filter {
    /// Whether the direction of the nose may be taken: there is an attitude, and no window's correction of it is pending.
    pub fn may_know_nose(&self) -> bool {
        self.aligned && !self.pending.corrects()
    }

    /// Takes the direction of the nose, where that may be.
    ///
    /// # Errors
    /// If attitude and direction contradict each other: by which angle \[rad\].
    #[inline(never)]
    pub fn know_nose(&mut self, nose: &Nose) -> Result<(), f32> {
        self.settle_covariance();
        let ((sin_a, cos_a), (sin_e, cos_e)) = (sin_cos(nose.azimuth), sin_cos(nose.elevation));
        let along_n = Vector3::new(cos_e * cos_a, cos_e * sin_a, -sin_e);
        let across_n = [
            Vector3::new(-sin_a, cos_a, 0.0),
            Vector3::new(-sin_e * cos_a, -sin_e * sin_a, -cos_e),
        ];
        let sds = [cos_e * nose.azimuth_sd, nose.elevation_sd];
        let nose_n: Vector3<f32> = dcm_nb(&self.q_nb).column(0).into();
        let doubt = self.doubt();
        let mut seen = [Seen::NOTHING; 2];
        self.correction.begin(self.params.gate);
        self.correction.usable = nose_n.dot(&along_n) > 0.0;
        let [first, second] = &mut seen;
        let [across, up] = across_n.map(|direction_n| Across {
            direction_n,
            nose_n,
            doubt,
        });
        let accepted =
            across.compare(self, sds[0], &[], first) & up.compare(self, sds[1], slice::from_ref(first), second);
        if !accepted {
            return Err(2.0 * RealField::atan2((along_n - nose_n).norm(), (along_n + nose_n).norm()));
        }
        let [first, second] = &seen;
        self.covariance.update(first, second);
        self.unsound |= !self.covariance.keep_bounds();
        self.settlements = self.settlements.wrapping_add(1);
        let error = self.correction.error;
        self.correct_by(&error);
        Ok(())
    }
}

/// A direction across the one that the nose is known to have.
struct Across {
    direction_n: Vector3<f32>,
    /// The nose as the attitude has it.
    nose_n: Vector3<f32>,
    doubt: f32,
}

impl Across {
    /// Compares the nose along it. Whether it was accepted.
    #[inline(never)]
    fn compare(&self, filter: &mut Filter, sd: f32, before: &[Seen], own: &mut Seen) -> bool {
        let sees_n = self.nose_n.cross(&self.direction_n);
        let row = State {
            driven: [sees_n.x, sees_n.y, sees_n.z, 0.0, 0.0],
            ..State::ZERO
        };
        let scalar = Scalar {
            quantity: Quantity::Nose,
            predicted: self.direction_n.dot(&self.nose_n),
            measured: 0.0,
            row: Row::Of(&row),
            noise: Noise {
                alone: square(sd) + self.doubt * square(sees_n.z),
                lasting: square(sd),
            },
        };
        let covariance = &filter.covariance;
        for (axis, part) in [sees_n.x, sees_n.y, sees_n.z].into_iter().enumerate() {
            own.column.add(&covariance.of_driven(axis), part);
        }
        let looked = filter.correction.look(&scalar, before, own);
        filter.correction.judge(&scalar, &looked, own)
    }
}
