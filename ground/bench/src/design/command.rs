//! `ground design`: a plan for table time, as a table that `ground calibrate` reads back once its outputs are filled in.

use std::{fmt::Write as _, path::PathBuf};

use chart::{Block, Figure};

use super::{Means, Plan, TooShort, Wanted, plan};
use crate::{
    calibrate::{CalibrateError, TableArguments, read_nominal},
    coverage::Coverage,
    experiment::Excitation,
    report::Report,
    turntable::Turning,
};

/// Plans table time: positions and runs that determine the wanted parameters best
#[derive(Clone, Debug, clap::Args)]
pub struct DesignArguments {
    /// Gyros on a rate table, or accelerometers in positions
    #[arg(value_enum)]
    sensors: Sensors,
    /// Nominal unit (unit.toml): axes and noise
    #[arg(long, value_name = "FILE")]
    unit: PathBuf,
    /// Time on the table (min)
    #[arg(long)]
    minutes: f64,
    /// Time a run is measured for (s)
    #[arg(long = "run-s", alias = "run", value_name = "S", default_value_t = 60.0)]
    run: f64,
    /// Time between two runs (s)
    #[arg(long = "between-s", alias = "between", value_name = "S", default_value_t = 20.0)]
    between: f64,
    /// Rate of the runs (deg/s)
    #[arg(long = "rate-deg-s", alias = "rate", value_name = "DEG/S", default_value_t = 200.0)]
    rate: f64,
    /// Steps of the table's angles (deg)
    #[arg(long = "step-deg", alias = "step", value_name = "DEG", default_value_t = 30.0)]
    step: f64,
    /// What is wanted, separated by commas
    #[arg(long, value_enum, value_delimiter = ',', default_value = "scale,axis,bias")]
    want: Vec<Wanted>,
    #[command(flatten)]
    table: TableArguments,
    /// Write the plan to this table
    #[arg(long = "table", alias = "out", value_name = "FILE")]
    out: Option<PathBuf>,
    /// Write a page to this file
    #[arg(long, value_name = "FILE")]
    page: Option<PathBuf>,
}

impl DesignArguments {
    /// Whether the plan goes to standard output.
    pub fn prints_the_plan(&self) -> bool {
        self.out.is_none()
    }
}

#[derive(Clone, Copy, Debug, PartialEq, clap::ValueEnum)]
enum Sensors {
    Gyros,
    Accelerometers,
}

