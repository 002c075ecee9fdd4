//! `ground case check`: what a case has, and what it lacks.
//!
//! In: a case's folder. Out: a line a point: `ok`, `look` (it can be diagnosed, and the verdict may mislead) or `missing` (it cannot).
//! Looked at are the files and keys (as the diagnosis reads them), the packets, the clocks along the case ([`super::clock`]), whether
//! windows hold the same kinds of motion, and the sigmas of the calibration.

use std::path::Path;

use gap::{input::case::Subject, null::problem::Problem};
use nalgebra::Vector3;
use twin::predict::Kind;

use super::clock;

/// Sigmas from which a clock is off.
const CLOCK_OFF_SIGMAS: f64 = 4.0;

/// \[s\] below which nobody minds: what a gyro at 100 deg/s turns in it is a tenth of a degree.
const MINDED_S: f64 = 1e-3;

/// One half of what the windows hold over the other from which they differ.
const DIFFER: f64 = 3.0;

/// Gap beyond which a unit is rather misread than off: ten sigma in every channel.
const MISREAD: f64 = 10.0;

/// How a point is.
#[derive(Clone, Copy)]
enum Mark {
    Ok,
    Look,
    Missing,
}

impl Mark {
    fn word(self) -> &'static str {
        match self {
            Mark::Ok => "ok",
            Mark::Look => "look",
            Mark::Missing => "missing",
        }
    }
}

/// What was found.
pub struct Checked {
    points: Vec<(Mark, String)>,
}

impl Checked {
    /// Nothing is missing: the case can be diagnosed.
    pub fn is_whole(&self) -> bool {
        !self.points.iter().any(|(mark, _)| matches!(mark, Mark::Missing))
    }

    /// A line a point.
    pub fn text(&self) -> String {
        let line = |(mark, says): &(Mark, String)| format!("{:9}{says}\n", mark.word());
        self.points.iter().map(line).collect()
    }

    /// The points for programs: `whole`, and `points` of a `mark` (`ok`, `look`, `missing`) and what it `says`.
    pub fn json(&self) -> serde_json::Value {
        let point = |(mark, says): &(Mark, String)| serde_json::json!({ "mark": mark.word(), "says": says });
        serde_json::json!({ "whole": self.is_whole(), "points": self.points.iter().map(point).collect::<Vec<_>>() })
    }

    fn ok(&mut self, says: String) {
        self.points.push((Mark::Ok, says));
    }

    fn look(&mut self, says: String) {
        self.points.push((Mark::Look, says));
    }
}

/// Checks a case.
pub fn checked(folder: &Path) -> Checked {
    let mut checked = Checked { points: Vec::new() };
    let subject = match Subject::open(folder) {
        Ok(subject) => subject,
        Err(error) => {
            checked.points.push((Mark::Missing, error.to_string()));
            return checked;
        }
    };
    let unit = subject.twin.unit();
    let rows = subject.twin.starts_s().len();
    checked.ok(format!(
        "{} channels, {rows} rows in the windows, keys and files as the format has them",
        unit.channels.len()
    ));
    stream(&subject, rows, &mut checked);
    clocks(&subject, &mut checked);
    windows(&subject, &mut checked);
    sigmas(&subject, &mut checked);
    gap_of(&subject, &mut checked);
    checked
}

fn stream(subject: &Subject, rows: usize, checked: &mut Checked) {
    let stream = subject.stream;
    let spoilt = stream.lost + stream.rejected + stream.repeated;
    let mark = if spoilt * 50 > rows as u64 {
        Mark::Look
    } else {
        Mark::Ok
    };
    let says = format!(
        "packets lost {}, repeated {}, not packets {}; samples unseen by the reference {}",
        stream.lost, stream.repeated, stream.rejected, subject.unseen
    );
    checked.points.push((mark, says));
    for (channel, masked) in subject.twin.unit().channels.iter().zip(&subject.masked) {
        let left_out = masked.missing + masked.clipped;
        if left_out * 10 > rows {
            checked.look(format!(
                "{}: {} samples missing, {} at the end of the range",
                channel.name, masked.missing, masked.clipped
            ));
        }
    }
}

