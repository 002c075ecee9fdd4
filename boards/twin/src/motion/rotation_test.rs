//! The two rotation tests of chapter 6 (thesis 002, sections 6.2 and 6.3), on the platform with the Spatial.
//!
//! The thesis lists turns about the axes of its left-handed frame e, clockwise or anticlockwise. They are taken to b once,
//! in [`Turn::in_b`]; from there on they are yaw, pitch and roll, each about the axis as turned so far. The thesis gives
//! angles, not times: two seconds a turn and five seconds of rest between turns are ours.

use super::Profile;
use super::{Attitude, Motion, Pose};

/// An axis of the thesis' frame e.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum AxisE {
    X,
    Y,
    Z,
}

/// The thesis' word for the sense of a turn away from zero.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Sense {
    /// "Horario".
    Clockwise,
    /// "Anti-horario".
    Anticlockwise,
}

/// A turn in the thesis' words: about this axis, in this sense as seen from zero, to this angle from zero.
#[derive(Clone, Copy, Debug)]
struct Turn(AxisE, Sense, f64);

/// An angle of the body.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum AngleB {
    Yaw,
    Pitch,
    Roll,
}

impl Turn {
    /// From e to b: x_e is down (yaw), y_e right (pitch), z_e forward (roll); signs are those of Table 6.3, in which
    /// clockwise is positive about z_e and negative about the others.
    fn in_b(self) -> (AngleB, f64) {
        let Self(axis, sense, degrees) = self;
        let angle = match axis {
            AxisE::X => AngleB::Yaw,
            AxisE::Y => AngleB::Pitch,
            AxisE::Z => AngleB::Roll,
        };
        let positive = (axis == AxisE::Z) == (sense == Sense::Clockwise);
        (
            angle,
            if positive {
                degrees.to_radians()
            } else {
                -degrees.to_radians()
            },
        )
    }
}

/// \[s\] at rest before the first turn and between turns.
const REST_S: f64 = 5.0;
/// \[s\] a turn.
const TURN_S: f64 = 2.0;

/// A rotation test: a list of turns, one after the other.
#[derive(Clone, Debug)]
pub struct RotationTest {
    yaw: Profile,
    pitch: Profile,
    roll: Profile,
}

impl RotationTest {
    /// Test 1: each axis on its own, to one side and back, then to the other.
    pub fn first() -> Self {
        use AxisE::{X, Y, Z};
        use Sense::{Anticlockwise, Clockwise};
        Self::of(&[
            Turn(Y, Anticlockwise, 30.0),
            Turn(Y, Clockwise, 0.0),
            Turn(Y, Clockwise, 30.0),
            Turn(Y, Anticlockwise, 0.0),
            Turn(Z, Clockwise, 35.0),
            Turn(Z, Anticlockwise, 0.0),
            Turn(Z, Anticlockwise, 30.0),
            Turn(Z, Clockwise, 0.0),
            Turn(X, Anticlockwise, 30.0),
            Turn(X, Clockwise, 0.0),
            Turn(X, Clockwise, 30.0),
            Turn(X, Anticlockwise, 0.0),
        ])
    }

    /// Test 2: the axes on top of each other.
    pub fn second() -> Self {
        use AxisE::{X, Y, Z};
        use Sense::{Anticlockwise, Clockwise};
        Self::of(&[
            Turn(X, Anticlockwise, 40.0),
            Turn(Y, Anticlockwise, 35.0),
            Turn(Z, Clockwise, 45.0),
            Turn(Z, Anticlockwise, 0.0),
            Turn(Z, Anticlockwise, 30.0),
            Turn(Z, Clockwise, 0.0),
            Turn(Y, Clockwise, 0.0),
            Turn(X, Clockwise, 0.0),
        ])
    }

