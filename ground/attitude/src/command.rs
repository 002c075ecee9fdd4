//! `ground attitude`: a log to attitude, the table of real recordings, or the theses' tables.
//!
//! In: a unit's log (packets, or their counts as CSV) for the estimation that flies, or a nine-axis recording for its
//! filter. Out: a summary, the methods beside each other, errors against a reference, a page of plots. Packets and derived
//! frames from the unit's start on are what the unit had: its estimate comes back bit for bit, and that is said.

use std::{
    io::{self, BufReader, Cursor, Read},
    path::{Path, PathBuf},
    process::Command,
    time::Instant,
};

use emems::{kalman::Params, sample::Reading, unit::Settings};
use indicatif::ProgressBar;
use logs::{
    cycles::{Cycle, Cycles},
    flight::{Comparison, CrewWord, Flight, Taken},
    plausible::{self, Implausible},
    plot,
    recording::{self, RecordingError},
    score,
    units::Units,
};
use packets::{
    input, output, reach,
    stream::{Bytes5To8, Decoder, Item},
};

use crate::{
    align::{self, Offset},
    broad,
    chapter6::{self, calibrated::NotCalibrated},
    counts,
    methods::{self, NoSet},
    orbit, peers, reference,
    told::{self, NothingTold},
};

/// Estimates attitude from a log, compares it with a reference, checks the filter
///
/// LOG is a stream of packets (with derived frames or without), their counts as CSV (of `ground decode --counts`), or
/// nine-axis CSV (t_s, gyr_x.., acc_x.., mag_x..). The estimation is the unit's own. With --recordings it runs on a folder
/// of real recordings with optical truth instead, with --theses it prints the theses' tables beside ours.
#[derive(Clone, Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  ground attitude flights/tumble-1/packets.txt --page attitude.html\n  ground attitude log.txt --set lms.toml --set ellipsoid.toml --reference motion.csv\n  ground attitude --recordings data/broad --peers\n  ground attitude --theses"
)]
pub struct AttitudeArguments {
    /// Packets or CSV, gzip or not
    #[arg(required_unless_present_any = ["recordings", "theses"], conflicts_with_all = ["recordings", "theses"])]
    pub log: Option<PathBuf>,
    /// Calibration set to run beside the nominal one; may be given again
    #[arg(long = "set", value_name = "FILE", requires = "log")]
    pub sets: Vec<PathBuf>,
    /// Attitude as CSV: t_s,qw,qx,qy,qz to north-east-down, or q_w, q_x, q_y, q_z to east-north-up; without, a nine-axis
    /// log's own columns are used
    #[arg(long, value_name = "FILE", requires = "log")]
    pub reference: Option<PathBuf>,
    /// Seconds to add to the reference's times to have the log's [default: 0]
    #[arg(long, value_name = "SECONDS", requires = "reference", allow_hyphen_values = true)]
    pub offset_s: Option<f64>,
    /// The unit's flight log, image or dump: launch rails and sites that its estimation took in this flight are taken from it
    #[arg(long, value_name = "FILE", requires = "log")]
    pub flight_log: Option<PathBuf>,
    #[command(flatten)]
    #[allow(missing_docs)] // clap would take the text for the command's.
    pub units: Units,
    /// Write plots to this HTML page
    #[arg(long, alias = "out", value_name = "FILE", requires = "log")]
    pub page: Option<PathBuf>,
    /// Print the figures as JSON
    #[arg(long, requires = "log")]
    pub json: bool,
    /// A folder of recordings with optical truth: one table, one set of parameters
    #[arg(long, value_name = "DIR", conflicts_with = "theses")]
    pub recordings: Option<PathBuf>,
    /// Add the filters of others, run by peers/broad.py
    #[arg(long, requires = "recordings")]
    pub peers: bool,
    /// Fly both rotation tests and the orbit test of the theses, and print their tables beside ours
    #[arg(long)]
    pub theses: bool,
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
    /// It is neither packets nor a table.
    #[error("{file}: neither packets of the unit nor a table with t_s, gyr_x..; {looks}")]
    NoLog {
        /// Which.
        file: String,
        /// What it looks like instead.
        looks: &'static str,
    },
    /// Its numbers can hardly be in their units.
    #[error("{file}: {why}")]
    Implausible {
        /// Which.
        file: String,
        /// What is wrong, and what to do.
        why: Box<Implausible>,
    },
    /// A calibration set for a log that is not in counts.
    #[error("{0}: a nine-axis log is in SI already; sets are for counts: packets, or CSV of `ground decode --counts`")]
    NotCounts(String),
    /// A flight log cannot be used.
    #[error(transparent)]
    FlightLog(#[from] NothingTold),
    /// A calibration set cannot be used.
    #[error(transparent)]
    Set(#[from] NoSet),
    /// The twin's unit cannot be calibrated.
    #[error(transparent)]
    Calibration(#[from] NotCalibrated),
    /// A plot cannot be drawn.
    #[error(transparent)]
    Chart(#[from] chart::ChartError),
    /// The filter never found an attitude.
    #[error(
        "{0}: no attitude in it; there must be a second of rates from three gyros, specific force near one g and a field not along it"
    )]
    NoAttitude(String),
    /// The reference and the log never meet in time.
    #[error(
        "{0}: no sample of it is within half a step of the log's; are both in seconds from the same zero? --offset-s moves it"
    )]
    NeverMeet(String),
}

