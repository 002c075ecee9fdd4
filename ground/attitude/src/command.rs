//! `ground attitude`: a log to attitude, or the table of real recordings.

use std::{
    fs,
    io::{self, Read},
    path::{Path, PathBuf},
    process::Command,
};

use emems::kalman::Params;
use indicatif::ProgressBar;
use packets::stream::{Bytes5To8, Decoder};

use crate::{
    broad,
    flight::Flight,
    log::Steps,
    peers, plots,
    recording::{self, RecordingError},
};

/// Estimates attitude from a log, compares it with a reference, checks the filter
///
/// LOG is a stream of packets (with derived frames or without), or nine-axis CSV (t_s, gyr_x.., acc_x.., mag_x..). The
/// filter is the unit's own. With --recordings it runs on a folder of real recordings with optical truth instead.
#[derive(Clone, Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  ground attitude flights/tumble-1/packets.txt --out attitude.html\n  ground attitude log.csv --reference truth.csv\n  ground attitude --recordings ../shared/data/broad --peers"
)]
pub struct Arguments {
    /// Packets, or nine-axis CSV (.csv or .csv.gz)
    #[arg(required_unless_present = "recordings", conflicts_with = "recordings")]
    pub log: Option<PathBuf>,
    /// Nine-axis CSV with q_w, q_x, q_y, q_z to east-north-up; without, a CSV log's own columns are used
    #[arg(long, value_name = "FILE", requires = "log")]
    pub reference: Option<PathBuf>,
    /// Write plots to this HTML page
    #[arg(long, value_name = "FILE", requires = "log")]
    pub out: Option<PathBuf>,
    /// A folder of recordings with optical truth: one table, one set of parameters
    #[arg(long, value_name = "DIR")]
    pub recordings: Option<PathBuf>,
    /// Add the filters of others, run by peers/broad.py
    #[arg(long, requires = "recordings")]
    pub peers: bool,
}

/// Why there is no attitude.
#[derive(Debug, thiserror::Error)]
pub enum AttitudeError {
    /// A file is no recording.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// A file cannot be read or written.
    #[error("{file}: {error}")]
    Io {
        /// Which.
        file: String,
        /// Why.
        error: io::Error,
    },
    /// A plot cannot be drawn.
    #[error(transparent)]
    Chart(#[from] chart::ChartError),
    /// The filter never found an attitude.
    #[error(
        "{0}: no attitude in it; there must be a second of rates from three gyros, specific force near one g and a field not along it"
    )]
    NoAttitude(String),
    /// The reference and the log never meet in time.
    #[error("{0}: no sample of it is within half a step of the log's; are both in seconds from the same zero?")]
    NeverMeet(String),
}

/// Runs the subcommand.
pub fn run(arguments: &Arguments) -> Result<(), AttitudeError> {
    if let Some(folder) = &arguments.recordings {
        return table(folder, arguments.peers);
    }
    let log = arguments.log.clone().unwrap_or_default();
    let (flight, own) = estimate(&log)?;
    if flight.estimates.is_empty() {
        return Err(AttitudeError::NoAttitude(log.display().to_string()));
    }
    let reference = match &arguments.reference {
        Some(path) => Some((path, recording::read(path)?)),
        None => own.map(|rows| (&log, rows)),
    };
    print!("{}", summary(&flight));
    if let Some((path, rows)) = reference {
        let met = flight
            .compare(&rows)
            .ok_or_else(|| AttitudeError::NeverMeet(path.display().to_string()))?;
        print!("{}", compared(&met));
    }
    if let Some(out) = &arguments.out {
        let page = plots::page(&flight)?;
        fs::write(out, page).map_err(|error| io_error(out, error))?;
        println!("{}", out.display());
    }
    Ok(())
}

fn io_error(path: &Path, error: io::Error) -> AttitudeError {
    AttitudeError::Io {
        file: path.display().to_string(),
        error,
    }
}

