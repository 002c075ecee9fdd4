//! `[motion_known]`: what is known of a motion that nobody recorded.
//!
//! In: the table of `case.toml`. Out: [`MotionKnown`]; attitudes at instants by [`super::attitude_at`]. Refuses, naming the key, that nothing is known beside something that is, and a
//! simulated trajectory without a distrust, or a distrust that is not above zero.

use std::path::{Path, PathBuf};

use serde::Deserialize;

use super::{
    CaseError,
    attitude_at::{AttitudeAt, Written},
};

/// `[motion_known]`.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct MotionKnown {
    /// Nothing.
    pub none: bool,
    /// Path of the positions that a receiver or a radar saw.
    pub track: Option<PathBuf>,
    /// Path of the trajectory that was simulated before the flight.
    pub simulated: Option<PathBuf>,
    /// How far that may be off, phase by phase.
    pub distrust: Distrusts,
    /// Attitudes that are known at some instants, as they are written.
    pub attitude_at: Vec<Written>,
}

/// `[motion_known.distrust]`: phases as `[phases]` has them.
#[derive(Clone, Copy, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Distrusts {
    /// Nothing moves, before a flight.
    pub rest: Option<Distrust>,
    /// A motor pushes.
    pub thrust: Option<Distrust>,
    /// Nothing but drag.
    #[serde(alias = "free_fall")]
    pub coast: Option<Distrust>,
    /// The air brakes harder than gravity pulls.
    pub entry: Option<Distrust>,
    /// It hangs.
    pub parachute: Option<Distrust>,
    /// Nothing moves, after a flight.
    pub landed: Option<Distrust>,
}

/// Standard deviations of a simulation in a phase.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct Distrust {
    /// \[deg\] of its attitude, about each axis.
    pub attitude_deg: f64,
    /// [m/s2] of its acceleration, along each axis; none where its positions are not to be believed at all.
    pub acceleration_m_s2: Option<f64>,
}

impl MotionKnown {
    /// Whether anything is known.
    pub fn is_something(&self) -> bool {
        self.track.is_some() || self.simulated.is_some() || !self.attitude_at.is_empty()
    }

    /// Attitudes that are known at some instants.
    ///
    /// # Errors
    /// When one is refused.
    pub fn attitudes(&self, file: &Path) -> Result<Vec<AttitudeAt>, CaseError> {
        let all = self.attitude_at.iter().enumerate();
        all.map(|(at, written)| written.read(file, at)).collect()
    }

    /// Checks what does not go together; `has_motion` where the case names a motion.
    pub(super) fn check(&self, file: &Path, has_motion: bool) -> Result<(), CaseError> {
        let refuse = |key: &str, problem: &str| Err(CaseError::key(file, format!("motion_known.{key}"), problem));
        if self.none && has_motion {
            return refuse(
                "none",
                "says that no motion is known, and motion names one; keep one of the two",
            );
        }
        if self.none && self.is_something() {
            return refuse(
                "none",
                "says that nothing is known, and track, simulated or attitude_at does; keep one of the two",
            );
        }
        self.attitudes(file)?;
        let told = self.distrust.all();
        match (&self.simulated, told.is_empty()) {
            (Some(_), true) => {
                return refuse(
                    "simulated",
                    "needs how far each phase of it may be off; write [motion_known.distrust] with lines like \
                     thrust = { attitude_deg = 5.0, acceleration_m_s2 = 5.0 }",
                );
            }
            (None, false) => {
                return refuse(
                    "distrust",
                    "is of a simulated trajectory, and there is none; write simulated = \"trajectory.csv\" or take it out",
                );
            }
            _ => {}
        }
        for own in told {
            let is_size = |value: f64| value.is_finite() && value > 0.0;
            if !is_size(own.attitude_deg) || own.acceleration_m_s2.is_some_and(|value| !is_size(value)) {
                return refuse(
                    "distrust",
                    "has a size that is not above zero; leave a phase out to not use it there",
                );
            }
        }
        Ok(())
    }
}

impl Distrusts {
    /// Those that are told.
    fn all(&self) -> Vec<Distrust> {
        let all = [
            self.rest,
            self.thrust,
            self.coast,
            self.entry,
            self.parachute,
            self.landed,
        ];
        all.into_iter().flatten().collect()
    }
}
