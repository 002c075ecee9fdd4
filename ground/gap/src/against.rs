//! A corrected twin on a log that it never saw: the gap before and after.
//!
//! In: a case `B`, and the description that the diagnosis of another case `A` of the same unit led to. Out: how far the twin of `B`
//! is off as described, and with what was found in `A`: in sigma, for all channels and by kind, and in attitude. Nothing is
//! fitted here: neither description has seen `B`.
//!
//! What goes over from `A` is what it found: the effects, and the noise that effects on the scatter gave the channels. Where and
//! when `B` is read is its own.
//!
//! The attitude after is that of the readings without what was found, `y - (after - before)`, as for the shrink on held-out
//! windows; TRIAD and filter are the unit's ([`crate::holdout::attitude`]).

use std::{fmt::Write, path::Path};

use nalgebra::UnitQuaternion;
use twin::predict::{Kind, Twin, UnitDescription};

use crate::{
    holdout::attitude::{Estimation, Response, Track},
    input::case::{CaseError, Subject},
    null::problem::Problem,
};

/// A figure with one description and with the other.
#[derive(Clone, Debug, PartialEq)]
pub struct Pair {
    /// Of what.
    pub name: String,
    /// Its unit.
    pub unit: &'static str,
    /// As described.
    pub before: f64,
    /// With what was found.
    pub after: f64,
}

/// All of them.
#[derive(Clone, Debug)]
pub struct Against {
    /// What `A` found.
    pub effects: Vec<String>,
    /// The gap, in total and by kind; then attitudes.
    pub pairs: Vec<Pair>,
    /// Attitude error \[deg\] against time \[s\], by the filter, before and after.
    pub errors_deg: [Errors; 2],
}

/// Attitude errors \[deg\] against time \[s\].
pub type Errors = Vec<(f64, f64)>;

/// Attitudes, row by row.
type Attitudes = Vec<Option<UnitQuaternion<f64>>>;

/// Kinds with their names.
const KINDS: [(Kind, &str); 4] = [
    (Kind::Accelerometer, "accelerometers"),
    (Kind::Magnetometer, "magnetometers"),
    (Kind::Gyro, "gyros"),
    (Kind::Thermometer, "thermometers"),
];

/// Holds a corrected description against a case.
///
/// # Errors
/// When the case or the description cannot be read.
pub fn against(case: &Path, corrected: &UnitDescription) -> Result<Against, CaseError> {
    let before = Subject::open(case)?;
    let after = Subject::open_with(case, |unit| teach(unit, corrected))?;
    let effects = after
        .twin
        .unit()
        .effects
        .iter()
        .filter(|known| !before.twin.unit().effects.contains(known));
    let effects: Vec<String> = effects
        .map(|known| format!("{} at {}", known.effect, known.locality))
        .collect();
    let squares = [&before, &after].map(squares);
    let mut pairs = vec![pair("gap", [&squares[0], &squares[1]], |_| true)];
    let kinds: Vec<Kind> = before
        .twin
        .unit()
        .channels
        .iter()
        .map(|channel| channel.sensor)
        .collect();
    for (kind, name) in KINDS.into_iter().filter(|(kind, _)| kinds.contains(kind)) {
        pairs.push(pair(name, [&squares[0], &squares[1]], |channel| kinds[channel] == kind));
    }
    let mut errors_deg = [Vec::new(), Vec::new()];
    if before.opened.text.motion.is_some() {
        let (attitudes, errors) = attitudes(&before, &after.twin);
        pairs.extend(attitudes);
        errors_deg = errors;
    }
    Ok(Against {
        effects,
        pairs,
        errors_deg,
    })
}

impl Against {
    /// As a table.
    pub fn text(&self, case: &str) -> String {
        let found = match self.effects.is_empty() {
            true => "nothing".to_owned(),
            false => self.effects.join(", "),
        };
        let mut text = format!("{case}, which neither description has seen; found before: {found}\n");
        let name = |pair: &Pair| format!("{} [{}]", pair.name, pair.unit);
        let width = self.pairs.iter().map(|pair| name(pair).len()).max().unwrap_or(0);
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{:width$} {:>10} {:>10}", "", "described", "corrected");
        for pair in &self.pairs {
            let _ = writeln!(text, "{:width$} {:10.3} {:10.3}", name(pair), pair.before, pair.after);
        }
        text
    }
}

