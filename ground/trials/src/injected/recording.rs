//! Healthy recordings of real units: what effects are injected into.
//!
//! In: a folder that holds `data/broad` (or `broad`) and `practice`. Out: [`Recording`]s, each with the unit as its calibration has it
//! and the reference's record, in rows of one step. A recording is for tuning or for judging, never for both ([`KNOWN`]).
//!
//! BROAD (Laidig, Caruso, Cereatti and Seel 2021, doi 10.3390/data6070072, CC BY 4.0) tells attitudes from the sensor to
//! east-north-up; cases have north-east-down, so `q_nb = q_ne q_eb` with a half turn about (1, 1, 0).
//!
//! Refused: rows that are not evenly spaced, a reference with rows of its own, sensors whose axes are not those of b.

use std::{
    fs,
    path::{Path, PathBuf},
};

use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

use super::description::{self, CaseText, ChannelText, UnitText};

/// \[bytes\] of a table at most.
const LARGEST: u64 = 1 << 28;

/// What a recording may be used for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "lowercase")]
pub enum Purpose {
    /// Looking at while something is changed.
    Tune,
    /// Judging what was changed before.
    Judge,
}

/// A recording that may be there.
struct Known {
    /// As the answer names it.
    name: &'static str,
    /// Where it is below the folder; of BROAD the beginning of the file's name.
    place: &'static str,
    /// The unit between two calibrations.
    session: Session,
    purpose: Purpose,
}

/// A unit between two calibrations.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Session {
    /// Of BROAD.
    Broad(Calibrated),
    /// As its own unit.toml has it.
    Own,
}

/// What a session of BROAD is calibrated to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Calibrated {
    /// \[rad/s\] zero of the gyros, at rest.
    pub(super) gyro_bias: [f64; 3],
    /// \[m\] from the markers to the accelerometer, by least squares over undisturbed recordings of the session.
    pub(super) lever_m: [f64; 3],
    /// \[uT\] the room's field in n.
    pub(super) field_n_ut: [f64; 3],
}

/// BROAD's second and third session.
const B: Session = Session::Broad(Calibrated {
    gyro_bias: [0.003_490_66, 0.002_094_4, -0.004_014_26],
    lever_m: [0.0006, -0.002, 0.0075],
    field_n_ut: [15.528, 0.065, 40.726],
});
const C: Session = Session::Broad(Calibrated {
    gyro_bias: [0.008_552_11, -0.003_316_13, -0.004_363_32],
    lever_m: [-0.0006, 0.0016, 0.0085],
    field_n_ut: [17.027, 0.258, 41.016],
});

/// All. The first session of BROAD (01, 15) is not here: its calibration is off by seven of its sigmas.
const KNOWN: &[Known] = &[
    known("BROAD 02", "02_", B, Purpose::Tune),
    known("BROAD 07", "07_", B, Purpose::Tune),
    known("BROAD 11", "11_", B, Purpose::Tune),
    known("BROAD 03", "03_", C, Purpose::Judge),
    known("BROAD 05", "05_", B, Purpose::Judge),
    known("BROAD 09", "09_", B, Purpose::Judge),
    known("BROAD 18", "18_", B, Purpose::Judge),
    known(
        "rocket, two chips beside a third",
        "practice/R09",
        Session::Own,
        Purpose::Judge,
    ),
];

/// What a fresh clone has instead: a minute each.
const MINUTES: &[Known] = &[
    known("a minute of BROAD 09", "09_", B, Purpose::Tune),
    known("a minute of BROAD 03", "practice/R06", Session::Own, Purpose::Judge),
];

const fn known(name: &'static str, place: &'static str, session: Session, purpose: Purpose) -> Known {
    Known {
        name,
        place,
        session,
        purpose,
    }
}

/// What a sensor measures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// \[rad/s\]
    Gyro,
    /// \[m/s2\]
    Accelerometer,
    /// \[uT\]
    Magnetometer,
}

/// Three channels along the axes of b.
#[derive(Clone, Debug)]
pub struct Sensor {
    /// What it measures.
    pub kind: Kind,
    /// Its channels.
    pub names: [String; 3],
    /// \[s\] from a row's time to what it shows.
    pub slot_s: f64,
    /// \[m\] where it is in b.
    pub lever_b: Vector3<f64>,
    /// Its zero as described.
    pub bias: Vector3<f64>,
    /// How well the calibration knows zero, scale and axes \[rad\].
    pub sigmas: [f64; 3],
    /// A row each, as recorded.
    pub values: Vec<Vector3<f64>>,
}

