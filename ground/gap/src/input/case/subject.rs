//! A case made ready: the twin along the whole log, what may be fitted, what only judges.
//!
//! Refuses, naming file and key: a motion that does not reach over the windows, a window without a sample.

use std::path::Path;

use nalgebra::{UnitQuaternion, Vector3};
use twin::{
    effect::Active,
    motion::Recorded,
    predict::{Accuracy, Channel, Feel, Kind, Scene, Twin, UnitDescription},
};

use super::{
    Bars, CaseError, Opened, Position, SlowErrors, allowance::allowance, environment::environment, read_table,
};
use crate::input::{
    faster::Fast,
    gross::{Gross, put_right},
    hold::Held,
    log::{Column, Log, Masked, Stream},
    reference::{Reference, SPREAD_S},
    repeats::{Repeats, by_axes, repeats},
    stops::{Stop, beneath, stops},
    windows::{Fit, Span},
};

/// \[counts\] what the HMC5883L sends for a field beyond its range (datasheet, table 11).
const MAGNETOMETER_OVERFLOW: i16 = -4096;

/// Share of the windows' rows that the reference must reach over: an optical system may find its markers a few seconds
/// late, but a motion that ends early belongs to another log.
const LEAST_SEEN: f64 = 0.9;

/// Rows that are kept at most: 40 min of packets. A longer or faster log is thinned evenly, which bounds time and memory.
const MOST_ROWS: usize = 12_000;

/// \[s\] beside a gap of such a reference where it still bends towards what is not known.
const BESIDE_GAP_S: f64 = 0.5;

/// A case ready to be diagnosed.
pub struct Subject {
    /// Its file.
    pub opened: Opened,
    /// The twin along the log.
    pub twin: Twin,
    /// How well the reference knows.
    pub reference: Reference,
    /// How reference and field err slowly.
    pub slow: SlowErrors,
    /// What is too small to care about.
    pub bars: Bars,
    /// What may be fitted.
    pub fit: Fit,
    /// What only judges.
    pub held: Held,
    /// What was left out of each channel.
    pub masked: Vec<Masked>,
    /// What happened to the stream.
    pub stream: Stream,
    /// Samples left out because the reference had lost sight.
    pub unseen: usize,
    /// One row in so many was kept.
    pub thinned: usize,
    /// Parts that sent samples twice by their rows alone; `None` where the search for effects on the scatter sees them.
    pub repeats: Option<Vec<Repeats>>,
    /// Parts of any kind that did, whoever sees them.
    pub repeated: Vec<Repeats>,
    /// What is too fast for the reference, a vibration among it; `None` also where the reference is exact, and the search for effects on the scatter
    /// sees it.
    pub fast: Option<Fast>,
    /// Where gyros stop before the end of their range; none where the reference is exact, and the search has their limits.
    pub stops: Vec<Stop>,
    /// What was grossly wrong and is put right; in tables only.
    pub gross: Gross,
}

impl Subject {
    /// Reads a case.
    ///
    /// # Errors
    /// When anything of it cannot be read or does not fit the rest.
    pub fn open(path: &Path) -> Result<Self, CaseError> {
        Subject::open_with(path, |_| ())
    }

