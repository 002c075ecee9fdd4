//! Attitudes that are known at some instants: on the rail, by a photograph of stars, of a unit that rests where it landed.
//!
//! In: [`AttitudeAt`]s of `case.toml`. Out: [`Instants`]: rows for the smoother, and whether they fit the motion. With `e` the turn from the known attitude
//! to the smoothed one, in b, three rows each
//!
//! ```text
//! L^-1 J_r(e)^-1 th = -L^-1 e,      S = L L'
//! ```
//!
//! (Chirikjian 2012, 10.86). `S` is the covariance of a turn in b. Of a quaternion it is what is stated about each axis. Of azimuth, elevation and roll
//! (Euler angles 3-2-1, the nose is x_b) an error of each turns the unit about z_n, about the horizontal axis across the nose, and about
//! the nose:
//!
//! ```text
//! S = s_az^2 z z' + s_el^2 y y' + s_roll^2 x x',   z = R_x' R_y' e_z,  y = R_x' e_y,  x = e_x
//! ```
//!
//! A roll that is not told may be anything: 104 deg, the standard deviation of any angle. Near the vertical an azimuth moves the nose by no more
//! than `s_az cos el`; no nose is known better to its side than upward, so there stands `s_el` at least.
//!
//! Of this flight: `e' (S + C)^-1 e`, `C` being the covariance of the attitude without them, has a chi-square law of three degrees of freedom. An instant is
//! not used where as much comes once in a thousand by chance, over all instants ([`SELDOM`]; Bonferroni); the others are.

use std::fmt::Write;

use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use serde_json::{Value, json};
use statrs::distribution::{ChiSquared, ContinuousCDF};

use crate::{
    input::case::{AttitudeAt, Turned},
    parity::{
        known::simulated::right_jacobian_inverse,
        smooth::{
            basis::Knots,
            prior::{Prior, row},
            trajectory::Trajectory,
        },
    },
    report::verdict::rounded,
    thresholds::SELDOM,
};

/// \[deg\] standard deviation of an angle that may be anything: 360 over the root of 12.
const ANY_DEG: f64 = 103.92;

/// An attitude at an instant.
#[derive(Clone, Copy, Debug)]
pub struct Instant {
    /// \[s\] on the clock of the log.
    pub t_s: f64,
    /// As it is known.
    pub q_nb: UnitQuaternion<f64>,
    /// \[rad2\] covariance of a turn in b.
    pub covariance: Matrix3<f64>,
}

/// Some of them.
#[derive(Clone, Debug, Default)]
pub struct Instants {
    /// In the order they were told.
    pub all: Vec<Instant>,
}

/// What became of one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Kept {
    /// \[s\] when.
    pub t_s: f64,
    /// \[deg\] it is off the motion as known without it.
    pub off_deg: f64,
    /// \[deg\] one sigma of that, about the axis of the turn.
    pub sigma_deg: f64,
    /// Probability of as much by chance.
    pub chance: f64,
    /// Whether it is in.
    pub is_used: bool,
}

impl Instant {
    /// Of what a case tells.
    pub fn of(told: &AttitudeAt) -> Self {
        let (q_nb, covariance) = match told.turned {
            Turned::Quaternion { q_nb, sigmas_deg } => {
                let variances = Vector3::from(sigmas_deg).map(|own| own.to_radians().powi(2));
                (q_nb, Matrix3::from_diagonal(&variances))
            }
            Turned::Angles {
                azimuth_deg: [azimuth, azimuth_sigma],
                elevation_deg: [elevation, elevation_sigma],
                roll_deg,
            } => {
                let [roll, roll_sigma] = roll_deg.unwrap_or([0.0, ANY_DEG]).map(f64::to_radians);
                let [azimuth, azimuth_sigma] = [azimuth, azimuth_sigma].map(f64::to_radians);
                let [elevation, elevation_sigma] = [elevation, elevation_sigma].map(f64::to_radians);
                let about = |axis: Vector3<f64>, angle: f64| UnitQuaternion::from_scaled_axis(axis * angle);
                let (rolled, pitched) = (about(Vector3::x(), roll), about(Vector3::y(), elevation));
                let q_nb = about(Vector3::z(), azimuth) * pitched * rolled;
                let x = Vector3::x();
                let y = rolled.inverse() * Vector3::y();
                let z = (pitched * rolled).inverse() * Vector3::z();
                let aside = rolled.inverse() * Vector3::z();
                let square = |axis: Vector3<f64>, sigma: f64| axis * axis.transpose() * sigma.powi(2);
                let least = elevation_sigma.powi(2) - (azimuth_sigma * elevation.cos()).powi(2);
                let own = square(z, azimuth_sigma) + square(y, elevation_sigma) + square(x, roll_sigma);
                (q_nb, own + square(aside, least.max(0.0).sqrt()))
            }
        };
        Self {
            t_s: told.t_s,
            q_nb,
            covariance,
        }
    }

    /// Turn in b from it to a motion.
    fn off(&self, trajectory: &Trajectory) -> Vector3<f64> {
        (self.q_nb.inverse() * trajectory.attitude(self.t_s)).scaled_axis()
    }
}

impl Instants {
    /// Of what a case tells.
    pub fn of(told: &[AttitudeAt]) -> Self {
        Self {
            all: told.iter().map(Instant::of).collect(),
        }
    }

