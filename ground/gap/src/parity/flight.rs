//! A case whose motion nobody recorded: the windows of its log, and the unit in its environment.
//!
//! In: the folder of a case. Out: [`Flight`]. A `motion` that is there is not opened.
//!
//! A log whose file has no `[windows]`, or has them in pieces that take turns, is parted in the middle: the motion of each half is
//! smoothed by itself, and a smoother does not bridge the minutes that lie between two pieces.
//!
//! Refuses, naming file and key, what any case is refused for, and tables, which are nothing but commanded motion.

use std::path::Path;

use twin::{environment::Environment, predict::UnitDescription};

use crate::{
    input::{
        case::{CaseError, Kind, Opened, columns_of, environment_of},
        log::{Log, Series},
        windows::{Span, Windows},
    },
    parity::{
        known::Known,
        lost::{Loss, put_back_spans},
        phases::{self, Stretch},
        smooth::rests::rests,
        turning::Holes,
    },
};

/// Rows that are kept at most: 20 min of packets. A longer or faster log is thinned evenly, which bounds time and memory.
const MOST_ROWS: usize = 6000;

/// Rows from which anything can be said.
const LEAST_ROWS: usize = 16;

/// A log without a reference.
pub struct Flight {
    /// Its file.
    pub opened: Opened,
    /// The unit as described.
    pub unit: UnitDescription,
    /// Where it was.
    pub environment: Environment,
    /// What it did when.
    pub phases: Vec<Stretch>,
    /// Whether its file says so.
    pub are_phases_told: bool,
    /// What else is known of its motion.
    pub known: Known,
    /// All rows, none thinned.
    pub whole: Log,
    /// The rows of the fit windows.
    pub log: Log,
    /// Those of the held-out windows, which no fit reads; none where they are too few.
    pub held: Option<Log>,
    /// One row in so many was kept.
    pub thinned: usize,
    /// Rows of the fit windows that were left out because nobody knows how fast the unit turned.
    pub unturned: usize,
    /// Where such rows are.
    pub holes: Holes,
    /// How it was parted where its file does not say it, or has pieces that a smoother does not bridge.
    pub windows: Option<Windows>,
}

impl Flight {
    /// Reads a case.
    ///
    /// # Errors
    /// When anything of it cannot be read or does not fit the rest.
    pub fn open(path: &Path) -> Result<Self, CaseError> {
        let opened = Opened::open(path)?;
        if opened.text.kind == Kind::Table {
            let problem = "is \"table\", which is nothing but commanded motion; leave --blind-motion out";
            return Err(CaseError::key(&opened.file, "kind", problem));
        }
        let unit = UnitDescription::open(&opened.path(&opened.text.unit))?;
        let environment = environment_of(&opened, &unit)?;
        let log = opened.log(&columns_of(&unit), unit.cycle_s)?;
        let is_whole = |spans: &[Span]| spans.len() < 2;
        let is_told =
            opened.text.windows.is_some() && is_whole(opened.windows.fit()) && is_whole(opened.windows.hold());
        let parted = (!is_told).then(|| halves(&log));
        let windows = parted.as_ref().unwrap_or(&opened.windows);
        let rows = rows(&log, windows.fit());
        if rows.len() < LEAST_ROWS {
            let problem = format!("hold {} rows of the log; at least {LEAST_ROWS} are needed", rows.len());
            return Err(CaseError::key(&opened.file, "windows.fit", problem));
        }
        let windowed = rows.len();
        let holes = Holes::of(&log, &unit);
        let rows = holes.without(rows, LEAST_ROWS);
        let unturned = windowed - rows.len();
        let thinned = rows.len().div_ceil(MOST_ROWS).max(1);
        let rows: Vec<usize> = rows.into_iter().step_by(thinned).collect();
        let held = holes.without(self::rows(&log, windows.hold()), LEAST_ROWS);
        let every = held.len().div_ceil(MOST_ROWS).max(1);
        let held: Vec<usize> = held.into_iter().step_by(every).collect();
        let phases = match &opened.text.phases {
            Some(pairs) => phases::told(pairs, &opened.file)?,
            None => phases::found(&log, &unit, &environment),
        };
        Ok(Flight {
            known: Known::open(&opened, &phases)?,
            phases,
            are_phases_told: opened.text.phases.is_some(),
            log: only(&log, &rows),
            held: (held.len() >= LEAST_ROWS).then(|| only(&log, &held)),
            windows: parted,
            whole: log,
            opened,
            unit,
            environment,
            thinned,
            unturned,
            holes,
        })
    }

    /// What it did when, in words.
    pub fn phases_line(&self) -> String {
        let first_s = self.whole.start_s.first().copied().unwrap_or(0.0);
        phases::line(&self.phases, self.are_phases_told, first_s)
    }

    /// \[s\] spans in which nothing moves, of rows of it that are put back in time: as its file says by the times that the log tells, or as they
    /// are found.
    pub fn rests(&self, log: &Log, unit: &UnitDescription, losses: &[Loss]) -> Vec<(f64, f64)> {
        if self.are_phases_told {
            let mut still = phases::still(&self.phases);
            put_back_spans(&mut still, losses);
            still
        } else {
            rests(log, unit, &self.environment)
        }
    }

    /// Names of channels.
    pub fn names(&self, channels: &[usize]) -> Vec<String> {
        let name = |index: &usize| self.unit.channels.get(*index).map(|channel| channel.name.clone());
        channels.iter().filter_map(name).collect()
    }
}

/// The first half of a log to be fitted, the second to judge; one that is too short for two is fitted as a whole.
fn halves(log: &Log) -> Windows {
    let rows = log.start_s.len();
    let middle = log.start_s.get(rows / 2).filter(|_| rows >= 2 * LEAST_ROWS);
    let halved = middle.and_then(|middle| {
        let (first, last) = (log.start_s[0], log.start_s[rows - 1]);
        // A row belongs to a window when it begins before the window's end.
        let fit = Span {
            from: first,
            to: *middle,
        };
        let hold = Span {
            from: *middle,
            to: last + (last - first) / rows as f64,
        };
        Windows::new(vec![fit], vec![hold]).ok()
    });
    halved.unwrap_or_else(Windows::all)
}

/// Rows of a log that begin in these windows.
fn rows(log: &Log, windows: &[Span]) -> Vec<usize> {
    let is_in = |start_s: f64| windows.iter().any(|span| span.contains(start_s));
    (0..log.start_s.len()).filter(|row| is_in(log.start_s[*row])).collect()
}

/// These rows of a log, which rise.
fn only(log: &Log, rows: &[usize]) -> Log {
    let mut new_row = vec![None; log.start_s.len()];
    rows.iter()
        .enumerate()
        .for_each(|(new, old)| new_row[*old] = Some(new as u32));
    let series = |series: &Series| {
        let kept = series.rows.iter().zip(&series.values);
        let kept = kept.filter_map(|(row, value)| Some((new_row[*row as usize]?, *value)));
        let (rows, values) = kept.unzip();
        Series { rows, values }
    };
    Log {
        start_s: rows.iter().map(|row| log.start_s[*row]).collect(),
        channels: log.channels.iter().map(series).collect(),
        masked: log.masked.clone(),
        stream: log.stream,
    }
}
