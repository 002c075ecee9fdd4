//! The gradient of the field where the body moves: what magnetometers feel of it.
//!
//! In: the twin, how fields err ([`SlowErrors`]). Out: a column for each of its five components, for it is symmetric and
//! has no trace, about the middle of the places where the unit was. None of a field that is stated as exact. It is
//! that at the centre of the body; what the places of the sensors about it add is not in them.

use nalgebra::Matrix3;
use twin::predict::{Column, Feel, Kind, Twin};

use crate::input::case::SlowErrors;

/// What each magnetometer feels of a gradient of one uT/m.
pub fn columns(twin: &Twin, errors: &SlowErrors) -> Vec<Column> {
    let sigma = errors.field_gradient_sigma_ut_m;
    let all = twin.unit().channels.iter().enumerate();
    let magnetometers: Vec<(usize, Vec<Feel>)> = (all.filter(|(_, own)| own.sensor == Kind::Magnetometer))
        .map(|(channel, _)| (channel, twin.feels(channel)))
        .collect();
    let is_told = |(_, feels): &(usize, Vec<Feel>)| {
        feels
            .iter()
            .any(|feel| feel.position_n.iter().all(|value| value.is_finite()))
    };
    if sigma <= 0.0 || !magnetometers.iter().any(is_told) {
        return Vec::new();
    }
    let parts = [
        ("xx", [(0, 0, 1.0), (2, 2, -1.0)]),
        ("yy", [(1, 1, 1.0), (2, 2, -1.0)]),
        ("xy", [(0, 1, 1.0), (1, 0, 1.0)]),
        ("xz", [(0, 2, 1.0), (2, 0, 1.0)]),
        ("yz", [(1, 2, 1.0), (2, 1, 1.0)]),
    ];
    let column = |(name, part): (&str, [(usize, usize, f64); 2])| {
        let mut gradient = Matrix3::zeros();
        (part.iter()).for_each(|(row, column, value)| gradient[(*row, *column)] = *value);
        let of_channel = |(channel, feels): &(usize, Vec<Feel>)| {
            let axis_b = twin.unit().channels[*channel].axis_b;
            let felt = |feel: &Feel| axis_b.dot(&feel.to_b(gradient * feel.position_n));
            (*channel, feels.iter().map(felt).collect())
        };
        Column {
            name: format!("field_gradient_{name}"),
            sigma,
            entries: magnetometers.iter().map(of_channel).collect(),
        }
    };
    parts.into_iter().map(column).collect()
}
