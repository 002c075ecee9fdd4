//! A unit that is moved while it runs: turned by whoever watches it, at the time of asking.
//!
//! In: turns about an axis of the body and levels of the lift-off line, each from an instant on that nobody has looked at yet.
//! Out: a [`Motion`]. What was is never changed: a turn begins after the end of the one before, so the pose at a time that
//! was asked for stays what it was, and the motion is a pure function of time for whoever asks in order.
//!
//! A turn is the quintic from rest to rest of [`Profile`], about a fixed axis.

use std::sync::{Arc, PoisonError, RwLock};

use nalgebra::{Unit, UnitQuaternion, Vector3};

use super::{Attitude, Motion, Pose, Profile};

/// One turn.
#[derive(Clone, Debug)]
struct Leg {
    from_s: f64,
    lasts_s: f64,
    /// Attitude before it.
    q_nb: UnitQuaternion<f64>,
    axis_b: Unit<Vector3<f64>>,
    angle_rad: f64,
}

#[derive(Clone, Debug, Default)]
struct Course {
    legs: Vec<Leg>,
    /// Levels of the lift-off line, and from when on \[s\].
    lift_off: Vec<(f64, bool)>,
}

/// A motion that is made up as it goes. Clones are the same motion.
#[derive(Clone, Debug, Default)]
pub struct Guided(Arc<RwLock<Course>>);

impl Guided {
    /// Turns by `angle_rad` \[rad\] about an axis of the body, from `from_s` on or after the turn before; when it ends \[s\].
    pub fn turn(&self, from_s: f64, axis_b: Unit<Vector3<f64>>, angle_rad: f64, lasts_s: f64) -> f64 {
        let mut course = self.0.write().unwrap_or_else(PoisonError::into_inner);
        let last = course.legs.last();
        let from_s = last.map_or(from_s, |leg| from_s.max(leg.from_s + leg.lasts_s));
        let q_nb = last.map_or_else(UnitQuaternion::identity, |leg| {
            leg.q_nb * UnitQuaternion::from_axis_angle(&leg.axis_b, leg.angle_rad)
        });
        course.legs.push(Leg {
            from_s,
            lasts_s,
            q_nb,
            axis_b,
            angle_rad,
        });
        from_s + lasts_s
    }

    /// Turns to an attitude on the shortest way; when it ends \[s\].
    pub fn turn_to(&self, from_s: f64, q_nb: &UnitQuaternion<f64>, lasts_s: f64) -> f64 {
        let now = self.resting();
        match (now.inverse() * q_nb).axis_angle() {
            Some((axis_b, angle_rad)) => self.turn(from_s, axis_b, angle_rad, lasts_s),
            None => from_s,
        }
    }

    /// The lift-off line has this level from an instant on.
    pub fn lift_off(&self, from_s: f64, asserted: bool) {
        let mut course = self.0.write().unwrap_or_else(PoisonError::into_inner);
        course.lift_off.push((from_s, asserted));
    }

    /// The attitude after the last turn.
    fn resting(&self) -> UnitQuaternion<f64> {
        let course = self.0.read().unwrap_or_else(PoisonError::into_inner);
        course.legs.last().map_or_else(UnitQuaternion::identity, |leg| {
            leg.q_nb * UnitQuaternion::from_axis_angle(&leg.axis_b, leg.angle_rad)
        })
    }
}

impl Motion for Guided {
    fn at(&self, t_s: f64) -> Pose {
        let course = self.0.read().unwrap_or_else(PoisonError::into_inner);
        let begun = course.legs.partition_point(|leg| leg.from_s <= t_s);
        let attitude = match begun.checked_sub(1).and_then(|k| course.legs.get(k)) {
            None => Attitude::level(),
            Some(leg) => {
                let angle = Profile::from_rest(0.0).move_to(leg.angle_rad, leg.lasts_s);
                Attitude::at_rest(leg.q_nb).turned(leg.axis_b, angle.at(t_s - leg.from_s))
            }
        };
        let levels = course.lift_off.iter().rev();
        let lift_off = levels.into_iter().find(|(from_s, _)| *from_s <= t_s);
        Pose {
            lift_off: lift_off.is_some_and(|(_, asserted)| *asserted),
            ..Pose::turning(attitude)
        }
    }

    fn duration_s(&self) -> Option<f64> {
        None
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use super::*;
    use crate::motion::check;

    #[test]
    fn turns_follow_each_other_and_leave_what_was() {
        let motion = Guided::default();
        assert_eq!(motion.turn(1.0, Vector3::x_axis(), FRAC_PI_2, 2.0), 3.0);
        let before = motion.at(2.0);
        // Asked for too early, it waits for the turn before.
        let level = UnitQuaternion::identity();
        assert_eq!(motion.turn_to(2.5, &level, 2.0), 5.0);
        assert_eq!(motion.at(2.0), before);
        assert!((motion.at(3.0).attitude.q_nb.angle() - FRAC_PI_2).abs() < 1e-12);
        assert!(motion.at(9.0).attitude.q_nb.angle() < 1e-12);
        check::derivatives(&motion, 0.0, 6.0);
    }

    #[test]
    fn the_line_has_the_level_of_the_last_order() {
        let motion = Guided::default();
        motion.lift_off(3.0, true);
        motion.lift_off(5.0, false);
        let levels = [0.0, 3.0, 4.9, 5.0].map(|t_s| motion.at(t_s).lift_off);
        assert_eq!(levels, [false, true, true, false]);
    }
}
