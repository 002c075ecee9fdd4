//! The calibration set: one text file with everything a unit's calibration says.
//!
//! TOML, a `[[channel]]` each, so that two sets differ line by line under review: parameters in counts and SI, covariance,
//! temperatures, part identities, and the SHA-256 of every file it came from. Out of calibrations, merged by channel; in
//! for [`diff`], for the twin's [`mod@unit`] and, in single precision, for the unit itself ([`image`]).
//!
//! Refused: another format, a key that there is not (with the nearest that there is), a covariance that is not square or not
//! positive, an axis without length, two channels with one name.

pub mod diff;
pub mod image;
pub mod send;
pub mod unit;

use std::path::Path;

use nalgebra::{DMatrix, Vector3};
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use twin::keys::meant;

use crate::{controlled::Calibration, ellipsoid::Ellipsoid, experiment::Excitation};

/// What the first line of a set says.
pub const FORMAT: &str = "calibration-set/1";

/// A calibration set.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Set {
    /// [`FORMAT`].
    pub format: String,
    /// Which unit.
    pub unit: String,
    /// Serial number of the unit, which refuses sets of others; 0 is that of a unit that was given none.
    #[serde(default)]
    pub serial: u32,
    /// Number of the set, counted up by whoever calibrates.
    #[serde(default)]
    pub number: u32,
    /// Files it came from.
    #[serde(default, rename = "source")]
    pub sources: Vec<Source>,
    /// Its channels.
    #[serde(default, rename = "channel")]
    pub channels: Vec<Entry>,
}

/// A file the set came from.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Source {
    /// Its name, without folders.
    pub file: String,
    /// SHA-256 of its bytes, hexadecimal.
    pub sha256: String,
}

/// A channel of a set: `counts = (1 + scale_per_k.. ) sensitivity_b . x + bias_counts..`, `x` in SI (field in uT).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Entry {
    /// Its name.
    pub name: String,
    /// accelerometer, magnetometer or gyro.
    pub sensor: String,
    /// Part and serial number, where known.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub part: String,
    /// How it was calibrated.
    pub method: String,
    /// Sensitivity in b [counts per unit].
    pub sensitivity_b: [f64; 3],
    /// Bias polynomial [counts, counts/K, ..].
    pub bias_counts: Vec<f64>,
    /// Scale polynomial without its 1 [1/K, ..].
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub scale_per_k: Vec<f64>,
    /// Where the polynomials have their zero \[degC\]; absent if nobody measured temperature.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reference_c: Option<f64>,
    /// Temperatures it was calibrated at \[degC\].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub valid_c: Option<[f64; 2]>,
    /// Root mean square residual \[counts\].
    pub scatter_counts: f64,
    /// Degrees of freedom the scatter was judged by.
    pub freedom: usize,
    /// Covariance of sensitivity, bias and scale in this order, by rows.
    pub covariance: Vec<Vec<f64>>,
    /// \[s\] by how much later it reads, where `ground gap` found that: the unit has it in its estimator and not in its set.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub delay_s: Option<f64>,
    /// \[m\] its place in b, where `ground gap` found another than was described: for the description.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lever_m: Option<[f64; 3]>,
}

/// Why a set cannot be used.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SetError {
    /// Not TOML of this shape.
    #[error("{0}")]
    Syntax(String),
    /// Another format.
    #[error("its format is \"{0}\", not \"{FORMAT}\"")]
    Format(String),
    /// Two channels with one name.
    #[error("channel {0} stands in it twice")]
    Twice(String),
    /// Numbers that mean nothing.
    #[error("channel {channel}: {why}")]
    Meaningless {
        /// The channel.
        channel: String,
        /// What is wrong.
        why: &'static str,
    },
}

impl Set {
    /// An empty set.
    pub fn new(unit: impl Into<String>) -> Self {
        Set {
            format: FORMAT.into(),
            unit: unit.into(),
            serial: 0,
            number: 0,
            sources: Vec::new(),
            channels: Vec::new(),
        }
    }

    /// Reads a set.
    ///
    /// # Errors
    /// When it is no set, or means nothing.
    pub fn parse(text: &str) -> Result<Self, SetError> {
        let set: Set = toml::from_str(text).map_err(|error| SetError::Syntax(meant(&error.to_string())))?;
        if set.format != FORMAT {
            return Err(SetError::Format(set.format));
        }
        for (k, entry) in set.channels.iter().enumerate() {
            if set.channels.iter().take(k).any(|other| other.name == entry.name) {
                return Err(SetError::Twice(entry.name.clone()));
            }
            entry.check().map_err(|why| SetError::Meaningless {
                channel: entry.name.clone(),
                why,
            })?;
        }
        Ok(set)
    }

    /// As text.
    ///
    /// # Errors
    /// When the library cannot write it.
    pub fn text(&self) -> Result<String, SetError> {
        toml::to_string(self).map_err(|error| SetError::Syntax(error.to_string()))
    }

    /// Adds the bytes of a file to the sources.
    pub fn from_file(&mut self, file: &Path, bytes: &[u8]) {
        let digest = Sha256::digest(bytes);
        let source = Source {
            file: file.file_name().unwrap_or(file.as_os_str()).to_string_lossy().into(),
            sha256: digest.iter().map(|byte| format!("{byte:02x}")).collect(),
        };
        if !self.sources.contains(&source) {
            self.sources.push(source);
        }
    }

