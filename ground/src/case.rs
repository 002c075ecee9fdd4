//! A folder as a gap case: the files beside a log that make it one.
//!
//! In: what was flown or logged, the unit's description, the place, how well the reference knows, the windows. Out: the text of
//! `case.toml` after the case format. What decides the windows is [`windows`], what a reference instrument would have written
//! [`instrument`]. A real unit's log becomes a case by [`made`], and [`checked`] says what it lacks.

pub mod checked;
pub mod clock;
mod described;
pub mod instrument;
pub mod made;
mod place;
pub mod reference;
pub mod windows;

use std::{fmt::Write, path::PathBuf};

use twin::environment::Environment;

use self::windows::Parted;

/// File names in a case's folder.
pub const CASE: &str = "case.toml";
/// The unit's description.
pub const UNIT: &str = "unit.toml";
/// What the unit was made to do.
pub const MOTION: &str = "motion.csv";

/// Makes a gap case of a real unit's log, and says what a case lacks
#[derive(Clone, Debug, clap::Subcommand)]
pub enum Step {
    /// Makes a case of a log and a reference: finds out formats, units, clocks, windows
    New(Box<made::Arguments>),
    /// Says what a case has, and what it lacks
    Check {
        /// Folder of the case
        folder: PathBuf,
        /// Print the points as JSON
        #[arg(long)]
        json: bool,
    },
}

impl Step {
    /// Whether standard output takes JSON.
    pub fn json(&self) -> bool {
        matches!(self, Step::Check { json: true, .. })
    }
}

/// A case that cannot be made, or that lacks something.
#[derive(Debug, thiserror::Error)]
pub enum StepError {
    /// Not made.
    #[error(transparent)]
    Made(#[from] made::MadeError),
    /// Not whole.
    #[error("{0} cannot be diagnosed; see above")]
    Lacks(PathBuf),
}

/// Runs `ground case`.
///
/// # Errors
/// When no case can be made, or one lacks something.
pub fn case(step: &Step) -> Result<(), StepError> {
    match step {
        Step::New(arguments) => print!("{}", made::made(arguments)?),
        Step::Check { folder, json } => {
            let checked = checked::checked(folder);
            match json {
                true => println!("{:#}", checked.json()),
                false => print!("{}", checked.text()),
            }
            if !checked.is_whole() {
                return Err(StepError::Lacks(folder.clone()));
            }
        }
    }
    Ok(())
}

/// What `case.toml` says.
pub struct Text<'a> {
    /// What the case is called in verdicts.
    pub name: &'a str,
    /// `packets` or `csv`.
    pub kind: &'a str,
    /// What anyone on the bench could see.
    pub about: &'a str,
    /// File of the log.
    pub measured: &'a str,
    /// The place.
    pub environment: &'a Environment,
    /// \[uT\] how well the field is known; 0 for exactly.
    pub field_sigma_ut: f64,
    /// \[rad\] and \[m\] of the reference; zeros for an exact one.
    pub reference: [f64; 2],
    /// What is fitted and what judges.
    pub windows: &'a Parted,
}

impl Text<'_> {
    /// The file.
    pub fn toml(&self) -> String {
        let mut text = String::new();
        // Writing to a string cannot fail.
        let _ = self.write(&mut text);
        text
    }

    fn write(&self, text: &mut String) -> std::fmt::Result {
        let quoted = |words: &str| toml::Value::String(words.into()).to_string();
        writeln!(text, "format = \"gap-case/1\"\nname = {}", quoted(self.name))?;
        writeln!(text, "kind = \"{}\"\nabout = {}", self.kind, quoted(self.about))?;
        writeln!(
            text,
            "unit = \"{UNIT}\"\nmeasured = {}\nmotion = \"{MOTION}\"\n",
            quoted(self.measured)
        )?;
        let Environment {
            gravity,
            latitude,
            field_n_ut: field,
            temperature_c,
        } = self.environment;
        writeln!(
            text,
            "[environment]\ngravity_m_s2 = {gravity:?}\nlatitude_deg = {:.6}",
            latitude.to_degrees()
        )?;
        writeln!(text, "field_n_ut = [{:.4}, {:.4}, {:.4}]", field.x, field.y, field.z)?;
        if self.field_sigma_ut > 0.0 {
            writeln!(text, "field_sigma_ut = {:.3}", self.field_sigma_ut)?;
        }
        writeln!(text, "temperature_c = {temperature_c:?}\n")?;
        let [attitude_rad, position_m] = self.reference;
        if attitude_rad > 0.0 {
            writeln!(text, "[reference]\nattitude_sigma_rad = {attitude_rad:?}")?;
            if position_m > 0.0 {
                writeln!(text, "position_sigma_m = {position_m:?}")?;
            }
            writeln!(text)?;
        }
        writeln!(
            text,
            "[windows]\nfit = {}\nhold = {}",
            spans(&self.windows.fit),
            spans(&self.windows.hold)
        )
    }
}

fn spans(spans: &[[f64; 2]]) -> String {
    let pairs: Vec<String> = spans.iter().map(|[from, to]| format!("[{from:?}, {to:?}]")).collect();
    format!("[{}]", pairs.join(", "))
}
