//! `ground calibrate`: from a table or a raw log to a calibration set, with a report.
//!
//! In: files and flags. Out: a report on standard output, and where asked for a set (`--set`, merged into what is there),
//! or a page (`--page`). The subcommands do the work; what they share is here.

mod controlled;
mod ellipsoid;

use std::path::{Path, PathBuf};

use crate::{
    nominal::Nominal,
    report::Report,
    set::{Entry, Set},
    table::{self, TableError},
    turntable::{Mount, Site},
};

/// Calibrates sensors from bench data, with uncertainties and what the test could not see
#[derive(Clone, Debug, clap::Args)]
pub struct CalibrateArguments {
    #[command(subcommand)]
    what: What,
}

impl CalibrateArguments {
    /// Whether standard output is for programs.
    pub fn json(&self) -> bool {
        match &self.what {
            What::RateTable(arguments) => arguments.json(),
            What::MultiPosition(arguments) => arguments.json(),
            What::Ellipsoid(arguments) => arguments.json(),
            What::Drift(arguments) => arguments.json,
        }
    }
}

#[derive(Clone, Debug, clap::Subcommand)]
enum What {
    RateTable(controlled::RateTable),
    MultiPosition(controlled::MultiPosition),
    Ellipsoid(ellipsoid::EllipsoidArguments),
    Drift(crate::drift::DriftArguments),
}

/// Why a calibration failed.
#[derive(Debug, thiserror::Error)]
pub enum CalibrateError {
    /// A table cannot be read.
    #[error(transparent)]
    Table(#[from] TableError),
    /// A channel is not determined.
    #[error(transparent)]
    Calibration(#[from] crate::controlled::CalibrationError),
    /// A drift test is not conclusive.
    #[error(transparent)]
    Drift(#[from] crate::drift::DriftError),
    /// It was done, and the report says what is wrong.
    #[error("not good; what is wrong stands above")]
    NotGood,
    /// Anything else, with the file it is about.
    #[error("{file}: {why}")]
    File {
        /// The file.
        file: PathBuf,
        /// What is wrong, and what to do.
        why: String,
    },
}

impl CalibrateError {
    pub(crate) fn of(file: &Path) -> impl Fn(String) -> CalibrateError {
        move |why| CalibrateError::File { file: file.into(), why }
    }
}

/// Runs `ground calibrate`.
///
/// # Errors
/// When files cannot be read or written, or do not determine what is asked for; and when the result is not good, so that
/// a script does not take it for one.
pub fn run(arguments: &CalibrateArguments) -> Result<(), CalibrateError> {
    let good = match &arguments.what {
        What::RateTable(arguments) => controlled::rate_table(arguments),
        What::MultiPosition(arguments) => controlled::multi_position(arguments),
        What::Ellipsoid(arguments) => ellipsoid::run(arguments),
        What::Drift(arguments) => Ok(crate::drift::run(arguments)?),
    }?;
    if good { Ok(()) } else { Err(CalibrateError::NotGood) }
}

/// Where the results go.
#[derive(Clone, Debug, clap::Args)]
struct Output {
    /// Put the channels into this calibration set, new or there
    #[arg(long, value_name = "FILE")]
    set: Option<PathBuf>,
    /// Write a page with residuals to this file
    #[arg(long, value_name = "FILE")]
    page: Option<PathBuf>,
    /// Print the report as JSON
    #[arg(long)]
    json: bool,
    /// Part and serial number, kept in the set: TEXT for every channel, or CHANNEL=TEXT, as often as needed
    #[arg(long, value_name = "[CHANNEL=]TEXT")]
    part: Vec<String>,
    /// Name of the unit, kept in the set
    #[arg(long, value_name = "TEXT", requires = "set")]
    unit_name: Option<String>,
    /// Serial number of the unit, which refuses sets of others
    #[arg(long, value_name = "NUMBER", requires = "set")]
    serial: Option<u32>,
    /// Number of the set, to be counted up from calibration to calibration
    #[arg(long, value_name = "NUMBER", requires = "set")]
    number: Option<u32>,
    /// Write the set even if the calibration is not good
    #[arg(long, requires = "set")]
    even_if_not_good: bool,
}

impl Output {
    fn json(&self) -> bool {
        self.json
    }

    /// Prints, and writes what was asked for.
    fn finish(
        &self,
        report: &Report,
        mut entries: Vec<Entry>,
        files: &[(&Path, &[u8])],
    ) -> Result<bool, CalibrateError> {
        report.print(self.json);
        let say = |text: String| {
            if !self.json {
                println!("{text}");
            }
        };
        let good = report.wrong.is_empty();
        if let Some(path) = self.set.as_ref().filter(|_| !good && !self.even_if_not_good) {
            say(format!(
                "{} is left as it is: not good (--even-if-not-good writes it)",
                path.display()
            ));
        } else if let Some(path) = &self.set {
            let fail = CalibrateError::of(path);
            let mut set = if path.exists() {
                read_set(path)?
            } else {
                Set::new("unit")
            };
            set.unit = self.unit_name.clone().unwrap_or(set.unit);
            set.serial = self.serial.unwrap_or(set.serial);
            set.number = self.number.unwrap_or(set.number);
            for (file, bytes) in files {
                set.from_file(file, bytes);
            }
            for entry in &mut entries {
                entry.part = part_of(&self.part, &entry.name);
            }
            set.merge(entries);
            let text = set.text().map_err(|error| fail(error.to_string()))?;
            packets::output::replace_with(path, text).map_err(|error| fail(format!("cannot be written: {error}")))?;
            say(path.display().to_string());
        }
        if let Some(path) = &self.page {
            let names: Vec<_> = files.iter().map(|(file, _)| file.display().to_string()).collect();
            report
                .write(path, &names.join(", "))
                .map_err(CalibrateError::of(path))?;
            say(path.display().to_string());
        }
        Ok(good)
    }
}

/// What `--part` says of a channel: its own word before that for all.
fn part_of(parts: &[String], channel: &str) -> String {
    let own = parts
        .iter()
        .find_map(|part| part.strip_prefix(channel)?.strip_prefix('='));
    let all = parts.iter().find(|part| !part.contains('=')).map(String::as_str);
    own.or(all).unwrap_or_default().into()
}

/// The table the unit stood on.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct TableArguments {
    /// How the unit sits on the table: axes at zero angles
    #[arg(long, value_enum, default_value = "emems")]
    mount: MountName,
    /// Gravity at the site [m/s2]
    #[arg(
        long = "gravity-m-s2",
        alias = "gravity",
        value_name = "M/S2",
        default_value_t = 9.80665
    )]
    gravity: f64,
    /// Latitude of the site (deg), north positive
    #[arg(long = "latitude-deg", alias = "latitude", value_name = "DEG", default_value_t = -23.2111, allow_negative_numbers = true)]
    latitude: f64,
    /// Azimuth of the table's outer axis (deg); without it the Earth's rate stays in the bias
    #[arg(
        long = "azimuth-deg",
        alias = "azimuth",
        value_name = "DEG",
        allow_negative_numbers = true
    )]
    azimuth: Option<f64>,
}