    /// Those within knots.
    pub fn within(&self, knots: &Knots) -> Self {
        let to_s = knots.from_s + knots.step_s * knots.intervals as f64;
        let is_in = |own: &&Instant| (knots.from_s..to_s).contains(&own.t_s);
        Self {
            all: self.all.iter().filter(is_in).copied().collect(),
        }
    }

    /// Rows about a motion.
    pub fn rows(&self, trajectory: &Trajectory, knots: &Knots) -> Vec<Prior> {
        let of = |own: &Instant| {
            let off = own.off(trajectory);
            let root = own
                .covariance
                .cholesky()
                .map(|root| root.l())
                .and_then(|l| l.try_inverse())?;
            let (by_turn, off) = (root * right_jacobian_inverse(&off), root * off);
            Some([0, 1, 2].map(|axis| row(knots, own.t_s, &[(0, 0, by_turn.row(axis).transpose())], 1.0, off[axis])))
        };
        self.all.iter().filter_map(of).flatten().collect()
    }

    /// Which of them a motion allows that is known without them to these covariances of a turn in b, one an instant.
    pub fn judged(&self, trajectory: &Trajectory, known: &[Matrix3<f64>]) -> Vec<Kept> {
        let of = |(own, known): (&Instant, &Matrix3<f64>)| {
            let (off, whole) = (own.off(trajectory), own.covariance + known);
            let energy = whole
                .try_inverse()
                .map_or(f64::INFINITY, |inverse| off.dot(&(inverse * off)));
            let one = ChiSquared::new(3.0).map_or(0.0, |law| law.sf(energy));
            let chance = (one * self.all.len() as f64).min(1.0);
            let axis = off.try_normalize(f64::MIN_POSITIVE).unwrap_or(Vector3::x());
            Kept {
                t_s: own.t_s,
                off_deg: off.norm().to_degrees(),
                sigma_deg: axis.dot(&(whole * axis)).max(0.0).sqrt().to_degrees(),
                chance,
                is_used: chance >= SELDOM,
            }
        };
        self.all.iter().zip(known).map(of).collect()
    }
}

/// What became of them, a line each that is worth one.
pub fn lines(kept: &[Kept]) -> String {
    if kept.is_empty() {
        return "KNOWN   attitude_at: none of its instants lies in the fit windows; it is not used\n".to_owned();
    }
    let mut out = String::new();
    for own in kept {
        // Writing to a string cannot fail.
        let _ = match own.is_used {
            true => writeln!(
                out,
                "KNOWN   the attitude at {:.1} s holds the motion; without it off by {:.2} deg, one sigma {:.2}",
                own.t_s, own.off_deg, own.sigma_deg
            ),
            false => writeln!(
                out,
                "KNOWN   the attitude at {:.1} s is not used: off by {:.2} deg where one sigma is {:.2}, which chance does less than once in a \
                 thousand. Another instant, axes that are swapped, or sigmas that are too small",
                own.t_s, own.off_deg, own.sigma_deg
            ),
        };
    }
    out
}

/// The same as JSON.
pub fn json(kept: &[Kept]) -> Value {
    let each = kept.iter().map(|own| {
        json!({
            "t_s": own.t_s, "is_used": own.is_used, "off_deg": rounded(own.off_deg, 4),
            "sigma_deg": rounded(own.sigma_deg, 4), "chance": own.chance,
        })
    });
    each.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn told(azimuth: [f64; 2], elevation: [f64; 2], roll: Option<[f64; 2]>) -> Instant {
        Instant::of(&AttitudeAt {
            t_s: 1.0,
            turned: Turned::Angles {
                azimuth_deg: azimuth,
                elevation_deg: elevation,
                roll_deg: roll,
            },
        })
    }

    #[test]
    fn a_rail_points_its_nose_and_an_error_of_each_angle_lies_within_its_covariance() {
        let own = told([70.0, 0.5], [40.0, 0.2], Some([10.0, 1.0]));
        let nose_n = own.q_nb * Vector3::x();
        assert!((nose_n.y.atan2(nose_n.x).to_degrees() - 70.0).abs() < 1e-9);
        assert!((-nose_n.z).asin().to_degrees() - 40.0 < 1e-9);
        let inverse = own.covariance.try_inverse().expect("known");
        for other in [
            told([70.5, 0.5], [40.0, 0.2], Some([10.0, 1.0])),
            told([70.0, 0.5], [40.2, 0.2], Some([10.0, 1.0])),
            told([70.0, 0.5], [40.0, 0.2], Some([11.0, 1.0])),
        ] {
            // One sigma of one angle.
            let off = (own.q_nb.inverse() * other.q_nb).scaled_axis();
            let energy = off.dot(&(inverse * off));
            assert!((energy - 1.0).abs() < 0.05, "{energy}");
        }
    }

    #[test]
    fn upright_no_side_of_the_nose_is_known_better_than_another_and_a_roll_that_is_not_told_may_be_anything() {
        let own = told([70.0, 0.5], [90.0, 0.2], None);
        let sigma = |axis: Vector3<f64>| axis.dot(&(own.covariance * axis)).sqrt().to_degrees();
        assert!((sigma(Vector3::y()) - 0.2).abs() < 1e-6 && (sigma(Vector3::z()) - 0.2).abs() < 1e-6);
        assert!(sigma(Vector3::x()) > 100.0);
    }
}
