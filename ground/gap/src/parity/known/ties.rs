//! What a smoothed motion is tied to, and what became of a track.
//!
//! In: what is known, and a motion that has settled without. Out: [`Ties`], and [`Use`] in words and as JSON.

use std::fmt::Write;

use serde_json::{Value, json};
use statrs::distribution::{ChiSquared, ContinuousCDF};

use crate::{
    parity::{
        known::{
            instants::Instants,
            simulated::Simulated,
            track::{Aligned, Fix, LEAST_FIXES},
        },
        smooth::{basis::Knots, prior::Prior, trajectory::Trajectory},
    },
    report::verdict::rounded,
    thresholds::SELDOM,
};

/// What a motion is tied to.
#[derive(Clone, Debug, Default)]
pub struct Ties {
    /// Fixes of a track.
    pub fixes: Vec<Fix>,
    /// \[s\] near which the offset of its clock is.
    pub offset_s: f64,
    /// A simulated trajectory.
    pub simulated: Option<Simulated>,
    /// Attitudes at instants.
    pub attitudes: Instants,
}

impl Ties {
    /// Rows of attitudes at instants and of the simulated trajectory about a motion; none where there are none.
    pub fn rows(&self, trajectory: &Trajectory, knots: &Knots) -> Vec<Prior> {
        let simulated = self.simulated.as_ref();
        let mut rows = simulated.map_or_else(Vec::new, |simulated| simulated.rows(trajectory, knots));
        rows.extend(self.attitudes.rows(trajectory, knots));
        rows
    }

    /// The track along a trajectory; none where there is none.
    pub fn aligned(&self, trajectory: &Trajectory) -> Option<Aligned> {
        (!self.fixes.is_empty()).then(|| Aligned::of(&self.fixes, trajectory, self.offset_s))
    }
}

/// What became of a track.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Use {
    /// It is in.
    Used(Fit),
    /// No offset of its clock brings enough of it into these windows.
    Elsewhere,
    /// With it the motion does not settle.
    Unsettled,
    /// It is off by more than its sigmas.
    Misfit(Fit),
}

/// How fixes lie along the motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fit {
    /// How many.
    pub fixes: usize,
    /// Their root mean square in sigmas, where 1 is noise.
    pub gap: f64,
    /// \[s\] `t_log = t_track + offset`.
    pub offset_s: f64,
}

impl Use {
    /// Of a track along a motion that was smoothed with it. Of noise the energy has a chi-square law of no more degrees of freedom than
    /// three a fix less begin, velocity and offset.
    pub fn of(aligned: &Aligned) -> Self {
        let free = aligned.off.len() as f64 - 7.0;
        let energy = aligned.off.norm_squared();
        let fit = Fit {
            fixes: aligned.off.len() / 3,
            gap: (energy / free).sqrt(),
            offset_s: aligned.offset_s,
        };
        let chance = ChiSquared::new(free).map_or(0.0, |law| law.sf(energy));
        if chance < SELDOM {
            Use::Misfit(fit)
        } else {
            Use::Used(fit)
        }
    }

    /// A line.
    pub fn line(&self, offset_sigma_s: Option<f64>) -> String {
        let mut out = "TRACK   ".to_owned();
        // Writing to a string cannot fail.
        let _ = match self {
            Use::Used(fit) => writeln!(
                out,
                "{} fixes of the fit windows hold the motion, off by {:.2} of their sigmas; {}",
                fit.fixes,
                fit.gap,
                clock(fit.offset_s, offset_sigma_s)
            ),
            Use::Elsewhere => writeln!(
                out,
                "not used: at no offset of its clock do {LEAST_FIXES} fixes lie in the fit windows; it is of another time"
            ),
            Use::Unsettled => writeln!(
                out,
                "not used: with it the motion does not settle; is it of another flight?"
            ),
            Use::Misfit(fit) => writeln!(
                out,
                "not used: off by {:.1} of its sigmas at the best offset of its clock ({:.2} s), which chance does less than once in a \
                 thousand. It is of another flight, its sigmas are too small (n is flat, gravity the same everywhere), or all \
                 accelerometers share something that this log alone does not show",
                fit.gap, fit.offset_s
            ),
        };
        out
    }

    /// The same as JSON.
    pub fn json(&self, offset_sigma_s: Option<f64>) -> Value {
        let fit = |is_used: bool, fit: &Fit| {
            json!({
                "is_used": is_used,
                "fixes": fit.fixes,
                "gap_sigma": rounded(fit.gap, 4),
                "clock_offset_s": { "value": rounded(fit.offset_s, 6), "sigma": offset_sigma_s.map(|own| rounded(own, 6)) },
            })
        };
        match self {
            Use::Used(own) => fit(true, own),
            Use::Misfit(own) => fit(false, own),
            Use::Elsewhere => json!({ "is_used": false, "why": "it is of another time" }),
            Use::Unsettled => json!({ "is_used": false, "why": "with it the motion does not settle" }),
        }
    }
}

fn clock(offset_s: f64, sigma_s: Option<f64>) -> String {
    match sigma_s {
        Some(sigma_s) => {
            format!("its clock: t of the log = t of the track {offset_s:+.3} +- {sigma_s:.3} s")
        }
        None => "its clock's offset does not show, for the unit does not change its velocity".to_owned(),
    }
}
