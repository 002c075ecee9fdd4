//! The six poses and the six turns of an acceptance test.
//!
//! A pose is an attitude relative to the table t: x_t away from whoever stands before it, y_t to the right, z_t down. Poses are full
//! attitudes, heading among them: so gravity and the field, of which only the place on the table has to be kept, both turn
//! with the unit as known vectors. A turn is once round about an axis of the body, there and back, and ends where it began.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use nalgebra::{UnitQuaternion, Vector3};

/// A pose.
pub struct Pose {
    /// Its name in reports.
    pub name: &'static str,
    /// What to do.
    pub ask: &'static str,
    axis_b: [f64; 3],
    angle_rad: f64,
}

const fn pose(name: &'static str, ask: &'static str, axis_b: [f64; 3], angle_rad: f64) -> Pose {
    Pose {
        name,
        ask,
        axis_b,
        angle_rad,
    }
}

/// The six, the first of them the one that everything begins and ends in.
pub const POSES: [Pose; 6] = [
    pose(
        "level",
        "lay the unit on the table, level, plate 4 down, its x arrow away from you; nothing of iron near",
        [1.0, 0.0, 0.0],
        0.0,
    ),
    pose(
        "upside down",
        "turn it upside down about its x axis: plate 4 up, x arrow still away from you",
        [1.0, 0.0, 0.0],
        PI,
    ),
    pose(
        "nose up",
        "from level, tip it nose up: x arrow to the ceiling, y arrow still to your right",
        [0.0, 1.0, 0.0],
        FRAC_PI_2,
    ),
    pose(
        "nose down",
        "from level, tip it nose down: x arrow to the floor, y arrow still to your right",
        [0.0, 1.0, 0.0],
        -FRAC_PI_2,
    ),
    pose(
        "right side down",
        "from level, roll it to the right: y arrow to the floor, x arrow still away from you",
        [1.0, 0.0, 0.0],
        FRAC_PI_2,
    ),
    pose(
        "left side down",
        "from level, roll it to the left: y arrow to the ceiling, x arrow still away from you",
        [1.0, 0.0, 0.0],
        -FRAC_PI_2,
    ),
];

impl Pose {
    /// Attitude relative to the table: `v_t = q_tb v_b q_tb*`.
    pub fn q_tb(&self) -> UnitQuaternion<f64> {
        UnitQuaternion::from_scaled_axis(Vector3::from(self.axis_b) * self.angle_rad)
    }

    /// A vector of the table in b.
    pub fn in_b(&self, vector_t: &Vector3<f64>) -> Vector3<f64> {
        self.q_tb().inverse() * vector_t
    }
}

/// A turn once round.
pub struct Turn {
    /// Its name in reports.
    pub name: &'static str,
    /// What to do.
    pub ask: &'static str,
    axis_b: [f64; 3],
}

const fn turn(name: &'static str, ask: &'static str, axis_b: [f64; 3]) -> Turn {
    Turn { name, ask, axis_b }
}

/// The six, two about each axis.
pub const TURNS: [Turn; 6] = [
    turn(
        "about x",
        "from level, roll it once round to the right, slower than half a turn a second, and lay it down as it was",
        [1.0, 0.0, 0.0],
    ),
    turn("back about x", "now once round to the left", [-1.0, 0.0, 0.0]),
    turn(
        "about y",
        "once round about its y axis, nose up first, and lay it down as it was",
        [0.0, 1.0, 0.0],
    ),
    turn("back about y", "now once round nose down first", [0.0, -1.0, 0.0]),
    turn(
        "about z",
        "on the table, once round clockwise as seen from above, until the x arrow is away from you again",
        [0.0, 0.0, 1.0],
    ),
    turn("back about z", "now once round anticlockwise", [0.0, 0.0, -1.0]),
];

impl Turn {
    /// Its axis in b, right-handed.
    pub fn axis_b(&self) -> Vector3<f64> {
        self.axis_b.into()
    }

    /// \[rad\] the rotation, in b.
    pub fn angle_b(&self) -> Vector3<f64> {
        self.axis_b() * TAU
    }
}

/// A pose as the accelerometers see it, plate by plate, when `pose` was asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Seen {
    /// At least two plates feel what was asked for, or nobody can tell.
    Right,
    /// At least two feel this pose, and not two the one asked for.
    Other(usize),
}

/// Cosine of the angle within which a plate feels a pose: 25 deg, of the 90 to the next one.
const FEELS: f64 = 0.906;

/// Which pose this is, from the specific force \[any unit\] that each plate makes of its accelerometer, in b.
pub fn seen(asked: usize, force_b: &[Vector3<f64>]) -> Seen {
    let up_t = Vector3::new(0.0, 0.0, -1.0);
    let feel = |pose: &Pose| {
        let expected_b = pose.in_b(&up_t);
        let near = |force: &&Vector3<f64>| force.norm() > 0.0 && force.dot(&expected_b) >= FEELS * force.norm();
        force_b.iter().filter(near).count()
    };
    if feel(&POSES[asked]) >= 2 {
        return Seen::Right;
    }
    let others = (0..POSES.len()).filter(|other| *other != asked);
    let other = others.max_by_key(|other| feel(&POSES[*other]));
    other
        .filter(|other| feel(&POSES[*other]) >= 2)
        .map_or(Seen::Right, Seen::Other)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_pose_points_another_axis_up() {
        let up = POSES.each_ref().map(|pose| pose.in_b(&Vector3::new(0.0, 0.0, -1.0)));
        let expected = [
            [0.0, 0.0, -1.0],
            [0.0, 0.0, 1.0],
            [1.0, 0.0, 0.0],
            [-1.0, 0.0, 0.0],
            [0.0, -1.0, 0.0],
            [0.0, 1.0, 0.0],
        ];
        for (up, expected) in up.iter().zip(expected) {
            assert!((up - Vector3::from(expected)).norm() < 1e-12, "{up}");
        }
    }

    #[test]
    fn two_plates_decide_and_two_wrong_ones_do_not() {
        let right = Vector3::new(0.0, 0.0, -9.8);
        let wrong = Vector3::new(9.8, 0.0, 0.0);
        let elsewhere = Vector3::new(5.0, 5.0, 5.0);
        assert_eq!(seen(0, &[right, wrong, elsewhere, right]), Seen::Right);
        assert_eq!(seen(0, &[wrong, wrong, elsewhere, right]), Seen::Other(2));
        assert_eq!(seen(0, &[elsewhere; 4]), Seen::Right);
        assert_eq!(seen(0, &[]), Seen::Right);
    }
}
