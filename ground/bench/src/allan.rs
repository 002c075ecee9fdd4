//! `ground allan`: the noise of records, as deviations over averaging times.
//!
//! In: a table of records, one column a sensor. Out: on the terminal a verdict and the coefficients of each; in a folder,
//! `index.html` with plots and tables, and each table as CSV. The modules below say how each step is done.

pub mod analysis;
pub mod bounds;
pub mod covariance;
pub mod deviation;
pub mod fit;
pub mod motion;
pub mod noise;
pub mod outliers;
pub mod phase;
pub mod record;
pub mod report;
pub mod series;
#[cfg(test)]
mod simulate;
pub mod terms;
#[cfg(test)]
mod thesis;

use std::{
    fs, io,
    path::{Path, PathBuf},
};

use indicatif::{ProgressBar, ProgressStyle};

use self::{
    analysis::{Analysis, Options, analyse},
    phase::Input,
    record::{Selection, records},
};
use crate::{
    report::five_digits,
    table::{Table, TableError},
};

/// Measures the noise of records: Allan, modified, time and Hadamard deviations, and what they are made of
#[derive(Clone, Debug, clap::Args)]
pub struct AllanArguments {
    /// Table of records: CSV, tab-separated or LabVIEW; decimal points or commas
    file: PathBuf,
    /// Columns to analyse; all but the times if none is named
    #[arg(long = "column", value_name = "NAME")]
    columns: Vec<String>,
    /// Column of times in seconds
    #[arg(long, value_name = "NAME", conflicts_with = "rate_hz")]
    time: Option<String>,
    /// Sampling rate of a table without times
    #[arg(long = "rate-hz", alias = "rate", value_name = "HZ", value_parser = positive)]
    rate_hz: Option<f64>,
    /// What the columns hold
    #[arg(long, value_enum, default_value = "rate")]
    input: Input,
    /// Unit of the rate; deg/s, deg/h and rad/s give coefficients in a gyro's customary units
    #[arg(long = "rates", alias = "unit", value_name = "UNIT", default_value = "unit")]
    unit: String,
    /// Confidence of bounds and intervals
    #[arg(long, default_value_t = 0.95, value_parser = share)]
    confidence: f64,
    /// Remove rates farther than this many robust deviations from their surroundings (5 is usual); a jump in an angle stays
    #[arg(long, value_name = "DEVIATIONS", value_parser = positive)]
    outliers: Option<f64>,
    /// Folder for the page and the tables [default: reports/allan-FILE]
    #[arg(long, value_name = "FOLDER")]
    out: Option<PathBuf>,
    /// Print verdicts and coefficients as JSON
    #[arg(long)]
    pub json: bool,
}

fn positive(text: &str) -> Result<f64, String> {
    let value: f64 = text.parse().map_err(|_| "not a number")?;
    if value > 0.0 && value.is_finite() {
        Ok(value)
    } else {
        Err("must be positive".into())
    }
}

fn share(text: &str) -> Result<f64, String> {
    let value = positive(text)?;
    if value < 1.0 {
        Ok(value)
    } else {
        Err("must lie between 0 and 1".into())
    }
}

/// Why there is no report.
#[derive(Debug, thiserror::Error)]
pub enum AllanError {
    /// The table cannot be read.
    #[error(transparent)]
    Table(#[from] TableError),
    /// It was done, and the verdict says what is wrong.
    #[error("not good; what is wrong stands above")]
    NotGood,
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

/// Analyses a file.
///
/// # Errors
/// When it cannot be read, or the report not written; and when a record is not good, so that a script does not take its
/// coefficients for noise.
pub fn run(arguments: &AllanArguments) -> Result<(), AllanError> {
    let table = Table::open(&arguments.file)?;
    let selection = Selection {
        columns: arguments.columns.clone(),
        time: arguments.time.clone(),
        rate_hz: arguments.rate_hz,
    };
    let records = records(&table, &selection)?;
    drop(table);
    let options = Options {
        input: arguments.input,
        confidence: arguments.confidence,
        outliers: arguments.outliers,
    };
    let style =
        ProgressStyle::with_template("{msg} {bar:40} {percent} %").unwrap_or_else(|_| ProgressStyle::default_bar());
    let bar = ProgressBar::new(1_000_000 * records.len() as u64).with_style(style);
    let mut analyses = Vec::new();
    for (name, series) in records {
        bar.set_message(name.clone());
        analyses.push(analyse(&name, series, &options, |share| bar.inc((share * 1e6) as u64)));
    }
    bar.finish_and_clear();
    let page = write(&analyses, arguments)?;
    if arguments.json {
        let records: Vec<_> = analyses
            .iter()
            .map(|analysis| json(analysis, &arguments.unit))
            .collect();
        println!("{}", serde_json::json!({ "records": records, "page": page }));
    } else {
        for analysis in &analyses {
            print(analysis, &arguments.unit);
        }
        println!("{}", page.display());
    }
    if analyses.iter().all(is_good) {
        Ok(())
    } else {
        Err(AllanError::NotGood)
    }
}

/// Whether the verdict finds nothing wrong.
fn is_good(analysis: &Analysis) -> bool {
    !report::verdict(analysis).iter().any(|line| line.starts_with("wrong"))
}

fn json(analysis: &Analysis, unit: &str) -> serde_json::Value {
    let said = report::verdict(analysis);
    serde_json::json!({
        "name": analysis.name,
        "samples": analysis.used,
        "step_s": analysis.step_s,
        "good": is_good(analysis),
        "said": said,
        "coefficients": report::coefficients(analysis, unit).into_iter().collect::<std::collections::BTreeMap<_, _>>(),
    })
}

fn print(analysis: &Analysis, unit: &str) {
    let (gaps, missing) = analysis.gaps;
    println!(
        "{}: {} samples every {} s, {gaps} gaps of {missing} samples, {} outliers removed",
        analysis.name,
        analysis.used,
        five_digits(analysis.step_s),
        analysis.outliers.len()
    );
    for (name, value) in report::coefficients(analysis, unit) {
        println!("  {name:24} {value}");
    }
    for line in report::verdict(analysis) {
        println!("  {line}");
    }
}

fn write(analyses: &[Analysis], arguments: &AllanArguments) -> Result<PathBuf, AllanError> {
    let stem = arguments
        .file
        .file_stem()
        .unwrap_or_default()
        .to_string_lossy()
        .into_owned();
    let folder = arguments
        .out
        .clone()
        .unwrap_or_else(|| Path::new("reports").join(format!("allan-{stem}")));
    let put = |file: PathBuf, text: String| {
        packets::output::replace_with(&file, text).map_err(|error| AllanError::Write { file, error })
    };
    fs::create_dir_all(&folder).map_err(|error| AllanError::Write {
        file: folder.clone(),
        error,
    })?;
    let mut blocks = Vec::new();
    for (k, analysis) in analyses.iter().enumerate() {
        blocks.extend(report::blocks(analysis, &arguments.unit)?);
        let rows = report::table(analysis)
            .iter()
            .map(|row| row.join(",") + "\n")
            .collect::<String>();
        // Column names are free text, so that files are numbered.
        put(
            folder.join(format!("{}.csv", k + 1)),
            format!("{}\n{rows}", report::COLUMNS.join(",")),
        )?;
    }
    let about = format!(
        "Noise of {stem}; bounds and intervals at {} %.",
        100.0 * arguments.confidence
    );
    let page = folder.join("index.html");
    put(page.clone(), chart::html(&format!("Noise: {stem}"), &about, &blocks))?;
    Ok(page)
}
