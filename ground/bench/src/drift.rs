//! `ground calibrate drift`: the tests of a dry-tuned gyro.
//!
//! In: a table for each test that was made, in `x` of the gyro. Out: on the terminal the figures of each and a verdict;
//! in a folder, `index.html` with tables and residual plots. The modules below say what each test needs and refuses.

pub mod positions;
pub mod report;
pub mod rotor;
pub mod scale;
pub mod sensitivity;
pub mod stability;

use std::{
    fs, io,
    path::{Path, PathBuf},
};

use self::{positions::Position, report::Section};
use crate::{
    allan::record::{Selection, records},
    table::{Table, TableError},
};

/// Tests a dry-tuned gyro: sensitivity to acceleration, scale factor, rotor, drift stability
#[derive(Clone, Debug, clap::Args)]
#[command(arg_required_else_help = true)]
pub struct DriftArguments {
    /// Multi-position test: columns inner_deg, middle_deg, output
    #[arg(long, value_name = "FILE", requires = "latitude_deg")]
    positions: Option<PathBuf>,
    /// Latitude of the table, south negative
    #[arg(
        long = "latitude-deg",
        alias = "latitude",
        value_name = "DEG",
        allow_negative_numbers = true
    )]
    latitude_deg: Option<f64>,
    /// Scale factor: columns rate, output
    #[arg(long, value_name = "FILE")]
    scale: Option<PathBuf>,
    /// Full scale, in the unit of the rate [default: the largest rate given]
    #[arg(long, value_name = "RATE", requires = "scale")]
    full_scale: Option<f64>,
    /// Scale stability at a constant rate: columns t_s, output
    #[arg(long, value_name = "FILE", requires = "steady_rate")]
    steady: Option<PathBuf>,
    /// The constant rate
    #[arg(long, value_name = "RATE", allow_negative_numbers = true)]
    steady_rate: Option<f64>,
    /// A figure a turn-on: column value
    #[arg(long, value_name = "FILE")]
    turn_on: Option<PathBuf>,
    /// Peaks of the free oscillation: columns t_s, amplitude
    #[arg(long, value_name = "FILE")]
    decay: Option<PathBuf>,
    /// Oscillation periods over spin speeds: columns speed_hz, period_s
    #[arg(long, value_name = "FILE")]
    tuning: Option<PathBuf>,
    /// Record at rest: columns t_s, output
    #[arg(long, value_name = "FILE")]
    rest: Option<PathBuf>,
    /// Folder for the page
    #[arg(long, value_name = "FOLDER", default_value = "reports/drift")]
    out: PathBuf,
    /// Print the figures as JSON
    #[arg(long)]
    pub(crate) json: bool,
}