#[derive(Clone, Copy, Debug, clap::ValueEnum)]
enum MountName {
    /// Inner axis along z down, outer along y (Marinho 2017)
    Emems,
    /// Inner axis along x up, middle along y (Siqueira 2014)
    Siqueira,
}

impl TableArguments {
    pub(crate) fn mount(&self) -> Mount {
        match self.mount {
            MountName::Emems => Mount::EMEMS,
            MountName::Siqueira => Mount::SIQUEIRA,
        }
    }

    pub(crate) fn site(&self) -> Site {
        Site {
            gravity_m_s2: self.gravity,
            latitude_rad: self.latitude.to_radians(),
            outer_azimuth_rad: self.azimuth.map(f64::to_radians),
        }
    }
}

/// Reads a unit file.
pub(crate) fn read_nominal(path: &Path) -> Result<Nominal, CalibrateError> {
    Nominal::parse(&read_text(path)?).map_err(CalibrateError::of(path))
}

/// Reads a calibration set.
pub(crate) fn read_set(path: &Path) -> Result<Set, CalibrateError> {
    Set::parse(&read_text(path)?).map_err(|error| CalibrateError::of(path)(error.to_string()))
}

/// Reads a file that must be text.
pub(crate) fn read_text(path: &Path) -> Result<String, CalibrateError> {
    String::from_utf8(table::bytes(path)?).map_err(|error| CalibrateError::of(path)(error.to_string()))
}
