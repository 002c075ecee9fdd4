//! The gradient of the field where the body moves: what magnetometers feel of it.
//!
//! In: the twin, how fields err ([`SlowErrors`]). Out: a column for each of its five components, for it is symmetric and
//! has no trace, about the middle of the places where the unit was. None of a field that is stated as exact. A magnetometer
//! is where the accelerometer of its plate is, for only the places of these are described.
//!
//! Where the case does not say how large it may be, it makes the field differ by the sigma that is stated of it, over the places where
//! the magnetometers were: a field that is known to half a microtesla is not known to be more uniform than that. Of recordings of
//! BROAD (0.8 uT, carried over some half a metre) that would be 1.6 uT/m, where 1 to 2 were found.

use nalgebra::{Matrix3, Vector3};
use twin::predict::{Column, Feel, Kind, Twin};

use crate::input::case::SlowErrors;

/// What a magnetometer felt, and where it was.
struct Felt {
    channel: usize,
    feels: Vec<Feel>,
    /// \[m\] in n, from the middle of the places where the unit was.
    places_n: Vec<Vector3<f64>>,
}

/// What each magnetometer feels of a gradient of one uT/m.
pub fn columns(twin: &Twin, errors: &SlowErrors) -> Vec<Column> {
    let unit = twin.unit();
    let magnetometers = (0..unit.channels.len()).filter(|channel| unit.channels[*channel].sensor == Kind::Magnetometer);
    let felt = |channel: usize| {
        let place_b = unit.place_b(&unit.channels[channel]);
        let feels = twin.feels(channel);
        let places_n = (feels.iter())
            .map(|feel| feel.position_n + feel.q_nb * place_b)
            .collect();
        Felt {
            channel,
            feels,
            places_n,
        }
    };
    let magnetometers: Vec<Felt> = magnetometers.map(felt).collect();
    let Some(sigma) = sigma(&magnetometers, errors) else {
        return Vec::new();
    };
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
        let of_channel = |felt: &Felt| {
            let axis_b = unit.channels[felt.channel].axis_b;
            let values = felt.feels.iter().zip(&felt.places_n);
            let values = values.map(|(feel, place_n)| axis_b.dot(&feel.to_b(gradient * place_n)));
            (felt.channel, values.collect())
        };
        Column {
            name: format!("field_gradient_{name}"),
            sigma,
            entries: magnetometers.iter().map(of_channel).collect(),
        }
    };
    parts.into_iter().map(column).collect()
}

/// [uT/m] of each component: as stated, or what makes the field's own sigma at the root mean square of the places; none where no place is told or
/// the field is exact.
fn sigma(magnetometers: &[Felt], errors: &SlowErrors) -> Option<f64> {
    let places = magnetometers.iter().flat_map(|felt| &felt.places_n);
    let squares: Vec<f64> = places
        .map(|place_n| place_n.norm_squared())
        .filter(|square| square.is_finite())
        .collect();
    let reach_m = (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
    let stated = errors.field_gradient_sigma_ut_m;
    let sigma = stated.unwrap_or(errors.field_sigma_ut / reach_m);
    (reach_m > 0.0 && sigma > 0.0).then_some(sigma)
}

#[cfg(test)]
mod tests {
    use twin::{
        environment::Environment,
        motion::Tumble,
        predict::{Scene, emems},
    };

    use super::*;

    /// Of a unit that turns about its middle and is not carried.
    fn turning(field_sigma_ut: f64, stated_ut_m: Option<f64>) -> Vec<Column> {
        let environment = Environment::laboratory();
        let scene = Scene::new(&Tumble::new(), &environment, 0.0, 20.0, 0.01);
        let starts_s = (0..100).map(|row| 0.2 * f64::from(row)).collect();
        let twin = Twin::new(emems(|_| 0.0), environment, scene, starts_s).expect("a twin");
        let errors = SlowErrors {
            attitude_sigma_rad: 1e-3,
            attitude_correlation_s: 20.0,
            field_wander_sigma_ut: 0.0,
            field_correlation_s: 10.0,
            field_sigma_ut,
            field_gradient_sigma_ut_m: stated_ut_m,
        };
        columns(&twin, &errors)
    }

    #[test]
    fn a_unit_that_is_not_carried_feels_it_at_its_plates_as_much_as_the_field_may_be_off() {
        let columns = turning(0.5, None);
        assert_eq!(columns.len(), 5);
        let values = columns.iter().flat_map(|column| {
            let of_column = column.entries.iter().flat_map(|(_, values)| values);
            of_column.map(|value| (value * column.sigma).powi(2))
        });
        let (count, squares) = values.fold((0, 0.0), |(count, sum), square| (count + 1, sum + square));
        // The five parts add up.
        let felt_ut = (5.0 * squares / f64::from(count)).sqrt();
        assert!((0.3..1.2).contains(&felt_ut), "{felt_ut}");
    }

    #[test]
    fn what_is_stated_is_taken_and_an_exact_field_has_none() {
        assert!(turning(0.5, Some(2.0)).iter().all(|column| column.sigma == 2.0));
        assert!(turning(0.0, None).is_empty() && turning(0.5, Some(0.0)).is_empty());
    }
}
