//! How far a motion has turned about the vertical, whole turns counted: what the encoder of a table's outermost axis counts.
//!
//! In: attitudes that follow each other closely. Out: the yaw of each, of Euler angles 3-2-1, of which every attitude has two
//! sets, `(yaw, pitch, roll)` and `(yaw + pi, pi - pitch, roll + pi)`, and each angle by whole turns more. An axis does not
//! jump: of these the set next to the one before is meant, so that a pitch may go through the vertical. Where a motion passes
//! close beside the vertical, yaw truly turns fast.

use core::f64::consts::{PI, TAU};

use nalgebra::{Quaternion, UnitQuaternion, Vector3};

/// Follows the angles from attitude to attitude.
#[derive(Clone, Debug, Default)]
pub struct Heading {
    /// \[rad\] yaw, pitch, roll.
    angles: Option<Vector3<f64>>,
    /// \[rad\] the first yaw.
    start: f64,
}

impl Heading {
    /// \[rad\] turned about the vertical since the first attitude.
    pub fn follow(&mut self, q_nb: Quaternion<f64>) -> f64 {
        let (roll, pitch, yaw) = UnitQuaternion::from_quaternion(q_nb).euler_angles();
        let told = Vector3::new(yaw, pitch, roll);
        let Some(before) = self.angles else {
            (self.angles, self.start) = (Some(told), yaw);
            return 0.0;
        };
        let other = Vector3::new(yaw + PI, PI - pitch, roll + PI);
        let [near, far] = [told, other].map(|angles| {
            let turns = (angles - before).map(|apart| (apart / TAU).round());
            angles - turns * TAU
        });
        let angles = if (near - before).norm() <= (far - before).norm() {
            near
        } else {
            far
        };
        self.angles = Some(angles);
        angles.x - self.start
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::motion::{Attitude, Jet};

    #[test]
    fn turns_are_counted_also_where_the_pitch_goes_over_the_top() {
        // Three turns one way and back while the pitch goes through the vertical fourteen times.
        let mut heading = Heading::default();
        for k in 0..6000 {
            let t_s = 0.01 * f64::from(k);
            let yaw = Jet::sine(3.0 * TAU, 0.1, t_s);
            let attitude = Attitude::level()
                .yawed(yaw)
                .pitched(Jet::sine(4.0, 0.4, t_s))
                .rolled(Jet::sine(1.0, 0.7, t_s));
            // The quaternion's sign says nothing.
            let q = attitude.q_nb.into_inner() * if k % 2 == 0 { 1.0 } else { -1.0 };
            let found = heading.follow(q);
            assert!(
                (found - yaw.value).abs() < 1e-9,
                "at {t_s} s: {found} for {}",
                yaw.value
            );
        }
    }

    #[test]
    fn it_counts_from_where_the_motion_begins() {
        let mut heading = Heading::default();
        let turned = |angle: f64| UnitQuaternion::from_axis_angle(&Vector3::z_axis(), angle).into_inner();
        assert_eq!(heading.follow(turned(2.0)), 0.0);
        assert!((heading.follow(turned(2.5)) - 0.5).abs() < 1e-12);
    }
}
