//! Every entry of the library, from one table: what it writes, that it is smooth, and that it comes back as it went in.

use nalgebra::{DMatrix, DVector, Vector3};

use super::*;
use crate::environment::Environment;
use crate::motion::{Attitude, Jet, Motion, Pose};
use crate::predict::{Scene, Twin, emems, thesis_slot_s};

mod digits;
mod equations;
mod pages;
mod past;
mod physics;
mod scatter;
mod sharpness;

/// A motion that excites everything: all axes up to 130 deg/s, acceleration of the centre, temperature up and down.
struct Exercise;

/// The attitude of the exercise, turned about the vertical by so much as often.
fn exercised(gear: f64, t_s: f64) -> Attitude {
    Attitude::level()
        .yawed(Jet::sine(gear * 2.5, 0.43, t_s))
        .pitched(Jet::sine(1.2, 0.91, t_s))
        .rolled(Jet::sine(2.2, 0.67, t_s))
}

impl Motion for Exercise {
    fn at(&self, t_s: f64) -> Pose {
        let shake = |amplitude: f64, rate: f64| -amplitude * rate * rate * (rate * t_s).sin();
        Pose {
            acc_n: Vector3::new(shake(0.3, 2.9), shake(0.4, 1.7), shake(0.2, 3.7)),
            temperature_c: Some(25.0 + 12.0 * (0.031 * t_s).sin()),
            ..Pose::turning(exercised(1.0, t_s))
        }
    }

    fn duration_s(&self) -> Option<f64> {
        None
    }

    fn position_n(&self, t_s: f64) -> Vector3<f64> {
        Vector3::new(
            0.3 * (2.9 * t_s).sin(),
            0.4 * (1.7 * t_s).sin(),
            0.2 * (3.7 * t_s).sin(),
        )
    }
}

/// Rows a second apart for what is deterministic, and cycles of the unit for what scatters.
const SPARSE: (usize, f64) = (240, 0.98);
const DENSE: (usize, f64) = (1200, 0.2);

fn twin((cycles, cycle_s): (usize, f64)) -> Twin {
    let environment = Environment::laboratory();
    let scene = Scene::new(&Exercise, &environment, 0.0, 241.0, 0.02);
    let starts_s = (0..cycles).map(|k| cycle_s * k as f64).collect();
    Twin::new(emems(thesis_slot_s), environment, scene, starts_s).unwrap()
}

/// Every smooth effect at one place of each sort, at its first, its middle and its last variant.
fn smooth(twin: &Twin) -> Vec<Cause> {
    let mut causes = Vec::new();
    for &effect in LIBRARY.iter().filter(|effect| effect.page().nature == Nature::Smooth) {
        let mut sorts = Vec::new();
        for locality in effect.localities(twin.unit()) {
            let sort = core::mem::discriminant(&locality);
            if sorts.contains(&sort) {
                continue;
            }
            sorts.push(sort);
            let variants = effect.variants(twin.starts_s());
            let mut tried = vec![0, variants.len() / 2, variants.len() - 1];
            tried.dedup();
            causes.extend(tried.into_iter().map(|i| Cause {
                effect,
                locality: locality.clone(),
                variant: variants[i],
            }));
        }
    }
    causes
}

/// Part of its prior sigma to which an effect is put in here: an open-loop fibre-optic gyro, sized for a few deg/s, answers a
/// hundred by going round its sine several times.
fn part_of_prior(cause: &Cause) -> f64 {
    if cause.effect.page().name == "gyro-sine-response" {
        0.003
    } else {
        1.0
    }
}

/// Parameters of these sizes in prior sigmas, alternating between the size and parts of it; never negative where that is
/// unphysical.
fn sized(cause: &Cause, twin: &Twin, size: f64) -> Active {
    let pattern = [1.0, -0.6, 0.8, -1.0, 0.5, -0.7, 0.9];
    let parameters = cause.parameters(twin.unit()).into_iter().enumerate();
    let size = size * part_of_prior(cause);
    let theta = parameters.map(|(i, parameter)| {
        let part: f64 = pattern[i % pattern.len()];
        size * parameter.prior_sigma * if parameter.signed { part } else { part.abs() }
    });
    Active {
        cause: cause.clone(),
        theta: theta.collect(),
    }
}

