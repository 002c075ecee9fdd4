//! `ground acceptance`: the first hour with a freshly soldered unit.
//!
//! In: a port, or the twin. Out: a folder with a page, every byte heard, the findings as JSON, and a first calibration set. The data
//! flow one way:
//!
//! ```text
//! line ──► procedure ──► evidence ──► judge ──► findings, fits ──► page, set
//!             └──► asks: words for the unit; poses, turns, the lift-off line for who holds it
//! ```
//!
//! [`procedure`] knows neither port nor clock and [`judge`] no line: [`person`] and [`rig`] talk.

use std::{
    fs, io,
    path::{Path, PathBuf},
};

use flight::interrupt::Interrupt;
use logs::folder::{self, FolderError};

pub mod evidence;
pub mod fit;
pub mod judge;
pub mod limits;
pub mod page;
pub mod person;
pub mod pose;
pub mod procedure;
pub mod rig;
pub mod set;
pub mod status;
#[cfg(test)]
mod tests;

use self::{
    judge::Place,
    procedure::Heard,
    rig::{Board, Run, Wrong},
};
use crate::{
    console::{serial::SerialLine, stream::Item},
    fly::board::BoardError,
};

/// Tests a freshly soldered unit over its umbilical: parts, wiring, noise, timing, recorder; a page and a first calibration set
///
/// Asks for six poses and six turns, sees in the data when they are done, and holds every line against its limit. What
/// fails is named, with what to check on the board. With --emulated the twin is tested and moves as it is asked.
#[derive(Clone, Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  ground acceptance /dev/ttyUSB0 --unit EM-7\n  ground acceptance --emulated\n  ground acceptance --host --defect exchanged-plates:1,2 --defect silent:m3@0s"
)]
pub struct AcceptanceArguments {
    /// Serial port of the umbilical (/dev/ttyUSB0, COM3)
    #[arg(required_unless_present_any = ["emulated", "host"], conflicts_with_all = ["emulated", "host"])]
    pub port: Option<String>,
    /// Test the release image on the emulated board
    #[arg(long, conflicts_with = "host")]
    pub emulated: bool,
    /// Test the unit's code on this computer
    #[arg(long)]
    pub host: bool,
    /// What is wrong with the emulated unit, such as crossed-selects:1,2, inverted:a1x, clone:m2, slow-bus=80, silent:g3@0s; several
    #[arg(long, value_name = "WORD", conflicts_with = "port")]
    pub defect: Vec<Wrong>,
    /// Which specimen of the emulated unit
    #[arg(long, value_name = "N", default_value_t = 1, conflicts_with = "port")]
    pub seed: u64,
    /// Name of the unit
    #[arg(long, value_name = "NAME", default_value = "unit")]
    pub unit: String,
    /// Gravity at the table (m/s2)
    #[arg(long, value_name = "NUMBER", default_value_t = 9.80665)]
    pub gravity: f64,
    /// Strength of the field at the table (uT), if it was measured [default: as the magnetometers' nominal scale has it]
    #[arg(long, value_name = "NUMBER")]
    pub field_ut: Option<f64>,
    /// Where the folder of the test goes; an existing one is never overwritten
    #[arg(long, value_name = "DIR", default_value = "acceptance")]
    pub out: PathBuf,
    /// Print the findings for programs
    #[arg(long)]
    pub json: bool,
}

