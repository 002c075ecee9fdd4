//! A campaign on the table: what the unit was made to feel, row by row, and what its channels put out.
//!
//! In: a table with one row a position or run. Its excitation stands in the row as components in b
//! (`wx_rad_s wy_rad_s wz_rad_s` or `wx_deg_s ..` for gyros, `fx_m_s2 fy_m_s2 fz_m_s2` or `fx_g ..` for accelerometers), as
//! table angles (`inner_deg outer_deg`, for gyros with `turning` (inner or outer) and `rate_deg_s`), or as both, which are
//! then held against each other. `temperature_c` and a label in `seq` are optional. Every other column with a
//! `NAME_sigma` or `NAME_n` beside it is a channel, or those named by the caller. Out: an [`Experiment`].
//!
//! Left out, and said: cells that are empty, and cells at the limit of the channel's code. Refused, with file, line and
//! column: half an excitation or one in two units, channels that never change, negative sigmas, and excitations that can hardly
//! be in the unit of their columns' name (specific force at rest far from one g, rates that no gyro measures).

use std::path::PathBuf;

use logs::units::Units;
use nalgebra::Vector3;
use packets::magnitude;

use crate::{
    table::{Row, Table, TableError},
    turntable::{Mount, Pose, Site, Turning},
};

/// What excites the channels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Excitation {
    /// Gyros, excited by rate [rad/s].
    Rate,
    /// Accelerometers, excited by specific force [m/s2].
    Force,
}

impl Excitation {
    /// As a kind of number.
    pub fn magnitude(self) -> magnitude::Kind {
        match self {
            Excitation::Rate => magnitude::Kind::Rate,
            Excitation::Force => magnitude::Kind::Force,
        }
    }
}

/// One position or run.
#[derive(Clone, Debug, PartialEq)]
pub struct Trial {
    /// Its label: column `seq`, or its number.
    pub label: String,
    /// Its line in the file; 0 if it came from a raw log.
    pub line: usize,
    /// Excitation written in the row.
    pub claimed_b: Option<Vector3<f64>>,
    /// Table angles, and the axis that turned.
    pub pose: Option<(Pose, Option<Turning>)>,
    /// Excitation in b that is used: of the angles if there are any, else as claimed.
    pub excitation_b: Vector3<f64>,
    /// Temperature \[degC\]; `NaN` if nobody measured it.
    pub temperature_c: f64,
    /// Mean output of each channel \[counts\]; `None` where it was not read.
    pub values: Vec<Option<f64>>,
    /// Their sigmas as the table states them (`NAME_sigma`).
    pub stated: Vec<Option<f64>>,
}

/// A campaign.
#[derive(Clone, Debug, PartialEq)]
pub struct Experiment {
    /// Where it came from.
    pub file: PathBuf,
    /// What excites the channels.
    pub kind: Excitation,
    /// Names of the channels.
    pub channels: Vec<String>,
    /// Its rows.
    pub trials: Vec<Trial>,
    /// Unit that its excitation was read in; `None` where it came from angles.
    pub declared: Option<Declared>,
    /// What was left out of it, and why.
    pub remarks: Vec<String>,
}

/// How to read a table.
#[derive(Clone)]
pub struct Layout<'a> {
    /// What excites the channels.
    pub kind: Excitation,
    /// How the unit sat on the table.
    pub mount: Mount,
    /// Where the table stands.
    pub site: Site,
    /// Channels; empty for all columns with a sigma or a count beside them, or else those that the unit has.
    pub channels: &'a [String],
    /// Whether the unit has a channel of this name that the excitation excites.
    pub has: &'a dyn Fn(&str) -> bool,
    /// Units that were told, whatever the columns' names say.
    pub units: Units,
    /// Code limit of each channel \[counts\]: beyond it, or at it, the sensor saturates.
    pub limit: &'a dyn Fn(&str) -> f64,
}

/// A kind of number and the unit it is declared to be in.
pub type Declared = (magnitude::Kind, magnitude::Unit);

/// Row number and row to the value of every channel.
pub type Outputs<'a> = dyn Fn(usize, &Row) -> Result<Vec<Option<f64>>, TableError> + 'a;

impl Experiment {
    /// Reads a table that holds both excitations and outputs.
    ///
    /// # Errors
    /// When its meaning is not certain.
    pub fn read(table: &Table, layout: &Layout) -> Result<Self, TableError> {
        let columns = channels(table, layout)?;
        let names: Vec<String> = columns.iter().map(|&column| table.columns[column].clone()).collect();
        let outputs = |_: usize, row: &Row| columns.iter().map(|&column| table.number(row, column)).collect();
        let experiment = Self::assemble(table, layout, names, &outputs)?;
        for (k, &column) in columns.iter().enumerate() {
            let mut values = experiment.trials.iter().filter_map(|trial| trial.values[k]);
            let first = values.next();
            if values.clone().next().is_some() && values.all(|value| Some(value) == first) {
                let why = "never changes: is the channel connected, is the column the right one?";
                return Err(table.error(0, column, why));
            }
        }
        Ok(experiment)
    }