    /// Reads a case whose unit is believed to be otherwise than its file says.
    ///
    /// # Errors
    /// When anything of it cannot be read or does not fit the rest.
    pub fn open_with(path: &Path, believed: impl FnOnce(&mut UnitDescription)) -> Result<Self, CaseError> {
        let opened = Opened::open(path)?;
        if opened.is_without_motion() {
            let problem = "is absent, and this compares with a reference; what the unit's redundancy says without one: ground gap CASE";
            return Err(CaseError::key(&opened.file, "motion", problem));
        }
        if opened.text.windows.is_none() {
            let problem =
                "is absent; say which seconds are fitted and which only judge: fit = [[from, to]], hold = [[from, to]]";
            return Err(CaseError::key(&opened.file, "windows", problem));
        }
        let mut unit = UnitDescription::open(&opened.path(&opened.text.unit))?;
        believed(&mut unit);
        if opened.text.kind == super::Kind::Table {
            return Subject::of_table(opened, unit);
        }
        let environment = environment(&opened, &unit)?;
        let (slow, bars) = allowance(&opened)?;
        let columns = columns(&unit);
        let mut log = opened.log(&columns, unit.cycle_s)?;
        let name = opened.text.motion.clone().unwrap_or_default();
        let file = opened.path(&name);
        let record = Recorded::open(&file)?;
        let (from_s, to_s) = record.span_s();
        log = within_windows(log, &opened);
        let is_exact = opened.text.reference.attitude_sigma_rad == 0.0;
        let repeats = repeats(&log, &unit).filter(|_| !is_exact);
        let fast = if is_exact { None } else { Fast::of(&log, &unit) };
        let repeated = by_axes(&log, &unit, &[Kind::Accelerometer, Kind::Gyro, Kind::Magnetometer]);
        let stops = if is_exact { Vec::new() } else { stops(&log, &unit) };
        beneath(&mut log, &stops);
        let thinned = log.start_s.len().div_ceil(MOST_ROWS).max(1);
        log = keep_rows(log, |row, _| row % thinned == 0);
        let overlap_s = seen_share(&log, (from_s, to_s));
        if overlap_s < LEAST_SEEN {
            let problem = format!(
                "runs from {from_s} to {to_s} s and covers {:.0} % of the windows; cut them to what both have",
                100.0 * overlap_s
            );
            return Err(CaseError::key(&file, "t_s", problem));
        }
        let mut lost_s = vec![(f64::NEG_INFINITY, from_s)];
        lost_s.extend(record.lost_s());
        lost_s.push((to_s, f64::INFINITY));
        if !is_exact {
            lost_s
                .iter_mut()
                .for_each(|(from_s, to_s)| (*from_s, *to_s) = (*from_s - BESIDE_GAP_S, *to_s + BESIDE_GAP_S));
        }
        let unseen = drop_unseen(&mut log, &lost_s, &unit);
        let (fit, held) = opened.windows.part(&log);
        check_windows(&opened, &fit, &held)?;
        let Log {
            start_s,
            masked,
            stream,
            ..
        } = log;
        let step_s = record.step_s();
        let along = |motion: &Recorded, starts_s: &[f64]| {
            let scene = Scene::new(motion, &environment, from_s, to_s, step_s);
            Twin::new(unit.clone(), environment, scene, starts_s.to_vec())
        };
        let stated = accuracy(&opened, &slow);
        let (twin, reference) = if is_exact {
            (along(&record, &start_s)?, Reference::stated(stated))
        } else {
            let used = record.used();
            let even = |step_s: f64, most: usize| -> Vec<f64> {
                let instants = (0..most).map(|row| from_s + row as f64 * step_s);
                instants.take_while(|t_s| *t_s < to_s).collect()
            };
            let twin = along(&used, &start_s)?;
            let close = even(step_s, MOST_ROWS);
            let spread = even(step_s.max(SPREAD_S), usize::MAX);
            let finer = record.finer();
            let [spread, close] = [spread, close].map(|t_s| [along(&used, &t_s), along(&finer, &t_s)]);
            let [[own, more], [close, closer]] = [spread, close];
            let reference = Reference::seen(stated, &twin, &fit, [&own?, &more?], [&close?, &closer?]);
            (twin, reference)
        };
        Ok(Subject {
            twin,
            reference,
            slow,
            bars,
            opened,
            fit,
            held,
            masked,
            stream,
            unseen,
            thinned,
            repeats,
            repeated,
            fast,
            stops,
            gross: Gross::default(),
        })
    }

    /// Of a table: gross errors are put right first, then its positions are instants a second apart.
    fn of_table(opened: Opened, mut unit: UnitDescription) -> Result<Self, CaseError> {
        let file = opened.path(&opened.text.measured);
        if let Some(channel) = unit
            .channels
            .iter()
            .find(|channel| channel.bandwidth_hz.is_some() || channel.slot_s != 0.0)
        {
            let problem = "has a bandwidth or a slot; the rows of a table are means at rest and have neither";
            return Err(CaseError::key(&file, &channel.name, problem));
        }
        let environment = environment(&opened, &unit)?;
        let (slow, bars) = allowance(&opened)?;
        let mut positions = read_table(&file, &unit.channels)?;
        let gross = put_right(&mut positions, &mut unit.channels);
        let columns = columns(&unit);
        let mut log = Log::empty(columns.len());
        for position in &positions {
            log.begin_row(position.seq);
            for (index, (column, value)) in columns.iter().zip(&position.values).enumerate() {
                log.put(index, column, *value);
            }
        }
        log = within_windows(log, &opened);
        let (fit, held) = opened.windows.part(&log);
        check_windows(&opened, &fit, &held)?;
        let used: Vec<Feel> = positions
            .iter()
            .filter(|position| log.start_s.contains(&position.seq))
            .map(|position| steady(position, environment.temperature_c))
            .collect();
        let starts_s = (0..used.len()).map(|row| row as f64).collect();
        Ok(Subject {
            twin: Twin::new(unit, environment, Scene::table(&used), starts_s)?,
            reference: Reference::stated(accuracy(&opened, &slow)),
            slow,
            bars,
            opened,
            fit,
            held,
            masked: log.masked,
            stream: log.stream,
            unseen: 0,
            thinned: 1,
            repeats: None,
            repeated: Vec::new(),
            fast: None,
            stops: Vec::new(),
            gross,
        })
    }

