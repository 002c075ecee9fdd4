//! `[[motion_known.attitude_at]]`: an attitude that is known at an instant.
//!
//! In: a table of `case.toml`, angles or a quaternion, with their sigmas. Out: [`AttitudeAt`]. Refuses, naming the key and which of them it is: neither or
//! both, an angle without its sigma, a sigma that is not above zero, an elevation beyond the vertical, a quaternion whose norm is not one.

use std::path::Path;

use nalgebra::{Quaternion, UnitQuaternion};
use serde::Deserialize;

use super::CaseError;

/// By how much the norm of a quaternion may be off: what three decimals of its parts leave.
const NORM: f64 = 2e-3;

/// As it is written.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Written {
    t_s: f64,
    azimuth_deg: Option<f64>,
    azimuth_sigma_deg: Option<f64>,
    elevation_deg: Option<f64>,
    elevation_sigma_deg: Option<f64>,
    roll_deg: Option<f64>,
    roll_sigma_deg: Option<f64>,
    q_nb: Option<[f64; 4]>,
    sigmas_deg: Option<[f64; 3]>,
}

/// An attitude at an instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AttitudeAt {
    /// \[s\] on the clock of the log.
    pub t_s: f64,
    /// How it is turned.
    pub turned: Turned,
}

/// An attitude with what it may be off by.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Turned {
    /// Body to north-east-down, and one sigma of a turn about each axis of b.
    Quaternion {
        /// Scalar first where it is written.
        q_nb: UnitQuaternion<f64>,
        /// \[deg\] about x, y, z.
        sigmas_deg: [f64; 3],
    },
    /// Of the nose x_b, each with its sigma.
    Angles {
        /// East of north.
        azimuth_deg: [f64; 2],
        /// Above the horizon.
        elevation_deg: [f64; 2],
        /// About the nose, right side down; none where it is not known.
        roll_deg: Option<[f64; 2]>,
    },
}

impl Written {
    /// The `at`-th of a file.
    ///
    /// # Errors
    /// When it is refused.
    pub fn read(&self, file: &Path, at: usize) -> Result<AttitudeAt, CaseError> {
        let refuse =
            |key: &str, problem: &str| CaseError::key(file, format!("motion_known.attitude_at[{at}].{key}"), problem);
        let size = |key: &str, value: f64| match value.is_finite() && value > 0.0 {
            true => Ok(value),
            false => Err(refuse(
                key,
                "is not above zero; write one standard deviation in degrees",
            )),
        };
        let number = |key: &str, value: f64| match value.is_finite() {
            true => Ok(value),
            false => Err(refuse(key, "is no number")),
        };
        let t_s = number("t_s", self.t_s)?;
        let angle = |name: &str, value: Option<f64>, sigma: Option<f64>| match (value, sigma) {
            (Some(value), Some(sigma)) => Ok(Some([
                number(&format!("{name}_deg"), value)?,
                size(&format!("{name}_sigma_deg"), sigma)?,
            ])),
            (None, None) => Ok(None),
            (Some(_), None) => Err(refuse(
                &format!("{name}_sigma_deg"),
                "is absent; an angle is known to something",
            )),
            (None, Some(_)) => Err(refuse(&format!("{name}_deg"), "is absent, and its sigma is there")),
        };
        let azimuth = angle("azimuth", self.azimuth_deg, self.azimuth_sigma_deg)?;
        let elevation = angle("elevation", self.elevation_deg, self.elevation_sigma_deg)?;
        let roll = angle("roll", self.roll_deg, self.roll_sigma_deg)?;
        let has_angles = azimuth.is_some() || elevation.is_some() || roll.is_some();
        let turned = match (self.q_nb, azimuth.zip(elevation)) {
            (Some(_), _) if has_angles => {
                return Err(refuse("q_nb", "stands beside angles; keep one of the two"));
            }
            (Some(parts), _) => {
                let [w, x, y, z] = parts;
                let norm = parts.iter().map(|part| part * part).sum::<f64>().sqrt();
                if (norm - 1.0).abs().is_nan() || (norm - 1.0).abs() > NORM {
                    return Err(refuse(
                        "q_nb",
                        "has a norm that is not one; write w, x, y, z of a unit quaternion",
                    ));
                }
                let sigmas = self.sigmas_deg.ok_or_else(|| {
                    refuse(
                        "sigmas_deg",
                        "is absent; write one standard deviation about each axis of b, in degrees",
                    )
                })?;
                sigmas.iter().try_for_each(|own| size("sigmas_deg", *own).map(drop))?;
                Turned::Quaternion {
                    q_nb: UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z)),
                    sigmas_deg: sigmas,
                }
            }
            (None, Some((azimuth_deg, elevation_deg))) => {
                if self.sigmas_deg.is_some() {
                    return Err(refuse(
                        "sigmas_deg",
                        "is of q_nb; angles have azimuth_sigma_deg, elevation_sigma_deg, roll_sigma_deg",
                    ));
                }
                if elevation_deg[0].abs() > 90.0 {
                    return Err(refuse(
                        "elevation_deg",
                        "lies beyond the vertical; -90 to 90 above the horizon",
                    ));
                }
                Turned::Angles {
                    azimuth_deg,
                    elevation_deg,
                    roll_deg: roll,
                }
            }
            (None, None) => {
                return Err(refuse(
                    "azimuth_deg",
                    "or elevation_deg is absent; write both, or q_nb, each with its sigmas",
                ));
            }
        };
        Ok(AttitudeAt { t_s, turned })
    }
}
