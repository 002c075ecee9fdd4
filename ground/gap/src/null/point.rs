//! The point of the body whose position a reference tells: what accelerometers feel if it is another.
//!
//! In: the twin, what is known of the reference. Out: what every accelerometer feels of a point that is off along each axis by
//! [`POINT_SIGMA_M`]: where the body turns, all feel `dw/dt x r + w x (w x r)` of the same `r`.
//!
//! The point is not open in the fit: a lever arm of a centimetre would be ten of its sigmas and worth fifty nats, however plain it is.
//! A reference without a position, or with one that is exact, has none.

use nalgebra::Vector3;
use twin::predict::{Accuracy, Column, Feel, Kind, Twin};

/// \[m\] to which the point is known: what the reference's frame of markers was fitted to. On three sessions of BROAD the lever arms
/// that were calibrated on the spot come out 0.4 to 2 mm otherwise.
const POINT_SIGMA_M: f64 = 0.001;

/// What each accelerometer feels of a point that is a metre off along x, y and z of the body. None of a reference that is exact.
pub fn columns(twin: &Twin, accuracy: &Accuracy) -> Vec<Column> {
    if accuracy.attitude_sigma_rad <= 0.0 || accuracy.position_sigma_m <= 0.0 {
        return Vec::new();
    }
    let felt = |index: usize, off_b: Vector3<f64>| -> Vec<f64> {
        let axis_b = twin.unit().channels[index].axis_b;
        let of = |feel: Feel| {
            let Feel { rate_b, rate_dot_b, .. } = feel;
            axis_b.dot(&(rate_dot_b.cross(&off_b) + rate_b.cross(&rate_b.cross(&off_b))))
        };
        twin.feels(index).into_iter().map(of).collect()
    };
    let channels = twin.unit().channels.iter().enumerate();
    let accelerometers: Vec<usize> = channels
        .filter(|(_, channel)| channel.sensor == Kind::Accelerometer)
        .map(|(index, _)| index)
        .collect();
    let axes = [("x", Vector3::x()), ("y", Vector3::y()), ("z", Vector3::z())];
    let column = |(name, off_b): (&str, Vector3<f64>)| Column {
        name: format!("point_{name}"),
        sigma: POINT_SIGMA_M,
        entries: accelerometers
            .iter()
            .map(|index| (*index, felt(*index, off_b)))
            .collect(),
    };
    axes.into_iter().map(column).collect()
}
