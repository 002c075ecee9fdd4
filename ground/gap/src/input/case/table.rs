//! A table of steady positions: what was commanded in each, and what every channel put out.
//!
//! In: `table.csv`, one row a position: `seq`, the commanded truth in b (`wx_rad_s` .. `fz_m_s2`; what does not apply is
//! absent), then for each channel its mean \[counts\], and optionally `NAME_sigma` and `NAME_n`. Out: [`Table`].
//!
//! `NAME_sigma` is the spread of the samples, not of their mean, and how many there were is often not said: it is checked
//! and not used. The command is taken for the inertial truth; an Earth rate that matters must be in it.
//!
//! Refuses, naming file and line or column: a channel without a column, a column that is none of these, a command the
//! unit's sensors need and the table lacks, cells that are no number, sequence numbers that do not rise, too many rows.

use std::path::Path;

use nalgebra::Vector3;
use twin::predict::{Channel, Kind};

use super::{CaseError, read_bytes};

/// Positions of a table: more than any campaign by hand, few enough to try every four of them.
const MOST_ROWS: usize = 1000;

const RATE: [&str; 3] = ["wx_rad_s", "wy_rad_s", "wz_rad_s"];
const FORCE: [&str; 3] = ["fx_m_s2", "fy_m_s2", "fz_m_s2"];

/// One position.
#[derive(Clone, Debug, PartialEq)]
pub struct Position {
    /// Its number.
    pub seq: f64,
    /// [rad/s] commanded inertial rate, in b.
    pub rate_b: Vector3<f64>,
    /// [m/s2] commanded specific force, in b.
    pub force_b: Vector3<f64>,
    /// Means in the unit's channel order, physical units; `None` for an empty cell.
    pub values: Vec<Option<f64>>,
}

/// Reads a table for these channels.
///
/// # Errors
/// When it cannot be read or does not fit the unit.
pub fn read_table(file: &Path, channels: &[Channel]) -> Result<Vec<Position>, CaseError> {
    let bytes = read_bytes(file)?;
    let mut reader = csv::Reader::from_reader(bytes.as_slice());
    let malformed = |error: csv::Error| CaseError::key(file, "rows", error.to_string());
    let header = reader.headers().map_err(malformed)?.clone();
    let place_of = |name: &str| header.iter().position(|cell| cell == name);
    let required = |name: &str, problem: &str| place_of(name).ok_or_else(|| CaseError::key(file, name, problem));
    let seq = required("seq", "is absent; it numbers the positions")?;
    let values = channels
        .iter()
        .map(|channel| required(&channel.name, "is a channel of the unit without a column"))
        .collect::<Result<Vec<usize>, CaseError>>()?;
    for (sensor, names) in [(Kind::Gyro, RATE), (Kind::Accelerometer, FORCE)] {
        let is_needed = channels.iter().any(|channel| channel.sensor == sensor);
        if is_needed && names.iter().all(|name| place_of(name).is_none()) {
            return Err(CaseError::key(
                file,
                names[0],
                "is absent; the unit's sensors need the command",
            ));
        }
    }
    if let Some(channel) = channels.iter().find(|channel| channel.sensor == Kind::Magnetometer) {
        return Err(CaseError::key(
            file,
            &channel.name,
            "is a magnetometer; a table commands rate and force",
        ));
    }
    let is_known = |name: &str| {
        let own = |channel: &Channel| {
            let rest = name.strip_prefix(channel.name.as_str());
            rest.is_some_and(|rest| ["", "_sigma", "_n"].contains(&rest))
        };
        name == "seq" || RATE.contains(&name) || FORCE.contains(&name) || channels.iter().any(own)
    };
    if let Some(stranger) = header.iter().find(|name| !is_known(name)) {
        return Err(CaseError::key(file, stranger, "is a column the unit does not describe"));
    }
    let mut positions: Vec<Position> = Vec::new();
    let mut record = csv::StringRecord::new();
    while reader.read_record(&mut record).map_err(malformed)? {
        let line = || format!("line {}", record.position().map_or(0, csv::Position::line));
        let number = |place: usize| -> Result<Option<f64>, CaseError> {
            let cell = record.get(place).unwrap_or_default().trim();
            let value = cell.parse::<f64>().ok().filter(|value| value.is_finite());
            if value.is_none() && !cell.is_empty() {
                let name = header.get(place).unwrap_or_default();
                return Err(CaseError::key(
                    file,
                    line(),
                    format!("{name} is {cell:?}, not a finite number"),
                ));
            }
            Ok(value)
        };
        let command = |names: [&str; 3]| -> Result<Vector3<f64>, CaseError> {
            let mut vector = Vector3::zeros();
            for (axis, name) in names.into_iter().enumerate() {
                if let Some(place) = place_of(name) {
                    let value = number(place)?;
                    vector[axis] = value.ok_or_else(|| CaseError::key(file, line(), format!("{name} is empty")))?;
                }
            }
            Ok(vector)
        };
        for place in 0..header.len() {
            number(place)?;
        }
        let seq = number(seq)?.ok_or_else(|| CaseError::key(file, line(), "seq is empty"))?;
        if positions.last().is_some_and(|last| seq <= last.seq) {
            return Err(CaseError::key(
                file,
                line(),
                format!("seq {seq} does not come after the line before"),
            ));
        }
        if positions.len() == MOST_ROWS {
            return Err(CaseError::key(
                file,
                line(),
                format!("is beyond the {MOST_ROWS} positions a table may have"),
            ));
        }
        let physical = |(place, channel): (&usize, &Channel)| Ok(number(*place)?.map(|mean| mean * channel.lsb));
        positions.push(Position {
            seq,
            rate_b: command(RATE)?,
            force_b: command(FORCE)?,
            values: values
                .iter()
                .zip(channels)
                .map(physical)
                .collect::<Result<_, CaseError>>()?,
        });
    }
    Ok(positions)
}
