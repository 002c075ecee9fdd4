//! The point of the body whose position a reference tells: how far what an effect adds may be an error of it.
//!
//! In: the problem, a model, one of its effects. Out: how many nats the effect is worth beyond what the point may be off, along each
//! axis by [`POINT_SIGMA_M`]: where the body turns, all accelerometers feel `dw/dt x r + w x (w x r)` of the same `r`.
//!
//! The point is not open in the fit: a lever arm of a centimetre would be ten of its sigmas and worth fifty nats, however plain it is.
//! A reference without a position, or with one that is exact, has none.

use nalgebra::{Cholesky, DMatrix, DVector, Vector3};
use twin::predict::{Accuracy, Column, Feel, Kind, Twin};

use crate::null::problem::{Component, Problem};

/// \[m\] to which the point is known: what the reference's frame of markers was fitted to. On three sessions of BROAD the lever arms
/// that were calibrated on the spot come out 0.4 to 2 mm otherwise.
const POINT_SIGMA_M: f64 = 0.001;

/// What each accelerometer feels of a point that is a metre off along x, y and z of the body.
fn columns(twin: &Twin, accuracy: &Accuracy) -> Vec<Column> {
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

/// Inner product of what two add, channel by channel in units of noise.
fn inner(one: &[(usize, DVector<f64>)], other: &[(usize, DVector<f64>)]) -> f64 {
    let on = |channel: usize| other.iter().find(|(own, _)| *own == channel);
    one.iter()
        .filter_map(|(channel, values)| on(*channel).map(|(_, others)| values.dot(others)))
        .sum()
}

/// \[nats\] by which what `model[of]` adds is worth more than the same taken for an error of the point: `(x'x - b'(A + I)^-1 b) / 2`, with
/// `A` and `b` the inner products of the point's columns, each times its sigma, and of `x` with them.
pub fn beyond(problem: &Problem, model: &[Component], of: usize) -> f64 {
    let columns = columns(problem.true_twin(), &problem.instrument.accuracy);
    if columns.is_empty() {
        return f64::INFINITY;
    }
    let sized = |column: &Column| -> Vec<(usize, DVector<f64>)> {
        let in_noise = problem.in_noise(column, None).into_iter();
        in_noise
            .map(|(channel, values)| (channel, values * column.sigma))
            .collect()
    };
    let columns: Vec<_> = columns.iter().map(sized).collect();
    let added = problem.contribution(model, of);
    let gram = DMatrix::from_fn(columns.len(), columns.len(), |row, column| {
        inner(&columns[row], &columns[column]) + f64::from(u8::from(row == column))
    });
    let pull = DVector::from_fn(columns.len(), |row, _| inner(&columns[row], &added));
    let taken = Cholesky::new(gram).map_or(0.0, |factor| pull.dot(&factor.solve(&pull)));
    0.5 * (inner(&added, &added) - taken)
}

#[cfg(test)]
mod tests {
    use twin::{
        effect::{Active, Cause, Locality, by_name},
        environment::Environment,
        motion::Tumble,
        predict::{Scene, emems},
    };

    use super::*;
    use crate::input::{log::Series, reference::Reference, windows::Fit};

    /// \[nats\] that an effect of all channels is worth, with a reference whose positions are known to `sigma_m`.
    fn worth(effect: &str, theta: &[f64], sigma_m: f64) -> f64 {
        let environment = Environment::laboratory();
        let scene = Scene::new(&Tumble::new(), &environment, 0.0, 60.0, 0.01);
        let starts_s: Vec<f64> = (0..300).map(|row| 0.2 * f64::from(row)).collect();
        let twin = Twin::new(emems(|_| 0.0), environment, scene, starts_s).expect("a twin");
        let series = |index: usize| Series {
            rows: (0..300).collect(),
            values: twin.channel(index, &[]).into_owned(),
        };
        let fit = Fit {
            channels: (0..twin.unit().channels.len()).map(series).collect(),
        };
        let reference = Reference::stated(Accuracy {
            attitude_sigma_rad: 1e-3,
            position_sigma_m: sigma_m,
            field_sigma_ut: 0.0,
        });
        let problem = Problem::new(&twin, &fit, &reference);
        let cause = Cause {
            effect: by_name(effect).expect("an effect"),
            locality: Locality::Common,
            variant: 0.0,
        };
        let theta = theta.to_vec();
        let model = [Component {
            active: Active { cause, theta },
            span: None,
        }];
        beyond(&problem, &model, 0)
    }

    #[test]
    fn a_lever_arm_of_a_millimetre_may_be_the_references_and_one_of_centimetres_is_not() {
        let arm = |metres: f64, sigma_m: f64| worth("lever-arm", &[metres, 0.0, 0.0], sigma_m);
        assert_eq!(
            arm(0.001, 0.0),
            f64::INFINITY,
            "an exact position has no point to doubt"
        );
        let [small, large] = [arm(0.001, 1e-4), arm(0.05, 1e-4)];
        // Seen through the point alone it is worth its prior price, half a nat a sigma squared.
        assert!(small <= 0.5, "{small}");
        assert!((100.0..=1250.0).contains(&large), "{large}");
    }

    #[test]
    fn what_accelerometers_do_not_feel_is_none_of_its_errors() {
        let [doubted, exact] = [1e-4, 1e-9].map(|sigma_m| worth("hard-iron", &[3.0, 0.0, 0.0], sigma_m));
        assert!(
            (doubted / exact - 1.0).abs() < 1e-9 && doubted > 100.0,
            "{doubted} {exact}"
        );
    }
}
