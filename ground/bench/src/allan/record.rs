//! A record from a laboratory's file.
//!
//! In: a [`Table`] with one column a gyro and, if there is one, a column of times \[s\]. Out: a [`Series`] for each column.
//! Empty cells are gaps.
//!
//! Refuses columns it does not find, a file without times unless the sampling rate is given, columns that never change,
//! and everything a grid refuses, with file, line and column.

use super::series::{GridError, Series};
use crate::table::{Table, TableError};

/// Names a column of times may have when none is given.
const TIMES: [&str; 7] = ["t_s", "t", "time_s", "time", "tempo", "tempo_s", "x_value"];

/// What to read of a file.
#[derive(Clone, Debug, Default)]
pub struct Selection {
    /// Columns of values; all but the times if empty.
    pub columns: Vec<String>,
    /// Column of times \[s\].
    pub time: Option<String>,
    /// Sampling rate \[Hz\] of a file without times.
    pub rate_hz: Option<f64>,
}

/// The chosen columns with their names.
pub fn records(table: &Table, selection: &Selection) -> Result<Vec<(String, Series)>, TableError> {
    let time = match (&selection.time, selection.rate_hz) {
        (Some(name), _) => Some(find(table, name)?),
        (None, Some(_)) => None,
        (None, None) => {
            let known = TIMES.iter().find_map(|name| table.column(name));
            let missing = || {
                table.error(
                    0,
                    usize::MAX,
                    "has no column of times: name it, or give the sampling rate",
                )
            };
            Some(known.ok_or_else(missing)?)
        }
    };
    let columns: Vec<usize> = if selection.columns.is_empty() {
        (0..table.columns.len())
            .filter(|column| Some(*column) != time)
            .collect()
    } else {
        selection
            .columns
            .iter()
            .map(|name| find(table, name))
            .collect::<Result<_, _>>()?
    };
    columns
        .into_iter()
        .map(|column| {
            let series = match (time, selection.rate_hz) {
                (Some(time), _) => stamped(table, time, column),
                (None, rate_hz) => unstamped(table, column, 1.0 / rate_hz.unwrap_or(f64::NAN)),
            }?;
            let first = series.values[0];
            if series.values.iter().all(|value| *value == first) {
                return Err(table.error(
                    0,
                    column,
                    "never changes: disconnected, or too coarsely resolved to show noise",
                ));
            }
            Ok((table.columns[column].clone(), series))
        })
        .collect()
}

fn find(table: &Table, name: &str) -> Result<usize, TableError> {
    table.column(name).ok_or_else(|| {
        table.error(
            0,
            usize::MAX,
            &format!("has no column {name}; it has {}", table.columns.join(", ")),
        )
    })
}

fn stamped(table: &Table, time: usize, column: usize) -> Result<Series, TableError> {
    let (mut times_s, mut values, mut lines) = (Vec::new(), Vec::new(), Vec::new());
    for row in &table.rows {
        if let Some(value) = table.number(row, column)? {
            times_s.push(table.required(row, time)?);
            values.push(value);
            lines.push(row.line);
        }
    }
    Series::stamped(&times_s, &values).map_err(|error| {
        let line = row_of(&error).and_then(|row| lines.get(row)).copied().unwrap_or(0);
        table.error(line, time, &error.to_string())
    })
}

fn unstamped(table: &Table, column: usize, step_s: f64) -> Result<Series, TableError> {
    let mut cells = table
        .rows
        .iter()
        .map(|row| table.number(row, column))
        .collect::<Result<Vec<_>, _>>()?;
    let trailing = cells.iter().rev().take_while(|cell| cell.is_none()).count();
    cells.truncate(cells.len() - trailing);
    let leading = cells.iter().take_while(|cell| cell.is_none()).count();
    let cells = &cells[leading..];
    let values = cells.iter().map(|cell| cell.unwrap_or(0.0)).collect();
    let mut series = Series::complete(step_s, values).map_err(|error| table.error(0, column, &error.to_string()))?;
    let mut start = None;
    for (k, cell) in cells.iter().enumerate() {
        match (cell, start) {
            (None, None) => start = Some(k),
            (Some(_), Some(from)) => {
                series.gaps.push(from..k);
                start = None;
            }
            _ => (),
        }
    }
    Ok(series)
}

fn row_of(error: &GridError) -> Option<usize> {
    match error {
        GridError::NotFinite(row)
        | GridError::Backwards { row, .. }
        | GridError::NotUniform { row, .. }
        | GridError::MostlyGap { row } => Some(*row),
        GridError::TooFew(_) | GridError::BadInterval(_) => None,
    }
}

#[cfg(test)]
mod tests {
    use std::{fmt::Write, path::Path};

    use super::*;

    fn table(rows: impl Iterator<Item = (f64, String)>, names: &str) -> Table {
        let mut text = format!("{names}\n");
        for (t, cells) in rows {
            writeln!(text, "{t:.2};{cells}").expect("a string");
        }
        Table::parse(Path::new("gyros.csv"), text.replace('.', ",").as_bytes()).expect("a table")
    }

    fn rows(count: u32) -> impl Iterator<Item = (f64, String)> {
        (0..count).map(|k| (f64::from(k) * 0.05, format!("{}.5;7.0", k % 5)))
    }

    #[test]
    fn a_brazilian_file_is_read_with_its_gap() {
        let table = table(rows(40).filter(|(t, _)| !(0.5..0.7).contains(t)), "Tempo;g1;g2");
        let selection = Selection {
            columns: vec!["g1".into()],
            ..Selection::default()
        };
        let records = records(&table, &selection).expect("readable");
        assert_eq!(
            (records[0].0.as_str(), &records[0].1.gaps),
            ("g1", &std::iter::once(10..14).collect())
        );
        assert!((records[0].1.step_s - 0.05).abs() < 1e-12);
    }

    #[test]
    fn a_column_that_never_changes_is_refused_by_name() {
        let error = records(&table(rows(40), "t;g1;g2"), &Selection::default()).expect_err("constant");
        assert_eq!(error.column, "g2");
    }

    #[test]
    fn time_that_runs_backwards_is_refused_with_its_line() {
        let jump = rows(40).map(|(t, cells)| (if t > 1.0 { t - 0.5 } else { t }, cells));
        let error = records(&table(jump, "t;g1;g2"), &Selection::default()).expect_err("backwards");
        // Line 1 has the names; row 21 (from 0) is the first after 1.00 s.
        assert_eq!((error.line, error.column.as_str()), (23, "t"));
    }

    #[test]
    fn without_times_the_sampling_rate_must_be_given() {
        let table = table(rows(40), "a;g1;g2");
        assert!(records(&table, &Selection::default()).is_err());
        let selection = Selection {
            columns: vec!["g1".into()],
            rate_hz: Some(20.0),
            ..Selection::default()
        };
        assert_eq!(records(&table, &selection).expect("readable")[0].1.step_s, 0.05);
    }
}
