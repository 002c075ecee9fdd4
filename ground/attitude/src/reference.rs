//! A reference attitude: what something better than the unit saw.
//!
//! In: CSV, plain or gzipped, by its header: `t_s,qw,qx,qy,qz`, body to north-east-down, as `motion.csv` of a gap case has
//! it; or `q_w,q_x,q_y,q_z`, sensor to east-north-up, with the nine axes of a recording. Out: rows with an attitude each,
//! their times moved onto the log's clock. Refuses what is neither, with the columns it looked for, and quaternions that
//! are far from norm one.

use std::{
    io::{BufRead, Read},
    path::Path,
};

use logs::recording::{self, RecordingError, Row};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};

const COLUMNS: [&str; 5] = ["t_s", "qw", "qx", "qy", "qz"];

/// How far a quaternion's norm may be from one: printed with two digits it is this far.
const NORM: f64 = 0.02;

/// Reads a file, its times later by `offset_s` \[s\].
pub fn read(path: &Path, offset_s: f64) -> Result<Vec<Row>, RecordingError> {
    let file = path.display().to_string();
    let mut text = String::new();
    let io = |error| RecordingError::Io {
        file: file.clone(),
        error,
    };
    let read = packets::input::open(path).and_then(|mut bytes| bytes.read_to_string(&mut text));
    read.map_err(io)?;
    let header = text.lines().next().unwrap_or_default();
    let own = header.split(',').any(|name| name.trim() == COLUMNS[1]);
    let mut rows = if own {
        parse(&file, text.as_bytes())?
    } else {
        recording::parse(&file, text.as_bytes())?
    };
    for row in &mut rows {
        row.t_s += offset_s;
    }
    Ok(rows)
}

/// Reads rows of `t_s,qw,qx,qy,qz`; other columns are passed over.
fn parse(file: &str, lines: impl BufRead) -> Result<Vec<Row>, RecordingError> {
    let named = || file.to_string();
    let mut rows: Vec<Row> = Vec::new();
    let mut places = [0; 5];
    for (index, line) in lines.lines().enumerate() {
        let line = line.map_err(|error| RecordingError::Io { file: named(), error })?;
        let cells: Vec<&str> = line.trim_end().split(',').map(str::trim).collect();
        if index == 0 {
            for (place, column) in places.iter_mut().zip(COLUMNS) {
                let found = cells.iter().position(|name| *name == column);
                *place = found.ok_or_else(|| RecordingError::Column {
                    file: named(),
                    column,
                    found: cells.join(", "),
                })?;
            }
            continue;
        }
        let cell = |k: usize| cells.get(places[k]).copied().unwrap_or_default();
        if (1..5).all(|k| cell(k).is_empty()) {
            continue;
        }
        let refused = |k: usize| RecordingError::Cell {
            file: named(),
            line: index + 1,
            column: COLUMNS[k],
            cell: cell(k).to_string(),
        };
        let mut parts = [0.0; 5];
        for (k, part) in parts.iter_mut().enumerate() {
            let value: f64 = cell(k).parse().map_err(|_| refused(k))?;
            *part = Some(value)
                .filter(|value| value.is_finite())
                .ok_or_else(|| refused(k))?;
        }
        let [t_s, w, x, y, z] = parts;
        let q = Quaternion::new(w, x, y, z);
        if (q.norm() - 1.0).abs() > NORM {
            return Err(refused(1));
        }
        if let Some(before) = rows.last().filter(|before| t_s <= before.t_s) {
            return Err(RecordingError::Time {
                file: named(),
                line: index + 1,
                t_s,
                before_s: before.t_s,
            });
        }
        rows.push(Row {
            t_s,
            rate_b: Vector3::zeros(),
            acc_b: None,
            mag_b: None,
            reference_nb: Some(UnitQuaternion::new_normalize(q)),
            scored: true,
        });
    }
    if rows.is_empty() {
        return Err(RecordingError::Empty { file: named() });
    }
    Ok(rows)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn attitudes_come_with_their_times_and_gaps_are_passed_over() {
        let rows = parse(
            "motion.csv",
            "t_s,px_m,qw,qx,qy,qz\n0,9,1,0,0,0\n1,9,,,,\n2,9,0,0,0,1\n".as_bytes(),
        );
        let rows = rows.expect("a reference");
        assert_eq!((rows.len(), rows[1].t_s), (2, 2.0));
        let half_turn = rows[1].reference_nb.expect("an attitude");
        assert!((half_turn * Vector3::x() + Vector3::x()).norm() < 1e-12);
    }

    #[test]
    fn what_is_no_attitude_is_named() {
        let refused = |text: &str| parse("motion.csv", text.as_bytes()).expect_err("none").to_string();
        assert!(refused("t_s,qw,qx,qy\n").contains("\"qz\""));
        assert!(refused("t_s,qw,qx,qy,qz\n0,5,0,0,0\n").contains("line 2"));
        assert!(refused("t_s,qw,qx,qy,qz\n0,1,0,0,NaN\n").contains("\"qz\""));
        assert!(refused("t_s,qw,qx,qy,qz\n1,1,0,0,0\n1,1,0,0,0\n").contains("not later"));
        assert!(refused("t_s,qw,qx,qy,qz\n").contains("fewer"));
    }
}