/// Readings of the channels the effect touches; the others are left empty.
fn predicted(twin: &Twin, active: &Active) -> Vec<Vec<f64>> {
    let mut readings = vec![Vec::new(); twin.unit().channels.len()];
    for channel in active.cause.channels(twin.unit()) {
        readings[channel] = twin.channel(channel, core::slice::from_ref(active)).into_owned();
    }
    readings
}

/// Whitened difference of two predictions of the channels an effect touches.
fn difference(twin: &Twin, cause: &Cause, from: &[Vec<f64>], to: &[Vec<f64>]) -> DVector<f64> {
    let channels = cause.channels(twin.unit());
    let of = |&c: &usize| {
        let sigma = twin.unit().channels[c].sigma();
        from[c].iter().zip(&to[c]).map(move |(from, to)| (to - from) / sigma)
    };
    DVector::from_iterator(channels.len() * twin.starts_s().len(), channels.iter().flat_map(of))
}

/// Whitened Jacobian of the channels the effect touches, one column a parameter.
fn jacobian(twin: &Twin, active: &Active) -> DMatrix<f64> {
    let channels = active.cause.channels(twin.unit());
    let columns = twin.jacobian(core::slice::from_ref(active), 0);
    let mut matrix = DMatrix::zeros(channels.len() * twin.starts_s().len(), columns.len());
    for (i, column) in columns.iter().enumerate() {
        for (channel, values) in &column.entries {
            let sigma = twin.unit().channels[*channel].sigma();
            let row = channels.iter().position(|c| c == channel).unwrap() * twin.starts_s().len();
            for (k, value) in values.iter().enumerate() {
                matrix[(row + k, i)] = value / sigma;
            }
        }
    }
    matrix
}

#[test]
fn zero_parameters_are_no_effect() {
    let twin = twin(SPARSE);
    let nominal = twin.predict(&[]);
    for cause in smooth(&twin) {
        // Its other variants are half-turns.
        if cause.effect.page().name == "plate-rotation" && cause.variant != 0.0 {
            continue;
        }
        let none = Active {
            theta: vec![0.0; cause.parameters(twin.unit()).len()],
            cause,
        };
        let change = difference(&twin, &none.cause, &nominal, &predicted(&twin, &none));
        assert!(change.amax() < 1e-9, "{:?}: {}", none.cause, change.amax());
    }
}

#[test]
fn the_jacobian_is_the_derivative_whatever_the_step() {
    // A step of a tenth of a prior sigma, halved: for a smooth effect the second is four times nearer to the derivative, and
    // what is left is below a thousandth of the change plus rounding. A filter stepped at the simulator's step fails this.
    let twin = twin(SPARSE);
    for cause in smooth(&twin) {
        let at = sized(&cause, &twin, 0.5);
        let matrix = jacobian(&twin, &at);
        for i in 0..matrix.ncols() {
            let step = 0.1 * part_of_prior(&cause) * at.cause.parameters(twin.unit())[i].prior_sigma;
            let quotient = |step: f64| {
                let moved = |by: f64| {
                    let mut moved = at.clone();
                    moved.theta[i] += by;
                    predicted(&twin, &moved)
                };
                difference(&twin, &cause, &moved(-step), &moved(step)) / (2.0 * step)
            };
            let extrapolated = (quotient(0.5 * step) * 4.0 - quotient(step)) / 3.0;
            let column = matrix.column(i);
            let error = (&extrapolated - column).norm() / column.norm();
            // Play and on-off terms are piecewise linear in theta only through where readings clip: not at all here.
            assert!(error < 1e-3, "{cause:?}, parameter {i}: {error}");
            assert!(column.norm() > 0.0, "{cause:?}, parameter {i} does nothing");
        }
    }
}

