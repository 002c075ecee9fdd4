//! One channel as it is looked at: its samples, what the unit did at each, and what of it is open.

use nalgebra::{DMatrix, DVector, Vector3};

use super::{clock::Clock, codes::Codes, instrument::Instrument};

/// Stretches of time.
pub const STRETCHES: usize = 20;

/// Fixed, so that one case gives one verdict.
pub const SEED: u64 = 0x5eed_0005;

/// The zero of a channel.
pub const ZERO: &str = "bias";

/// The directions in which its axis is open.
pub const AXES: [&str; 2] = ["axis_1", "axis_2"];

/// What is looked at of one channel.
#[derive(Clone, Debug)]
pub struct View {
    /// Name, for the report.
    pub name: String,
    /// Kind of sensor, an index.
    pub kind: usize,
    /// The part it is of, an index: channels of one have one.
    pub part: usize,
    /// What it is mounted with, an index: channels on one plate have one.
    pub group: usize,
    /// Its axis in b.
    pub axis_b: Vector3<f64>,
    /// Place of each sample in the fitted time, 0 to 1.
    pub phase: Vec<f64>,
    /// What the unit does at each sample (rates, force, field, temperature), each about zero with unit spread.
    pub motion: DMatrix<f64>,
    /// What a small rotation of the unit against its reference adds to each sample, in units of noise for 1 rad about the
    /// axes of b.
    pub turned: DMatrix<f64>,
    /// What it feels at each sample, in units of noise.
    pub felt: DVector<f64>,
    /// What it is predicted to read at each sample, in units of noise.
    pub predicted: DVector<f64>,
    /// Its codes, where it sends such.
    pub codes: Option<Codes>,
    /// The clock of its part, where that is its own.
    pub clock: Option<Clock>,
    /// What is open of it, in the order of the fit's columns.
    pub open: Vec<Open>,
    /// What its reference errs by, where that is not exact.
    pub instrument: Option<Instrument>,
    /// Whether that is more than it scatters by itself.
    pub is_limited: bool,
    /// For each quantity of [`LEVELLED`], in which of [`LEVELS`] equally filled levels each sample stands.
    pub levels: Vec<Vec<u8>>,
}

/// Quantities whose levels a residual is sorted by.
pub const LEVELLED: [&str; 4] = ["its own reading", "the rate", "the specific force", "the temperature"];

/// Levels of each: the curve of a wrong law shows in eight, and a sum of eight squares is still sharp.
pub const LEVELS: usize = 8;

/// What is open in one direction of a channel's calibration.
#[derive(Clone, Debug, PartialEq)]
pub struct Open {
    /// What it is, the same word in all channels.
    pub name: String,
    /// In its sigmas, what a vector of 1 in b makes of a zero, or a turn of 1 rad about the axes of b of an axis; else zero.
    pub by_b: Vector3<f64>,
}

impl Open {
    /// Of a channel with its axis, and the two directions in which that is open, in b.
    pub fn new(name: String, sigma: f64, axis_b: Vector3<f64>, across_b: [Vector3<f64>; 2]) -> Self {
        let by_b = match AXES.iter().position(|own| *own == name) {
            // The axis n moves by `turn x n`.
            Some(own) => axis_b.cross(&across_b[own]) / sigma,
            None if name == ZERO => axis_b / sigma,
            None => Vector3::zeros(),
        };
        Open { name, by_b }
    }
}

/// In which of so many equal parts of the log.
pub fn place(phase: f64, of: usize) -> usize {
    ((phase * of as f64) as usize).min(of - 1)
}
