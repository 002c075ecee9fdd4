//! `ground calibrate ellipsoid`: a triad without controlled inputs.

use std::path::PathBuf;

use chart::{Axis, Figure, Layer, Marks, Panel};
use nalgebra::{Matrix3, Vector3};

use super::{CalibrateError, Output, read_nominal};
use crate::{
    coverage::{Coverage, ENOUGH},
    ellipsoid::{Convention, Ellipsoid},
    log,
    report::Report,
    set::Entry,
    stretches,
};

/// A triad turned every way in a field of known strength, or in gravity, at rest
///
/// FILE is a raw log (packets, or a table with a column a channel); every sample is a point, or with --still every stretch
/// at rest. The nine parameters do not say how the triad sits in the body: --unit gives that for the set.
#[derive(Clone, Debug, clap::Args)]
pub struct Arguments {
    /// Raw log
    file: PathBuf,
    /// The three channels x, y, z, separated by commas
    #[arg(long, value_delimiter = ',', required = true)]
    channels: Vec<String>,
    /// Strength of the field [uT], or gravity [m/s2]
    #[arg(long)]
    strength: f64,
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

pub fn run(arguments: &Arguments) -> Result<bool, CalibrateError> {
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
    let found = Ellipsoid::fit(&points, arguments.strength).map_err(|error| fail(error.to_string()))?;

    let mut report = describe(&found, &points, arguments);
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

fn describe(found: &Ellipsoid, points: &[Vector3<f64>], arguments: &Arguments) -> Report {
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
