//! The world around a motion: gravity, Earth rate, magnetic field, temperature.
//!
//! In: where the centre of the unit goes and how it turns ([`Motion`]), and where on Earth. Out: [`Truth`], what ideal
//! sensors at the centre would feel. Navigation frame n is North-East-Down and fixed to the site; the Coriolis term of
//! the small velocities on a bench is below the resolution of every sensor here and is left out.

use nalgebra::Vector3;

use crate::kinematics::Motion;
use crate::truth::{Truth, TruthSource};

/// [rad/s] rate of the Earth: IERS' nominal mean angular velocity, 15.041069 deg/h.
pub const EARTH_RATE: f64 = 7.292_115_854_7e-5;

/// A site on Earth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Environment {
    /// [m/s2] local gravity, downwards.
    pub gravity: f64,
    /// \[rad\] latitude, north positive.
    pub latitude: f64,
    /// \[uT\] magnetic field in n.
    pub field_n_ut: Vector3<f64>,
    /// \[degC\] temperature where the motion has none of its own.
    pub temperature_c: f64,
}

impl Environment {
    /// A laboratory at the latitude of São José dos Campos, where the thesis' tables were turned.
    pub fn laboratory() -> Self {
        Self {
            gravity: 9.7864,
            latitude: (-23.2111_f64).to_radians(),
            field_n_ut: Vector3::new(17.0, -6.9, -14.2),
            temperature_c: 25.0,
        }
    }

    /// The launch centre of Alcântara (2.32 S, 44.37 W), from where the unit flew in December 2016.
    ///
    /// Gravity after the normal formula of WGS 84, field after IGRF-13 for 7 December 2016.
    pub fn alcantara() -> Self {
        Self {
            gravity: 9.7804,
            latitude: (-2.32_f64).to_radians(),
            field_n_ut: Vector3::new(24.23, -9.22, -4.07),
            temperature_c: 30.0,
        }
    }

    /// [rad/s] rate of the Earth in n. South of the equator its axis points up through the ground, so Down is positive.
    pub fn earth_rate_n(&self) -> Vector3<f64> {
        let (sin, cos) = self.latitude.sin_cos();
        Vector3::new(EARTH_RATE * cos, 0.0, -EARTH_RATE * sin)
    }

    /// [m/s2] gravity in n.
    pub fn gravity_n(&self) -> Vector3<f64> {
        Vector3::new(0.0, 0.0, self.gravity)
    }
}

/// A motion somewhere on Earth.
#[derive(Clone, Debug)]
pub struct World<M> {
    /// How the unit moves.
    pub motion: M,
    /// Where.
    pub environment: Environment,
}

impl<M: Motion> TruthSource for World<M> {
    fn at(&self, t_s: f64) -> Truth {
        let pose = self.motion.at(t_s);
        let to_b = pose.attitude.q_nb.inverse();
        let earth_b = to_b * self.environment.earth_rate_n();
        let rate_nb_b = pose.attitude.rate_nb_b;
        Truth {
            rate_b: earth_b + rate_nb_b,
            // A vector fixed in n changes in b by -w x v.
            rate_dot_b: pose.attitude.rate_dot_nb_b - rate_nb_b.cross(&earth_b),
            force_b: to_b * (pose.acc_n - self.environment.gravity_n()),
            field_b_ut: to_b * self.environment.field_n_ut,
            temperature_c: pose.temperature_c.unwrap_or(self.environment.temperature_c),
            lift_off: pose.lift_off,
            micro_g: pose.micro_g,
        }
    }

    fn duration_s(&self) -> Option<f64> {
        self.motion.duration_s()
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use nalgebra::UnitQuaternion;

    use super::*;
    use crate::motion::{Attitude, Still, Tumble};

    /// [deg/h] the golden figures have nine decimals.
    const PRINTED: f64 = 1e-8;

    #[test]
    fn at_rest_and_level_the_force_is_up_and_the_field_is_the_sites() {
        let site = Environment::laboratory();
        let truth = World {
            motion: Still::level(),
            environment: site,
        }
        .at(7.0);
        assert_eq!(truth.force_b, Vector3::new(0.0, 0.0, -9.7864));
        assert_eq!(truth.field_b_ut, site.field_n_ut);
        assert_eq!(truth.temperature_c, 25.0);
        assert!(!truth.lift_off && !truth.micro_g);
    }

    #[test]
    fn the_earth_rate_points_north_and_down_in_the_south() {
        // Thesis 000, 7.12: latitude -23.211132308 deg gives (13.823626205, 0, +5.927993281) deg/h.
        let site = Environment {
            latitude: (-23.211132308_f64).to_radians(),
            ..Environment::laboratory()
        };
        let rate = World {
            motion: Still::level(),
            environment: site,
        }
        .at(0.0)
        .rate_b;
        let golden = Vector3::new(13.823626205, 0.0, 5.927993281);
        assert!(
            (rate.map(|r| r.to_degrees() * 3600.0) - golden).norm() < PRINTED,
            "{rate}"
        );
    }

    #[test]
    fn pitched_up_by_ninety_degrees_the_force_is_forward() {
        let q_nb = UnitQuaternion::from_euler_angles(0.0, FRAC_PI_2, 0.0);
        let motion = Still {
            attitude: Attitude::at_rest(q_nb),
        };
        let truth = World {
            motion,
            environment: Environment::laboratory(),
        }
        .at(0.0);
        assert!(
            (truth.force_b - Vector3::new(9.7864, 0.0, 0.0)).norm() < 1e-12,
            "{}",
            truth.force_b
        );
    }

    #[test]
    fn what_is_fixed_in_n_turns_backwards_in_b() {
        // Handedness: dg_b/dt = -w x g_b. In the thesis' left-handed frame the sign is the other one.
        let site = Environment::laboratory();
        let world = World {
            motion: Tumble::new(),
            environment: site,
        };
        let h = 1e-4;
        for i in 0..200 {
            let t = 8.0 + f64::from(i) * 0.173;
            let slope = (world.at(t + h).force_b - world.at(t - h).force_b) / (2.0 * h);
            let rate_nb_b = world.motion.at(t).attitude.rate_nb_b;
            assert!((slope + rate_nb_b.cross(&world.at(t).force_b)).norm() < 1e-5, "at {t}");
        }
    }

    #[test]
    fn the_earths_share_of_the_angular_acceleration_is_not_forgotten() {
        let world = World {
            motion: Tumble::new(),
            environment: Environment::laboratory(),
        };
        let h = 1e-4;
        for i in 0..200 {
            let t = 8.0 + f64::from(i) * 0.173;
            let slope = (world.at(t + h).rate_b - world.at(t - h).rate_b) / (2.0 * h);
            // The Earth's share is up to 1.5e-4 rad/s2; the difference quotient is good to 1e-6.
            assert!((slope - world.at(t).rate_dot_b).norm() < 1e-5, "at {t}");
        }
    }
}