/// What the reference says of a row.
#[derive(Clone, Copy, Debug, Default)]
pub struct Pose {
    /// Attitude; `None` where it lost sight.
    pub q_nb: Option<UnitQuaternion<f64>>,
    /// \[m\] place in n.
    pub place_n: Option<Vector3<f64>>,
}

/// A recording.
#[derive(Clone, Debug)]
pub struct Recording {
    /// As the answer names it.
    pub name: String,
    /// What it may be used for.
    pub purpose: Purpose,
    /// unit.toml.
    pub unit: String,
    /// case.toml.
    pub case: CaseText,
    /// Its sensors.
    pub sensors: Vec<Sensor>,
    /// \[s\] of each row.
    pub times_s: Vec<f64>,
    /// What the reference says of each row.
    pub record: Vec<Pose>,
}

/// Why there is no recording.
#[derive(Debug, thiserror::Error)]
pub enum RecordingError {
    /// None is there.
    #[error(
        "{folder}: no recording for {what} is there; it should have data/broad or practice (set EMEMS_DATA or give --recordings FOLDER)"
    )]
    None {
        /// Where it was looked for.
        folder: PathBuf,
        /// What for.
        what: &'static str,
    },
    /// A file cannot be read.
    #[error("{path}: {source}")]
    File {
        /// Which.
        path: PathBuf,
        /// Why.
        source: Box<dyn std::error::Error + Send + Sync>,
    },
    /// A file has not what is needed.
    #[error("{path}: {problem}")]
    Form {
        /// Which.
        path: PathBuf,
        /// What it lacks.
        problem: String,
    },
}

/// Recordings for a purpose, in the order of the list; on a folder without whole ones, minutes.
///
/// # Errors
/// When there are none, or one cannot be read.
pub fn all(folder: &Path, purpose: Purpose) -> Result<Vec<Recording>, RecordingError> {
    let read = |list: &[Known]| -> Result<Vec<Recording>, RecordingError> {
        let of_purpose = list.iter().filter(|known| known.purpose == purpose);
        of_purpose.filter_map(|known| read(folder, known).transpose()).collect()
    };
    let is_whole = ["data/broad", "broad"]
        .iter()
        .any(|place| fs::read_dir(folder.join(place)).is_ok_and(|files| files.count() > MINUTES.len()));
    let found = read(if is_whole { KNOWN } else { MINUTES })?;
    if found.is_empty() {
        return Err(RecordingError::None {
            folder: folder.into(),
            what: match purpose {
                Purpose::Tune => "tuning",
                Purpose::Judge => "judging",
            },
        });
    }
    Ok(found)
}

/// `None` where it is not there.
fn read(folder: &Path, known: &Known) -> Result<Option<Recording>, RecordingError> {
    match known.session {
        Session::Broad(calibrated) => {
            let files = ["data/broad", "broad"]
                .iter()
                .filter_map(|place| fs::read_dir(folder.join(place)).ok());
            let mut paths = files.flatten().filter_map(Result::ok).map(|entry| entry.path());
            let path = paths.find(|path| {
                path.file_name()
                    .is_some_and(|name| name.to_string_lossy().starts_with(known.place))
            });
            path.map(|path| of_broad(&path, known, &calibrated)).transpose()
        }
        Session::Own => {
            let case = folder.join(known.place);
            case.join("case.toml")
                .exists()
                .then(|| of_case(&case, known))
                .transpose()
        }
    }
}

/// A table: what its header says, and its rows; an empty cell is NaN.
fn table(path: &Path) -> Result<(Vec<String>, Vec<Vec<f64>>), RecordingError> {
    let failed = |source: Box<dyn std::error::Error + Send + Sync>| RecordingError::File {
        path: path.into(),
        source,
    };
    let text = packed::read(path, LARGEST).map_err(|source| failed(source.into()))?;
    let mut reader = csv::Reader::from_reader(text.as_slice());
    let header = reader.headers().map_err(|source| failed(source.into()))?;
    let header = header.iter().map(str::to_owned).collect();
    let mut rows = Vec::new();
    for row in reader.records() {
        let row = row.map_err(|source| failed(source.into()))?;
        let cells = row.iter().map(|cell| match cell.is_empty() {
            true => Ok(f64::NAN),
            false => cell.parse::<f64>().map_err(|_| RecordingError::Form {
                path: path.into(),
                problem: format!("row {}: {cell} is no number", rows.len() + 1),
            }),
        });
        rows.push(cells.collect::<Result<Vec<f64>, _>>()?);
    }
    Ok((header, rows))
}

