//! `ground calibrate ellipsoid`: a triad without controlled inputs.

use std::path::PathBuf;

use chart::{Axis, Figure, Layer, Marks, Panel};
use nalgebra::{Matrix3, Vector3};
use packets::{
    channel::{CHANNELS, Quantity},
    magnitude::{self, Kind, Unit, digits},
};

use super::{CalibrateError, Output, read_nominal};
use crate::{
    checks,
    coverage::{Coverage, ENOUGH},
    ellipsoid::{Convention, Ellipsoid},
    log,
    nominal::Nominal,
    report::Report,
    set::Entry,
    stretches,
};

/// A triad turned every way in a field of known strength, or in gravity, at rest
///
/// FILE is a raw log (packets, or a table with a column a channel); every sample is a point, or with --still every stretch
/// at rest. The nine parameters do not say how the triad sits in the body: --unit gives that for the set.
#[derive(Clone, Debug, clap::Args)]
pub struct EllipsoidArguments {
    /// Raw log
    file: PathBuf,
    /// The three channels x, y, z, separated by commas
    #[arg(long, value_delimiter = ',', required = true)]
    channels: Vec<String>,
    /// Strength of the field (uT), or gravity (m/s2), or in a unit of its own: 0.232gauss, 23200nT, 1g
    #[arg(long, value_name = "NUMBER[UNIT]", value_parser = strength)]
    strength: Strength,
    /// Points are the means of stretches at rest of at least this many samples
    #[arg(long, value_name = "SAMPLES")]
    still: Option<usize>,
    /// Which angles are called phi and lambda
    #[arg(long, value_enum, default_value = "thesis")]
    angles: Convention,
    /// Nominal unit (unit.toml): the triad's axes in b, and ranges to tell saturation by
    #[arg(long, value_name = "FILE")]
    unit: Option<PathBuf>,
    #[command(flatten)]
    output: Output,
}

impl EllipsoidArguments {
    pub fn json(&self) -> bool {
        self.output.json()
    }
}

pub fn run(arguments: &EllipsoidArguments) -> Result<bool, CalibrateError> {
    let fail = CalibrateError::of(&arguments.file);
    let names: [String; 3] = arguments
        .channels
        .clone()
        .try_into()
        .map_err(|_| fail("an ellipsoid needs three channels: --channels x,y,z".into()))?;
    let nominal = arguments.unit.as_deref().map(read_nominal).transpose()?;
    let (mut samples, bytes) = log::samples(&arguments.file, &names)?;
    if let Some(shortest) = arguments.still {
        samples = stretches::still(&samples, shortest)
            .into_iter()
            .map(|stretch| stretch.mean)
            .collect();
    }
    let channel = |name: &String| nominal.as_ref().and_then(|nominal| nominal.channel(name));
    let limits = names
        .each_ref()
        .map(|name| channel(name).map_or(f64::INFINITY, |channel| channel.limit_counts()));
    let whole = |sample: &&Vec<f64>| sample.iter().zip(limits).all(|(value, limit)| value.abs() < limit);
    let points: Vec<Vector3<f64>> = samples
        .iter()
        .filter(whole)
        .map(|v| Vector3::new(v[0], v[1], v[2]))
        .collect();
    let left_out = samples.len() - points.len();
    let kind = kind_of(&names[0], channel(&names[0]).map(|channel| channel.sensor.as_str()));
    let strength = arguments.strength.base(kind).map_err(&fail)?;
    let found = Ellipsoid::fit(&points, strength).map_err(|error| fail(error.to_string()))?;

    let mut report = describe(&found, &points, arguments);
    report.wrong.extend(held_against(
        &found,
        &names,
        nominal.as_ref(),
        arguments.strength.declared(kind),
    ));
    if left_out > 0 {
        report.remarks.push(format!(
            "{left_out} of {} points are saturated or incomplete, left out",
            samples.len()
        ));
    }
    let (dcm_bp, sensor) = match &nominal {
        Some(nominal) => {
            let axes = nominal
                .axes_b(&names)
                .map_err(|name| fail(format!("the unit file has no axis for {name}")))?;
            let sensor = nominal
                .channel(&names[0])
                .map_or("magnetometer", |channel| channel.sensor.as_str());
            (Matrix3::from_columns(&[axes[0], axes[1], axes[2]]), sensor)
        }
        None => (Matrix3::identity(), "magnetometer"),
    };
    let entries = Entry::ellipsoid(&found, &names, sensor, &dcm_bp);
    if arguments.output.set.is_some() && nominal.is_none() {
        report
            .wrong
            .push("without --unit the set takes the triad's axes for the body's".into());
    }
    arguments.output.finish(&report, entries, &[(&arguments.file, &bytes)])
}