fn clocks(subject: &Subject, checked: &mut Checked) {
    if subject.opened.text.motion.is_none() {
        return;
    }
    match clock::error(subject) {
        None => checked.look("no gyro turns: nothing tells whether the clocks are one".to_owned()),
        Some(offset) => {
            let is_off = offset.seconds.abs() > CLOCK_OFF_SIGMAS * offset.sigma_s && offset.seconds.abs() > MINDED_S;
            let mark = if is_off { Mark::Look } else { Mark::Ok };
            let says = format!(
                "clocks: by the gyros the reference is {:+.4} +- {:.4} s off the log{}",
                offset.seconds,
                offset.sigma_s,
                if is_off {
                    "; take that off its t_s, or it shows as latency or reference-lag"
                } else {
                    ""
                }
            );
            checked.points.push((mark, says));
        }
    }
}

/// What each half of the windows excites.
fn windows(subject: &Subject, checked: &mut Checked) {
    let feels = subject.twin.feels(0);
    let starts_s = subject.twin.starts_s();
    let of = |spans: &[gap::input::windows::Span], what: &dyn Fn(usize) -> f64| {
        let rows = (0..starts_s.len()).filter(|row| spans.iter().any(|span| span.contains(starts_s[*row])));
        rows.map(what).fold(0.0, |most: f64, value| most.max(value.abs()))
    };
    let windows = &subject.opened.windows;
    let mut differ = Vec::new();
    for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
        let rate = |row: usize| feels[row].rate_b[axis];
        let (fit, hold) = (of(windows.fit(), &rate), of(windows.hold(), &rate));
        if fit.max(hold) > 0.05 && fit.max(hold) > DIFFER * fit.min(hold) {
            differ.push(format!("rates about {name} ({fit:.2} and {hold:.2} rad/s at most)"));
        }
        let tilt = |row: usize| feels[row].to_b(Vector3::z())[axis];
        let (fit, hold) = (of(windows.fit(), &tilt), of(windows.hold(), &tilt));
        if fit.max(hold) > 0.3 && fit.max(hold) > DIFFER * fit.min(hold) {
            differ.push(format!("tilts along {name}"));
        }
    }
    match differ.is_empty() {
        true => checked.ok("fit and hold hold the same kinds of motion".to_owned()),
        false => checked.look(format!(
            "fit and hold differ in {}: what only one excites cannot be judged",
            differ.join(", ")
        )),
    }
}

fn sigmas(subject: &Subject, checked: &mut Checked) {
    let sensed = subject
        .twin
        .unit()
        .channels
        .iter()
        .filter(|channel| channel.sensor != Kind::Thermometer);
    let exact: Vec<&str> = sensed
        .filter(|channel| channel.bias_sigma == 0.0 || channel.scale_sigma == 0.0 || channel.axis_sigma_rad == 0.0)
        .map(|channel| channel.name.as_str())
        .collect();
    match exact.is_empty() {
        true => checked.ok("every channel says how well its calibration knew it".to_owned()),
        false => checked.look(format!("{}: bias_sigma, scale_sigma or axis_sigma_rad is 0, so any unit has a gap; take them from the set's covariance",
            exact.join(" ")
        )),
    }
    let text = &subject.opened.text;
    if text.motion.is_some() && text.reference.attitude_sigma_rad == 0.0 {
        checked
            .look("[reference] is absent: the reference is taken for exact, as a table's or a simulation's".to_owned());
    }
}

/// Channels that are off by so much that they are rather misread.
fn gap_of(subject: &Subject, checked: &mut Checked) {
    let problem = Problem::new(&subject.twin, &subject.fit, &subject.reference);
    let predicted = subject.twin.predict(&[]);
    for (index, channel) in subject.twin.unit().channels.iter().enumerate() {
        let series = &subject.fit.channels[index];
        let square = |(row, value): (&u32, &f64)| {
            let row = *row as usize;
            ((value - predicted[index][row]) / problem.sigmas[index][row]).powi(2)
        };
        let sum: f64 = series.rows.iter().zip(&series.values).map(square).sum();
        let gap = (sum / series.rows.len().max(1) as f64).sqrt();
        if gap > MISREAD {
            checked.look(format!(
                "{}: {gap:.0} sigma off; rather its unit, axis, sign or zero than an effect",
                channel.name
            ));
        }
    }
}
