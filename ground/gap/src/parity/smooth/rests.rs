//! When the unit rests: spans in which nothing that it reads changes, and it feels gravity.
//!
//! In: a log and its unit. Out: spans \[s\]. A window rests when the samples of every channel scatter about their mean no more than
//! the described noise lets them, once in a thousand windows ([`SELDOM`]), and when the specific force is gravity's within
//! [`ABOUT_GRAVITY`]: in free fall nothing may change either. Windows that touch are one span.

use nalgebra::{Matrix3, Vector3};
use statrs::distribution::{ChiSquared, ContinuousCDF};
use twin::{
    environment::Environment,
    predict::{Kind, UnitDescription},
};

use crate::{input::log::Log, thresholds::SELDOM};

/// \[s\] of a window: a hand does not hold still for so long.
const WINDOW_S: f64 = 2.0;

/// Share of gravity: far above what a calibration leaves open, far below what a flight feels.
const ABOUT_GRAVITY: f64 = 0.05;

/// All spans.
pub fn rests(log: &Log, unit: &UnitDescription, environment: &Environment) -> Vec<(f64, f64)> {
    let (Some(first_s), Some(last_s)) = (log.start_s.first(), log.start_s.last()) else {
        return Vec::new();
    };
    let windows = ((last_s - first_s) / WINDOW_S).floor() as usize;
    let mut spans: Vec<(f64, f64)> = Vec::new();
    for window in 0..windows {
        let from_s = first_s + window as f64 * WINDOW_S;
        let to_s = from_s + WINDOW_S;
        if !is_rest(log, unit, environment, (from_s, to_s)) {
            continue;
        }
        match spans.last_mut() {
            Some(last) if last.1 == from_s => last.1 = to_s,
            _ => spans.push((from_s, to_s)),
        }
    }
    spans
}

fn is_rest(log: &Log, unit: &UnitDescription, environment: &Environment, (from_s, to_s): (f64, f64)) -> bool {
    let first = log.start_s.partition_point(|start_s| *start_s < from_s) as u32;
    let last = log.start_s.partition_point(|start_s| *start_s < to_s) as u32;
    let (mut energy, mut freedom) = (0.0, 0.0);
    let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
    for (channel, series) in unit.channels.iter().zip(&log.channels) {
        let from = series.rows.partition_point(|row| *row < first);
        let to = series.rows.partition_point(|row| *row < last);
        let values = &series.values[from..to];
        if values.len() < 2 || channel.sensor == Kind::Thermometer {
            continue;
        }
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        let spread: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
        energy += spread / channel.sigma().powi(2);
        freedom += (values.len() - 1) as f64;
        if channel.sensor == Kind::Accelerometer {
            normal += channel.axis_b * channel.axis_b.transpose();
            right += channel.axis_b * (mean - channel.bias);
        }
    }
    let Ok(law) = ChiSquared::new(freedom) else {
        return false;
    };
    let force_b = normal.try_inverse().map(|inverse| inverse * right);
    let is_gravity = force_b
        .is_some_and(|force_b| (force_b.norm() - environment.gravity).abs() < ABOUT_GRAVITY * environment.gravity);
    is_gravity && law.sf(energy) > SELDOM
}