/// Adds what was found elsewhere.
fn teach(unit: &mut UnitDescription, corrected: &UnitDescription) {
    for known in &corrected.effects {
        if !unit.effects.contains(known) {
            unit.effects.push(known.clone());
        }
    }
    for channel in &mut unit.channels {
        if let Some(index) = corrected.channel(&channel.name) {
            channel.noise_sigma = corrected.channels[index].noise_sigma;
        }
    }
}

/// Squared standardised residuals of every channel: their sum and their number.
fn squares(subject: &Subject) -> Vec<(f64, f64)> {
    let problem = Problem::new(&subject.twin, &subject.fit, &subject.reference);
    let predicted = subject.twin.predict(&[]);
    let of_channel = |(channel, series): (usize, &crate::input::log::Series)| {
        let samples = series.rows.iter().zip(&series.values);
        let square = |(row, value): (&u32, &f64)| {
            let row = *row as usize;
            ((value - predicted[channel][row]) / problem.sigmas[channel][row]).powi(2)
        };
        (samples.map(square).sum::<f64>(), series.rows.len() as f64)
    };
    subject.fit.channels.iter().enumerate().map(of_channel).collect()
}

fn pair(name: &str, squares: [&Vec<(f64, f64)>; 2], of: impl Fn(usize) -> bool) -> Pair {
    let rms = |squares: &Vec<(f64, f64)>| {
        let own = squares.iter().enumerate().filter(|(channel, _)| of(*channel));
        let (sum, count) = own.fold((0.0, 0.0), |(sum, count), (_, (more, samples))| {
            (sum + more, count + samples)
        });
        (sum / f64::max(count, 1.0)).sqrt()
    };
    Pair {
        name: name.to_owned(),
        unit: "sigma",
        before: rms(squares[0]),
        after: rms(squares[1]),
    }
}

/// Attitude errors, and the filter's against time.
fn attitudes(subject: &Subject, after: &Twin) -> (Vec<Pair>, [Errors; 2]) {
    let twin = &subject.twin;
    let rows = twin.starts_s().len();
    let (without, with) = (twin.predict(&[]), after.predict(&[]));
    let mut measured = vec![vec![f64::NAN; rows]; subject.fit.channels.len()];
    let mut cleaned = measured.clone();
    for (channel, series) in subject.fit.channels.iter().enumerate() {
        for (row, value) in series.rows.iter().zip(&series.values) {
            let row = *row as usize;
            measured[channel][row] = *value;
            cleaned[channel][row] = value - (with[channel][row] - without[channel][row]);
        }
    }
    let seen: Vec<usize> = (0..rows)
        .filter(|row| measured.iter().any(|channel| channel[*row].is_finite()))
        .collect();
    let estimation = Estimation::new(twin, seen);
    let nominal: Vec<Response> = twin.unit().channels.iter().map(Response::nominal).collect();
    let tracks = [measured, cleaned].map(|readings| estimation.track(&readings, &nominal));
    let reference = estimation.reference();
    let t_s: Vec<f64> = estimation.rows().iter().map(|row| twin.starts_s()[*row]).collect();
    let errors = |of: fn(&Track) -> &Attitudes| {
        tracks.each_ref().map(|track| -> Errors {
            let found = of(track);
            let error = |at: usize| Some((t_s[at], found[at]?.angle_to(&reference[at]).to_degrees()));
            (0..found.len()).filter_map(error).collect()
        })
    };
    let rms = |errors: &Errors| {
        (errors.iter().map(|(_, error)| error * error).sum::<f64>() / errors.len().max(1) as f64).sqrt()
    };
    let [triad, filter] = [errors(|track| &track.triad), errors(|track| &track.filter)];
    let pair = |name: &str, errors: &[Errors; 2]| Pair {
        name: name.to_owned(),
        unit: "deg",
        before: rms(&errors[0]),
        after: rms(&errors[1]),
    };
    let pairs = vec![
        pair("attitude by TRIAD", &triad),
        pair("attitude by the Kalman filter", &filter),
    ];
    (pairs, filter)
}
