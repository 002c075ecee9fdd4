//! Attitude of the body with its exact rate and angular acceleration, composed of rotations about known axes.
//!
//! In: an attitude and an angle with its derivatives about an axis of the body as turned so far. Out: the attitude after
//! that turn. Gimbals, Euler angles and coning are all such chains, so every analytic motion gets its rates from the one
//! rule below and none differentiates anything itself.

use nalgebra::{Unit, UnitQuaternion, Vector3};

use super::profile::Jet;

/// Attitude and its first two derivatives, relative to n.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Attitude {
    /// Hamilton quaternion that takes components in b to components in n: `v_n = q_nb v_b q_nb*`.
    pub q_nb: UnitQuaternion<f64>,
    /// [rad/s] rate of b relative to n, in b.
    pub rate_nb_b: Vector3<f64>,
    /// [rad/s2] its time derivative.
    pub rate_dot_nb_b: Vector3<f64>,
}

impl Attitude {
    /// Forward north, right east, down down, at rest.
    pub fn level() -> Self {
        Self::at_rest(UnitQuaternion::identity())
    }

    /// This attitude, at rest.
    pub fn at_rest(q_nb: UnitQuaternion<f64>) -> Self {
        Self {
            q_nb,
            rate_nb_b: Vector3::zeros(),
            rate_dot_nb_b: Vector3::zeros(),
        }
    }

    /// Turned by `angle` \[rad\] about `axis` of the body as it was before the turn.
    ///
    /// With R the turn: `w = R' w_before + axis a'` and, as `d/dt (R' w) = R' w' + (R' w) x (axis a')`,
    /// `w' = R' w_before' + (R' w_before) x (axis a') + axis a''`.
    pub fn turned(self, axis: Unit<Vector3<f64>>, angle: Jet) -> Self {
        let turn = UnitQuaternion::from_axis_angle(&axis, angle.value);
        let back = turn.inverse();
        let carried = back * self.rate_nb_b;
        let added = axis.into_inner() * angle.rate;
        Self {
            q_nb: self.q_nb * turn,
            rate_nb_b: carried + added,
            rate_dot_nb_b: back * self.rate_dot_nb_b + carried.cross(&added) + axis.into_inner() * angle.acc,
        }
    }

    /// Turned about the forward axis: roll, right side down.
    pub fn rolled(self, angle: Jet) -> Self {
        self.turned(Vector3::x_axis(), angle)
    }

    /// Turned about the right axis: pitch, nose up.
    pub fn pitched(self, angle: Jet) -> Self {
        self.turned(Vector3::y_axis(), angle)
    }

    /// Turned about the down axis: yaw, nose right.
    pub fn yawed(self, angle: Jet) -> Self {
        self.turned(Vector3::z_axis(), angle)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The golden vectors are printed to twelve decimals.
    const PRINTED: f64 = 1e-12;

    fn angle(degrees: f64) -> Jet {
        Jet {
            value: degrees.to_radians(),
            rate: 0.0,
            acc: 0.0,
        }
    }

    #[test]
    fn yaw_pitch_roll_give_the_thesis_quaternion() {
        // Thesis 002, Eqs 2.32-2.35 for (phi, theta, psi) = (10, -20, 30) deg.
        let q = Attitude::level()
            .yawed(angle(30.0))
            .pitched(angle(-20.0))
            .rolled(angle(10.0))
            .q_nb;
        let golden = [0.943714364147, 0.127679440696, -0.144878125417, 0.268535822752];
        for (part, golden) in [q.w, q.i, q.j, q.k].into_iter().zip(golden) {
            assert!((part - golden).abs() < PRINTED, "{part} is not {golden}");
        }
    }

    #[test]
    fn the_rate_of_a_turn_is_carried_into_the_axes_after_the_next() {
        // Turning about down at 1 rad/s, then rolled by 90 deg: down as seen from the body is now its right.
        let spinning = Attitude::level().yawed(Jet {
            value: 0.3,
            rate: 1.0,
            acc: 0.0,
        });
        let rolled = spinning.rolled(angle(90.0));
        assert!((rolled.rate_nb_b - Vector3::new(0.0, 1.0, 0.0)).norm() < PRINTED);
    }

    #[test]
    fn turning_while_turning_adds_the_cross_term() {
        // Yaw at 2 rad/s, roll at 3 rad/s through zero: w = (3, 2 sin 0, 2 cos 0), w' = (0, 2*3, 0).
        let both = Attitude::level()
            .yawed(Jet {
                value: 0.0,
                rate: 2.0,
                acc: 0.0,
            })
            .rolled(Jet {
                value: 0.0,
                rate: 3.0,
                acc: 0.0,
            });
        assert!((both.rate_nb_b - Vector3::new(3.0, 0.0, 2.0)).norm() < PRINTED);
        assert!((both.rate_dot_nb_b - Vector3::new(0.0, 6.0, 0.0)).norm() < PRINTED);
    }
}
