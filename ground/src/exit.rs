//! How the program ends: exit codes, and outputs that nobody reads any more.
//!
//! In: the error of a command. Out: a code that a script can act on, and a line on standard error.
//!
//! | code | meaning |
//! |---|---|
//! | 0 | good; also when the reader of the output went away (`ground ... \| head`) |
//! | 1 | not good: it was done, and the answer is that something is wrong; or it failed on the way (disk, port, board) |
//! | 2 | bad input or usage: a file that is not what it should be, numbers that can hardly be in their unit, unknown options |

use std::{error::Error, io, process::ExitCode};

use attitude::AttitudeError;
use bench::{
    allan::AllanError, calibrate::CalibrateError, design::command::DesignError, drift::DriftError, table::TableError,
};
use flight::{FlyError, source::SourceError};
use gap::GapError;
use recorder::{dump::DumpError, recover::RecoverError};

use crate::{
    acceptance::AcceptanceError,
    case::{StepError, made::MadeError},
    compare::CompareError,
    console,
    decode::DecodeError,
    effects::NoEffect,
    fly::board::BoardError,
    size::SizeError,
};

/// What `--help` says of exit codes.
pub const HELP: &str = "Exit codes: 0 good; 1 not good, or failed; 2 bad input or usage. A closed pipe ends with 0.";

/// Ends with the code of a command's result, and says why on standard error.
pub fn code(result: Result<(), Box<dyn Error>>) -> ExitCode {
    let Err(error) = result else { return ExitCode::SUCCESS };
    if is_closed_pipe(error.as_ref()) {
        return ExitCode::SUCCESS;
    }
    eprintln!("error: {error}");
    ExitCode::from(if is_bad_input(error.as_ref()) { 2 } else { 1 })
}

/// Lets standard output go nowhere, for `--quiet`: what follows is reports for people. Where the system has no such thing they
/// are printed.
pub fn print_nothing() {
    #[cfg(unix)]
    if let Ok(nowhere) = std::fs::OpenOptions::new().write(true).open("/dev/null") {
        // If it fails the reports are printed, which does no harm.
        let _ = rustix::stdio::dup2_stdout(&nowhere);
    }
}

fn is_closed_pipe(error: &(dyn Error + 'static)) -> bool {
    let broken = |error: &io::Error| error.kind() == io::ErrorKind::BrokenPipe;
    let mut at = Some(error);
    while let Some(error) = at {
        if error.downcast_ref::<io::Error>().is_some_and(broken) {
            return true;
        }
        // Transparent errors give the source of what they hold, not what they hold.
        if let Some(DecodeError::Output(error) | DecodeError::Read { source: error, .. }) = error.downcast_ref()
            && broken(error)
        {
            return true;
        }
        if let Some(RecoverError::Output(error)) = error.downcast_ref()
            && broken(error)
        {
            return true;
        }
        at = error.source();
    }
    false
}

/// Whether it is the file of an image that is at fault, not the board.
fn is_bad_image(error: &BoardError) -> bool {
    matches!(error, BoardError::Image(error) if error.is_of_the_file())
}

/// Whether it is the input or the command line that is at fault, not the world.
fn is_bad_input(error: &(dyn Error + 'static)) -> bool {
    if let Some(error) = error.downcast_ref::<CalibrateError>() {
        return match error {
            CalibrateError::NotGood => false,
            CalibrateError::Drift(error) => !matches!(error, DriftError::Write { .. } | DriftError::Chart(_)),
            CalibrateError::Table(_) | CalibrateError::Calibration(_) | CalibrateError::File { .. } => true,
        };
    }
    if let Some(error) = error.downcast_ref::<AttitudeError>() {
        return !matches!(error, AttitudeError::Chart(_) | AttitudeError::Calibration(_));
    }
    if let Some(error) = error.downcast_ref::<DecodeError>() {
        return !matches!(error, DecodeError::Output(_) | DecodeError::Folder(_));
    }
    if let Some(error) = error.downcast_ref::<CompareError>() {
        return !matches!(error, CompareError::Chart(_));
    }
    if let Some(error) = error.downcast_ref::<RecoverError>() {
        return !matches!(error, RecoverError::Output(_));
    }
    if let Some(error) = error.downcast_ref::<FlyError>() {
        return match error {
            FlyError::Board(error) => error.downcast_ref().is_some_and(is_bad_image),
            error => error.is_bad_input(),
        };
    }
    if let Some(error) = error.downcast_ref::<AllanError>() {
        return matches!(error, AllanError::Table(_));
    }
    if let Some(error) = error.downcast_ref::<GapError>() {
        return matches!(error, GapError::Case(_) | GapError::Word(_) | GapError::Against);
    }
    if let Some(error) = error.downcast_ref::<DumpError>() {
        return matches!(error, DumpError::Port { .. });
    }
    if let Some(error) = error.downcast_ref::<SizeError>() {
        return !matches!(error, SizeError::Ceiling { .. });
    }
    if let Some(error) = error.downcast_ref::<console::Error>() {
        return matches!(error, console::Error::NoPort(_));
    }
    if let Some(StepError::Made(error)) = error.downcast_ref() {
        return !matches!(error, MadeError::File { .. });
    }
    if let Some(error) = error.downcast_ref::<AcceptanceError>() {
        return match error {
            AcceptanceError::Number(_) | AcceptanceError::NoPort(_) | AcceptanceError::OnlyEmulated => true,
            AcceptanceError::Board(error) => is_bad_image(error),
            _ => false,
        };
    }
    error.is::<TableError>() || error.is::<SourceError>() || error.is::<DesignError>() || error.is::<NoEffect>()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bad_input_a_bad_answer_and_a_full_disk_are_told_apart() {
        let bad = |error: Box<dyn Error>| is_bad_input(error.as_ref());
        assert!(!bad(CalibrateError::NotGood.into()));
        assert!(bad(Box::new(DecodeError::NoPackets {
            path: "page.html".into(),
            looks: "it looks like a web page",
        })));
        let full = || io::Error::from(io::ErrorKind::StorageFull);
        assert!(!bad(Box::new(DecodeError::Output(full()))));
        assert!(!bad(Box::new(RecoverError::Output(full()))));
    }

    #[test]
    fn a_closed_pipe_is_known_wherever_it_stands() {
        let pipe = || io::Error::from(io::ErrorKind::BrokenPipe);
        for error in [
            Box::new(pipe()) as Box<dyn Error>,
            Box::new(DecodeError::Output(pipe())),
            Box::new(RecoverError::Output(pipe())),
        ] {
            assert!(is_closed_pipe(error.as_ref()), "{error}");
        }
        assert!(!is_closed_pipe(&io::Error::from(io::ErrorKind::NotFound)));
    }
}
