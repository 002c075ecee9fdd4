//! The filter on real recordings with optical truth: one table.
//!
//! The recordings are of BROAD (D. Laidig, M. Caruso, A. Cereatti, T. Seel, "BROAD, A Benchmark for Robust Inertial
//! Orientation Estimation", Data 6(7), 2021, doi 10.3390/data6070072, CC-BY 4.0), 285.7 rows a second, about three
//! minutes each. One set of parameters for all; it was chosen on [`TUNE`], and [`REPORT`] says what it is worth.

use std::{
    path::{Path, PathBuf},
    time::Instant,
};

use emems::{
    increments::forces::READINGS,
    kalman::{Delays, Filter, Params, Step},
};
use logs::{
    recording::{self, RecordingError, Row},
    score::{Rmse, mean},
};
use nalgebra::Vector3;

use crate::replay::{Noise, Replay};

/// Recordings on which parameters were chosen.
pub const TUNE: [&str; 7] = ["02", "07", "11", "15", "24", "28", "32"];
/// Recordings that played no part in it.
pub const REPORT: [&str; 9] = ["01", "03", "05", "09", "18", "26", "30", "34", "36"];

/// All of them by what was done, as the data set names it.
pub const GROUPS: [(&str, &[&str]); 8] = [
    ("slow rotation", &["01", "02", "03", "05"]),
    ("fast rotation", &["07", "09"]),
    ("slow translation", &["11"]),
    ("fast translation", &["15", "18"]),
    ("tapping", &["24"]),
    ("vibrating phone", &["26"]),
    ("stationary magnet", &["28", "30"]),
    ("attached magnet", &["32", "34", "36"]),
];

/// [rad/s] the Earth's rate and \[rad\] the latitude of Berlin, where the recordings were made.
const EARTH_RATE: f64 = 7.292_115e-5;
const LATITUDE_DEG: f64 = 52.5;

/// A way to run the filter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    /// At every row.
    Full,
    /// At 5 Hz, on rates integrated within the period and force read three times in it, as the unit does.
    FiveHz,
    /// At every row, begun 10 s into the motion.
    FromMotion,
    /// At 5 Hz, the mean over [`FIRST_ROWS`]: at which instants force and field are sampled is chance.
    FiveHzFromAnyRow,
    /// At 5 Hz on one reading of force a period, which is what packets alone have and what peers are given.
    FiveHzOneForce,
}

impl Mode {
    /// All of them.
    pub const ALL: [Mode; MODES] = [
        Mode::Full,
        Mode::FiveHz,
        Mode::FromMotion,
        Mode::FiveHzFromAnyRow,
        Mode::FiveHzOneForce,
    ];

    /// As a table's heading has it.
    pub fn name(self) -> &'static str {
        match self {
            Mode::Full => "285 Hz",
            Mode::FiveHz => "5 Hz",
            Mode::FromMotion => "start in motion",
            Mode::FiveHzFromAnyRow => "5 Hz, 12 first rows",
            Mode::FiveHzOneForce => "5 Hz, one force",
        }
    }
}

/// [deg/s] step of the rates' codes, +-2000 deg/s in 16 bits. They were cut towards zero: on the recordings of [`TUNE`]
/// zero is twice as frequent as its neighbours, and every bias is half a step greater in motion than at rest.
/// Half a step is put back for ours and for its peers.
pub const CUT_STEP_DEG: f64 = 2000.0 / 32768.0;

/// Rows of the recordings in a period of 0.2 s.
const FIVE_HZ: usize = 57;

/// Rows that the first period begins at, through one period.
const FIRST_ROWS: [usize; 12] = [0, 5, 10, 15, 20, 25, 30, 35, 40, 45, 50, 55];

/// How many modes there are.
pub const MODES: usize = 5;

/// Parameters and noise for these recordings, one set for all.
pub fn replay(mode: Mode) -> Replay {
    let latitude = LATITUDE_DEG.to_radians();
    let earth = Vector3::new(EARTH_RATE * latitude.cos(), 0.0, -EARTH_RATE * latitude.sin());
    Replay {
        params: Params {
            delays: Delays {
                gyro_s: 0.004,
                acc_s: 0.004,
                mag_s: 0.015,
            },
            gravity: 9.82,
            earth_rate_n: earth.cast(),
            ..Params::ROOM
        },
        noise: Noise {
            angle: 0.0,
            acc: 2e-4,
            mag: 0.1,
        },
        cut_step: CUT_STEP_DEG.to_radians(),
        rows_per_step: match mode {
            Mode::FiveHz | Mode::FiveHzFromAnyRow | Mode::FiveHzOneForce => FIVE_HZ,
            Mode::Full | Mode::FromMotion => 1,
        },
        forces: match mode {
            Mode::FiveHz | Mode::FiveHzFromAnyRow => 1 + READINGS,
            _ => 1,
        },
    }
}