    /// Names of channels.
    pub fn names(&self, channels: impl IntoIterator<Item = usize>) -> Vec<String> {
        let name = |index: usize| self.twin.unit().channels.get(index).map(|channel| channel.name.clone());
        channels.into_iter().filter_map(name).collect()
    }

    /// Names of the channels an effect touches.
    pub fn touched(&self, active: &Active) -> Vec<String> {
        self.names(active.cause.channels(self.twin.unit()))
    }
}

fn accuracy(opened: &Opened, slow: &SlowErrors) -> Accuracy {
    Accuracy {
        attitude_sigma_rad: slow.attitude_sigma_rad,
        attitude_correlation_s: slow.attitude_correlation_s,
        position_sigma_m: opened.text.reference.position_sigma_m,
        field_sigma_ut: opened.text.environment.field_sigma_ut,
    }
}

fn check_windows(opened: &Opened, fit: &Fit, held: &Held) -> Result<(), CaseError> {
    let absent = |key: &str| Err(CaseError::key(&opened.file, key, "holds no sample of the log"));
    if fit.channels.iter().all(|series| series.rows.len() < 2) {
        return absent("windows.fit");
    }
    if held.counts().iter().all(|count| *count < 2) {
        return absent("windows.hold");
    }
    Ok(())
}

/// What a position feels like: the command, and nothing changes.
fn steady(position: &Position, temperature_c: f64) -> Feel {
    Feel {
        t_s: 0.0,
        rate_b: position.rate_b,
        rate_dot_b: Vector3::zeros(),
        force_b: position.force_b,
        field_b_ut: Vector3::zeros(),
        temperature_c,
        temperature_rate: 0.0,
        q_nb: UnitQuaternion::identity(),
        position_n: Vector3::zeros(),
        heading: 0.0,
        heading_rate: 0.0,
        heading_acc: 0.0,
    }
}

/// What the log's reader must know of each channel.
pub fn columns(unit: &UnitDescription) -> Vec<Column> {
    unit.channels.iter().map(column).collect()
}

fn column(channel: &Channel) -> Column {
    let is_magnetometer = channel.sensor == Kind::Magnetometer && channel.bits.is_some();
    Column {
        name: channel.name.clone(),
        lsb: channel.lsb,
        sensor: channel.sensor,
        bias: channel.bias,
        range: channel.range,
        code_range: channel.bits.map(|bits| {
            let half = 1i64 << (bits.clamp(1, 62) - 1);
            [-half, half - 1]
        }),
        overflow_counts: is_magnetometer.then_some(MAGNETOMETER_OVERFLOW),
    }
}

/// Keeps the rows of a window: nothing outside them is predicted, fitted or judged.
fn within_windows(log: Log, opened: &Opened) -> Log {
    let spans: Vec<Span> = opened
        .windows
        .fit()
        .iter()
        .chain(opened.windows.hold())
        .copied()
        .collect();
    keep_rows(log, |_, start_s| spans.iter().any(|span| span.contains(start_s)))
}

fn keep_rows(mut log: Log, wanted: impl Fn(usize, f64) -> bool) -> Log {
    let mut new_row = Vec::with_capacity(log.start_s.len());
    let mut kept = 0u32;
    for (row, start_s) in log.start_s.iter().enumerate() {
        let is_wanted = wanted(row, *start_s);
        new_row.push(is_wanted.then_some(kept));
        kept += u32::from(is_wanted);
    }
    for series in &mut log.channels {
        *series = series.only(|row| new_row[row].is_some());
        series
            .rows
            .iter_mut()
            .for_each(|row| *row = new_row[*row as usize].unwrap_or(*row));
    }
    let mut is_kept = new_row.iter().map(Option::is_some);
    log.start_s.retain(|_| is_kept.next().unwrap_or(false));
    log
}

/// Share of the rows within a span.
fn seen_share(log: &Log, (from_s, to_s): (f64, f64)) -> f64 {
    let seen = log.start_s.iter().filter(|t_s| (from_s..=to_s).contains(*t_s)).count();
    seen as f64 / log.start_s.len().max(1) as f64
}

/// Leaves out samples taken while the reference saw nothing; tells how many.
fn drop_unseen(log: &mut Log, lost_s: &[(f64, f64)], unit: &UnitDescription) -> usize {
    let mut dropped = 0;
    for (series, channel) in log.channels.iter_mut().zip(&unit.channels) {
        let before = series.rows.len();
        let start_s = &log.start_s;
        *series = series.only(|row| {
            let t_s = start_s[row] + channel.slot_s;
            let next = lost_s.partition_point(|(_, to_s)| *to_s <= t_s);
            lost_s.get(next).is_none_or(|(from_s, _)| *from_s > t_s)
        });
        dropped += before - series.rows.len();
    }
    dropped
}
