//! How much of a reference's fast error lies where the log sees it: told by the log itself.
//!
//! In: the twin along the reference, the fitted samples, for each of them how large the error is an octave above. Out: for each
//! channel the factor from that octave to what is below it, from nothing to the most that it may be.
//!
//! The octave above tells when the error is large, not how large it is below: white noise of a position, differentiated twice, has a
//! thirty-first of its energy there; markers that shake with the skin or a soft mount have nearly as much. So the factor is the one
//! with which the samples scatter as they should: `f` that solves `mean(r^2 / (own^2 + (f octave)^2)) = 1`. `r` is the reading less
//! the prediction, less what a calibration may change: a zero, the three components of what is felt, a delay, a lever arm.
//!
//! The error is a vector, larger along one axis than along another, so a channel has the median of the factors of its kind, each
//! weighed by the squared cosine between the axes. Where four plates see each axis, that does not follow an effect on one of them; a
//! triad alone has nothing but itself, and what makes one of its sensors loud is hidden up to the most.

use nalgebra::{DMatrix, DVector};
use twin::predict::{Feel, Kind, Twin};

use crate::input::windows::Fit;

/// Halvings of the interval in which a factor lies: to a thousandth of it.
const HALVINGS: usize = 10;

/// What a calibration may change of a channel.
const COLUMNS: usize = 8;

/// Part of the largest singular value below which a column is none: columns in their own units span some six powers of ten, and
/// rounding leaves 1e-16 of the largest.
const SINGULAR: f64 = 1e-9;

/// The factors of the channels of a kind, each with its channel; `octave` is the size of the error above, of a channel at a row, and
/// `most` the largest factor.
pub fn levels(
    twin: &Twin,
    fit: &Fit,
    kind: Kind,
    octave: &dyn Fn(usize, usize) -> f64,
    most: f64,
) -> Vec<(usize, f64)> {
    let channels = &twin.unit().channels;
    let own = (0..channels.len()).filter(|index| channels[*index].sensor == kind);
    let mut told: Vec<(usize, f64)> = own
        .map(|index| {
            let rows = &fit.channels[index].rows;
            let Some(squares) = squares(twin, fit, index) else {
                return (index, most);
            };
            let scatter = |factor: f64| {
                let of = |(row, square): (&u32, &f64)| {
                    square / (channels[index].sigma().powi(2) + (factor * octave(index, *row as usize)).powi(2))
                };
                rows.iter().zip(&squares).map(of).sum::<f64>() / (squares.len() - COLUMNS) as f64
            };
            (index, solved(&scatter, most))
        })
        .collect();
    told.sort_by(|one, other| one.1.total_cmp(&other.1));
    let level = |index: usize| {
        let axis_b = channels[index].axis_b;
        let weigh = |(other, _): &(usize, f64)| axis_b.dot(&channels[*other].axis_b).powi(2);
        let half = 0.5 * told.iter().map(weigh).sum::<f64>();
        let mut below = 0.0;
        let middle = told.iter().find(|other| {
            below += weigh(other);
            below >= half
        });
        middle.map_or(most, |(_, level)| *level)
    };
    told.iter().map(|(index, _)| (*index, level(*index))).collect()
}

/// Where `scatter`, which falls, is one.
fn solved(scatter: &dyn Fn(f64) -> f64, most: f64) -> f64 {
    let (mut low, mut high) = (0.0, most);
    if scatter(low) <= 1.0 {
        return low;
    }
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if scatter(middle) > 1.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
    high
}

/// Squares of what a calibration leaves of a channel at its fitted samples; none of too few of them.
fn squares(twin: &Twin, fit: &Fit, index: usize) -> Option<Vec<f64>> {
    let series = &fit.channels[index];
    let channel = &twin.unit().channels[index];
    let (predicted, feels, by_instant) = (twin.channel(index, &[]), twin.feels(index), twin.by_instant(index));
    let columns = |row: usize| {
        let Feel {
            rate_b,
            rate_dot_b,
            force_b,
            field_b_ut,
            ..
        } = feels[row];
        let felt_b = match channel.sensor {
            Kind::Accelerometer => force_b,
            Kind::Magnetometer => field_b_ut,
            Kind::Gyro | Kind::Thermometer => rate_b,
        };
        // axis.(dw x r + w x (w x r)) = r.(axis x dw + w (axis.w) - axis (w.w))
        let axis_b = channel.axis_b;
        let arm = axis_b.cross(&rate_dot_b) + rate_b * axis_b.dot(&rate_b) - axis_b * rate_b.norm_squared();
        [1.0, felt_b.x, felt_b.y, felt_b.z, by_instant[row], arm.x, arm.y, arm.z]
    };
    let rows: Vec<usize> = series.rows.iter().map(|row| *row as usize).collect();
    let design: Vec<[f64; COLUMNS]> = rows.iter().map(|row| columns(*row)).collect();
    let rest = rows
        .iter()
        .zip(&series.values)
        .map(|(row, value)| value - predicted[*row]);
    let rest = DVector::from_iterator(rows.len(), rest);
    if rows.len() <= 2 * COLUMNS {
        return None;
    }
    let matrix = DMatrix::from_fn(rows.len(), COLUMNS, |row, column| design[row][column]);
    let parts = matrix.clone().svd(true, true);
    let smallest = SINGULAR * parts.singular_values.max();
    let fitted = parts.solve(&rest, smallest).ok()?;
    let left = rest - matrix * fitted;
    left.iter()
        .all(|value| value.is_finite())
        .then(|| left.iter().map(|value| value * value).collect())
}

#[cfg(test)]
mod tests;
