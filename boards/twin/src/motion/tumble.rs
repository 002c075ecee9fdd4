//! A tumble about all three axes at once, after a rest.
//!
//! Yaw, pitch and roll are sinusoids whose frequencies have irrational ratios, so that the attitude never repeats and
//! every direction is visited; an envelope lets them begin smoothly after ten seconds at rest, because alignment and
//! gyro bias are found at rest. The centre does not move.

use std::f64::consts::{PI, SQRT_2};

use super::{Attitude, Motion, Pose};
use super::{Jet, Profile};

/// \[s\] at rest before it begins.
const REST_S: f64 = 10.0;
/// \[s\] from rest to the full tumble.
const BEGIN_S: f64 = 5.0;
/// (amplitude \[rad\], angular frequency [rad/s]); peak rates 75, 47 and 88 deg/s, together within the gyros' range.
const YAW: (f64, f64) = (PI, 0.42);
const PITCH: (f64, f64) = (1.2, 0.42 * GOLDEN_RATIO);
const ROLL: (f64, f64) = (2.6, 0.42 * SQRT_2);
const GOLDEN_RATIO: f64 = 1.618_033_988_749_895;

/// The tumble; it has no end.
#[derive(Clone, Debug)]
pub struct Tumble {
    envelope: Profile,
}

impl Tumble {
    /// Rest, then tumble.
    pub fn new() -> Self {
        Self {
            envelope: Profile::from_rest(0.0).coast(REST_S).move_to(1.0, BEGIN_S),
        }
    }
}

impl Default for Tumble {
    fn default() -> Self {
        Self::new()
    }
}

impl Motion for Tumble {
    fn at(&self, t_s: f64) -> Pose {
        let envelope = self.envelope.at(t_s);
        let swing = |(amplitude, rate): (f64, f64)| envelope * Jet::sine(amplitude, rate, t_s);
        Pose::turning(
            Attitude::level()
                .yawed(swing(YAW))
                .pitched(swing(PITCH))
                .rolled(swing(ROLL)),
        )
    }

    fn duration_s(&self) -> Option<f64> {
        None
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;
    use crate::motion::check;

    #[test]
    fn its_derivatives_are_those_of_its_attitude() {
        check::derivatives(&Tumble::new(), 0.0, 60.0);
    }

    #[test]
    fn it_begins_at_rest_and_then_uses_all_axes_within_the_gyros_range() {
        let tumble = Tumble::new();
        assert_eq!(tumble.at(9.0).attitude.rate_nb_b, Vector3::zeros());
        let mut most = Vector3::<f64>::zeros();
        for i in 0..6000 {
            most = most.sup(&tumble.at(f64::from(i) * 0.1).attitude.rate_nb_b.abs());
        }
        // ADIS16265: at least +-320 deg/s.
        assert!(most.min() > 1.0 && most.max() < 320.0_f64.to_radians(), "{most}");
    }
}