/// Why there is no report.
#[derive(Debug, thiserror::Error)]
pub enum DriftError {
    /// A table cannot be read.
    #[error(transparent)]
    Table(#[from] TableError),
    /// A test does not say what it should.
    #[error("{file}: {why}")]
    Test {
        /// Its table.
        file: PathBuf,
        /// What is missing or wrong.
        why: String,
    },
    /// A plot cannot be drawn.
    #[error(transparent)]
    Chart(#[from] chart::ChartError),
    /// The folder cannot be written.
    #[error("{file}: {error}")]
    Write {
        /// Which file.
        file: PathBuf,
        /// Why.
        error: io::Error,
    },
}

/// Evaluates the tests given; `false` if one says that something is wrong.
///
/// # Errors
/// When a table cannot be read, a test is not conclusive, or the report not written.
pub fn run(arguments: &DriftArguments) -> Result<bool, DriftError> {
    let mut sections = Vec::new();
    if let (Some(file), Some(latitude_deg)) = (&arguments.positions, arguments.latitude_deg) {
        let rows = columns(file, ["inner_deg", "middle_deg", "output"])?;
        let test: Vec<(Position, f64)> = rows
            .iter()
            .map(|row| (Position::on_table(row[0], row[1], latitude_deg), row[2]))
            .collect();
        let found = sensitivity::sensitivity(&test).map_err(|error| inconclusive(file, error))?;
        let positions: Vec<Position> = test.iter().map(|(position, _)| *position).collect();
        sections.push(report::sensitivity(&found, &sensitivity::unidentifiable(&positions))?);
    }
    if let Some(file) = &arguments.scale {
        let points: Vec<(f64, f64)> = pairs(file, ["rate", "output"])?;
        let found = scale::scale(&points, arguments.full_scale).map_err(|error| inconclusive(file, error))?;
        sections.push(report::scale(&found, &points)?);
    }
    if let (Some(file), Some(rate)) = (&arguments.steady, arguments.steady_rate) {
        let found = scale::steadiness(&pairs(file, ["t_s", "output"])?, rate, 0.0);
        sections.push(report::steadiness(&found.map_err(|error| inconclusive(file, error))?));
    }
    if let Some(file) = &arguments.turn_on {
        let values: Vec<f64> = columns(file, ["value"])?.into_iter().map(|[value]| value).collect();
        sections.push(report::turn_on(
            &scale::spread(&values).map_err(|error| inconclusive(file, error))?,
        ));
    }
    if let Some(file) = &arguments.decay {
        let found = rotor::decay_time(&pairs(file, ["t_s", "amplitude"])?);
        sections.push(report::decay(found.map_err(|error| inconclusive(file, error))?));
    }
    if let Some(file) = &arguments.tuning {
        let found = rotor::tuning(&pairs(file, ["speed_hz", "period_s"])?);
        sections.push(report::tuning(&found.map_err(|error| inconclusive(file, error))?));
    }
    if let Some(file) = &arguments.rest {
        sections.push(rest(file)?);
    }
    if !arguments.json {
        sections.iter().for_each(|section| print!("{}", section.text()));
    }
    let tests = serde_json::Value::from_iter(sections.iter().map(Section::json));
    let good = !sections.iter().any(Section::is_wrong);
    let blocks: Vec<chart::Block> = sections.into_iter().flat_map(Section::into_blocks).collect();
    let page = arguments.out.join("index.html");
    let written = fs::create_dir_all(&arguments.out).and_then(|()| {
        fs::write(
            &page,
            chart::html("Dry-tuned gyro", "Drift, scale factor and rotor.", &blocks),
        )
    });
    written.map_err(|error| DriftError::Write {
        file: page.clone(),
        error,
    })?;
    if arguments.json {
        println!("{:#}", serde_json::json!({"good": good, "tests": tests, "page": page}));
    } else {
        println!("{}", page.display());
    }
    Ok(good)
}

fn rest(file: &Path) -> Result<Section, DriftError> {
    let selection = Selection {
        columns: vec!["output".into()],
        ..Selection::default()
    };
    let mut found = records(&Table::open(file)?, &selection)?;
    let Some((_, series)) = found.pop() else {
        return Err(inconclusive(file, "no column output"));
    };
    if !series.gaps.is_empty() {
        return Err(inconclusive(
            file,
            "the record has gaps; give its longest stretch without one",
        ));
    }
    let found = stability::stability(&series.values, series.step_s).map_err(|error| inconclusive(file, error))?;
    Ok(report::stability(&found))
}

fn inconclusive(file: &Path, why: impl ToString) -> DriftError {
    DriftError::Test {
        file: file.into(),
        why: why.to_string(),
    }
}

fn columns<const N: usize>(file: &Path, names: [&str; N]) -> Result<Vec<[f64; N]>, TableError> {
    let table = Table::open(file)?;
    let mut found = [0; N];
    for (index, name) in found.iter_mut().zip(names) {
        let missing = || {
            table.error(
                0,
                usize::MAX,
                &format!("has no column {name}; it has {}", table.columns.join(", ")),
            )
        };
        *index = table.column(name).ok_or_else(missing)?;
    }
    let row = |row| {
        let mut values = [0.0; N];
        for (value, column) in values.iter_mut().zip(found) {
            *value = table.required(row, column)?;
        }
        Ok(values)
    };
    table.rows.iter().map(row).collect()
}

fn pairs(file: &Path, names: [&str; 2]) -> Result<Vec<(f64, f64)>, TableError> {
    Ok(columns(file, names)?.into_iter().map(|[x, y]| (x, y)).collect())
}
