//! The umbilical console: one screen for the engineer at the launch pad.
//!
//! In: a [`mod@line`] to the unit (a serial port, or a unit that flies in another thread), keys or lines of text. Out: the
//! unit's replies, all sensors live, and a recording of every byte received. Data flows one way:
//!
//! ```text
//! line -> recording -> stream -> model -> view -> terminal          keys -> input -> line
//! ```
//!
//! [`stream`], [`model`], [`input`], [`keys`] and [`view`] are functions of their arguments; only [`mod@line`], [`serial`],
//! [`recording`], [`screen`] and [`plain`] touch the world, and [`session`] is where they meet.

use std::{
    io::{self, IsTerminal, Write},
    path::{Path, PathBuf},
    time::{Duration, SystemTime},
};

mod attitude;
pub mod display;
mod help;
pub mod history;
pub mod input;
pub mod keys;
pub mod line;
pub mod model;
pub mod plain;
mod plot;
pub mod recording;
pub mod screen;
pub mod serial;
pub mod session;
mod state;
pub mod stream;
mod table;
pub mod view;
pub mod word;

use line::Line;
use recording::Recording;
use serial::SerialLine;
use session::Session;

/// `ground console`: talk to the unit over its umbilical, see all sensors live, keep everything it says
///
/// Opens the port at 115200 8N1, and opens it again when it was unplugged. The unit's words are sent as typed, other words are
/// answered here; `?` shows the keys and the unit's commands. The recording holds the received bytes as they came: `ground decode`
/// reads it.
#[derive(Clone, Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  ground console /dev/ttyUSB0 --record pad.log\n  echo G_ST | ground console /dev/ttyUSB0 --plain"
)]
pub struct ConsoleArguments {
    /// Serial port of the umbilical (/dev/ttyUSB0, COM3); it may be plugged in later
    pub port: String,
    /// File to append every received byte to; FILE.commands.txt takes what was sent [default: umbilical-TIME.log]
    #[arg(long, value_name = "FILE")]
    pub record: Option<PathBuf>,
    #[command(flatten)]
    #[allow(missing_docs)] // clap would take the text for the command's.
    pub options: Options,
}

/// How a console shows itself.
#[derive(Clone, Copy, Debug, Default, clap::Args)]
pub struct Options {
    /// Print lines instead of a screen and read commands from standard input, until that ends; so without a terminal
    #[arg(long)]
    pub plain: bool,
    /// With --plain: listen for so long after the input has ended, such as 10s or 1h [default: until the reply, 2s at most]
    #[arg(long, value_name = "TIME", value_parser = humantime::parse_duration)]
    pub listen: Option<Duration>,
}

/// Why a console ended.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// Nothing can be recorded, so nothing is shown.
    #[error(transparent)]
    Recording(#[from] recording::OpenError),
    /// What was named is there and is no port.
    #[error("{0} is no serial port; name one as /dev/ttyUSB0 or COM3")]
    NoPort(String),
    /// The unit said nothing.
    #[error("no reply to {word} within {wait:?}: is the unit on, and is this its umbilical?")]
    Silent {
        /// The last word sent.
        word: String,
        /// How long was waited.
        wait: Duration,
    },
    /// The terminal failed; the recording is whole up to then.
    #[error("the terminal failed: {0}; --plain does without one")]
    Terminal(#[from] io::Error),
}

/// Runs `ground console`.
///
/// # Errors
/// See [`run`].
pub fn console(arguments: &ConsoleArguments) -> Result<(), Error> {
    if is_no_port(Path::new(&arguments.port)) {
        return Err(Error::NoPort(arguments.port.clone()));
    }
    let default = || recording::default_path(SystemTime::now());
    let path = arguments.record.clone().unwrap_or_else(default);
    run(SerialLine::new(&arguments.port), &path, arguments.options)
}

/// Whether a path is there and is something that no port can be.
pub(crate) fn is_no_port(path: &Path) -> bool {
    let Ok(there) = path.metadata() else { return false };
    #[cfg(unix)]
    return !std::os::unix::fs::FileTypeExt::is_char_device(&there.file_type());
    #[cfg(not(unix))]
    return there.is_dir() || there.is_file();
}

/// A console on `line` until the user quits, recording to `path`.
///
/// # Errors
/// When the recording cannot be opened, or the terminal fails; never because of the line.
pub fn run(line: impl Line, path: &Path, options: Options) -> Result<(), Error> {
    let recording = Recording::open(path, line.name(), SystemTime::now())?;
    let mut session = Session::new(line, recording);
    if options.plain || !io::stdout().is_terminal() || !io::stdin().is_terminal() {
        plain::run(&mut session, options.listen)?;
    } else {
        screen::run(&mut session)?;
    }
    let kept = display::size(session.model.recorded_bytes);
    // To a terminal that went away nothing can be said.
    let _ = writeln!(
        io::stderr(),
        "{kept} in {}, what was sent in {}",
        path.display(),
        recording::commands_path(path).display()
    );
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_port_is_refused_before_anything_is_recorded() {
        let place = tempfile::tempdir().expect("temporary folder");
        let file = place.path().join("flight.log");
        std::fs::write(&file, "not a port").expect("written");
        for port in [place.path(), &file] {
            let arguments = ConsoleArguments {
                port: port.display().to_string(),
                record: Some(place.path().join("kept.log")),
                options: Options::default(),
            };
            let error = console(&arguments).expect_err("no port").to_string();
            assert!(error.contains("is no serial port"), "{error}");
        }
        assert!(!place.path().join("kept.log").exists());
        assert!(!is_no_port(&place.path().join("ttyUSB7")), "it may be plugged in later");
    }
}
