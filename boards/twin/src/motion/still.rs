//! The unit at rest in one attitude.

use super::{Attitude, Motion, Pose};

/// At rest for ever.
#[derive(Clone, Copy, Debug)]
pub struct Still {
    /// The attitude it rests in.
    pub attitude: Attitude,
}

impl Still {
    /// Forward north, down down.
    pub fn level() -> Self {
        Self {
            attitude: Attitude::level(),
        }
    }
}

impl Motion for Still {
    fn at(&self, _t_s: f64) -> Pose {
        Pose::turning(self.attitude)
    }

    fn duration_s(&self) -> Option<f64> {
        None
    }
}
