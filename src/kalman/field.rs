//! The field that is expected, and the mean field of a window against it.
//!
//! In: norm, dip and declination, given or learnt, and a window's mean field in n. Out: two scalars across the field in
//! parts of its norm `n0`, with what they see of the attitude. With `m0 = (cos dip, 0, sin dip)` in magnetic axes, an
//! attitude error `a` turns the mean field found to `m = m0 - a x m0`:
//!
//! * east: `-m_E/n0 = cos(dip) a_D - sin(dip) a_N`, the residual taken as an angle, `-cos(dip) atan2(m_E, m_N)`, so that
//!   it grows up to half a turn;
//! * meridian: `dip0 - dip = -a_E`.
//!
//! The variance of each is that of the reference plus what is seen of a disturbance: `(|m|/n0 - 1)^2 + (dip - dip0)^2`
//! holds two of its three components, and the third is as large on average.

use nalgebra::{ComplexField, Matrix3, RealField, Vector3};

use super::{
    Params, Quantity,
    field_sums::{FieldSums, MeanField},
    innovation::Noise,
    square,
};
use crate::{attitude::sin_cos, root::root};

/// The expected field.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reference {
    /// \[uT\] norm.
    pub norm_ut: f32,
    /// \[rad\] below the horizontal.
    pub dip: f32,
    /// \[rad\] magnetic north, east of north.
    pub declination: f32,
    /// North is where the field was found.
    found: bool,
    /// \[rad\] it was found in n.
    found_at: f32,
    learnt_s: f32,
    /// \[uT\] mean in n while it was learnt, hard iron included.
    raw_n: Vector3<f32>,
    /// Mean attitude meanwhile.
    turned: Matrix3<f32>,
}

/// A scalar of the field.
#[derive(Clone, Copy, Debug)]
pub struct Scalar {
    pub quantity: Quantity,
    pub residual: f32,
    /// What it sees of the attitude error, in n.
    pub row_n: Vector3<f32>,
    pub noise: Noise,
}

/// The field of a window.
#[derive(Clone, Copy, Debug)]
pub struct Compared {
    pub scalars: [Scalar; 2],
    /// \[1\] square of what norm and dip show of a disturbance.
    pub disturbance: f32,
    /// \[1\] horizontal part of the reference.
    pub horizontal: f32,
    /// \[1\] variance of the field east by the reference and the samples, without any disturbance or iron.
    pub of_reference: f32,
}

impl Reference {
    /// The field of a site: norm \[uT\], dip and declination \[rad\].
    pub const fn known(norm_ut: f32, dip: f32, declination: f32) -> Self {
        Reference {
            norm_ut,
            dip,
            declination,
            found: false,
            found_at: 0.0,
            learnt_s: f32::INFINITY,
            raw_n: Vector3::new(0.0, 0.0, 0.0),
            turned: Matrix3::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
        }
    }

    /// One to be learnt; north is where it is found. Iron that is learnt after that turns the field away from north, and not
    /// north from where it was.
    pub const fn unknown() -> Self {
        Reference {
            found: true,
            ..Reference::at_site(0.0)
        }
    }

    /// One to be learnt at a site whose declination \[rad\] is known.
    pub const fn at_site(declination: f32) -> Self {
        Reference {
            learnt_s: 0.0,
            ..Reference::known(0.0, 0.0, declination)
        }
    }

    /// \[uT\] the field in n; `None` before it is known.
    pub fn field_n_ut(&self) -> Option<Vector3<f32>> {
        let ((sin, cos), (sin_d, cos_d)) = (sin_cos(self.dip), sin_cos(self.declination));
        let known = self.norm_ut > 0.0;
        known.then(|| Vector3::new(cos * cos_d, cos * sin_d, sin) * self.norm_ut)
    }

    /// Its numbers; of a field that is known from the start none is learnt, and all are the site's.
    pub(super) fn each(&mut self, visit: &mut dyn FnMut(&mut f32)) {
        let scalars = [
            &mut self.norm_ut,
            &mut self.dip,
            &mut self.declination,
            &mut self.found_at,
            &mut self.learnt_s,
        ];
        scalars.into_iter().for_each(&mut *visit);
        self.raw_n.iter_mut().for_each(&mut *visit);
        self.turned.iter_mut().for_each(visit);
    }

