//! A gap case: one folder with what a unit logged, what it was made to do, and what its designers believed of it.
//!
//! In: the folder, or its `case.toml`. Out: [`Subject`], whose log is already parted into what may be fitted
//! ([`crate::input::windows::Fit`]) and what only judges ([`crate::input::hold::Held`]).
//!
//! Refuses, naming file and key: a missing file, a key that is absent or of the wrong type, windows that are empty,
//! run backwards or overlap, a window without a sample, a sigma or a correlation time that cannot be, a motion that ends
//! before the log does, a clock that never meets the motion's, channels the packets do not have. Lost, missing and
//! clipped samples are not errors: they are left out and counted in [`crate::input::log::Masked`].

mod allowance;
mod attitude_at;
mod environment;
mod known;
mod measured;
mod plausible;
mod subject;
mod table;
mod text;

use std::{
    io,
    path::{Path, PathBuf},
};

use serde::Deserialize;

use crate::input::{
    log::{Column, Log},
    windows::{Span, Windows},
};

pub use allowance::{Bars, SlowErrors};
pub use attitude_at::{AttitudeAt, Turned};
pub use environment::environment as environment_of;
pub use known::{Distrust, Distrusts, MotionKnown};
pub use measured::read_measured;
pub use subject::{Subject, columns as columns_of};
pub use table::{Position, read_table};
pub use text::read_bytes;

/// Why a case cannot be judged.
#[derive(Debug, thiserror::Error)]
pub enum CaseError {
    /// A file is missing or unreadable.
    #[error("{file}: cannot be read: {source}")]
    Read {
        /// Which.
        file: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// A key is absent, of the wrong type, or senseless.
    #[error("{file}: {key}: {problem}")]
    Key {
        /// In which file.
        file: PathBuf,
        /// Which key, column or line.
        key: String,
        /// What is wrong and what would be right.
        problem: String,
    },
    /// The unit's description is unusable.
    #[error(transparent)]
    Unit(#[from] twin::predict::UnitError),
    /// The motion is unusable.
    #[error(transparent)]
    Motion(#[from] twin::recording::FileError),
    /// The unit's description names an effect there is not.
    #[error(transparent)]
    Effect(#[from] twin::effect::UnknownEffect),
}

impl CaseError {
    /// Something wrong at one key of a file.
    pub fn key(file: &Path, key: impl Into<String>, problem: impl Into<String>) -> Self {
        CaseError::Key {
            file: file.to_path_buf(),
            key: key.into(),
            problem: problem.into(),
        }
    }
}

/// How the log is written.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// The unit's own 156-byte frames.
    Packets,
    /// A time column and one column a channel, physical units.
    Csv,
    /// One row a position: commanded truth, means and standard deviations.
    Table,
}

/// `case.toml` as written.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CaseFile {
    /// `gap-case/1`.
    pub format: String,
    /// What the case is called in verdicts.
    pub name: String,
    /// How the log is written.
    pub kind: Kind,
    /// What anyone on the bench could see.
    #[serde(default)]
    pub about: String,
    /// Path of the unit's description.
    pub unit: PathBuf,
    /// Path of the log.
    pub measured: PathBuf,
    /// Path of the reference; none for a table, and none where nobody saw the motion.
    pub motion: Option<PathBuf>,
    /// What is known of the motion where nobody saw it.
    #[serde(default)]
    pub motion_known: MotionKnown,
    /// What a flight did when, where its log is not to tell it.
    pub phases: Option<PhasePairs>,
    /// Surroundings.
    #[serde(default)]
    pub environment: Surroundings,
    /// How well the truth instrument knows.
    #[serde(default)]
    pub reference: ReferenceSigmas,
    /// What is too small to care about.
    #[serde(default)]
    pub matters: Matters,
    /// What is fitted and what only judges; a log without a reference is parted by itself where nobody says it.
    pub windows: Option<WindowPairs>,
}

/// `[phases]`: pairs of seconds each.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PhasePairs {
    /// Nothing moves, before a flight.
    pub rest: Vec<[f64; 2]>,
    /// A motor pushes.
    pub thrust: Vec<[f64; 2]>,
    /// Nothing but drag.
    #[serde(alias = "free_fall")]
    pub coast: Vec<[f64; 2]>,
    /// A turn a second and more, across others.
    pub spin: Vec<[f64; 2]>,
    /// The air brakes harder than gravity pulls.
    pub entry: Vec<[f64; 2]>,
    /// It hangs.
    pub parachute: Vec<[f64; 2]>,
    /// Nothing moves, after a flight.
    pub landed: Vec<[f64; 2]>,
}

/// `[matters]`: see [`Bars`].
#[derive(Clone, Copy, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Matters {
    /// \[deg\] of attitude.
    pub attitude_deg: Option<f64>,
    /// \[sigma\] of the gap.
    pub gap_sigma: Option<f64>,
}