/// Columns of a table by name; of some that are not there, `None`.
fn columns(header: &[String], names: &[&str]) -> Option<Vec<usize>> {
    let place = |name: &&str| header.iter().position(|own| own == *name);
    names.iter().map(place).collect()
}

fn vector(row: &[f64], places: &[usize]) -> Vector3<f64> {
    Vector3::from_fn(|axis, _| row[places[axis]])
}

fn attitude(row: &[f64], places: &[usize]) -> Option<UnitQuaternion<f64>> {
    let [w, x, y, z] = [0, 1, 2, 3].map(|at| row[places[at]]);
    UnitQuaternion::try_new(Quaternion::new(w, x, y, z), 0.5)
}

fn of_broad(path: &Path, known: &Known, calibrated: &Calibrated) -> Result<Recording, RecordingError> {
    let (header, rows) = table(path)?;
    let named = |names: &[&str]| {
        columns(&header, names).ok_or_else(|| RecordingError::Form {
            path: path.into(),
            problem: format!("has no columns {}", names.join(", ")),
        })
    };
    let unit = description::of_broad(calibrated);
    let times_s: Vec<f64> = rows.iter().map(|row| row[0]).collect();
    let channels = [
        ["gyr_x", "gyr_y", "gyr_z"],
        ["acc_x", "acc_y", "acc_z"],
        ["mag_x", "mag_y", "mag_z"],
    ];
    let mut sensors = sensors(path, &unit)?;
    for (sensor, names) in sensors.iter_mut().zip(channels) {
        let places = named(&names)?;
        sensor.values = rows.iter().map(|row| vector(row, &places)).collect();
    }
    let (turned, placed) = (named(&["q_w", "q_x", "q_y", "q_z"])?, named(&["p_x", "p_y", "p_z"])?);
    let to_n = UnitQuaternion::from_quaternion(Quaternion::new(0.0, 0.5f64.sqrt(), 0.5f64.sqrt(), 0.0));
    let record = rows.iter().map(|row| {
        let place = vector(row, &placed);
        Pose {
            q_nb: attitude(row, &turned).map(|q_eb| to_n * q_eb),
            place_n: place.x.is_finite().then(|| Vector3::new(place.y, place.x, -place.z)),
        }
    });
    let case = description::case_of_broad(calibrated.field_n_ut);
    finished(
        path,
        known,
        description::text(&unit),
        case,
        sensors,
        times_s.clone(),
        record.collect(),
    )
}

fn of_case(folder: &Path, known: &Known) -> Result<Recording, RecordingError> {
    fn text<T: serde::de::DeserializeOwned>(path: &Path) -> Result<(String, T), RecordingError> {
        let failed = |source: Box<dyn std::error::Error + Send + Sync>| RecordingError::File {
            path: path.into(),
            source,
        };
        let text = fs::read_to_string(path).map_err(|source| failed(source.into()))?;
        let parsed = toml::from_str(&text).map_err(|source| failed(source.into()))?;
        Ok((text, parsed))
    }
    let (_, case): (_, CaseText) = text(&folder.join("case.toml"))?;
    let path = folder.join(&case.unit);
    let (unit_text, unit): (_, UnitText) = text(&path)?;
    let mut sensors = sensors(&path, &unit)?;
    let path = folder.join(&case.measured);
    let (header, rows) = table(&path)?;
    for sensor in &mut sensors {
        let names = sensor.names.each_ref().map(String::as_str);
        let places = columns(&header, &names).ok_or_else(|| RecordingError::Form {
            path: path.clone(),
            problem: format!("has no columns {}", names.join(", ")),
        })?;
        sensor.values = rows.iter().map(|row| vector(row, &places)).collect();
    }
    let times_s: Vec<f64> = rows.iter().map(|row| row[0]).collect();
    let path = folder.join(&case.motion);
    let (header, rows) = table(&path)?;
    let Some(turned) = columns(&header, &["qw", "qx", "qy", "qz"]) else {
        return Err(RecordingError::Form {
            path,
            problem: "has no columns qw, qx, qy, qz".to_owned(),
        });
    };
    let is_same =
        rows.len() == times_s.len() && rows.iter().zip(&times_s).all(|(row, t_s)| (row[0] - t_s).abs() < 1e-6);
    if !is_same {
        return Err(RecordingError::Form {
            path,
            problem: "has other times than the measured rows: effects are injected row by row".to_owned(),
        });
    }
    let placed = columns(&header, &["px_m", "py_m", "pz_m"]);
    let record = rows.iter().map(|row| {
        let place = placed.as_ref().map(|placed| vector(row, placed));
        Pose {
            q_nb: attitude(row, &turned),
            place_n: place.filter(|place| place.x.is_finite()),
        }
    });
    finished(&path, known, unit_text, case, sensors, times_s, record.collect())
}