    /// Excitations from a table, outputs from elsewhere: row number and row to the value of every named channel.
    ///
    /// # Errors
    /// When the table's meaning is not certain.
    pub fn assemble(
        table: &Table,
        layout: &Layout,
        channels: Vec<String>,
        outputs: &Outputs,
    ) -> Result<Self, TableError> {
        let source = Source::of(table, layout.kind, &layout.units)?;
        source.judge(table, layout)?;
        let sigmas: Vec<Option<usize>> = (channels.iter())
            .map(|name| table.column(&format!("{name}_sigma")))
            .collect();
        let mut remarks = Vec::new();
        let mut trials = Vec::new();
        for (number, row) in table.rows.iter().enumerate() {
            let mut values = outputs(number, row)?;
            for (value, name) in values.iter_mut().zip(&channels) {
                let why = match *value {
                    None => "no value (empty or NaN), left out".to_string(),
                    Some(code) if code.abs() >= (layout.limit)(name) => {
                        format!("{code} is at the end of its range, left out")
                    }
                    Some(_) => continue,
                };
                remarks.push(format!("line {}, {name}: {why}", row.line));
                *value = None;
            }
            let (claimed_b, pose, rate_rad_s) = source.of_row(table, row)?;
            let of_angles = pose.map(|(pose, turning)| match turning {
                Some(turning) => layout.mount.rate_b(pose, turning, rate_rad_s, &layout.site),
                None => layout.mount.force_b(pose, &layout.site, [0.0; 2]),
            });
            let seq = table.column("seq").and_then(|column| row.cells.get(column)).cloned();
            let temperature = table
                .column("temperature_c")
                .map(|column| table.number(row, column))
                .transpose()?;
            trials.push(Trial {
                label: seq
                    .filter(|seq| !seq.is_empty())
                    .unwrap_or_else(|| (number + 1).to_string()),
                line: row.line,
                claimed_b,
                pose,
                // A source has components or angles, so there is one.
                excitation_b: of_angles.or(claimed_b).unwrap_or_default(),
                temperature_c: temperature.flatten().unwrap_or(f64::NAN),
                stated: stated(table, row, &sigmas)?,
                values,
            });
        }
        Ok(Experiment {
            file: table.file.clone(),
            kind: layout.kind,
            channels,
            trials,
            declared: source.components.map(|(_, declared)| declared),
            remarks,
        })
    }
}

fn stated(table: &Table, row: &Row, sigmas: &[Option<usize>]) -> Result<Vec<Option<f64>>, TableError> {
    let of = |column: &Option<usize>| {
        let Some(column) = *column else { return Ok(None) };
        match table.number(row, column)? {
            Some(sigma) if sigma < 0.0 => Err(table.error(row.line, column, "a sigma is not negative")),
            sigma => Ok(sigma),
        }
    };
    sigmas.iter().map(of).collect()
}

fn channels(table: &Table, layout: &Layout) -> Result<Vec<usize>, TableError> {
    let asked = layout.channels;
    let beside = |name: &str| {
        let has = |end: &str| table.column(&format!("{name}{end}")).is_some();
        has("_sigma") || has("_n")
    };
    let those = |is_channel: &dyn Fn(&str) -> bool| -> Vec<usize> {
        let names = table.columns.iter().enumerate();
        names.filter(|(_, name)| is_channel(name)).map(|(k, _)| k).collect()
    };
    let found = match those(&beside) {
        _ if !asked.is_empty() => asked.iter().map(|name| table.column(name)).collect(),
        found if found.is_empty() => Some(those(layout.has)),
        found => Some(found),
    };
    found.filter(|found| !found.is_empty()).ok_or_else(|| TableError {
        file: table.file.clone(),
        line: 0,
        column: String::new(),
        why: format!(
            "which columns are channels? Name them with --channels, or the unit that has them with --unit; the file has {}",
            table.columns.join(", ")
        ),
    })
}

/// Columns that hold the excitation.
struct Source {
    components: Option<([usize; 3], Declared)>,
    angles: Option<[usize; 2]>,
    run: Option<[usize; 2]>,
}

/// Excitation as claimed, pose and turning axis, rate.
type Excited = (Option<Vector3<f64>>, Option<(Pose, Option<Turning>)>, f64);