/// `[environment]`.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Surroundings {
    /// [m/s2] local gravity.
    pub gravity_m_s2: Option<f64>,
    /// \[deg\] geographic latitude.
    pub latitude_deg: Option<f64>,
    /// \[uT\] geomagnetic field, in n.
    pub field_n_ut: Option<[f64; 3]>,
    /// \[uT\] how well that field is known and how uniform it is.
    #[serde(default)]
    pub field_sigma_ut: f64,
    /// \[uT\] how much it changes during the log.
    pub field_wander_sigma_ut: Option<f64>,
    /// \[s\] over which it stays alike.
    pub field_correlation_s: Option<f64>,
    /// [uT/m] how much it changes with the place.
    pub field_gradient_sigma_ut_m: Option<f64>,
    /// \[degC\] temperature at which the nominal parameters hold.
    pub temperature_c: Option<f64>,
    /// Why the earth's rate is left out of the prediction of a rate table, in words; of the format, and not read: without the
    /// attitude against north no such prediction is made.
    pub earth_rate: Option<String>,
}

/// `[reference]`.
#[derive(Clone, Copy, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ReferenceSigmas {
    /// \[rad\] of its attitude.
    #[serde(default)]
    pub attitude_sigma_rad: f64,
    /// \[s\] over which its error stays alike.
    pub attitude_correlation_s: Option<f64>,
    /// \[m\] of its position.
    #[serde(default)]
    pub position_sigma_m: f64,
}

/// `[windows]` as written: pairs of seconds, or for a table sequence numbers.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WindowPairs {
    /// The cause is fitted on these.
    pub fit: Vec<Edge>,
    /// And judged on these.
    pub hold: Vec<Edge>,
}

/// One window: a pair of seconds or one sequence number.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(untagged)]
pub enum Edge {
    /// From, to.
    Pair([f64; 2]),
    /// A row of a table.
    Row(f64),
}

/// A case file with the folder its paths are relative to.
#[derive(Clone, Debug)]
pub struct Opened {
    /// Path of `case.toml`.
    pub file: PathBuf,
    /// What it says.
    pub text: CaseFile,
    /// Its windows, checked; empty where it says none.
    pub windows: Windows,
}

impl Opened {
    /// Whether nobody saw the motion.
    pub fn is_without_motion(&self) -> bool {
        self.text.kind != Kind::Table && self.text.motion.is_none()
    }

    /// Reads `case.toml`, given itself or its folder.
    ///
    /// # Errors
    /// When it cannot be read or a key is wrong.
    pub fn open(path: &Path) -> Result<Self, CaseError> {
        let file = if path.is_dir() {
            path.join("case.toml")
        } else {
            path.to_path_buf()
        };
        let bytes = read_bytes(&file)?;
        let text = String::from_utf8(bytes).map_err(|_| CaseError::key(&file, "encoding", "is not UTF-8"))?;
        let text: CaseFile = toml::from_str(&text).map_err(|error| text::toml_problem(&file, &error))?;
        if text.format != "gap-case/1" {
            return Err(CaseError::key(
                &file,
                "format",
                format!("is {:?}, known is \"gap-case/1\"", text.format),
            ));
        }
        text.motion_known.check(&file, text.motion.is_some())?;
        let (fit, hold) = match &text.windows {
            Some(pairs) => (
                spans(&file, "windows.fit", &pairs.fit)?,
                spans(&file, "windows.hold", &pairs.hold)?,
            ),
            None => (Vec::new(), Vec::new()),
        };
        let windows =
            Windows::new(fit, hold).map_err(|problem| CaseError::key(&file, "windows", problem.to_string()))?;
        Ok(Opened { file, text, windows })
    }

    /// A path of the case file, from where the program runs.
    pub fn path(&self, relative: &Path) -> PathBuf {
        self.file.parent().unwrap_or(Path::new(".")).join(relative)
    }

    /// Reads the log of a `packets` or `csv` case.
    ///
    /// # Errors
    /// When the log cannot be read or does not fit the unit.
    pub fn log(&self, columns: &[Column], cycle_s: Option<f64>) -> Result<Log, CaseError> {
        read_measured(&self.path(&self.text.measured), self.text.kind, columns, cycle_s)
    }
}

fn spans(file: &Path, key: &str, edges: &[Edge]) -> Result<Vec<Span>, CaseError> {
    if edges.is_empty() {
        return Err(CaseError::key(file, key, "is empty; give at least one [from, to]"));
    }
    let span = |edge: &Edge| match *edge {
        Edge::Pair([from, to]) => Span { from, to },
        Edge::Row(row) => Span {
            from: row - 0.5,
            to: row + 0.5,
        },
    };
    Ok(edges.iter().map(span).collect())
}

#[cfg(test)]
mod tests;