fn finished(
    path: &Path,
    known: &Known,
    unit: String,
    mut case: CaseText,
    sensors: Vec<Sensor>,
    times_s: Vec<f64>,
    record: Vec<Pose>,
) -> Result<Recording, RecordingError> {
    case.windows = description::alternating(&times_s);
    let recording = Recording {
        name: known.name.to_owned(),
        purpose: known.purpose,
        unit,
        case,
        sensors,
        times_s,
        record,
    };
    let step_s = recording.step_s();
    let is_even = (recording.times_s.windows(2)).all(|pair| ((pair[1] - pair[0]) / step_s - 1.0).abs() < 0.2);
    match recording.times_s.len() > 100 && is_even {
        true => Ok(recording),
        false => Err(RecordingError::Form {
            path: path.into(),
            problem: "is too short or has rows that are not evenly spaced".to_owned(),
        }),
    }
}

/// The triads of a unit, without values.
fn sensors(path: &Path, unit: &UnitText) -> Result<Vec<Sensor>, RecordingError> {
    let triads = unit.channel.chunks(3).map(|triad| {
        let [x, y, z] = triad else { return None };
        let kind = match x.sensor.as_str() {
            "gyro" => Kind::Gyro,
            "accelerometer" => Kind::Accelerometer,
            "magnetometer" => Kind::Magnetometer,
            _ => return None,
        };
        let along = |channel: &ChannelText, axis: usize| {
            channel.sensor == x.sensor && channel.axis_b == std::array::from_fn(|at| f64::from(u8::from(at == axis)))
        };
        (along(x, 0) && along(y, 1) && along(z, 2)).then(|| Sensor {
            kind,
            names: [x, y, z].map(|channel| channel.name.clone()),
            slot_s: x.slot_s,
            lever_b: Vector3::from(x.lever_m),
            bias: Vector3::new(x.bias, y.bias, z.bias),
            sigmas: [x.bias_sigma, x.scale_sigma, x.axis_sigma_rad],
            values: Vec::new(),
        })
    });
    triads.collect::<Option<_>>().ok_or_else(|| RecordingError::Form {
        path: path.into(),
        problem: "channels are not threes of one kind along x, y, z of b".to_owned(),
    })
}

impl Recording {
    /// \[s\] between rows.
    pub fn step_s(&self) -> f64 {
        let (first, last) = (
            self.times_s.first().copied().unwrap_or(0.0),
            self.times_s.last().copied().unwrap_or(1.0),
        );
        (last - first) / (self.times_s.len().max(2) - 1) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_recording_tunes_and_judges() {
        for list in [KNOWN, MINUTES] {
            for (at, one) in list.iter().enumerate() {
                assert!(
                    list.iter().skip(at + 1).all(|other| other.place != one.place),
                    "{}",
                    one.name
                );
            }
            for purpose in [Purpose::Tune, Purpose::Judge] {
                assert!(list.iter().any(|known| known.purpose == purpose));
            }
        }
    }

    #[test]
    fn a_recording_and_a_case_of_it_say_the_same_of_the_same_room() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../data");
        let [tune, judge] = [Purpose::Tune, Purpose::Judge].map(|purpose| all(&folder, purpose).expect("a minute"));
        for recording in [&tune[0], &judge[0]] {
            assert_eq!(recording.sensors.len(), 3, "{}", recording.name);
            let (force, field) = (&recording.sensors[1], &recording.sensors[2]);
            // The means in n over a minute of turning: gravity's reaction is up, the field points north and down.
            let mean = |sensor: &Sensor| {
                let turned: Vec<Vector3<f64>> = (sensor.values.iter().zip(&recording.record))
                    .filter_map(|(value, pose)| Some(pose.q_nb? * value))
                    .collect();
                turned.iter().sum::<Vector3<f64>>() / turned.len() as f64
            };
            let claimed = Vector3::from(recording.case.environment.field_n_ut.expect("a field"));
            assert!((mean(force) + Vector3::z() * 9.8127).norm() < 0.3, "{}", mean(force));
            assert!((mean(field) - claimed).norm() < 3.0, "{} {claimed}", mean(field));
        }
    }
}