/// Why there is no plan.
#[derive(Debug, thiserror::Error)]
pub enum DesignError {
    /// A file.
    #[error(transparent)]
    Calibrate(#[from] CalibrateError),
    /// Too little time.
    #[error(transparent)]
    TooShort(#[from] TooShort),
    /// The unit file lacks something, or a number makes no sense.
    #[error("{0}")]
    Missing(String),
}

/// Runs `ground design`.
///
/// # Errors
/// When the unit file lacks axes or noise, or there is too little time.
pub fn run(arguments: &DesignArguments) -> Result<(), DesignError> {
    let means = means(arguments)?;
    let plan = plan(&means, &arguments.want)?;
    let table = table(&plan);
    match &arguments.out {
        Some(path) => packets::output::replace_with(path, &table)
            .map_err(|error| DesignError::Missing(format!("{} cannot be written: {error}", path.display())))?,
        None => print!("{table}"),
    }
    let report = describe(&plan, &means, arguments);
    let about = format!("{} min on the table, {}", arguments.minutes, arguments.unit.display());
    report
        .finish(arguments.page.as_deref(), &about, false)
        .map_err(DesignError::Missing)
}

fn describe(plan: &Plan, means: &Means, arguments: &DesignArguments) -> Report {
    let (unit, command) = match means.kind {
        Excitation::Rate => ("rad/s", "rate-table"),
        Excitation::Force => ("m/s²", "multi-position"),
    };
    let row = |what: &str, sigma: f64, unit: &str| vec![what.into(), format!("{sigma:.2e}"), unit.into()];
    let mut report = Report {
        title: format!("Plan of {} runs", plan.runs.len()),
        columns: ["wanted", "± sigma", "unit"].map(String::from).to_vec(),
        rows: vec![
            row("scale", plan.scale_sigma, "relative"),
            row("axis", plan.axis_sigma_rad, "rad"),
            row("bias", plan.bias_sigma, unit),
        ],
        remarks: plan.unobservable.iter().map(|line| format!("unseen: {line}")).collect(),
        ..Report::default()
    };
    let file = arguments
        .out
        .as_ref()
        .map_or("it".into(), |path| path.display().to_string());
    report.next.push(format!(
        "run the plan, put a mean a channel into {file} as further columns, then: ground calibrate {command}"
    ));
    let directions = plan.runs.iter().map(|run| run.excitation_b);
    report.picture(Figure::map(
        "Runs by direction in b: height by longitude, in percent of the fullest cell",
        &Coverage::of(directions).map(),
    ));
    let text = table(plan);
    let mut lines = text.lines().map(|line| line.split(',').map(String::from).collect());
    report.blocks.push(Block::Table {
        columns: lines.next().unwrap_or_default(),
        rows: lines.collect(),
    });
    report
}

fn means(arguments: &DesignArguments) -> Result<Means, DesignError> {
    let nominal = read_nominal(&arguments.unit)?;
    let (kind, sensor) = match arguments.sensors {
        Sensors::Gyros => (Excitation::Rate, "gyro"),
        Sensors::Accelerometers => (Excitation::Force, "accelerometer"),
    };
    let channels: Vec<_> = nominal
        .channels
        .iter()
        .filter(|channel| channel.sensor == sensor)
        .collect();
    let names: Vec<String> = channels.iter().map(|channel| channel.name.clone()).collect();
    let axes_b = nominal
        .axes_b(&names)
        .map_err(|name| DesignError::Missing(format!("{name} has no axis_b")))?;
    let noise = channels
        .iter()
        .filter_map(|channel| channel.noise_sigma)
        .fold(0.0, f64::max);
    let numbers = [arguments.minutes, arguments.run, arguments.rate, arguments.step];
    if axes_b.is_empty() || noise <= 0.0 {
        return Err(DesignError::Missing(format!(
            "the unit file has no {sensor} with axis_b and noise_sigma"
        )));
    }
    if !numbers.iter().all(|number| number.is_finite() && *number > 0.0)
        || arguments.between.is_nan()
        || arguments.between < 0.0
    {
        return Err(DesignError::Missing(
            "minutes, run, rate and step must be positive numbers".into(),
        ));
    }
    let samples = (arguments.run / nominal.cycle_s.unwrap_or(0.2)).max(1.0);
    Ok(Means {
        kind,
        mount: arguments.table.mount(),
        site: arguments.table.site(),
        time_s: 60.0 * arguments.minutes,
        run_s: arguments.run,
        between_s: arguments.between,
        rate_rad_s: arguments.rate.to_radians(),
        step_deg: arguments.step,
        axes_b,
        mean_sigma: noise / samples.sqrt(),
    })
}

fn table(plan: &Plan) -> String {
    let rates = plan.runs.iter().any(|run| run.turning.is_some());
    let mut text = String::from(if rates {
        "seq,inner_deg,outer_deg,turning,rate_deg_s\n"
    } else {
        "seq,inner_deg,outer_deg\n"
    });
    for (k, run) in plan.runs.iter().enumerate() {
        // Writing to a string cannot fail.
        let _ = write!(
            text,
            "{},{:.3},{:.3}",
            k + 1,
            run.pose.inner_rad.to_degrees(),
            run.pose.outer_rad.to_degrees()
        );
        if let Some((turning, rate)) = run.turning {
            let name = if turning == Turning::Inner { "inner" } else { "outer" };
            let _ = write!(text, ",{name},{:.3}", rate.to_degrees());
        }
        text.push('\n');
    }
    text
}
