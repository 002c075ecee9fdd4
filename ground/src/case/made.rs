//! `ground case new`: a real unit's log and its reference, made a gap case.
//!
//! In: a log (packets, or CSV in SI with a column a channel), a reference's record, perhaps a unit's description, a calibration set, and a
//! flight log that says which launch site the unit was told.
//! Out: a folder as [`super`] has it, and in words what was found out: formats, units, which way the reference counts, the
//! offset of the clocks with its sigma, place and windows. In order:
//!
//! 1. formats: packets by their frames, else CSV; the reference by its columns ([`super::reference`]);
//! 2. the unit: `--unit`, or the design, with `--set`'s parameters and the sigmas of its covariance; slots of a log with derived
//!    frames, half a conversion older than the read ([`super::described`]);
//! 3. the clocks, coarsely ([`super::clock`]);
//! 4. which way the attitude turns and navigation's axes point, and the place where it is not given ([`super::place`]);
//! 5. metres or millimetres, where the reference does not say: what the accelerometers feel less amiss at;
//! 6. the clocks, finely, along the case itself; windows where both are there.
//!
//! Refused: no packet and no CSV, what the readers refuse, clocks that cannot be told, what [`super::place`] refuses.

use std::{
    fs, io,
    path::{Path, PathBuf},
};

use attitude::told::NothingTold;
use flight::{
    case::{
        text::{CASE, MOTION, Text, UNIT},
        windows::{self, TooShort},
    },
    site::field,
};
use gap::{
    input::case::{Kind as LogKind, Subject, read_bytes, read_measured},
    null::problem::Problem,
};
use twin::{motion::Recorded, predict::Kind};

use super::{
    clock::{self, ClockError},
    described::{columns, format_of, unit},
    place::{MODEL_SIGMA_UT, check_units, environment, settled, site_told},
    reference::{Axes, ReferenceRecord, Refused},
};

/// Steps that the fine search of the clocks takes at most; three come to a tenth of a sigma from 50 ms off.
const MOST_STEPS: usize = 6;

/// \[rad\] and \[m\] that a reference is taken to be good for where nobody says: a camera system's.
const REFERENCE: [f64; 2] = [1e-3, 1e-3];

/// Makes a gap case of a real unit's log and its reference
#[derive(Clone, Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  ground case new --log umbilical.txt --reference mocap.csv --set set.toml --latitude-deg -23.2 --out flight-7\n  ground case new --log umbilical.txt --reference radar.csv --flight-log nand.bin --out flight-8\n  ground case check flight-7"
)]
pub struct NewCaseArguments {
    /// What the unit sent: packets as the console kept them or `recover` gave them, or CSV with t_s and a column a channel in SI
    #[arg(long, value_name = "FILE")]
    pub log: PathBuf,
    /// What it was made to do: CSV with time and attitude, of a camera system or a table
    #[arg(long, value_name = "FILE")]
    pub reference: PathBuf,
    /// Calibration set of the unit
    #[arg(long, value_name = "FILE")]
    pub set: Option<PathBuf>,
    /// Description of the unit [default: the design]
    #[arg(long, value_name = "FILE")]
    pub unit: Option<PathBuf>,
    /// Seconds to take from the reference's times [default: from the rates]
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    pub offset_s: Option<f64>,
    /// How well the reference knows attitudes (rad); 0 for exact
    #[arg(long, value_name = "RAD", default_value_t = REFERENCE[0])]
    pub attitude_sigma_rad: f64,
    /// The unit's flight log, image or dump: gravity, latitude and field of the launch site that the unit was told, where they are not given
    #[arg(long, value_name = "FILE")]
    pub flight_log: Option<PathBuf>,
    /// Latitude, north positive
    #[arg(long, value_name = "DEG", allow_negative_numbers = true)]
    pub latitude_deg: Option<f64>,
    /// Local gravity [default: from the accelerometers]
    #[arg(long, value_name = "M/S2")]
    pub gravity_m_s2: Option<f64>,
    /// Magnetic field north, east, down in microtesla [default: from the magnetometers]
    #[arg(long, value_name = "N,E,D", allow_hyphen_values = true, value_parser = field)]
    pub field_n_ut: Option<[f64; 3]>,
    /// Folder of the case; must not exist
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
}