/// A strength as it was written.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Strength {
    value: f64,
    unit: Option<(Kind, Unit)>,
}

fn strength(text: &str) -> Result<Strength, String> {
    let text = text.trim();
    let known = [Kind::Field, Kind::Force].into_iter();
    let units = known.flat_map(|kind| kind.units().iter().map(move |unit| (kind, *unit)));
    // The longest name that fits: mgauss ends in gauss, mg in g.
    let unit = units
        .filter(|(_, unit)| text.to_ascii_lowercase().ends_with(&unit.name.to_ascii_lowercase()))
        .max_by_key(|(_, unit)| unit.name.len());
    let number = unit.map_or(text, |(_, unit)| text[..text.len() - unit.name.len()].trim_end());
    let value = number
        .parse()
        .ok()
        .filter(|value: &f64| value.is_finite() && *value > 0.0);
    value
        .map(|value| Strength { value, unit })
        .ok_or_else(|| "a positive number, perhaps with uT, nT, gauss, m/s2 or g after it".into())
}

impl Strength {
    /// The unit it is taken to be in.
    fn declared(self, kind: Option<Kind>) -> Option<(Kind, Unit)> {
        self.unit.or(kind.map(|kind| (kind, kind.base())))
    }

    /// In uT or m/s2. Without a unit of its own it must be what the kind of sensor can feel.
    fn base(self, kind: Option<Kind>) -> Result<f64, String> {
        match (self.unit, kind) {
            (Some((said, unit)), Some(kind)) if said != kind => Err(format!(
                "--strength is in {}, which these channels do not measure",
                unit.name
            )),
            (Some((_, unit)), _) => Ok(self.value * unit.size),
            (None, None) => Ok(self.value),
            (None, Some(kind)) => {
                let judged = magnitude::judge("--strength", kind, kind.base(), self.value, kind.possible());
                judged.map(|()| self.value).map_err(|doubt| {
                    let unit = doubt.likely.unwrap_or(doubt.declared).name;
                    let (low, high) = doubt.possible;
                    let base = doubt.declared.name;
                    format!(
                        "--strength {} {base} is not possible ({} to {}): is it {unit}? Write the unit after it, as {0}{unit}",
                        digits(self.value),
                        digits(low),
                        digits(high)
                    )
                })
            }
        }
    }
}

/// What a channel measures, by the unit's description or by its name in packets.
fn kind_of(name: &str, sensor: Option<&str>) -> Option<Kind> {
    match sensor {
        Some("accelerometer") => return Some(Kind::Force),
        Some("magnetometer") => return Some(Kind::Field),
        _ => {}
    }
    let channel = CHANNELS.iter().find(|channel| channel.name == name)?;
    match channel.quantity {
        Quantity::SpecificForce => Some(Kind::Force),
        Quantity::Field => Some(Kind::Field),
        _ => None,
    }
}

/// \[deg\] angles between a triad's axes beyond which it is none: what the unit takes at most, and twice its worst (Table 6.1).
const MOST_ANGLE_DEG: f64 = 10.0;

/// Noise of a point as a share of the field: what is left is no sphere. The parts' noise is 0.1 to 1 %.
const MOST_NOISE: f64 = 0.05;

