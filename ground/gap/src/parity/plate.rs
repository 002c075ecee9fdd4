//! One plate: three gyros, three accelerometers, three magnetometers or none, and no parity.
//!
//! A motion has as many unknowns as one plate has sensors, so packet by packet nothing is left. Over the whole log something is: gyros tie
//! the attitude of one instant to that of the next, and gravity and field are known. In: a [`Flight`]. Out: [`Findings`], and its texts.
//!
//! | step | file | gives |
//! |---|---|---|
//! | 1 | [`sensors`], [`samples`] | the log at its full rate, as vectors |
//! | 2 | [`shaken`] | knocks and vibration, which are too quick for a body; no motion is needed |
//! | 3 | [`still`] | when the plate rests, and its first attitude |
//! | 4 | [`node`], [`filter`] | attitude, calibration and field along the log, with the evidence of a model of them |
//! | 5 | [`magnets`] | whether something magnetic is there, fixed to the plate or in the room |
//! | 6 | [`told`], [`text`] | how it is told |
//!
//! The library's search is not used: of its effects, those that all sensors of a kind share are another motion
//! ([`crate::parity::nulls`]), and with one plate all are shared. What is left is what no motion does.

pub mod attitude;
pub mod filter;
pub mod magnets;
pub mod node;
pub mod samples;
pub mod sensors;
pub mod shaken;
pub mod still;
pub mod text;
pub mod told;

use crate::{
    input::case::CaseError,
    parity::{
        flight::Flight,
        phases,
        plate::{
            filter::{At, Course, Stay},
            magnets::{Added, Weighed},
            sensors::Sensors,
            shaken::{Knock, Line},
        },
    },
    probability::outcome::Outcome,
    thresholds::{FIELD_MISFIT, KNOCKS, LINE_OVER, VELOCITY_MISFIT},
};

/// Names that one plate can be given.
pub const CAN_BE_NAMED: [&str; 4] = ["shock", "vibration", "hard-iron", "field-gradient"];

/// \[s\] between samples from which on gyros cannot be integrated: a hand turns a unit by a tenth of a radian in it.
const SLOWEST_S: f64 = 0.05;

/// Least length of a log \[s\].
const SHORTEST_S: f64 = 5.0;

/// What is said.
pub struct Findings {
    /// Which channels.
    pub sensors: Sensors,
    /// Samples of the gyros, and \[s\] from one to the next.
    pub samples: (usize, f64),
    /// \[s\] first and last.
    pub span_s: (f64, f64),
    /// Whether the log begins at rest.
    pub is_begun_at_rest: bool,
    /// What hit it.
    pub knocks: Vec<Knock>,
    /// The strongest line of forces and of rates; none of a log that is too slow for it.
    pub lines: [Option<Line>; 2],
    /// What the field says.
    pub weighed: Weighed,
    /// The log along the best model of the field: what is added, node by node.
    pub field: Vec<At>,
    /// Root mean square of what the field is off by with nothing added, and along the best model.
    pub gap: [f64; 2],
    /// The log along the model in which the attitude is told; none where the motion is not what was supposed.
    pub attitude: Option<Vec<At>>,
    /// Names that are left out.
    withheld: Vec<String>,
}

/// A name, and what of it was seen.
pub struct Name {
    /// In the library.
    pub effect: &'static str,
    /// Where.
    pub channels: Vec<String>,
    /// What was seen.
    pub seen: String,
}

