//! The methods beside each other: one log through MT, LMS EC and MV SEC parameters, each with TRIAD and the filter.
//!
//! In: a unit's cycles and parameter sets. Out: a line a set: norms of specific force and field with their scatter, which
//! a good calibration keeps constant however the unit is turned, and against a reference the errors of TRIAD and filter.
//! MT is what is compiled in; LMS EC and MV SEC are sets of `ground calibrate multi-position`, `rate-table` and
//! `ellipsoid`, and a set says itself which of them found its accelerometers, magnetometers and gyros.

use std::path::Path;

use bench::set::{Set as File, image};
use emems::{
    calibration::{Method, Ranges, Set},
    estimate::Estimator,
    unit::Settings,
};
use logs::{
    cycles::Cycle,
    flight::{Comparison, EstimatedStep, Flight, Taken},
    recording::Row,
    score::Rmse,
};
use nalgebra::Vector3;

/// A log by one set.
pub struct Run {
    /// Its methods and where they are from.
    pub name: String,
    /// What came of it.
    pub flight: Flight,
    /// Against the reference, where there is one and they meet.
    pub met: Option<Comparison>,
}

/// Why a set cannot be used.
#[derive(Debug, thiserror::Error)]
#[error("{file}: {why}")]
pub struct NoSet {
    /// Its file.
    pub file: String,
    /// What is wrong with it.
    pub why: String,
}

/// What is compiled in, with its name.
pub fn compiled_in(settings: &Settings) -> (String, Set) {
    ("MT, compiled in".into(), Set::nominal(Ranges::of(settings)))
}

/// A set of `ground calibrate`, with its name.
pub fn read(file: &Path, settings: &Settings) -> Result<(String, Set), NoSet> {
    let refused = |why: String| NoSet {
        file: file.display().to_string(),
        why,
    };
    let text = std::fs::read_to_string(file).map_err(|error| refused(error.to_string()))?;
    let set = File::parse(&text).map_err(|error| refused(error.to_string()))?;
    let image = image::image(&set, Ranges::of(settings)).map_err(|error| refused(error.to_string()))?;
    let methods = image.set.identity.methods.map(|method| match method {
        Method::Mt => "MT",
        Method::LmsEc => "LMS EC",
        Method::MvSec => "MV SEC",
    });
    let methods = match methods {
        [acc, mag, gyro] if acc == mag && mag == gyro => acc.to_string(),
        [acc, mag, gyro] => format!("{acc} acc, {mag} mag, {gyro} gyro"),
    };
    let name = file.file_name().unwrap_or(file.as_os_str()).to_string_lossy();
    Ok((format!("{methods}, {name}"), image.set))
}

/// The log by each of the sets, with the launch rails and sites that the unit took.
pub fn run(
    sets: Vec<(String, Set)>,
    settings: &Settings,
    cycles: &[Cycle],
    taken: &[Taken],
    reference: Option<&[Row]>,
) -> Vec<Run> {
    let of = |(name, set)| {
        let flight = Flight::of_unit(Estimator::new(set, &settings.site), &settings.site, cycles, taken);
        let met = reference.and_then(|rows| flight.compare(rows));
        Run { name, flight, met }
    };
    sets.into_iter().map(of).collect()
}

/// A line a run.
pub fn format(runs: &[Run]) -> String {
    let mut text = format!(
        "{:<34}{:>18}{:>18}{:>22}{:>22}\n",
        "method", "force [m/s2]", "field [uT]", "TRIAD RMSE [deg]", "filter RMSE [deg]"
    );
    for run in runs {
        let norms = |vector: fn(&EstimatedStep) -> Option<Vector3<f64>>| {
            let all: Vec<f64> = run
                .flight
                .estimates
                .iter()
                .filter_map(vector)
                .map(|v| v.norm())
                .collect();
            let mean = all.iter().sum::<f64>() / all.len() as f64;
            let variance = all.iter().map(|norm| (norm - mean).powi(2)).sum::<f64>() / all.len() as f64;
            format!("{mean:.3} sd {:.3}", variance.sqrt())
        };
        let rmse = |rmse: Option<Rmse>| match rmse {
            Some(rmse) => format!(
                "{:.2} ({:.2}, {:.2})",
                rmse.total_deg, rmse.heading_deg, rmse.inclination_deg
            ),
            None => "-".into(),
        };
        text += &format!(
            "{:<34}{:>18}{:>18}{:>22}{:>22}\n",
            run.name,
            norms(|estimate| estimate.force_b),
            norms(|estimate| estimate.field_b_ut),
            rmse(run.met.as_ref().and_then(|met| met.triad)),
            rmse(run.met.as_ref().map(|met| met.rmse)),
        );
    }
    text + "total (heading, inclination)\n"
}