    /// Puts channels in, in place of those of the same name.
    pub fn merge(&mut self, entries: Vec<Entry>) {
        for entry in entries {
            match self.channels.iter_mut().find(|old| old.name == entry.name) {
                Some(old) => *old = entry,
                None => self.channels.push(entry),
            }
        }
    }
}

impl Entry {
    /// Channels of a calibration with controlled inputs.
    pub fn controlled(calibration: &Calibration, kind: Excitation) -> Vec<Entry> {
        let (sensor, method) = match kind {
            Excitation::Rate => ("gyro", "rate-table"),
            Excitation::Force => ("accelerometer", "multi-position"),
        };
        let entry = |channel: &crate::controlled::Channel| {
            let fit = &channel.response;
            let warm = fit.reference_c.is_finite();
            Entry {
                name: channel.name.clone(),
                sensor: sensor.into(),
                part: String::new(),
                method: method.into(),
                sensitivity_b: fit.sensitivity_b.into(),
                bias_counts: fit.bias.clone(),
                scale_per_k: fit.scale.clone(),
                reference_c: warm.then_some(fit.reference_c),
                valid_c: warm.then_some([*fit.valid_c.start(), *fit.valid_c.end()]),
                scatter_counts: fit.scatter,
                freedom: fit.freedom,
                covariance: rows(&fit.covariance),
                delay_s: None,
                lever_m: None,
            }
        };
        calibration.channels.iter().map(entry).collect()
    }

    /// The three channels of a triad calibrated on its ellipsoid, with the nominal rotation of the triad to b.
    pub fn ellipsoid(
        found: &Ellipsoid,
        names: &[String; 3],
        sensor: &str,
        dcm_bp: &nalgebra::Matrix3<f64>,
    ) -> Vec<Entry> {
        // Rows of T in the covariance: T11 | T21 T22 | T31 T32 T33.
        let places: [&[usize]; 3] = [&[0], &[1, 2], &[3, 4, 5]];
        let entry = |axis: usize| {
            // d(sensitivity_b, bias)/d(the nine), of which a row of T and one offset matter.
            let mut gradient = DMatrix::zeros(4, 9);
            for (column, &place) in places[axis].iter().enumerate() {
                for row in 0..3 {
                    gradient[(row, place)] = dcm_bp[(row, column)];
                }
            }
            gradient[(3, 6 + axis)] = 1.0;
            let covariance = &gradient * DMatrix::from_fn(9, 9, |r, c| found.covariance[(r, c)]) * gradient.transpose();
            Entry {
                name: names[axis].clone(),
                sensor: sensor.into(),
                part: String::new(),
                method: "ellipsoid".into(),
                sensitivity_b: (dcm_bp * found.shape.row(axis).transpose()).into(),
                bias_counts: vec![found.offset[axis]],
                scale_per_k: Vec::new(),
                reference_c: None,
                valid_c: None,
                scatter_counts: found.scatter,
                freedom: found.freedom,
                covariance: rows(&covariance),
                delay_s: None,
                lever_m: None,
            }
        };
        (0..3).map(entry).collect()
    }

    /// Sensitivity as a vector.
    pub fn sensitivity(&self) -> Vector3<f64> {
        self.sensitivity_b.into()
    }

    /// Sensitivity, bias and scale in the order of the covariance.
    pub fn parameters(&self) -> Vec<f64> {
        self.sensitivity_b
            .iter()
            .chain(&self.bias_counts)
            .chain(&self.scale_per_k)
            .copied()
            .collect()
    }

    /// Covariance as a matrix.
    pub fn covariance(&self) -> DMatrix<f64> {
        let size = self.covariance.len();
        DMatrix::from_fn(size, size, |row, column| {
            self.covariance[row].get(column).copied().unwrap_or(f64::NAN)
        })
    }

    fn check(&self) -> Result<(), &'static str> {
        let size = self.parameters().len();
        let numbers = self.parameters();
        if !numbers
            .iter()
            .chain(self.covariance.iter().flatten())
            .all(|value| value.is_finite())
        {
            return Err("holds something that is no number");
        }
        if self.sensitivity().norm() == 0.0 {
            return Err("its sensitivity is zero");
        }
        if self.bias_counts.is_empty() {
            return Err("has no bias");
        }
        if self.covariance.len() != size || self.covariance.iter().any(|row| row.len() != size) {
            return Err("its covariance has not a row and a column for every parameter");
        }
        let covariance = self.covariance();
        // Ellipsoids know no rotation of the triad, so a variance may be zero, but none negative beyond rounding.
        let symmetric = (&covariance - covariance.transpose()).amax() <= 1e-9 * covariance.amax();
        let least = covariance.symmetric_eigenvalues().min();
        if !symmetric || least < -1e-9 * covariance.amax() {
            return Err("its covariance is not symmetric and positive");
        }
        Ok(())
    }
}

fn rows(matrix: &DMatrix<f64>) -> Vec<Vec<f64>> {
    // Rounding leaves the halves of a covariance an ulp apart; a reviewed file shows them alike.
    let symmetric = (matrix + matrix.transpose()) / 2.0;
    symmetric.row_iter().map(|row| row.iter().copied().collect()).collect()
}

#[cfg(test)]
mod tests;