    /// The field of a window against this one. `None` for a field of zero, or one along the vertical: it tells no
    /// heading.
    pub(super) fn compare(&self, params: &Params, duration_s: f32, mean: &MeanField) -> Option<Compared> {
        // The axes of the reference in n: the tilts it sees are about magnetic north and magnetic east.
        let (sin_d, cos_d) = sin_cos(self.declination);
        let (x, y) = (mean.mag_n.x, mean.mag_n.y);
        let (north, east) = (cos_d * x + sin_d * y, cos_d * y - sin_d * x);
        let norm = root(mean.mag_n.norm_squared());
        let horizontal = ComplexField::sqrt(north * north + east * east);
        let dip = RealField::atan2(mean.mag_n.z, horizontal);
        if !(horizontal > LEAST_HORIZONTAL * norm && self.norm_ut > 0.0) {
            return None;
        }
        let (sin, cos) = sin_cos(self.dip);
        let disturbance = self.deviation(norm, dip);
        let unrest = mean.unrest(params) / square(self.norm_ut);
        let seen = square(params.disturbance) * disturbance + unrest;
        let noise = |sd: f32| Noise::lasting(square(sd), params.field_lasts_s, duration_s).and_white(seen);
        Some(Compared {
            scalars: [
                Scalar {
                    quantity: Quantity::FieldEast,
                    residual: -cos * RealField::atan2(east, north),
                    row_n: Vector3::new(-sin * cos_d, -sin * sin_d, cos),
                    noise: noise(params.heading_sd * cos),
                },
                Scalar {
                    quantity: Quantity::FieldMeridian,
                    residual: self.dip - dip,
                    row_n: Vector3::new(sin_d, -cos_d, 0.0),
                    noise: noise(params.dip_sd),
                },
            ],
            disturbance,
            horizontal: cos,
            of_reference: square(params.heading_sd * cos) + (mean.unrest(params) - mean.iron) / square(self.norm_ut),
        })
    }

    /// Where the field lies as seen from above, in n.
    pub(super) fn heading_n(&self) -> Vector3<f32> {
        let (sin, cos) = sin_cos(self.declination);
        Vector3::new(cos, sin, 0.0)
    }

    /// \[1\] square of what norm and dip of a mean field show of a disturbance, the vertical being where mean specific
    /// force has it; zero before anything is known of the field.
    pub(super) fn disturbance(&self, mag_n: &Vector3<f32>, acc_n: &Vector3<f32>) -> f32 {
        if self.learnt_s == 0.0 {
            return 0.0;
        }
        let down = -acc_n / acc_n.norm();
        let dip = RealField::atan2(mag_n.dot(&down), mag_n.cross(&down).norm());
        self.deviation(mag_n.norm(), dip)
    }

    fn deviation(&self, norm_ut: f32, dip: f32) -> f32 {
        square(norm_ut / self.norm_ut - 1.0) + square(dip - self.dip)
    }

    /// The iron is another from now on; until now it was `iron_b` \[uT\]. A reference that was complete stands, a younger one
    /// is learnt afresh.
    pub(super) fn have_other_iron(&mut self, params: &Params, iron_b: &Vector3<f32>) {
        if self.learnt_s < params.learn_s {
            *self = if self.found {
                Reference::unknown()
            } else {
                Reference::at_site(self.declination)
            };
        } else {
            self.raw_n -= self.turned * iron_b;
            self.turned = Matrix3::zeros();
        }
    }

    /// The mean field so far, while the reference is young.
    pub(super) fn learn(&mut self, params: &Params, duration_s: f32, sums: &FieldSums, iron_b: &Vector3<f32>) {
        if !self.is_young(params) {
            return;
        }
        self.learnt_s += duration_s;
        let part = duration_s / self.learnt_s;
        self.raw_n += (sums.total_n / sums.count - self.raw_n) * part;
        self.turned += (sums.turned / sums.count - self.turned) * part;
        if self.found {
            let field_n = self.without(iron_b);
            self.found_at = RealField::atan2(field_n.y, field_n.x);
        }
        self.take_off(iron_b);
    }

    /// Norm, dip and direction without `iron_b` \[uT\], which was learnt: of a young reference they follow when it learns.
    pub(super) fn follow(&mut self, params: &Params, iron_b: &Vector3<f32>) {
        if self.learnt_s.is_finite() && !self.is_young(params) {
            self.take_off(iron_b);
        }
    }

    fn is_young(&self, params: &Params) -> bool {
        self.learnt_s < params.learn_s
    }

    fn without(&self, iron_b: &Vector3<f32>) -> Vector3<f32> {
        self.raw_n - self.turned * iron_b
    }

    fn take_off(&mut self, iron_b: &Vector3<f32>) {
        let field_n = self.without(iron_b);
        if self.found {
            self.declination = RealField::atan2(field_n.y, field_n.x) - self.found_at;
        }
        self.norm_ut = field_n.norm();
        self.dip = RealField::atan2(field_n.z, ComplexField::sqrt(field_n.xy().norm_squared()));
    }
}

/// Horizontal part of the field that still tells a heading.
const LEAST_HORIZONTAL: f32 = 1e-3;

#[cfg(test)]
mod tests;
