//! `ground calibration`: what is done with a calibration set: into the unit, beside another, into the twin.

mod apply;
mod sets;

use crate::calibrate::CalibrateError;

/// Puts a calibration set into the unit or the twin, or compares two
#[derive(Clone, Debug, clap::Args)]
pub struct CalibrationArguments {
    #[command(subcommand)]
    what: What,
}

impl CalibrationArguments {
    /// Whether standard output is for programs.
    pub fn json(&self) -> bool {
        match &self.what {
            What::Apply(arguments) => arguments.json,
            What::Diff(arguments) => arguments.json,
            What::Unit(_) => false,
        }
    }
}

#[derive(Clone, Debug, clap::Subcommand)]
enum What {
    Apply(apply::ApplyArguments),
    Diff(sets::Diff),
    Unit(sets::Unit),
}

/// Runs `ground calibration`.
///
/// # Errors
/// When files cannot be read or written, or the unit refuses; and when two sets differ.
pub fn run(arguments: &CalibrationArguments) -> Result<(), CalibrateError> {
    let good = match &arguments.what {
        What::Apply(arguments) => apply::apply(arguments).map(|()| true),
        What::Diff(arguments) => sets::diff(arguments),
        What::Unit(arguments) => sets::unit(arguments).map(|()| true),
    }?;
    if good { Ok(()) } else { Err(CalibrateError::NotGood) }
}