#[test]
fn every_smooth_effect_comes_back_as_large_as_it_went_in() {
    let twin = twin(SPARSE);
    let nominal = twin.predict(&[]);
    for cause in smooth(&twin) {
        for size in [0.2, 1.0, 3.0] {
            let truth = sized(&cause, &twin, size);
            let measured = predicted(&twin, &truth);
            let mut found = sized(&cause, &twin, 0.0);
            for _ in 0..6 {
                let matrix = jacobian(&twin, &found);
                let residual = difference(&twin, &cause, &predicted(&twin, &found), &measured);
                let mut normal = matrix.transpose() * &matrix;
                for i in 0..normal.nrows() {
                    // A millionth of one sample's information keeps what the motion does not show at zero.
                    let prior = cause.parameters(twin.unit())[i].prior_sigma;
                    normal[(i, i)] += 1e-6 / prior.powi(2);
                }
                let step = normal.cholesky().unwrap().solve(&(matrix.transpose() * residual));
                found
                    .theta
                    .iter_mut()
                    .zip(step.iter())
                    .for_each(|(theta, step)| *theta += step);
            }
            let left = difference(&twin, &cause, &predicted(&twin, &found), &measured).norm();
            let whole = difference(&twin, &cause, &nominal, &measured).norm();
            assert!(
                left < 1e-3 * whole + 1e-6,
                "{cause:?} at {size}: {left} of {whole}, {:?} for {:?}",
                found.theta,
                truth.theta
            );
            for (found, (truth, parameter)) in found
                .theta
                .iter()
                .zip(truth.theta.iter().zip(cause.parameters(twin.unit())))
            {
                let error = (found - truth).abs() / (parameter.prior_sigma * size * part_of_prior(&cause));
                assert!(
                    error < 0.01,
                    "{cause:?} at {size}: {} {found} for {truth}",
                    parameter.name
                );
            }
        }
    }
}

#[test]
fn a_unit_that_is_known_to_have_an_effect_is_predicted_with_it() {
    let twin = twin(SPARSE);
    let mut unit = twin.unit().clone();
    let active = sized(
        &Cause {
            effect: by_name("gyro-scale").unwrap(),
            locality: Locality::All,
            variant: 0.0,
        },
        &twin,
        1.0,
    );
    unit.effects.push(active.to_known());
    let again = UnitDescription::read(&unit.text(), "unit.toml").unwrap();
    assert_eq!(again.effects, unit.effects);
    let scene = Scene::new(&Exercise, twin.environment(), 0.0, 241.0, 0.02);
    let taught = Twin::new(again, *twin.environment(), scene, twin.starts_s().to_vec()).unwrap();
    let g1 = twin.unit().channel("g1").unwrap();
    // The axes are normalised again: rounding.
    let pairs = taught.predict(&[])[g1]
        .iter()
        .zip(&twin.predict(&[active])[g1])
        .map(|(a, b)| (a - b).abs())
        .collect::<Vec<_>>();
    assert!(pairs.iter().all(|off| *off < 1e-12));
}

#[test]
fn what_a_unit_cannot_have_is_refused() {
    let mut unit = emems(thesis_slot_s);
    let known = |effect: &str, locality: &str, theta: &[f64]| crate::channel::KnownEffect {
        effect: effect.to_owned(),
        locality: locality.to_owned(),
        variant: 0.0,
        theta: theta.to_vec(),
    };
    for (entry, message) in [
        (
            known("gyro-blas", "all", &[]),
            "effect \"gyro-blas\" is not in the library; see the list of effects",
        ),
        (
            known("latency", "plate 1", &[0.1]),
            "effect latency cannot be at \"plate 1\" in this unit; it can be at unit",
        ),
        (
            known("gyro-bias", "g2", &[]),
            "effect gyro-bias at g2 has 1 parameters, theta has 0",
        ),
    ] {
        unit.effects = vec![entry];
        assert_eq!(Active::known(&unit.effects[0], &unit).unwrap_err().to_string(), message);
    }
}