impl Source {
    fn of(table: &Table, kind: Excitation, told: &Units) -> Result<Self, TableError> {
        let triple =
            |unit: &str, letter: char| ["x", "y", "z"].map(|axis| table.column(&format!("{letter}{axis}_{unit}")));
        let of = kind.magnitude();
        let units: Vec<(&str, magnitude::Unit)> = match kind {
            Excitation::Rate => vec!["rad_s", "deg_s"],
            Excitation::Force => vec!["m_s2", "g"],
        }
        .into_iter()
        .zip(of.units().iter().copied())
        .collect();
        let letter = if kind == Excitation::Rate { 'w' } else { 'f' };
        let missing = |why: String| TableError {
            file: table.file.clone(),
            line: 0,
            column: String::new(),
            why,
        };
        let mut components = None;
        for &(unit, named) in &units {
            match triple(unit, letter) {
                [Some(_), Some(_), Some(_)] if components.is_some() => {
                    return Err(missing(
                        "says what the unit felt in two units: keep the columns of one".into(),
                    ));
                }
                [Some(x), Some(y), Some(z)] => {
                    components = Some(([x, y, z], (of, told.told(of).unwrap_or(named))));
                }
                [None, None, None] => {}
                _ => {
                    return Err(missing(format!(
                        "has not all of {letter}x_{unit}, {letter}y_{unit}, {letter}z_{unit}"
                    )));
                }
            }
        }
        let pair = |a: &str, b: &str| Some([table.column(a)?, table.column(b)?]);
        let (angles, run) = (pair("inner_deg", "outer_deg"), pair("turning", "rate_deg_s"));
        if components.is_none() && (angles.is_none() || kind == Excitation::Rate && run.is_none()) {
            let wanted = match kind {
                Excitation::Rate => "wx_rad_s, wy_rad_s, wz_rad_s or inner_deg, outer_deg, turning, rate_deg_s",
                Excitation::Force => "fx_m_s2, fy_m_s2, fz_m_s2 or inner_deg, outer_deg",
            };
            return Err(missing(format!(
                "does not say what the unit felt: it needs columns {wanted}"
            )));
        }
        let angles = if kind == Excitation::Rate && run.is_none() {
            None
        } else {
            angles
        };
        Ok(Source {
            components,
            angles,
            run: if kind == Excitation::Rate { run } else { None },
        })
    }

    /// Whether the components can be in their unit: specific force on a table at rest is near one g, and no table and no
    /// gyro turns faster than [`magnitude::Kind::possible`].
    fn judge(&self, table: &Table, layout: &Layout) -> Result<(), TableError> {
        let Some((columns, (kind, unit))) = self.components else {
            return Ok(());
        };
        if layout.units.told(kind).is_some() {
            return Ok(());
        }
        let mut norms = Vec::new();
        for row in &table.rows {
            let mut squares = 0.0;
            for column in columns {
                squares += table.required(row, column)?.powi(2);
            }
            norms.push(f64::sqrt(squares));
        }
        let (what, observed) = match layout.kind {
            Excitation::Rate => ("the largest rate", norms.into_iter().reduce(f64::max)),
            Excitation::Force => ("specific force at rest, the median,", magnitude::median(norms)),
        };
        let Some(observed) = observed else { return Ok(()) };
        magnitude::judge(what, kind, unit, observed, kind.possible())
            .map_err(|doubt| table.error(0, columns[0], &doubt.to_string()))
    }

    fn of_row(&self, table: &Table, row: &Row) -> Result<Excited, TableError> {
        let mut claimed_b = None;
        if let Some((columns, (_, unit))) = self.components {
            let mut components = [0.0; 3];
            for (component, column) in components.iter_mut().zip(columns) {
                *component = table.required(row, column)? * unit.size;
            }
            claimed_b = Some(Vector3::from(components));
        }
        let Some([inner, outer]) = self.angles else {
            return Ok((claimed_b, None, 0.0));
        };
        let pose = Pose {
            inner_rad: table.required(row, inner)?.to_radians(),
            outer_rad: table.required(row, outer)?.to_radians(),
        };
        let Some([turning, rate]) = self.run else {
            return Ok((claimed_b, Some((pose, None)), 0.0));
        };
        let axis = match row.cells.get(turning).map(|cell| cell.to_ascii_lowercase()).as_deref() {
            Some("inner" | "interno" | "1") => Turning::Inner,
            Some("outer" | "middle" | "2" | "intermediário") => Turning::Outer,
            _ => return Err(table.error(row.line, turning, "names no axis: write inner or outer")),
        };
        Ok((
            claimed_b,
            Some((pose, Some(axis))),
            table.required(row, rate)?.to_radians(),
        ))
    }
}

#[cfg(test)]
mod tests;
