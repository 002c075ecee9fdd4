//! The smoothed attitude as it is told: a file, a line of text, a plot.
//!
//! In: a [`Flight`]. Out: [`Told`]: attitude and its standard deviations at every row of the log, or that the smoother did not settle. Then
//! there is no file: an attitude that still turns is no result.

use std::fmt::Write;

use chart::{Axis, ChartError, Figure, Layer, Marks, Panel};
use nalgebra::{UnitQuaternion, Vector3};
use serde_json::{Map, Value, json};

use crate::{
    input::{case::CaseError, reference::Reference},
    null::problem::Problem,
    parity::{
        beforehand,
        findings::Findings,
        flight::Flight,
        followed::Followed,
        known::{
            Known,
            instants::{self, Kept},
            simulated::Belief,
            ties::Use,
            track::Beside,
        },
    },
    parity::{
        search::{Free, opened},
        smooth::covariances,
        space::Space,
    },
    probability::outcome::Outcome,
    thresholds::PARITY_GAP,
};

/// Why nothing else that is known of a motion was looked at.
const NOT_SETTLED: &str = "the motion did not settle without it";

/// Why neither a track nor a simulated trajectory was looked at along a motion that has settled.
const HOLED: &str = "packets whose rate nobody knows were left out, and what happened meanwhile is not known";

/// Why a motion is not told along which something is left.
const UNEXPLAINED: &str = "something is there that no name explains";

/// The same where a name is wanting.
const UNDECIDED: &str = "something is there, and it is not known which of several it is";

/// What an attitude is at a row.
#[derive(Clone, Copy, Debug)]
pub struct Attitude {
    /// \[s\] start of the row.
    pub t_s: f64,
    /// Body to north-east-down.
    pub q_nb: UnitQuaternion<f64>,
    /// \[deg\] one sigma of a turn about each axis of b.
    pub sigmas_b_deg: Vector3<f64>,
}

/// The attitude of a flight.
#[derive(Default)]
pub struct Told {
    /// At every row; none where the smoother did not settle.
    pub attitudes: Vec<Attitude>,
    /// \[s\] spans in which the unit was at rest.
    pub rests: Vec<(f64, f64)>,
    /// \[rad\] largest turn of each step of the smoother.
    pub turns: Vec<f64>,
    /// What became of the track, and \[s\] one sigma of its clock's offset; none where there is none.
    pub track: Option<(Use, Option<f64>)>,
    /// Its fixes beside the motion.
    pub beside_track: Vec<Beside>,
    /// What became of the simulated trajectory; none where there is none.
    pub belief: Option<Belief>,
    /// What became of attitudes at instants; none where none are told.
    pub kept: Option<Vec<Kept>>,
    /// \[s\] pieces of the log along which nothing tells an attitude ([`super::Smoothed::lost`]).
    pub lost: Vec<(f64, f64)>,
    /// Why the motion is not told although it has settled.
    pub withheld: Option<&'static str>,
    /// \[sigma\] by how much more the readings scatter than described, where that is much; then it may be why the motion did not settle.
    pub scatters: Option<f64>,
}

/// In how many spans a unit is at rest, in words.
pub fn rests_words(spans: usize) -> String {
    match spans {
        0 => "at rest in none of it".to_owned(),
        1 => "at rest in one span".to_owned(),
        _ => format!("at rest in {spans} spans"),
    }
}

impl Told {
    /// Of a flight.
    ///
    /// # Errors
    /// When the unit's description names an effect there is not.
    pub fn of(flight: &Flight, progress: &dyn Fn(f64)) -> Result<Self, CaseError> {
        let beforehand = beforehand::look(flight, &[])?;
        Self::along(&Followed::of(flight, &flight.log, &beforehand), progress)
    }

    /// Of a log whose motion is followed.
    ///
    /// # Errors
    /// When the unit's description names an effect there is not.
    pub fn along(followed: &Followed, progress: &dyn Fn(f64)) -> Result<Self, CaseError> {
        Self::beside(followed, &[], progress)
    }