impl Findings {
    /// Of a flight of one plate.
    ///
    /// # Errors
    /// When the log is too slow or too short to be integrated.
    pub fn of(
        flight: &Flight,
        sensors: Sensors,
        withheld: &[String],
        progress: &dyn Fn(&'static str, f64),
    ) -> Result<Self, CaseError> {
        let opened = &flight.opened;
        // All of it, at its full rate: neither the windows nor thinning leave a course that gyros could be integrated along.
        let refused = |problem: String| CaseError::key(&opened.path(&opened.text.measured), "t_s", problem);
        let samples = (sensors.samples(&flight.whole, &flight.unit))
            .ok_or_else(|| refused("has no two rows with all three gyros and accelerometers".to_owned()))?;
        let (t_s, step_s) = (&samples.rates.t_s, samples.step_s());
        let span_s = (t_s[0], t_s[t_s.len() - 1]);
        if step_s > SLOWEST_S {
            return Err(refused(format!(
                "has {:.1} samples a second; one plate has no parity, and its gyros cannot be integrated below {:.0} a second. Log faster, \
                 give a motion, or the channels of further plates",
                1.0 / step_s,
                1.0 / SLOWEST_S
            )));
        }
        if span_s.1 - span_s.0 < SHORTEST_S {
            return Err(refused(format!(
                "spans {:.1} s; at least {SHORTEST_S} s are needed",
                span_s.1 - span_s.0
            )));
        }
        let knocks = shaken::knocks(&samples.felt.t_s, &samples.felt.in_b);
        let lines = [
            shaken::line(step_s, &samples.felt.in_b),
            shaken::line(step_s, &samples.rates.in_b),
        ];
        let begins = filter::begins(&samples);
        let model = |is_still| sensors.model(&flight.unit, &flight.environment, &opened.text.environment, is_still);
        let rests = still::rests(&samples, &begins, &model(true));
        let is_begun_at_rest = rests.first().copied().unwrap_or(false);
        let stays = stays(flight, t_s, &begins, &rests);
        let nothing = model(is_begun_at_rest);
        let first = still::first(&samples, &nothing);
        let weighed = match sensors.has_field() {
            true => Weighed::of(&samples, &begins, &stays, first, nothing, &|share| {
                progress("field", share)
            }),
            false => Weighed::unseen(nothing),
        };
        progress("attitude", 0.0);
        let along = |model| Course::of(&samples, &begins, &stays, first, &model);
        let (without, best, wary) = (along(nothing), along(weighed.model()), along(weighed.wary()));
        let is_supposed = wary.misfit[1] <= VELOCITY_MISFIT;
        Ok(Self {
            sensors,
            samples: (t_s.len(), step_s),
            span_s,
            is_begun_at_rest,
            knocks,
            lines,
            weighed,
            gap: [without.misfit[0].sqrt(), best.misfit[0].sqrt()],
            field: best.nodes,
            attitude: is_supposed.then_some(wary.nodes),
            withheld: withheld.to_vec(),
        })
    }

    /// Whether the motion is what was supposed: about a place.
    pub fn is_about_a_place(&self) -> bool {
        self.attitude.is_some()
    }

    /// What stays on in the field is more than any of the models makes.
    pub fn is_unexplained(&self) -> bool {
        self.is_about_a_place() && self.gap[1].powi(2) > FIELD_MISFIT
    }

    /// Every name, of which the field's needs a motion about a place.
    pub fn names(&self, flight: &Flight) -> Vec<Name> {
        use twin::predict::Kind::{Accelerometer, Gyro, Magnetometer};
        let channels = |kind| self.sensors.names(&flight.unit, kind);
        let mut names = Vec::new();
        if self.knocks.len() > KNOCKS {
            let seen = text::knocks(&self.knocks);
            names.push(Name {
                effect: "shock",
                channels: channels(Accelerometer),
                seen,
            });
        }
        for (line, kind) in self.lines.iter().zip([Accelerometer, Gyro]) {
            let is_named = names.iter().any(|own| own.effect == "vibration");
            if let Some(line) = line.filter(|line| line.over > LINE_OVER && !is_named) {
                let seen = text::line(&line, kind);
                names.push(Name {
                    effect: "vibration",
                    channels: channels(kind),
                    seen,
                });
            }
        }
        if let Some(added) = self.weighed.told().filter(|_| self.is_about_a_place()) {
            let effect = match added {
                Added::ToPlate => "hard-iron",
                Added::ToRoom => "field-gradient",
            };
            let seen = text::added(added, &self.field);
            names.push(Name {
                effect,
                channels: channels(Magnetometer),
                seen,
            });
        }
        names.retain(|name| self.withheld.iter().all(|own| own != name.effect));
        names
    }

    /// Effects of which one is there, and the log does not tell which.
    pub fn untold(&self) -> Vec<&'static str> {
        let is_untold = self.is_about_a_place() && self.weighed.is_there() && self.weighed.told().is_none();
        if is_untold {
            vec!["hard-iron", "field-gradient"]
        } else {
            Vec::new()
        }
    }

    /// What it comes to.
    pub fn outcome(&self, flight: &Flight) -> Outcome {
        let names = self.names(flight).len();
        let is_off = self.is_unexplained() || !self.is_about_a_place();
        let matters = is_off || !self.untold().is_empty();
        Outcome::of(names, f64::from(u8::from(matters)), f64::from(u8::from(is_off)), false)
    }
}

/// What holds the velocity of each node: phases that are told come before what is seen.
fn stays(flight: &Flight, t_s: &[f64], begins: &[usize], rests: &[bool]) -> Vec<Stay> {
    let told = flight.are_phases_told.then(|| phases::still(&flight.phases));
    let nodes = begins.iter().map(|at| t_s[*at]).zip(rests);
    let stay = |(from_s, is_rest): (f64, &bool)| {
        let is_still = match &told {
            Some(spans) => spans
                .iter()
                .any(|(first_s, last_s)| (*first_s..*last_s).contains(&from_s)),
            None => *is_rest,
        };
        match (phases::flies(&flight.phases, from_s), is_still) {
            (true, _) => Stay::Flies,
            (false, true) => Stay::Still,
            (false, false) => Stay::About,
        }
    };
    nodes.map(stay).collect()
}
