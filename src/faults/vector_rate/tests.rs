//! Directions carried along by four rates, against rotations composed in f64.

use super::*;
use crate::{
    draws::Draws,
    faults::tests::reference::{V, VectorRateModel, of},
};

#[derive(Default)]
struct Seen {
    guilty: u32,
    open: u32,
}

/// A unit that turns, with one rate of four that is right, or with all wrong alike, or with all right; whatever is asked of the pages
/// is answered alike.
fn run(seed: u64, seen: &mut Seen) {
    let mut draws = Draws::of(seed);
    let error = RateError {
        noise: draws.within(0.0, 0.02),
        bias: draws.one_of([0.0, 0.001, 0.01]),
    };
    let (mut watched, mut model) = (VectorRate::new(error), VectorRateModel::default());
    let (rate_b, swings_b) = (draws.vector(1.0), draws.vector(0.5));
    let most = draws.one_of([0.0, 0.01, 0.1]);
    let mut wrong: [Vector3<f32>; 4] = core::array::from_fn(|_| draws.vector(most));
    if draws.below(2) == 0 {
        wrong[draws.below(4) as usize] = Vector3::zeros();
    }
    let known_n = [draws.vector(1.0).normalize(), draws.vector(1.0).normalize()];
    let mut q = draws.attitude();
    for cycle in 0..150 {
        let dt_s = draws.within(0.1, 0.3);
        let swing = nalgebra::ComplexField::sin(cycle as f32 * 0.3);
        let turns_b = rate_b + swings_b * swing;
        q *= from_rotation_vector(turns_b * dt_s);
        let asked = draws.below(40) > 0;
        let rates_b = asked.then(|| wrong.map(|wrong_b| turns_b + wrong_b));
        let dt = (draws.below(40) > 0).then_some(dt_s);
        let directions = known_n.map(|known_n| {
            let along_b = (q.inverse_transform_vector(&known_n) + draws.vector(0.005)).normalize();
            let variance = draws.within(1e-5, 1e-4);
            (draws.below(30) > 0).then_some(Direction { along_b, variance })
        });
        if draws.below(60) == 0 {
            watched.pause();
            model.pause();
        }
        let found = watched.step(rates_b, dt, directions);
        let of_model: Option<[V; 4]> = rates_b.map(|rates_b| rates_b.map(|rate_b| rate_b.cast()));
        let expected = model.step(
            (of(error.noise), of(error.bias)),
            of_model,
            dt.map(of),
            directions.map(|direction| direction.map(|now| (now.along_b.cast(), of(now.variance)))),
        );
        assert_eq!(found, expected, "{seed} {cycle}");
        match expected {
            Some(_) => seen.guilty += 1,
            None => seen.open += 1,
        }
    }
}

#[test]
fn the_one_gyro_without_which_the_rate_fits_is_found() {
    let mut seen = Seen::default();
    for seed in 0..300 {
        run(seed, &mut seen);
    }
    assert!(seen.guilty > 300 && seen.open > 10_000, "{} {}", seen.guilty, seen.open);
}