    fn of(turns: &[Turn]) -> Self {
        let mut test = Self {
            yaw: Profile::from_rest(0.0).coast(REST_S),
            pitch: Profile::from_rest(0.0).coast(REST_S),
            roll: Profile::from_rest(0.0).coast(REST_S),
        };
        for turn in turns {
            let (angle, to) = turn.in_b();
            let next = |profile: Profile, own: AngleB| {
                let moved = if own == angle {
                    profile.move_to(to, TURN_S)
                } else {
                    profile.coast(TURN_S)
                };
                moved.coast(REST_S)
            };
            test.yaw = next(test.yaw, AngleB::Yaw);
            test.pitch = next(test.pitch, AngleB::Pitch);
            test.roll = next(test.roll, AngleB::Roll);
        }
        test
    }
}

impl Motion for RotationTest {
    fn at(&self, t_s: f64) -> Pose {
        let [yaw, pitch, roll] = [&self.yaw, &self.pitch, &self.roll].map(|angle| angle.at(t_s));
        Pose::turning(Attitude::level().yawed(yaw).pitched(pitch).rolled(roll))
    }

    fn duration_s(&self) -> Option<f64> {
        Some(self.yaw.end_s())
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;
    use crate::environment::{Environment, World};
    use crate::motion::check;
    use crate::truth::TruthSource;

    /// [m/s2] the thesis' values are exact to the digits below.
    const PRINTED: f64 = 1e-6;

    /// Specific force along (x_e, y_e, z_e), with the thesis' g = 9.8, in the middle of the rest after `turns` turns.
    fn force_e(test: RotationTest, turns: u32) -> Vector3<f64> {
        let environment = Environment {
            gravity: 9.8,
            ..Environment::laboratory()
        };
        let t_s = f64::from(turns) * (TURN_S + REST_S) + REST_S / 2.0;
        let force_b = World {
            motion: test,
            environment,
        }
        .at(t_s)
        .force_b;
        Vector3::new(force_b.z, force_b.y, force_b.x)
    }

    fn near(force: Vector3<f64>, x_e: f64, y_e: f64, z_e: f64) {
        assert!((force - Vector3::new(x_e, y_e, z_e)).norm() < PRINTED, "{force}");
    }

    #[test]
    fn test_1_gives_the_forces_of_table_6_2() {
        near(force_e(RotationTest::first(), 1), -8.487048957, 0.0, 4.9); // A
        near(force_e(RotationTest::first(), 3), -8.487048957, 0.0, -4.9); // B
        near(force_e(RotationTest::first(), 5), -8.027690034, -5.621049076, 0.0); // C
        near(force_e(RotationTest::first(), 9), -9.8, 0.0, 0.0); // D
    }

    #[test]
    fn test_2_gives_the_forces_of_table_6_4() {
        near(force_e(RotationTest::second(), 1), -9.8, 0.0, 0.0); // A
        near(force_e(RotationTest::second(), 2), -8.027690034, 0.0, 5.621049076); // B
        // C: printed -6.92 on y_e multiplies sin 45 by 9.8 and has a norm of 10.56; it is sin 45 times 8.03.
        near(
            force_e(RotationTest::second(), 3),
            -5.67643406,
            -5.67643406,
            5.621049076,
        );
    }

    #[test]
    fn rates_have_the_signs_of_table_6_3() {
        let rate_b = |t_s: f64| RotationTest::first().at(t_s).attitude.rate_nb_b;
        let turn = |nth: u32| f64::from(nth) * (TURN_S + REST_S) + REST_S + TURN_S / 2.0;
        assert!(
            rate_b(turn(0)).y > 0.4 && rate_b(turn(1)).y < -0.4,
            "y_e: anticlockwise is positive"
        );
        assert!(
            rate_b(turn(4)).x > 0.4 && rate_b(turn(5)).x < -0.4,
            "z_e: clockwise is positive"
        );
        assert!(
            rate_b(turn(8)).z > 0.4 && rate_b(turn(9)).z < -0.4,
            "x_e: anticlockwise is positive"
        );
    }

    #[test]
    fn both_end_where_they_began() {
        for test in [RotationTest::first(), RotationTest::second()] {
            assert!(test.at(test.duration_s().unwrap()).attitude.q_nb.angle() < 1e-12);
        }
    }

    #[test]
    fn their_derivatives_are_those_of_their_attitude() {
        check::derivatives(&RotationTest::first(), 0.0, 90.0);
        check::derivatives(&RotationTest::second(), 0.0, 60.0);
    }
}