/// Where errors begin to count: for a start in motion, 10 s after it began.
pub fn scored(rows: &[Row], mode: Mode) -> &[Row] {
    let moving = rows.iter().position(|row| row.scored).unwrap_or_default();
    match mode {
        Mode::FromMotion => {
            let from = rows[moving].t_s + 10.0;
            &rows[rows.partition_point(|row| row.t_s < from).min(rows.len() - 1)..]
        }
        _ => rows,
    }
}

/// The recordings in a folder, by number.
pub fn files(folder: &Path) -> Result<Vec<(String, PathBuf)>, RecordingError> {
    let io = |error| RecordingError::Io {
        file: folder.display().to_string(),
        error,
    };
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(io)? {
        let path = entry.map_err(io)?.path();
        let name = path
            .file_name()
            .map(|name| name.to_string_lossy().into_owned())
            .unwrap_or_default();
        if name.contains(".csv")
            && name
                .get(..2)
                .is_some_and(|number| number.bytes().all(|byte| byte.is_ascii_digit()))
        {
            files.push((name[..2].to_string(), path));
        }
    }
    files.sort();
    Ok(files)
}

/// A recording's number, and its errors in each mode of [`Mode::ALL`].
pub type Line = (String, [Option<Rmse>; MODES]);

/// A line a recording.
pub type Table = Vec<Line>;

/// Errors on each recording of a folder in each mode of [`Mode::ALL`].
pub fn run(folder: &Path, mut done: impl FnMut(&str)) -> Result<Table, RecordingError> {
    let mut table = Vec::new();
    for (number, path) in files(folder)? {
        let rows = recording::read(&path)?;
        let of = |mode| {
            let (replay, rows) = (replay(mode), scored(&rows, mode));
            let begun_at = |first: usize| rows.get(first..).and_then(|rows| replay.score(rows));
            match mode {
                Mode::FiveHzFromAnyRow => {
                    let all: Option<Vec<Rmse>> = FIRST_ROWS.into_iter().map(begun_at).collect();
                    all.map(|all| mean(&all))
                }
                _ => begun_at(0),
            }
        };
        table.push((number.clone(), Mode::ALL.map(of)));
        done(&number);
    }
    Ok(table)
}

/// Updates a second of the filter at every row of the recording of a folder with this number, the most of five runs.
pub fn updates_a_second(folder: &Path, number: &str) -> Result<Option<f64>, RecordingError> {
    let Some((_, path)) = files(folder)?.into_iter().find(|(found, _)| found == number) else {
        return Ok(None);
    };
    let (rows, replay) = (recording::read(&path)?, replay(Mode::Full));
    let steps: Vec<Step> = replay.steps(&rows).map(|(step, _)| step).collect();
    let least_s = (0..5)
        .map(|_| {
            let mut filter = Filter::new(replay.params);
            let begun = Instant::now();
            steps.iter().for_each(|step| {
                std::hint::black_box(filter.step(step));
            });
            begun.elapsed().as_secs_f64()
        })
        .fold(f64::INFINITY, f64::min);
    Ok(Some(steps.len() as f64 / least_s))
}

/// The mean over those of `numbers` that are in a table, in a mode.
pub fn mean_of(table: &[Line], numbers: &[&str], mode: Mode) -> Option<Rmse> {
    let chosen = table.iter().filter(|(number, _)| numbers.contains(&number.as_str()));
    let all: Option<Vec<Rmse>> = chosen.map(|(_, modes)| modes[mode as usize]).collect();
    all.filter(|all| !all.is_empty()).map(|all| mean(&all))
}

/// The table as text.
pub fn format(table: &[Line]) -> String {
    let mut text = format!("{:<14}", "RMSE [deg]");
    for mode in Mode::ALL {
        text += &format!("{:>24}", mode.name());
    }
    text += "\n";
    let cell = |rmse: Option<Rmse>| match rmse {
        Some(rmse) => format!(
            "{:>10.2} ({:>4.2}, {:>4.2})",
            rmse.total_deg, rmse.heading_deg, rmse.inclination_deg
        ),
        None => format!("{:>24}", "no attitude"),
    };
    let mut line = |name: &str, modes: [Option<Rmse>; MODES]| {
        text += &format!("{name:<14}");
        for rmse in modes {
            text += &format!("{:>24}", cell(rmse));
        }
        text += "\n";
    };
    for (number, modes) in table {
        line(number, *modes);
    }
    for (name, numbers) in [("mean of tune", &TUNE[..]), ("mean of report", &REPORT[..])] {
        line(name, Mode::ALL.map(|mode| mean_of(table, numbers, mode)));
    }
    text + "total (heading, inclination)\n"
}
