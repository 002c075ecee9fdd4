//! The calibration set as the twin's nominal unit (`unit.toml` of a gap case).
//!
//! In: a set and the unit file it refines. Out: that file with `axis_b`, `lsb`, `bias`, `noise_sigma`, `bias_sigma`,
//! `scale_sigma` and `axis_sigma_rad` of every calibrated channel in place of its own, everything else untouched. Counts
//! become units by the channel's own scale: `measured = (axis_b . truth + bias) / lsb`, so `lsb = 1/K`, `bias = b/K`.
//!
//! Noise stays the unit file's unless it is missing: a calibration row is a mean of many samples, and its scatter is no
//! noise of one. Refused: a file that is no unit, and calibrated channels it does not have.

use toml::{Table, Value};

use super::{Entry, Set, SetError};

/// Refines a unit file; `warm_c` is the temperature the twin's parameters shall hold at, if not the set's own.
///
/// # Errors
/// When the file is no unit, or lacks a channel of the set.
pub fn refine(unit: &str, set: &Set, warm_c: Option<f64>) -> Result<String, SetError> {
    let mut table: Table = unit
        .parse()
        .map_err(|error: toml::de::Error| SetError::Syntax(error.to_string()))?;
    let channels = table.get_mut("channel").and_then(Value::as_array_mut);
    let channels = channels.ok_or_else(|| SetError::Syntax("the unit file has no [[channel]]".into()))?;
    for entry in &set.channels {
        let named = |value: &&mut Value| value.get("name").and_then(Value::as_str) == Some(&entry.name);
        let channel = channels.iter_mut().find(named).and_then(Value::as_table_mut);
        let channel =
            channel.ok_or_else(|| SetError::Syntax(format!("the unit file has no channel {}", entry.name)))?;
        for (key, value) in values(entry, warm_c) {
            channel.insert(key.into(), value);
        }
    }
    table.insert("name".into(), Value::String(set.unit.clone()));
    toml::to_string(&table).map_err(|error| SetError::Syntax(error.to_string()))
}

fn values(entry: &Entry, warm_c: Option<f64>) -> Vec<(&'static str, Value)> {
    let t = match (warm_c, entry.reference_c) {
        (Some(warm_c), Some(reference_c)) => warm_c - reference_c,
        _ => 0.0,
    };
    let series = |coefficients: &[f64]| coefficients.iter().rev().fold(0.0, |sum, c| sum * t + c);
    let sensitivity_b = entry.sensitivity() * (1.0 + t * series(&entry.scale_per_k));
    let scale = sensitivity_b.norm();
    let axis_b = sensitivity_b / scale;
    let covariance = entry.covariance();
    let block = covariance.fixed_view::<3, 3>(0, 0).into_owned();
    let along = axis_b.dot(&(block * axis_b)).max(0.0);
    let across = (block.trace() - along).max(0.0) / 2.0;
    vec![
        (
            "axis_b",
            Value::Array(axis_b.iter().map(|&c| Value::Float(c)).collect()),
        ),
        ("lsb", Value::Float(1.0 / scale)),
        ("bias", Value::Float(series(&entry.bias_counts) / scale)),
        ("bias_sigma", Value::Float(covariance[(3, 3)].max(0.0).sqrt() / scale)),
        ("scale_sigma", Value::Float(along.sqrt() / scale)),
        ("axis_sigma_rad", Value::Float(across.sqrt() / scale)),
    ]
}