    /// The same with what was found in it: effects that are named are in the model, and where something is left that no name explains,
    /// nothing says how far the motion is bent by it, and it is not told.
    ///
    /// # Errors
    /// When the unit's description names an effect there is not.
    pub fn explained(followed: &Followed, findings: &Findings, progress: &dyn Fn(f64)) -> Result<Self, CaseError> {
        let mut told = Self::beside(followed, &findings.free_effects, progress)?;
        told.scatters = Some(findings.gap[1]).filter(|gap| *gap > PARITY_GAP);
        let why = match findings.outcome {
            Outcome::Clean | Outcome::Recalibrate | Outcome::Named => return Ok(told),
            Outcome::Undecided => UNDECIDED,
            Outcome::PartlyNamed | Outcome::Unknown => UNEXPLAINED,
        };
        told.withheld = Some(why).filter(|_| !told.attitudes.is_empty());
        told.attitudes.clear();
        Ok(told)
    }

    fn beside(followed: &Followed, named: &[Free], progress: &dyn Fn(f64)) -> Result<Self, CaseError> {
        let smoothed = followed.smoothed(progress)?;
        let bent = match smoothed.is_settled() && !named.is_empty() {
            true => Some(followed.beside(smoothed, named)?),
            false => None,
        };
        let smoothed = bent.as_ref().unwrap_or(smoothed);
        let mut told = Self {
            rests: smoothed.rests.clone(),
            turns: smoothed.turns.clone(),
            track: smoothed.track.map(|own| (own, None)),
            beside_track: smoothed.beside_track.clone(),
            belief: smoothed.belief,
            kept: smoothed.attitudes.clone(),
            ..Told::default()
        };
        if !smoothed.is_settled() {
            return Ok(told);
        }
        let (twin, fit, reference) = (followed.twin(smoothed)?, followed.fit(), Reference::default());
        let problem = Problem::new(&twin, &fit, &reference);
        let another = bent.as_ref().map(|bent| followed.another(bent, &problem));
        let motion = match &another {
            Some(another) => another,
            None => followed.motion(smoothed, &problem),
        };
        if let Some((_, sigma_s)) = &mut told.track {
            *sigma_s = motion.offset_sigma_s();
        }
        let log = &followed.log;
        let covariances = match followed.in_free_fall(smoothed, &problem) {
            Some(falling) => {
                let mut space = Space::open_still(&problem, &falling, opened(&problem, named));
                let parts = space.marginalise();
                covariances(&space, &falling, parts, &log.start_s)
            }
            None => {
                let free = opened(&problem, named);
                let mut space = match free.is_empty() && another.is_none() {
                    true => followed.space(&problem, motion),
                    false => Space::open_still(&problem, motion, free),
                };
                let parts = match space.factor() {
                    Some(_) => space.open_parts(),
                    None => space.marginalise(),
                };
                covariances(&space, motion, parts, &log.start_s)
            }
        };
        let lost = smoothed.lost(&log.start_s, followed.holes());
        let is_lost = |t_s: f64| lost.iter().any(|(from_s, to_s)| (*from_s..=*to_s).contains(&t_s));
        told.attitudes = (log.start_s.iter().zip(&covariances))
            .filter(|(t_s, _)| !is_lost(**t_s))
            .map(|(t_s, covariance)| Attitude {
                t_s: *t_s,
                q_nb: smoothed.trajectory.attitude(*t_s),
                sigmas_b_deg: covariance
                    .diagonal()
                    .map(|variance| variance.max(0.0).sqrt().to_degrees()),
            })
            .collect();
        told.lost = lost;
        Ok(told)
    }

    /// \[deg\] one sigma, all axes, root mean square over the log; none where it did not settle.
    pub fn sigma_deg(&self) -> Option<f64> {
        let squares: f64 = self.attitudes.iter().map(|own| own.sigmas_b_deg.norm_squared()).sum();
        (!self.attitudes.is_empty()).then(|| (squares / self.attitudes.len() as f64).sqrt())
    }

