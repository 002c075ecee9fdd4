//! A nine-axis recording: rates, specific force, field, and the attitude that something better saw.
//!
//! In: CSV, gzip or plain, one row a sample, columns found by name: `t_s`, `gyr_x`.. \[rad/s\], `acc_x`.. \[m/s2\],
//! `mag_x`.. \[uT\] in the sensor's axes, and if there is a reference `q_w`.. (Hamilton, scalar first, sensor to
//! east-north-up) and `movement` (1 where errors count). Out: rows in the axes of frame b, the reference as `q_nb`.
//!
//! Empty cells of the reference mean that it was not seen; of a sensor, that it was not read. Refuses files without the
//! sensors' columns, cells that are no finite number, and time that does not go forward, each with its line and column.

use std::{
    io::{BufRead, BufReader},
    path::Path,
};

use nalgebra::{Quaternion, UnitQuaternion, Vector3};

/// One sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row {
    /// \[s\] since the recording's zero.
    pub t_s: f64,
    /// [rad/s] in b.
    pub rate_b: Vector3<f64>,
    /// [m/s2] specific force in b, if it was read.
    pub acc_b: Option<Vector3<f64>>,
    /// \[uT\] in b, if it was read.
    pub mag_b: Option<Vector3<f64>>,
    /// The reference, b to n.
    pub reference_nb: Option<UnitQuaternion<f64>>,
    /// Errors count here.
    pub scored: bool,
}

/// Why a file is no recording.
#[derive(Debug, thiserror::Error)]
pub enum RecordingError {
    /// It cannot be read.
    #[error("{file}: {error}; is it a CSV file, or a gzipped one that ends in .gz?")]
    Io {
        /// Which.
        file: String,
        /// Why.
        error: std::io::Error,
    },
    /// A column is missing.
    #[error("{file}: no column {column:?}; there are {found}")]
    Column {
        /// Which file.
        file: String,
        /// What was looked for.
        column: &'static str,
        /// What is there.
        found: String,
    },
    /// Channels of the unit, converted.
    #[error(
        "{file}: no column \"counter\", so these are the unit's channels in SI; the filter runs on what the unit sent: packets.txt or counts.csv of the same flight"
    )]
    Converted {
        /// Which file.
        file: String,
    },
    /// A cell is no number.
    #[error("{file}, line {line}, column {column:?}: {cell:?} is no finite number")]
    Cell {
        /// Which file.
        file: String,
        /// Counted from 1, the header's.
        line: usize,
        /// Name of the column.
        column: &'static str,
        /// What stands there.
        cell: String,
    },
    /// Time does not go forward.
    #[error("{file}, line {line}: {t_s} s is not later than the {before_s} s before it; sort the rows by time")]
    Time {
        /// Which file.
        file: String,
        /// Counted from 1.
        line: usize,
        /// There.
        t_s: f64,
        /// In the row before.
        before_s: f64,
    },
    /// There is nothing in it.
    #[error("{file}: fewer than two rows")]
    Empty {
        /// Which file.
        file: String,
    },
}

const SENSORS: [&str; 10] = [
    "t_s", "gyr_x", "gyr_y", "gyr_z", "acc_x", "acc_y", "acc_z", "mag_x", "mag_y", "mag_z",
];
const REFERENCE: [&str; 4] = ["q_w", "q_x", "q_y", "q_z"];

/// Reads a file.
pub fn read(path: &Path) -> Result<Vec<Row>, RecordingError> {
    let file = path.display().to_string();
    let io = |error| RecordingError::Io {
        file: file.clone(),
        error,
    };
    parse(&file, BufReader::new(packets::input::open(path).map_err(io)?))
}

