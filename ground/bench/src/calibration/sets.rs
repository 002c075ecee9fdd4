//! `ground calibration diff` and `unit`: what two sets say differently, and a set as the twin's nominal unit.

use std::path::PathBuf;

use chart::{Axis, Figure, Layer, Marks, Panel};

use crate::{
    calibrate::{CalibrateError, read_set, read_text},
    report::Report,
    set::{diff, unit},
};

/// Changes beyond this many sigmas are no chance: one in 370 is.
const SIGNIFICANT: f64 = 3.0;

/// What two calibration sets say differently, in sigma
#[derive(Clone, Debug, clap::Args)]
pub struct Diff {
    /// Earlier set
    earlier: PathBuf,
    /// Later set
    later: PathBuf,
    /// Write a page to this file
    #[arg(long, value_name = "FILE")]
    page: Option<PathBuf>,
    /// Print the report as JSON
    #[arg(long)]
    pub json: bool,
}

/// A calibration set as the twin's nominal unit
#[derive(Clone, Debug, clap::Args)]
pub struct Unit {
    /// Calibration set
    set: PathBuf,
    /// Unit file it refines
    #[arg(long, value_name = "FILE")]
    unit: PathBuf,
    /// Unit file to write
    #[arg(long = "refined", alias = "out", value_name = "FILE")]
    out: PathBuf,
    /// Temperature the twin's parameters hold at (degC); without it each channel's reference
    #[arg(
        long = "temperature-c",
        alias = "temperature",
        value_name = "DEGC",
        allow_negative_numbers = true
    )]
    temperature: Option<f64>,
}

pub fn diff(arguments: &Diff) -> Result<bool, CalibrateError> {
    let found = diff::diff(&read_set(&arguments.earlier)?, &read_set(&arguments.later)?);
    let mut report = Report {
        title: "Calibration sets".into(),
        columns: [
            "channel", "scale %", "sigma", "bias", "sigma", "axis deg", "sigma", "distance",
        ]
        .map(String::from)
        .to_vec(),
        ..Report::default()
    };
    for moved in &found.moved {
        let cell = |change: diff::Change, factor: f64| {
            [
                format!("{:+.5}", change.change * factor),
                format!("{:+.1}", change.sigmas()),
            ]
        };
        let mut row = vec![moved.channel.clone()];
        row.extend(cell(moved.scale, 100.0));
        row.extend(cell(moved.bias, 1.0));
        row.extend(cell(moved.axis_rad, 1_f64.to_degrees()));
        row.push(
            moved
                .distance
                .map_or("-".into(), |(distance, of)| format!("{distance:.1} of {of}")),
        );
        report.rows.push(row);
        for (what, change) in [("scale", moved.scale), ("bias", moved.bias), ("axis", moved.axis_rad)] {
            if change.sigmas().abs() > SIGNIFICANT {
                report.wrong.push(format!(
                    "{}: {what} moved by {:+.1} sigma",
                    moved.channel,
                    change.sigmas()
                ));
            }
        }
    }
    report.wrong.extend(
        found
            .gone
            .iter()
            .map(|name| format!("{name} is in the earlier set only")),
    );
    report
        .remarks
        .extend(found.come.iter().map(|name| format!("{name} is in the later set only")));
    report.next.push(if report.wrong.is_empty() {
        "either set will do: nothing moved beyond what chance does".into()
    } else {
        "find out what happened between the two: turn-on, temperature, a blow, another part".into()
    });
    report.picture(picture(&found.moved));
    let about = format!("{} to {}", arguments.earlier.display(), arguments.later.display());
    report
        .finish(arguments.page.as_deref(), &about, arguments.json)
        .map_err(CalibrateError::of(&arguments.later))?;
    Ok(report.wrong.is_empty())
}

/// Changes of every channel in sigma, in the order of the table.
fn picture(moved: &[diff::Moved]) -> Result<Figure, chart::ChartError> {
    let dots = |change: fn(&diff::Moved) -> diff::Change| {
        let points = moved.iter().enumerate();
        Marks::Dots(points.map(|(k, one)| (k as f64 + 1.0, change(one).sigmas())).collect())
    };
    let panel = Panel {
        title: String::new(),
        x: Axis::linear("channel, by row of the table"),
        y: Axis::linear("change [sigma]"),
        layers: vec![
            Layer::new("scale", 0, dots(|one| one.scale)),
            Layer::new("bias", 1, dots(|one| one.bias)),
            Layer::new("axis", 2, dots(|one| one.axis_rad)),
        ],
    };
    Figure::of("What moved", 1, &[panel])
}

pub fn unit(arguments: &Unit) -> Result<(), CalibrateError> {
    let set = read_set(&arguments.set)?;
    let fail = CalibrateError::of(&arguments.out);
    let refined = unit::refine(&read_text(&arguments.unit)?, &set, arguments.temperature);
    let refined = refined.map_err(|error| CalibrateError::of(&arguments.unit)(error.to_string()))?;
    packets::output::replace_with(&arguments.out, refined)
        .map_err(|error| fail(format!("cannot be written: {error}")))?;
    println!("{}", arguments.out.display());
    Ok(())
}