/// Why there is no case.
#[derive(Debug, thiserror::Error)]
pub enum MadeError {
    /// The log, or the case made of it.
    #[error(transparent)]
    Case(#[from] gap::input::case::CaseError),
    /// The reference.
    #[error(transparent)]
    Reference(#[from] Refused),
    /// The reference as a motion.
    #[error(transparent)]
    Motion(#[from] twin::recording::FileError),
    /// The unit.
    #[error(transparent)]
    Unit(#[from] twin::predict::UnitError),
    /// The set.
    #[error("{file}: {why}")]
    Set {
        /// Which.
        file: String,
        /// Why.
        why: bench::set::SetError,
    },
    /// The flight log.
    #[error(transparent)]
    FlightLog(#[from] NothingTold),
    /// The clocks.
    #[error(transparent)]
    Clock(#[from] ClockError),
    /// The windows.
    #[error(transparent)]
    Windows(#[from] TooShort),
    /// Something is not as it must be.
    #[error("{0}")]
    Wrong(String),
    /// A file.
    #[error("{path}: {source}")]
    File {
        /// Which.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
}

/// Runs `ground case new`; says what was found out.
///
/// # Errors
/// When no case can be made.
pub fn made(arguments: &NewCaseArguments) -> Result<String, MadeError> {
    make(&arguments.out)?;
    let made = make_case(arguments);
    if made.is_err() {
        // Half a case would stand in the way of the next attempt. What cannot be removed does no other harm.
        let _ = fs::remove_dir_all(&arguments.out);
    }
    made
}

fn make_case(arguments: &NewCaseArguments) -> Result<String, MadeError> {
    let mut said = Vec::new();
    let site = site_told(arguments)?;
    let bytes = read_bytes(&arguments.log)?;
    let log_name = arguments.log.display().to_string();
    let (kind, slots) = format_of(&bytes, &log_name)?;
    let unit = unit(arguments, kind, slots.as_ref(), &mut said)?;
    let measured = if kind == LogKind::Packets {
        "measured.txt"
    } else {
        "measured.csv"
    };
    let log_file = arguments.out.join(measured);
    put(&log_file, &bytes)?;
    let log = read_measured(&log_file, kind, &columns(&unit), unit.cycle_s)?;
    said.insert(
        0,
        format!("log        {log_name}: {}, {} rows", kind_text(kind), log.start_s.len()),
    );
    check_units(&log, &unit, &log_name)?;

    let mut reference = ReferenceRecord::open(&arguments.reference)?;
    said.push(format!(
        "reference  {}: {} rows",
        arguments.reference.display(),
        reference.rows.len()
    ));
    said.extend(reference.taken.iter().map(|line| format!("           {line}")));
    let record = |reference: &ReferenceRecord, offset_s: f64, axes: Axes, is_inverse: bool| {
        let text = reference.text(offset_s, axes, is_inverse);
        Recorded::read(io::Cursor::new(text.into_bytes()), MOTION).map(|record| record.used())
    };
    let rates = clock::rates(&log, &unit);
    let (mut offset_s, alike) = match arguments.offset_s {
        Some(offset_s) => (offset_s, f64::NAN),
        None => clock::coarse(&rates, &record(&reference, 0.0, Axes::Ned, false)?)?,
    };
    let (axes, is_inverse, place) = settled(&reference, &log, &unit, offset_s, &rates)?;
    said.push(format!(
        "           read as {} to {axes:?}, by the rates and where down is",
        if is_inverse {
            "navigation to body"
        } else {
            "body to navigation"
        }
    ));
    let environment = environment(arguments, site.as_ref(), &place, &mut said)?;
    put(&arguments.out.join(UNIT), unit.text().as_bytes())?;
    let case = |reference: &ReferenceRecord, offset_s: f64| -> Result<Subject, MadeError> {
        put(
            &arguments.out.join(MOTION),
            reference.text(offset_s, axes, is_inverse).as_bytes(),
        )?;
        let motion = record(reference, offset_s, axes, is_inverse)?;
        let (from_s, to_s) = motion.span_s();
        let (first_s, last_s) = (
            log.start_s.first().copied().unwrap_or(0.0),
            log.start_s.last().copied().unwrap_or(0.0),
        );
        let windows = windows::parted(&motion, |t_s| t_s, [from_s.max(first_s), to_s.min(last_s)])?;
        let name = arguments.out.file_name().unwrap_or_default().to_string_lossy();
        let text = Text {
            name: &name,
            kind: kind_text(kind),
            about: "",
            measured,
            environment: &environment,
            field_sigma_ut: match (&arguments.field_n_ut, &site) {
                (Some(_), _) => MODEL_SIGMA_UT,
                (None, Some(site)) => site.field_sigma_ut,
                (None, None) => place.field_sigma_ut,
            },
            reference: [arguments.attitude_sigma_rad, REFERENCE[1]],
            windows: &windows,
        };
        put(&arguments.out.join(CASE), text.toml().as_bytes())?;
        Ok(Subject::open(&arguments.out)?)
    };
    let mut subject = case(&reference, offset_s)?;
    if !reference.place_is_named {
        let smaller = reference.in_millimetres();
        let apart = [forces_off(&subject), forces_off(&case(&smaller, offset_s)?)];
        let is_mm = apart[1] < apart[0];
        said.push(format!(
            "           place in {}: accelerometers are {:.1} sigma off so, else {:.1}",
            if is_mm { "millimetres" } else { "metres" },
            apart[0].min(apart[1]),
            apart[0].max(apart[1])
        ));
        if is_mm {
            reference = smaller;
        }
        subject = case(&reference, offset_s)?;
    }
    if arguments.offset_s.is_none() {
        let mut error = clock::error(&subject).ok_or(ClockError::Still)?;
        for _ in 0..MOST_STEPS {
            offset_s += error.seconds;
            subject = case(&reference, offset_s)?;
            error = clock::error(&subject).ok_or(ClockError::Still)?;
            if error.seconds.abs() < 0.1 * error.sigma_s {
                break;
            }
        }
        said.push(format!(
            "clocks     reference minus log {offset_s:+.4} +- {:.4} s, from the rates (alike to {alike:.3}); taken off motion.csv",
            error.sigma_s
        ));
    } else {
        said.push(format!("clocks     reference minus log {offset_s:+.4} s, as given"));
    }
    let windows = &subject.opened.windows;
    let spans = |spans: &[gap::input::windows::Span]| -> String {
        spans
            .iter()
            .map(|span| format!(" [{:.1}, {:.1}]", span.from, span.to))
            .collect()
    };
    said.push(format!(
        "windows    fit{}; hold{}",
        spans(windows.fit()),
        spans(windows.hold())
    ));
    said.push(format!(
        "case       {}; next: ground case check, ground gap",
        arguments.out.display()
    ));
    Ok(said.join("\n") + "\n")
}

fn kind_text(kind: LogKind) -> &'static str {
    match kind {
        LogKind::Packets => "packets",
        LogKind::Csv => "csv",
        LogKind::Table => "table",
    }
}

/// How far the accelerometers are off, in sigma.
fn forces_off(subject: &Subject) -> f64 {
    let problem = Problem::new(&subject.twin, &subject.fit, &subject.reference);
    let predicted = subject.twin.predict(&[]);
    let (mut sum, mut count) = (0.0, 0.0);
    for (index, channel) in subject.twin.unit().channels.iter().enumerate() {
        // What a reference is told to err by from sample to sample would excuse any unit.
        let sigma = problem.steady[index];
        for (row, value) in subject.fit.channels[index]
            .rows
            .iter()
            .zip(&subject.fit.channels[index].values)
        {
            if channel.sensor == Kind::Accelerometer {
                sum += ((value - predicted[index][*row as usize]) / sigma).powi(2);
                count += 1.0;
            }
        }
    }
    (sum / f64::max(count, 1.0)).sqrt()
}

fn make(folder: &Path) -> Result<(), MadeError> {
    fs::create_dir(folder).map_err(|source| match source.kind() {
        io::ErrorKind::AlreadyExists => MadeError::Wrong(format!(
            "{} is there already and is left as it is; --out names another folder",
            folder.display()
        )),
        _ => MadeError::File {
            path: folder.into(),
            source,
        },
    })
}

fn put(path: &Path, bytes: &[u8]) -> Result<(), MadeError> {
    fs::write(path, bytes).map_err(|source| MadeError::File {
        path: path.into(),
        source,
    })
}