/// What the nominal unit and the triad's own shape say against it.
fn held_against(
    found: &Ellipsoid,
    names: &[String; 3],
    nominal: Option<&Nominal>,
    declared: Option<(Kind, Unit)>,
) -> Vec<String> {
    let mut wrong = Vec::new();
    let plates = names
        .each_ref()
        .map(|name| CHANNELS.iter().find(|channel| channel.name == name));
    if let [Some(x), Some(y), Some(z)] = plates
        && (x.plate != y.plate || y.plate != z.plate || x.quantity != y.quantity || y.quantity != z.quantity)
    {
        wrong.push(format!(
            "{} are not the axes of one sensor: name x, y, z of one plate",
            names.join(", ")
        ));
    }
    let nine = found.nine(Convention::Standard);
    let declared: Vec<_> = declared.into_iter().collect();
    for (name, scale) in names.iter().zip(nine.values) {
        if let Some(channel) = nominal.and_then(|nominal| nominal.channel(name)) {
            wrong.extend(checks::scale(name, scale, channel.lsb.recip(), &declared));
        }
    }
    let angle_deg = nine.values[6..]
        .iter()
        .map(|angle| angle.to_degrees().abs())
        .fold(0.0, f64::max);
    if angle_deg > MOST_ANGLE_DEG {
        wrong.push(format!(
            "its axes are {angle_deg:.1} deg from square (at most {MOST_ANGLE_DEG} deg is believed): are x, y, z of one sensor, \
             in this order, and nothing magnetic near?"
        ));
    }
    let field = found.residuals.iter().map(|one| one * one).sum::<f64>() / found.residuals.len() as f64;
    if field.sqrt() > MOST_NOISE {
        wrong.push(format!(
            "the points lie {:.1} % (root mean square) off the ellipsoid, {} counts: was it at rest, and far from iron?",
            100.0 * field.sqrt(),
            digits(found.scatter)
        ));
    }
    wrong
}

fn describe(found: &Ellipsoid, points: &[Vector3<f64>], arguments: &EllipsoidArguments) -> Report {
    let convention = match arguments.angles {
        Convention::Thesis => "angles as in Eq 4.44 of the thesis",
        Convention::Standard => "angles as in public code",
    };
    let mut report = Report {
        title: format!("Ellipsoid of {}", arguments.channels.join(", ")),
        columns: ["parameter", "value", "± sigma", "unit"].map(String::from).to_vec(),
        ..Report::default()
    };
    let nine = found.nine(arguments.angles);
    let names = ["a", "b", "c", "x0", "y0", "z0", "rho", "phi", "lambda"];
    for (k, name) in names.into_iter().enumerate() {
        let (unit, factor) = match k {
            0..=2 => ("counts per unit", 1.0),
            3..=5 => ("counts", 1.0),
            _ => ("deg", 1_f64.to_degrees()),
        };
        let cells = [nine.values[k] * factor, nine.sigmas[k] * factor].map(|value| format!("{value:.5}"));
        report.rows.push(
            [name.to_string()]
                .into_iter()
                .chain(cells)
                .chain([unit.to_string()])
                .collect(),
        );
    }
    report.remarks.push(convention.into());
    report
        .remarks
        .push(format!("{} points, noise {:.3} counts", points.len(), found.scatter));
    let coverage = Coverage::of(points.iter().map(|v| found.field(v)));
    let share = 100.0 * coverage.share();
    if coverage.share() < ENOUGH || !coverage.missing().is_empty() {
        let missing = coverage.missing();
        let towards = if missing.is_empty() {
            "everywhere".into()
        } else {
            missing.join(", ")
        };
        report.wrong.push(format!(
            "only {share:.0} % of the sphere was covered; points are missing towards {towards}"
        ));
        report
            .next
            .push("turn the triad through the empty parts of the map, and run again".into());
    } else {
        report.remarks.push(format!("{share:.0} % of the sphere was covered"));
        report
            .next
            .push("compare with the last set: ground calibration diff".into());
    }
    report.picture(Figure::map(
        "Points on the sphere: height by longitude, in percent of the fullest cell",
        &coverage.map(),
    ));
    let relative = found
        .residuals
        .iter()
        .enumerate()
        .map(|(k, residual)| (k as f64, 100.0 * residual))
        .collect();
    report.picture(Figure::of(
        "Residuals",
        1,
        &[Panel {
            title: String::new(),
            x: Axis::linear("point"),
            y: Axis::linear("1 − h/R [%]"),
            layers: vec![Layer::new("points", 0, Marks::Dots(relative))],
        }],
    ));
    report
}