/// Reads rows; `file` is what errors call them.
pub fn parse(file: &str, lines: impl BufRead) -> Result<Vec<Row>, RecordingError> {
    let named = || file.to_string();
    let mut lines = lines.lines();
    let header = lines
        .next()
        .transpose()
        .map_err(|error| RecordingError::Io { file: named(), error })?;
    let header = header.ok_or_else(|| RecordingError::Empty { file: named() })?;
    let names: Vec<&str> = header.trim_end().split(',').map(str::trim).collect();
    let place = |column: &'static str| names.iter().position(|name| *name == column);
    let mut sensors = [0; 10];
    for (at, column) in sensors.iter_mut().zip(SENSORS) {
        *at = place(column).ok_or_else(|| RecordingError::Column {
            file: named(),
            column,
            found: names.join(", "),
        })?;
    }
    let reference = REFERENCE.map(place);
    let movement = place("movement");
    let mut rows: Vec<Row> = Vec::new();
    for (index, line) in lines.enumerate() {
        let line_number = index + 2;
        let line = line.map_err(|error| RecordingError::Io { file: named(), error })?;
        if line.trim().is_empty() {
            continue;
        }
        let cells: Vec<&str> = line.trim_end().split(',').map(str::trim).collect();
        let number = |at: usize, column: &'static str| -> Result<Option<f64>, RecordingError> {
            let cell = cells.get(at).copied().unwrap_or_default();
            if cell.is_empty() {
                return Ok(None);
            }
            let value = cell.parse().ok().filter(|value: &f64| value.is_finite());
            value.map(Some).ok_or_else(|| RecordingError::Cell {
                file: named(),
                line: line_number,
                column,
                cell: cell.to_string(),
            })
        };
        let needed = |k: usize| {
            number(sensors[k], SENSORS[k])?.ok_or_else(|| RecordingError::Cell {
                file: named(),
                line: line_number,
                column: SENSORS[k],
                cell: String::new(),
            })
        };
        let vector = |first: usize| -> Result<Option<Vector3<f64>>, RecordingError> {
            let mut found = [None; 3];
            for (axis, value) in found.iter_mut().enumerate() {
                *value = number(sensors[first + axis], SENSORS[first + axis])?;
            }
            Ok(match found {
                [Some(x), Some(y), Some(z)] => Some(Vector3::new(x, y, z)),
                _ => None,
            })
        };
        let mut parts = [None; 4];
        for ((part, at), column) in parts.iter_mut().zip(reference).zip(REFERENCE) {
            *part = at.map(|at| number(at, column)).transpose()?.flatten();
        }
        let row = Row {
            t_s: needed(0)?,
            rate_b: Vector3::new(needed(1)?, needed(2)?, needed(3)?),
            acc_b: vector(4)?,
            mag_b: vector(7)?,
            reference_nb: match parts {
                [Some(w), Some(x), Some(y), Some(z)] => from_east_north_up(Quaternion::new(w, x, y, z)),
                _ => None,
            },
            scored: movement
                .map(|at| number(at, "movement"))
                .transpose()?
                .flatten()
                .is_none_or(|flag| flag > 0.0),
        };
        if let Some(before) = rows.last()
            && row.t_s <= before.t_s
        {
            return Err(RecordingError::Time {
                file: named(),
                line: line_number,
                t_s: row.t_s,
                before_s: before.t_s,
            });
        }
        rows.push(row);
    }
    if rows.len() < 2 {
        return Err(RecordingError::Empty { file: named() });
    }
    Ok(rows)
}

/// The attitude that rows have at `t_s`: between two of them that are at most `most_s` \[s\] from it, or at the one that is
/// within half of that. `None` where they have none or do not count.
pub fn attitude_at(rows: &[Row], t_s: f64, most_s: f64) -> Option<UnitQuaternion<f64>> {
    let near = |row: &&Row| row.scored && (row.t_s - t_s).abs() <= most_s;
    let after_at = rows.partition_point(|row| row.t_s < t_s);
    let after = rows.get(after_at).filter(near);
    let before = after_at.checked_sub(1).map(|at| &rows[at]).filter(near);
    let single = |row: &Row| row.reference_nb.filter(|_| (row.t_s - t_s).abs() <= most_s / 2.0);
    match (before, after) {
        (Some(before), Some(after)) => match (before.reference_nb, after.reference_nb) {
            (Some(q_before), Some(q_after)) => {
                let part = (t_s - before.t_s) / (after.t_s - before.t_s);
                // Opposite attitudes have no shortest way between them.
                q_before.try_slerp(&q_after, part, 1e-9)
            }
            _ => single(before).or_else(|| single(after)),
        },
        (Some(row), None) | (None, Some(row)) => single(row),
        (None, None) => None,
    }
}

