//! What the leftover test looks at of each channel: its place in time, and what the unit does at each sample.

use nalgebra::DMatrix;
use twin::predict::{Feel, Kind};

use crate::{leftover::View, problem::Problem};

/// Quantities of the motion: rate, force and field in b, temperature.
const QUANTITIES: usize = 10;

/// The views of every channel.
pub fn views(problem: &Problem) -> Vec<View> {
    let twin = problem.twin;
    let states = standardised(&twin.feels(0));
    let starts_s = twin.starts_s();
    let fitted = problem
        .frames
        .iter()
        .flat_map(|frame| &frame.series.rows)
        .map(|row| starts_s[*row as usize]);
    let (from_s, to_s) = fitted.fold((f64::INFINITY, f64::NEG_INFINITY), |(from, to), t| {
        (from.min(t), to.max(t))
    });
    let view = |(channel, frame): (&twin::predict::Channel, &crate::problem::Frame)| View {
        name: channel.name.clone(),
        kind: match channel.sensor {
            Kind::Accelerometer => 0,
            Kind::Gyro => 1,
            Kind::Magnetometer => 2,
            Kind::Thermometer => 3,
        },
        axis_b: channel.axis_b,
        phase: frame
            .series
            .rows
            .iter()
            .map(|row| (starts_s[*row as usize] - from_s) / (to_s - from_s).max(f64::EPSILON))
            .collect(),
        motion: DMatrix::from_fn(frame.series.rows.len(), QUANTITIES, |row, column| {
            states[(frame.series.rows[row] as usize, column)]
        }),
    };
    twin.unit().channels.iter().zip(&problem.frames).map(view).collect()
}

/// The motion, each quantity about zero with unit spread; one that does not change is zero.
fn standardised(feels: &[Feel]) -> DMatrix<f64> {
    let mut states = DMatrix::from_fn(feels.len(), QUANTITIES, |row, column| {
        let feel = &feels[row];
        match column {
            0..3 => feel.rate_b[column],
            3..6 => feel.force_b[column - 3],
            6..9 => feel.field_b_ut[column - 6],
            _ => feel.temperature_c,
        }
    });
    for mut column in states.column_iter_mut() {
        let mean = column.mean();
        let spread = column.variance().sqrt();
        column
            .iter_mut()
            .for_each(|value| *value = if spread > 1e-9 { (*value - mean) / spread } else { 0.0 });
    }
    states
}