/// Seed of the flights of [`AttitudeArguments::theses`].
const SEED: u64 = 7;

/// Runs the subcommand.
pub fn run(arguments: &AttitudeArguments) -> Result<(), AttitudeError> {
    if let Some(folder) = &arguments.recordings {
        return table(folder, arguments.peers);
    }
    if arguments.theses {
        let bar = ProgressBar::new(chapter6::STEPS);
        let tables = chapter6::tables(SEED, &|| bar.inc(1))?;
        bar.finish_and_clear();
        print!("{tables}{}", orbit::table(SEED));
        return Ok(());
    }
    let path = arguments.log.clone().unwrap_or_default();
    let reference = match &arguments.reference {
        Some(file) => Some(reference::read(file, arguments.offset_s.unwrap_or_default())?),
        None => None,
    };
    let never = || AttitudeError::NeverMeet(arguments.reference.as_ref().unwrap_or(&path).display().to_string());
    let no_attitude = || AttitudeError::NoAttitude(path.display().to_string());
    let (flight, met, reference) = match read(&path, &arguments.units)? {
        Log::NineAxis(rows) => {
            if let Some(set) = arguments.sets.first() {
                return Err(AttitudeError::NotCounts(set.display().to_string()));
            }
            let own = rows.iter().any(|row| row.reference_nb.is_some());
            let steps = broad::replay(broad::Mode::Full).steps(&rows).map(|(step, _)| step);
            let flight = Flight::of(Params::ROOM, steps).shifted(-crate::replay::EPOCH_S);
            if flight.estimates.is_empty() {
                return Err(no_attitude());
            }
            let reference = reference.or_else(|| own.then(|| rows.clone()));
            let met = reference
                .as_ref()
                .map(|rows| flight.compare(rows).ok_or_else(never))
                .transpose()?;
            (flight, met, reference)
        }
        Log::Unit(cycles) => {
            let (flight, met) = of_unit(arguments, &cycles, reference.as_deref())?.ok_or_else(no_attitude)?;
            (flight, met, reference)
        }
    };
    if reference_missed(arguments, &met) {
        return Err(never());
    }
    let summed = summary(&flight);
    let said = met.as_ref().map(compared).unwrap_or_default();
    let offset = reference.as_ref().and_then(|rows| align::offset(&flight, rows));
    let mut rows = vec![("log".to_string(), named(&path))];
    rows.extend(
        arguments
            .reference
            .iter()
            .map(|file| ("reference".to_string(), named(file))),
    );
    rows.extend(summed.lines().chain(said.lines()).map(split));
    rows.extend(offset.iter().map(|offset| split(&warning(arguments, offset))));
    if arguments.json {
        let rows: serde_json::Map<_, _> = rows
            .iter()
            .map(|(name, value)| (name.clone(), value.as_str().into()))
            .collect();
        println!("{}", serde_json::Value::from(rows));
    } else {
        print!("{summed}{said}");
        if let Some(offset) = &offset {
            println!("{}", warning(arguments, offset));
        }
    }
    if let Some(file) = &arguments.page {
        let page = plot::attitude::page(&flight, reference.as_deref(), rows)?;
        output::replace_with(file, page).map_err(|error| io_error(file, error))?;
        if !arguments.json {
            println!("{}", file.display());
        }
    }
    Ok(())
}

