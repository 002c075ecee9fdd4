//! The gap case of a real unit's log, and what a case lacks.
//!
//! A log and a reference become a case by [`made`]; [`checked`] says what a case has and lacks. The text of `case.toml`, the windows and
//! the reference instrument of a flight are in [`flight::case`], which this takes its windows and its text from.

pub mod checked;
pub mod clock;
mod described;
pub mod made;
mod place;
pub mod reference;

use std::path::PathBuf;

/// Makes a gap case of a real unit's log, and says what a case lacks
#[derive(Clone, Debug, clap::Subcommand)]
pub enum Step {
    /// Makes a case of a log and a reference: finds out formats, units, clocks, windows
    New(Box<made::NewCaseArguments>),
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