/// The log's flight, and its own reference if it has one.
fn estimate(path: &Path) -> Result<(Flight, Option<Vec<recording::Row>>), AttitudeError> {
    let name = path.to_string_lossy();
    if name.ends_with(".csv") || name.ends_with(".csv.gz") {
        let rows = recording::read(path)?;
        let steps = broad::replay(broad::Mode::Full).steps(&rows).map(|(step, _)| step);
        let flight = Flight::of(Params::ROOM, steps).shifted(-crate::replay::EPOCH_S);
        let referenced = rows.iter().any(|row| row.reference_nb.is_some());
        return Ok((flight, referenced.then_some(rows)));
    }
    let mut file = fs::File::open(path).map_err(|error| io_error(path, error))?;
    let bar = ProgressBar::new(file.metadata().map(|metadata| metadata.len()).unwrap_or_default());
    let (mut decoder, mut steps, mut taken) = (Decoder::new(Bytes5To8::Errors), Steps::default(), Vec::new());
    let mut piece = [0; 65_536];
    loop {
        let count = file.read(&mut piece).map_err(|error| io_error(path, error))?;
        if count == 0 {
            break;
        }
        taken.extend(decoder.push(&piece[..count]).iter().filter_map(|item| steps.take(item)));
        bar.inc(count as u64);
    }
    taken.extend(steps.finish());
    bar.finish_and_clear();
    Ok((Flight::of(Params::ROOM, taken), None))
}

fn summary(flight: &Flight) -> String {
    let mut text = format!("steps with an attitude      {}\n", flight.estimates.len());
    for (reason, count) in &flight.refused {
        text += &format!("refused, {reason:<18} {count}\n");
    }
    text += &format!("found by TRIAD              {} times\n", flight.aligned_s.len());
    if let Some(last) = flight.estimates.last() {
        let [roll, pitch, yaw] = last.euler_deg();
        let sd = last.sd_n.map(f64::to_degrees);
        text += &format!("attitude at the end         roll {roll:.2}, pitch {pitch:.2}, yaw {yaw:.2} deg\n");
        text += &format!(
            "its standard deviation      north {:.2}, east {:.2}, down {:.2} deg\n",
            sd.x, sd.y, sd.z
        );
    }
    for (quantity, check) in flight.checks() {
        text += &format!("{:<27} {}\n", format!("{quantity:?} innovations"), check.line());
    }
    text
}

fn compared(met: &crate::flight::Comparison) -> String {
    let (mean, sd) = (met.mean_deg, met.sd_deg);
    let rmse = |rmse: &crate::score::Rmse| {
        format!(
            "total {:.2}, heading {:.2}, inclination {:.2} deg",
            rmse.total_deg, rmse.heading_deg, rmse.inclination_deg
        )
    };
    let triad = met.triad.as_ref().map_or_else(|| "none".to_string(), rmse);
    format!(
        "compared with a reference   {} samples\nerror about x, y, z of b    mean {:.2}, {:.2}, {:.2} deg, sd {:.2}, {:.2}, {:.2} deg\nRMSE, filter                {}\nRMSE, TRIAD alone           {triad}\n",
        met.count,
        mean.x,
        mean.y,
        mean.z,
        sd.x,
        sd.y,
        sd.z,
        rmse(&met.rmse),
    )
}

fn table(folder: &Path, with_peers: bool) -> Result<(), AttitudeError> {
    let bar = ProgressBar::new(broad::files(folder)?.len() as u64);
    let ours = broad::run(folder, |_| bar.inc(1))?;
    bar.finish_and_clear();
    print!("{}", broad::format(&ours));
    if with_peers {
        match peers::run(Command::new(peers::python()), folder) {
            Ok(others) => print!("{}", peers::format(&ours, &others)),
            Err(why) => println!("peers left out: {why}"),
        }
    }
    Ok(())
}