    /// `attitude.csv`, if there is one.
    pub fn csv(&self) -> Option<String> {
        let mut out = "t_s,qw,qx,qy,qz,sigma_x_deg,sigma_y_deg,sigma_z_deg\n".to_owned();
        for own in &self.attitudes {
            let (q, sigma) = (own.q_nb.quaternion(), own.sigmas_b_deg);
            // Writing to a string cannot fail.
            let _ = writeln!(
                out,
                "{:.3},{:.7},{:.7},{:.7},{:.7},{:.4},{:.4},{:.4}",
                own.t_s, q.w, q.i, q.j, q.k, sigma.x, sigma.y, sigma.z
            );
        }
        (!self.attitudes.is_empty()).then_some(out)
    }

    /// A line of each thing that is known besides; of one that could not be looked at too.
    pub fn known_lines(&self, known: &Known) -> String {
        let mut out = String::new();
        match (&self.belief, &known.simulated) {
            (Some(belief), _) => out += &belief.line(),
            (None, Some(_)) => out += &format!("NOMINAL the simulated trajectory: not used: {}\n", self.not_used()),
            (None, None) => {}
        }
        match (&self.kept, known.attitudes.all.is_empty()) {
            (Some(kept), _) => out += &instants::lines(kept),
            (None, false) => out += &format!("KNOWN   attitude_at: not used: {NOT_SETTLED}\n"),
            (None, true) => {}
        }
        match (&self.track, &known.track) {
            (Some((found, sigma_s)), _) => out += &found.line(*sigma_s),
            (None, Some(_)) => out += &format!("TRACK   not used: {}\n", self.not_used()),
            (None, None) => {}
        }
        out
    }

    /// The same as JSON; nothing where nothing is known.
    pub fn known_json(&self, known: &Known) -> Map<String, Value> {
        let not_used = |why: &str| json!({ "is_used": false, "why": why });
        let simulated = self.belief.as_ref().map(Belief::json);
        let track = self.track.as_ref().map(|(found, sigma_s)| found.json(*sigma_s));
        let kept = match (&self.kept, known.attitudes.all.is_empty()) {
            (Some(kept), _) => Some(instants::json(kept)),
            (None, false) => Some(not_used(NOT_SETTLED)),
            (None, true) => None,
        };
        let all = [
            (
                "simulated",
                simulated.or_else(|| known.simulated.as_ref().map(|_| not_used(self.not_used()))),
            ),
            (
                "track",
                track.or_else(|| known.track.as_ref().map(|_| not_used(self.not_used()))),
            ),
            ("attitude_at", kept),
        ];
        all.into_iter()
            .filter_map(|(key, value)| Some((key.to_owned(), value?)))
            .collect()
    }

    fn lost_words(&self) -> String {
        let spans = self
            .lost
            .iter()
            .map(|(from_s, to_s)| format!("{from_s:.0} to {to_s:.0} s"));
        match spans.collect::<Vec<_>>().join(", ").as_str() {
            "" => String::new(),
            spans => format!(
                "; none is given {spans}: beyond packets that were left out, and in free fall, nothing tells a turn about the field; \
                 an attitude_at there would"
            ),
        }
    }