/// A reference to east-north-up as one to north-east-down; `None` for one that is no rotation.
fn from_east_north_up(q_ub: Quaternion<f64>) -> Option<UnitQuaternion<f64>> {
    // Half a turn about the bisector of north and east swaps them and turns up down.
    let q_nu = Quaternion::new(
        0.0,
        std::f64::consts::FRAC_1_SQRT_2,
        std::f64::consts::FRAC_1_SQRT_2,
        0.0,
    );
    // A norm beyond the largest number would leave nothing of the quaternion.
    Some(q_nu * q_ub)
        .filter(|q_nb| (0.5..2.0).contains(&q_nb.norm()))
        .map(UnitQuaternion::new_normalize)
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEADER: &str = "t_s,gyr_x,gyr_y,gyr_z,acc_x,acc_y,acc_z,mag_x,mag_y,mag_z,q_w,q_x,q_y,q_z,movement\n";

    fn parsed(rows: &str) -> Result<Vec<Row>, RecordingError> {
        parse("log.csv", format!("{HEADER}{rows}").as_bytes())
    }

    fn refused(rows: &str, text: &str) {
        let error = parsed(rows).expect_err("a recording it is not").to_string();
        assert!(error.contains(text), "{error}");
    }

    #[test]
    fn empty_cells_are_samples_that_were_not_read() {
        let rows = parsed("0,1,2,3,,,,7,8,9,,,,,0\n0.1,1,2,3,4,5,6,,8,9,1,0,0,0,1\n").expect("rows");
        assert_eq!(
            (rows[0].acc_b, rows[0].mag_b),
            (None, Some(Vector3::new(7.0, 8.0, 9.0)))
        );
        assert_eq!((rows[1].mag_b, rows[0].reference_nb), (None, None));
        assert_eq!((rows[0].scored, rows[1].scored), (false, true));
    }

    #[test]
    fn a_reference_of_another_rate_is_read_between_its_rows_and_nowhere_else() {
        let row = |t_s: f64, yaw: f64| Row {
            t_s,
            rate_b: Vector3::zeros(),
            acc_b: None,
            mag_b: None,
            reference_nb: Some(UnitQuaternion::from_euler_angles(0.0, 0.0, yaw)),
            scored: t_s < 2.5,
        };
        let rows = [row(1.0, 0.0), row(2.0, 0.4), row(3.0, 0.8)];
        let yaw = |t_s: f64, most_s: f64| attitude_at(&rows, t_s, most_s).map(|q| q.euler_angles().2);
        assert!((yaw(1.25, 1.0).expect("between") - 0.1).abs() < 1e-12);
        assert_eq!(yaw(1.5, 0.2), None);
        assert!((yaw(0.95, 0.2).expect("near the first")).abs() < 1e-12);
        assert_eq!(
            (yaw(0.5, 0.6), yaw(2.9, 0.5)),
            (None, None),
            "before it begins, and where it does not count"
        );
    }

    #[test]
    fn the_reference_is_turned_to_north_east_down() {
        let rows = parsed("0,1,2,3,4,5,6,7,8,9,1,0,0,0,1\n1,1,2,3,4,5,6,7,8,9,1,0,0,0,1\n").expect("rows");
        let q_nb = rows[0].reference_nb.expect("a reference");
        assert!((q_nb * Vector3::x() - Vector3::y()).norm() < 1e-12, "east");
        assert!((q_nb * Vector3::z() + Vector3::z()).norm() < 1e-12, "up");
    }

    #[test]
    fn what_is_wrong_is_named_by_line_and_column() {
        refused(
            "0,1,2,3,4,5,6,7,8,9,,,,,\n1,1,x,3,4,5,6,7,8,9,,,,,\n",
            "line 3, column \"gyr_y\"",
        );
        refused("0,1,NaN,3,4,5,6,7,8,9,,,,,\n", "no finite number");
        refused("1,1,2,3,4,5,6,7,8,9,,,,,\n1,1,2,3,4,5,6,7,8,9,,,,,\n", "not later");
        refused("0,,2,3,4,5,6,7,8,9,,,,,\n", "gyr_x");
        refused("", "fewer than two rows");
        let error = parse("log.csv", "t_s,gx\n".as_bytes())
            .expect_err("no columns")
            .to_string();
        assert!(error.contains("gyr_x") && error.contains("t_s, gx"), "{error}");
    }
}
