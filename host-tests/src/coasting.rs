//! A slow turn that begins at rest and goes on without weight.

use nalgebra::{Unit, Vector3};
use twin::{
    environment::Environment,
    motion::{Attitude, Motion, Pose, Profile},
};

/// A turn about a slanting axis, without weight from an instant on.
pub struct Coasting {
    angle: Profile,
    gravity_n: Vector3<f64>,
    weightless_s: f64,
}

impl Coasting {
    /// Rests for `rest_s`, reaches the rate within `ramp_s`, and goes on; falls freely from `weightless_s` on.
    pub fn turning(rate_deg_s: f64, rest_s: f64, ramp_s: f64, weightless_s: f64, environment: &Environment) -> Self {
        Coasting {
            angle: Profile::from_rest(0.0)
                .coast(rest_s)
                .ramp_to_rate(rate_deg_s.to_radians(), ramp_s)
                .coast(1000.0),
            gravity_n: environment.gravity_n(),
            weightless_s,
        }
    }
}

impl Motion for Coasting {
    fn at(&self, t_s: f64) -> Pose {
        let axis = Unit::new_normalize(Vector3::new(1.0, 0.4, -0.3));
        let mut pose = Pose::turning(Attitude::level().turned(axis, self.angle.at(t_s)));
        if t_s > self.weightless_s {
            pose.acc_n = self.gravity_n;
        }
        pose
    }

    fn duration_s(&self) -> Option<f64> {
        None
    }
}