    /// Why a track or a simulated trajectory was not looked at.
    fn not_used(&self) -> &'static str {
        if self.attitudes.is_empty() { NOT_SETTLED } else { HOLED }
    }

    /// One line.
    pub fn line(&self) -> String {
        let turn_deg = self.turns.last().copied().unwrap_or(f64::NAN).to_degrees();
        let norms = self.attitudes.iter().map(|own| (own.t_s, own.sigmas_b_deg.norm()));
        if let Some(why) = self.withheld {
            return format!(
                "ATTITUDE  not told: {why}. The motion bends with it, and by how much its sigma, of noise and calibration, does not say; \
                 no attitude.csv is written"
            );
        }
        let Some((worst_s, worst)) = norms.clone().max_by(|one, other| one.1.total_cmp(&other.1)) else {
            let help = match self.scatters {
                Some(gap) => format!(
                    "the readings scatter {gap:.1} times as much as unit.toml says, so its sigmas weigh them wrongly; with true ones it \
                     may settle"
                ),
                None => "a reference or a rest in the log would help".to_owned(),
            };
            return format!(
                "ATTITUDE  did not settle: step {} still turned it by {turn_deg:.2} deg, so no attitude.csv is written; {help}",
                self.turns.len()
            );
        };
        let mean = (norms.map(|(_, norm)| norm * norm).sum::<f64>() / self.attitudes.len() as f64).sqrt();
        format!(
            "ATTITUDE  smoothed over the whole log, in attitude.csv: known to {mean:.2} deg (one sigma, all axes), to {worst:.2} deg \
             at {worst_s:.0} s; {}; settled in {} steps{}",
            rests_words(self.rests.len()),
            self.turns.len(),
            self.lost_words()
        )
    }

    /// Three sigma about each axis of b, and the attitude as angles; none where it did not settle.
    ///
    /// # Errors
    /// When a plot cannot be drawn.
    pub fn figure(&self) -> Result<Option<Figure>, ChartError> {
        if self.attitudes.is_empty() {
            return Ok(None);
        }
        let line = |of: &dyn Fn(&Attitude) -> f64| -> Marks {
            Marks::Line(self.attitudes.iter().map(|own| (own.t_s, of(own))).collect())
        };
        let angles = |own: &Attitude| {
            let (roll, pitch, yaw) = own.q_nb.euler_angles();
            [roll, pitch, yaw].map(f64::to_degrees)
        };
        let panel = |y: &str, layers: Vec<Layer>| Panel {
            x: Axis::linear("time [s]"),
            y: Axis::linear(y),
            layers,
            ..Panel::default()
        };
        let names = ["roll", "pitch", "yaw"];
        let turned = (0..3).map(|axis| Layer::new(names[axis], axis, line(&|own| angles(own)[axis])));
        let known = (0..3).map(|axis| Layer::new("", axis, line(&|own| 3.0 * own.sigmas_b_deg[axis])));
        let panels = [
            panel("attitude [deg]", turned.collect()),
            panel("three sigma about x, y, z [deg]", known.collect()),
        ];
        Figure::of("Attitude, smoothed over the whole log", 1, &panels).map(Some)
    }

    /// What each fix of the track is off by; none where there is no track, or it never met the motion. A track that was refused is
    /// shown as well: where it parts from the motion says why.
    ///
    /// # Errors
    /// When a plot cannot be drawn.
    pub fn track_figure(&self) -> Result<Option<Figure>, ChartError> {
        let Some((found, _)) = self.track.filter(|_| !self.beside_track.is_empty()) else {
            return Ok(None);
        };
        let names = ["north", "east", "down"];
        let points =
            |axis: usize| Marks::Dots(self.beside_track.iter().map(|own| (own.t_s, own.off_n[axis])).collect());
        let panel = Panel {
            x: Axis::linear("time [s]"),
            y: Axis::linear("off [sigma]"),
            layers: (0..3).map(|axis| Layer::new(names[axis], axis, points(axis))).collect(),
            ..Panel::default()
        };
        let title = match found {
            Use::Used(_) => "The track beside the motion that it holds",
            _ => "The track beside the motion: not used",
        };
        Figure::of(title, 1, &[panel]).map(Some)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_motion_that_did_not_settle_says_what_would_help() {
        let mut told = Told {
            turns: vec![0.1],
            ..Told::default()
        };
        assert!(told.line().contains("a reference or a rest"), "{}", told.line());
        told.scatters = Some(2.96);
        assert!(
            told.line().contains("3.0 times") && told.line().contains("unit.toml"),
            "{}",
            told.line()
        );
    }

    #[test]
    fn rests_are_counted_in_words() {
        assert_eq!(rests_words(1), "at rest in one span");
        assert_eq!(rests_words(2), "at rest in 2 spans");
    }
}