/// A file's name without its folder, which is nobody's business on a page that may be passed on.
fn named(file: &Path) -> String {
    file.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// A printed line as a name and its value, which begins in the 29th column.
fn split(line: &str) -> (String, String) {
    let (name, value) = line.split_at_checked(28).unwrap_or((line, ""));
    (name.trim().into(), value.trim().into())
}

/// What to say of a reference whose clock seems to be off.
fn warning(arguments: &AttitudeArguments, offset: &Offset) -> String {
    let said = match arguments.reference {
        Some(_) => format!(
            "--offset-s {:.4}",
            arguments.offset_s.unwrap_or_default() + offset.later_s
        ),
        None => format!("its times later by {:.4} s", offset.later_s),
    };
    let used = match (&arguments.reference, arguments.offset_s) {
        (Some(_), Some(_)) => "the errors are by the offset that was told",
        (Some(_), None) => "the errors are by no offset, as none was told",
        (None, _) => "the errors are by its times as they stand",
    };
    format!(
        "{:<28}the reference fits best with {said} (sigma {:.4} s): error about its mean {:.2} instead of {:.2} deg; {used}",
        "warning", offset.sigma_s, offset.rms_deg[1], offset.rms_deg[0]
    )
}

fn reference_missed(arguments: &AttitudeArguments, met: &Option<Comparison>) -> bool {
    arguments.reference.is_some() && met.is_none()
}

/// The methods beside each other; the last set's flight is what is looked at closer. `None` without an attitude.
fn of_unit(
    arguments: &AttitudeArguments,
    cycles: &[Cycle],
    reference: Option<&[recording::Row]>,
) -> Result<Option<(Flight, Option<Comparison>)>, AttitudeError> {
    let settings = Settings::NOMINAL;
    let mut sets = vec![methods::compiled_in(&settings)];
    for file in &arguments.sets {
        sets.push(methods::read(file, &settings)?);
    }
    let flight_log = arguments.flight_log.as_deref().map(told::open).transpose()?;
    let readings = || cycles.iter().map(|cycle| cycle.sample.reading);
    let of_these = |log| told::of(log, told::boot(log, readings()));
    let told = flight_log.as_ref().map(of_these).unwrap_or_default();
    let count = sets.len() * cycles.len();
    let began = Instant::now();
    let mut runs = methods::run(sets, &settings, cycles, &told, reference);
    let took_s = began.elapsed().as_secs_f64();
    if runs.iter().all(|run| run.flight.estimates.is_empty()) {
        return Ok(None);
    }
    // A program gets the figures of the last set; the table beside them is for people.
    let say = |text: String| {
        if !arguments.json {
            print!("{text}");
        }
    };
    say(methods::format(&runs));
    say(format!(
        "estimated                   {count} cycles in {took_s:.2} s, {:.0} a second\n",
        count as f64 / took_s
    ));
    let mut tally = reach::Tally::default();
    cycles.iter().for_each(|cycle| tally.add(&cycle.sample.reading));
    for (name, value) in tally.rows() {
        say(format!("{name:<30}{value}\n"));
    }
    let Some(last) = runs.pop() else { return Ok(None) };
    say(format!("looked at closer            {}\n", last.name));
    for Taken { at_us, told } in &told {
        let (name, text) = match told {
            CrewWord::Rail(rail) => ("launch rail", rail.to_string()),
            CrewWord::Site(site) => ("launch site", site.to_string()),
        };
        say(format!("{name:<28}{text}, taken at {:.3} s\n", 1e-6 * *at_us as f64));
    }
    if let Some(site) = flight_log.as_ref().and_then(told::untaken) {
        say(format!("launch site, not taken      {site}: kept for the next start\n"));
    }
    let [taken, left] = last.flight.rails;
    if taken + left > 0 {
        say(format!("launch rails                {taken} taken, {left} not\n"));
    }
    if last.flight.sites > 0 {
        say(format!("launch sites                {} taken\n", last.flight.sites));
    }
    let [equal, other] = last.flight.replayed;
    if equal + other > 0 {
        say(format!(
            "as the unit sent it         {equal} cycles bit for bit, {other} not\n"
        ));
    }
    Ok(Some((last.flight, last.met)))
}

fn io_error(path: &Path, error: io::Error) -> AttitudeError {
    AttitudeError::Io {
        file: path.display().to_string(),
        error,
    }
}

/// What a file is.
enum Log {
    /// Rates, forces and fields in SI.
    NineAxis(Vec<recording::Row>),
    /// A unit's counts.
    Unit(Vec<Cycle>),
}

/// \[bytes\] a beginning that tells what a file is.
const HEAD: u64 = 4096;

/// Reads a log, whichever it is; its first bytes tell.
fn read(path: &Path, units: &Units) -> Result<Log, AttitudeError> {
    let name = path.display().to_string();
    let failed = |error| io_error(path, error);
    let mut bytes = input::open(path).map_err(failed)?;
    let mut head = Vec::new();
    bytes.by_ref().take(HEAD).read_to_end(&mut head).map_err(failed)?;
    let header = String::from_utf8_lossy(head.split(|byte| *byte == b'\n').next().unwrap_or_default()).into_owned();
    let whole = Cursor::new(head.clone()).chain(bytes);
    let mut cycles = Cycles::new(Settings::NOMINAL);
    if counts::is_one(&header) {
        let packet = |reading: Reading| Item::Packet { offset: 0, reading };
        let readings = counts::parse(&name, BufReader::new(whole))?;
        let mut taken: Vec<Cycle> = (readings.into_iter())
            .filter_map(|reading| cycles.take(&packet(reading)))
            .collect();
        taken.extend(cycles.finish());
        return Ok(Log::Unit(taken));
    }
    if header.split(',').any(|column| column.trim() == "t_s") {
        let rows = recording::parse(&name, BufReader::new(whole))?;
        let rows = plausible::in_si(rows, units).map_err(|why| AttitudeError::Implausible {
            file: name,
            why: Box::new(why),
        })?;
        return Ok(Log::NineAxis(rows));
    }
    match packets(whole, cycles).map_err(failed)? {
        taken if taken.is_empty() => Err(AttitudeError::NoLog {
            file: name,
            looks: input::looks_like(&head),
        }),
        taken => Ok(Log::Unit(taken)),
    }
}

/// The cycles of a stream of packets, without codes that no part can give.
fn packets(mut bytes: impl Read, mut cycles: Cycles) -> io::Result<Vec<Cycle>> {
    let bar = ProgressBar::new_spinner();
    let mut decoder = Decoder::new(Bytes5To8::Errors);
    let (mut taken, mut piece) = (Vec::new(), [0; 65_536]);
    loop {
        let count = bytes.read(&mut piece)?;
        if count == 0 {
            break;
        }
        for mut item in decoder.push(&piece[..count]) {
            if let Item::Packet { reading, .. } = &mut item {
                *reading = reach::without_impossible(*reading);
            }
            taken.extend(cycles.take(&item));
        }
        bar.inc(count as u64);
    }
    taken.extend(cycles.finish());
    bar.finish_and_clear();
    Ok(taken)
}

fn summary(flight: &Flight) -> String {
    let mut text = format!("steps with an attitude      {}\n", flight.estimates.len());
    for (reason, count) in &flight.refused {
        text += &format!("refused, {reason:<18} {count}\n");
    }
    text += &format!("found by TRIAD              {} times\n", flight.aligned_s.len());
    if let Some(last) = flight.estimates.last() {
        let [roll, pitch, yaw] = last.euler_deg();
        let sd = last.sd_n().map(f64::to_degrees);
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

fn compared(met: &Comparison) -> String {
    let (mean, sd) = (met.mean_deg, met.sd_deg);
    let rmse = |rmse: &score::Rmse| {
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
            Ok(others) => {
                print!("{}", peers::format(&ours, &others));
                print!("{}", peers::format_groups(&ours, &others));
                print!("{}", peers::format_speed(folder, &others)?);
            }
            Err(why) => println!("peers left out: {why}"),
        }
    }
    Ok(())
}
