//! What makes the folder of a flight a gap case: `motion.csv`, `unit.toml`, `case.toml`, and apart from them `answer.toml`.
//!
//! In: the scene that was flown, the seed of the unit, how long it flew. Out: files. The clock of all of them is the log's: time 0
//! is the start of the cycle of packet 0, and a channel's slot is the instant of the conversion that a packet holds, which is
//! learnt by listening at the parts of the same unit ([`trials::flight::instants`]). `answer.toml` says what `--with` did to the
//! unit; nothing of the diagnosis reads it.
//!
//! A reference records an hour at most: a diagnosis uses 40 min of packets.

pub mod instrument;
pub mod text;
pub mod windows;

use std::{
    fs, io,
    path::{Path, PathBuf},
};

use packets::channel::CHANNELS;
use serde::Serialize;
use trials::{
    answer::Size,
    flight::{self, Instants},
    scene::Scene,
    strike::Struck,
};
use twin::predict::{Kind, UnitDescription, conversion_s, emems};

use self::{
    instrument::{Instrument, Scenery, Unseen},
    text::{CASE, MOTION, Text, UNIT},
    windows::TooShort,
};

/// What was done to the unit.
pub const ANSWER: &str = "answer.toml";

/// \[s\] that a reference records at most.
pub const LONGEST_S: f64 = 3600.0;

/// \[s\] that the record goes on beyond the log at either end: what filters look back on.
const BEYOND_S: f64 = 0.3;

/// Why a flight's folder is no case.
#[derive(Debug, thiserror::Error)]
pub enum CaseError {
    /// The unit told no slot times.
    #[error("the unit of seed {0} sent no derived frames: its sampling instants cannot be learnt")]
    NoInstants(u64),
    /// Too short.
    #[error(transparent)]
    TooShort(#[from] TooShort),
    /// The instrument cannot see this motion.
    #[error(transparent)]
    Unseen(#[from] Unseen),
    /// A file cannot be written.
    #[error("{path} cannot be written: {source}")]
    Write {
        /// Which.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// The answer is no TOML.
    #[error("the answer cannot be written: {0}")]
    Answer(#[from] toml::ser::Error),
}

/// A flight that was made.
pub struct Flown<'a> {
    /// What the case is called.
    pub name: &'a str,
    /// What was flown.
    pub scene: &'a Scene,
    /// What was done to it.
    pub struck: &'a [Struck],
    /// As the command line describes the unit; as designed where absent.
    pub unit: Option<&'a UnitDescription>,
    /// What it was, in a line.
    pub about: &'a str,
    /// Of the unit.
    pub seed: u64,
    /// Of the flight: the reference's errors are its own.
    pub flight: u64,
    /// \[s\] since power-on.
    pub flown_s: f64,
    /// What recorded it.
    pub instrument: Instrument,
    /// When the parts of the unit convert, if that could be learnt.
    pub instants: Option<&'a Instants>,
}

/// The answer, as it is kept.
#[derive(Serialize)]
struct Answer<'a> {
    format: &'static str,
    effect: Vec<Done<'a>>,
}

#[derive(Serialize)]
struct Done<'a> {
    name: &'a str,
    channels: &'a [&'static str],
    acts_on: String,
    typical_sizes: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    during_s: Option<[f64; 2]>,
    size: &'a [Size],
}

impl<'a> Done<'a> {
    fn of(struck: &'a Struck) -> Self {
        Done {
            name: struck.name,
            channels: &struck.channels,
            acts_on: struck.acts_on.to_string(),
            typical_sizes: struck.strength,
            during_s: struck.during_s,
            size: &struck.sizes,
        }
    }
}

impl Flown<'_> {
    /// Writes the case into the folder of its flight.
    ///
    /// # Errors
    /// When the flight makes no case, or a file cannot be written.
    pub fn write(&self, folder: &Path) -> Result<(), CaseError> {
        if !self.struck.is_empty() {
            put(folder, ANSWER, &self.answer()?)?;
        }
        let instants = self.instants.ok_or(CaseError::NoInstants(self.seed))?;
        let zero_s = instants.zero_s + instants.lead_s;
        let end_s = (self.flown_s - zero_s).min(LONGEST_S);
        // The packet of the last whole cycle.
        let last_s = (end_s / flight::CYCLE_S).floor() * flight::CYCLE_S;
        let motion_s = |t_s: f64| t_s + zero_s;
        let windows = windows::parted(&*self.scene.motion, motion_s, [0.0, last_s])?;
        let source = &self.scene.source;
        let scenery = Scenery {
            record: &self.scene.record,
            temperature_c: &|t_s| source.at(t_s).temperature_c,
        };
        let errors = self.seed.wrapping_add(self.flight << 32);
        let motion = (self.instrument).record(&scenery, zero_s, [-BEYOND_S, end_s + BEYOND_S], errors)?;
        let text = Text {
            name: self.name,
            kind: "packets",
            about: self.about,
            measured: "packets.txt",
            environment: &self.scene.claimed,
            field_sigma_ut: 0.0,
            reference: [
                self.instrument.attitude_sigma_rad(),
                self.instrument.position_sigma_m().unwrap_or(0.0),
            ],
            windows: &windows,
        };
        put(folder, MOTION, &motion)?;
        put(folder, UNIT, &described(self.unit, instants).text())?;
        put(folder, CASE, &text.toml())
    }

    fn answer(&self) -> Result<String, toml::ser::Error> {
        toml::to_string(&Answer {
            format: "flight-answer/1",
            effect: self.struck.iter().map(Done::of).collect(),
        })
    }
}

/// The unit, each channel read when this one's parts convert.
fn described(unit: Option<&UnitDescription>, instants: &Instants) -> UnitDescription {
    let mut unit = unit.cloned().unwrap_or_else(|| {
        let mut unit = emems(|_| 0.0);
        for channel in &mut unit.channels {
            channel.instant_sigma_s = (channel.sensor != Kind::Thermometer)
                .then(|| to_microseconds(conversion_s(channel.sensor) / 12f64.sqrt()));
        }
        unit
    });
    for channel in &mut unit.channels {
        let place = CHANNELS.iter().position(|known| known.name == channel.name);
        if let Some(slot_s) = place.and_then(|place| instants.slots_s.get(place)) {
            channel.slot_s = to_microseconds(slot_s - instants.lead_s);
        }
    }
    unit
}

fn to_microseconds(t_s: f64) -> f64 {
    (t_s * 1e6).round() / 1e6
}

fn put(folder: &Path, name: &str, text: &str) -> Result<(), CaseError> {
    let path = folder.join(name);
    fs::write(&path, text).map_err(|source| CaseError::Write { path, source })
}