/// Why a test ended otherwise than good.
#[derive(Debug, thiserror::Error)]
pub enum AcceptanceError {
    /// Something is wrong with the unit.
    #[error("not good: {0} lines fail")]
    NotGood(usize),
    /// A number that can hardly be meant.
    #[error("{0}")]
    Number(&'static str),
    /// What was named is there and is no port.
    #[error("{0} is no serial port; name one as /dev/ttyUSB0 or COM3")]
    NoPort(String),
    /// A defect that only the emulated board can have.
    #[error("no-crystal is of the board: use --emulated")]
    OnlyEmulated,
    /// The board.
    #[error(transparent)]
    Board(#[from] BoardError),
    /// The operating system's interrupt.
    #[error("Ctrl-C cannot be listened to: {0}")]
    Interrupt(#[from] ctrlc::Error),
    /// The terminal.
    #[error("the terminal failed: {0}")]
    Terminal(#[from] io::Error),
    /// A file.
    #[error("{path} cannot be written: {source}")]
    File {
        /// Which.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// The folder.
    #[error(transparent)]
    Folder(#[from] FolderError),
    /// The set.
    #[error(transparent)]
    Set(#[from] bench::set::SetError),
    /// A figure.
    #[error(transparent)]
    Chart(#[from] chart::ChartError),
}

/// What the stream holds, as the procedure takes it.
fn heard(item: Item) -> Heard {
    match item {
        Item::Packet(reading) => Heard::Packet(reading),
        Item::Derived(derived) => Heard::Derived(derived),
        Item::Reply(text) => Heard::Line(text),
        Item::Unread { .. } => Heard::Unread,
    }
}

/// Runs `ground acceptance`.
///
/// # Errors
/// See [`AcceptanceError`]; a unit that is not good is one.
pub fn acceptance(arguments: &AcceptanceArguments) -> Result<(), AcceptanceError> {
    if !(9.7..=9.9).contains(&arguments.gravity) {
        return Err(AcceptanceError::Number(
            "--gravity is 9.76 to 9.84 m/s2 anywhere on Earth",
        ));
    }
    if arguments.field_ut.is_some_and(|field| !(5.0..=200.0).contains(&field)) {
        return Err(AcceptanceError::Number(
            "--field-ut is 22 to 67 uT anywhere on Earth: is it in gauss (x 100) or nT (/ 1000)?",
        ));
    }
    let run = heard_from(arguments)?;
    let place = Place {
        gravity: arguments.gravity,
        field_ut: arguments.field_ut,
    };
    let outcome = judge::judge(&run.evidence, place);
    let folder = folder::make(&arguments.out, &arguments.unit)?;
    let set = set::first(&outcome, &arguments.unit);
    let about = match &arguments.port {
        Some(port) => format!("on {port}"),
        None => "the twin, emulated".to_owned(),
    };
    let json = page::json(&outcome);
    put(&folder.join("umbilical.txt"), &run.bytes)?;
    put(&folder.join("report.json"), format!("{json:#}\n").as_bytes())?;
    put(
        &folder.join("index.html"),
        page::html(&outcome, &run.evidence, &arguments.unit, &about)?.as_bytes(),
    )?;
    if !set.channels.is_empty() {
        let mut set = set;
        set.from_file(Path::new("umbilical.txt"), &run.bytes);
        put(&folder.join("set.toml"), set.text()?.as_bytes())?;
    }
    if arguments.json {
        println!("{json}");
    } else {
        print!("{}", page::text(&outcome));
        println!("{}", folder.join("index.html").display());
    }
    match outcome.findings.iter().filter(|finding| !finding.good).count() {
        0 => Ok(()),
        bad => Err(AcceptanceError::NotGood(bad)),
    }
}

fn heard_from(arguments: &AcceptanceArguments) -> Result<Run, AcceptanceError> {
    if let Some(port) = &arguments.port {
        if crate::console::is_no_port(Path::new(port)) {
            return Err(AcceptanceError::NoPort(port.clone()));
        }
        let interrupt = Interrupt::listen()?;
        return Ok(person::run(&mut SerialLine::new(port), &interrupt, &mut io::stderr())?);
    }
    let board = if arguments.emulated {
        Board::Emulated
    } else {
        Board::Host
    };
    if board == Board::Host && arguments.defect.contains(&Wrong::NoCrystal) {
        return Err(AcceptanceError::OnlyEmulated);
    }
    let mut tell = |at_s: f64, text: &str| eprintln!("{at_s:6.1} s  {text}");
    Ok(rig::run(board, &arguments.defect, arguments.seed, &mut tell)?)
}

fn put(path: &Path, bytes: &[u8]) -> Result<(), AcceptanceError> {
    fs::write(path, bytes).map_err(|source| AcceptanceError::File {
        path: path.to_owned(),
        source,
    })
}
