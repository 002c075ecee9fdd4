use rand_distr::{Distribution, Normal};
use rand_xoshiro::{Xoshiro256PlusPlus, rand_core::SeedableRng};

use super::*;
use crate::least_squares::student_95;

/// Six faces and eight corners of a cube, at three temperatures.
fn excitations() -> Vec<(Vector3<f64>, f64)> {
    let mut list = Vec::new();
    for temperature_c in [-10.0, 20.0, 50.0] {
        for k in 0..27 {
            let along = |digit: i32| f64::from(digit % 3 - 1);
            let way = Vector3::new(along(k), along(k / 3), along(k / 9));
            if way.iter().filter(|c| **c != 0.0).count() % 2 == 1 {
                list.push((way.normalize() * 9.8, temperature_c));
            }
        }
    }
    list
}

fn truth() -> Response {
    Response {
        sensitivity_b: Vector3::new(-33.0, 0.5, 11.0),
        bias: vec![7.5, 0.05, -0.001],
        scale: vec![-2e-4],
        reference_c: 20.0,
        valid_c: -10.0..=50.0,
        covariance: DMatrix::zeros(7, 7),
        residuals: Vec::new(),
        scatter: 0.0,
        freedom: 0,
    }
}

fn observed(noise: impl FnMut() -> f64) -> Vec<Observation> {
    let (truth, mut noise) = (truth(), noise);
    let one = |(excitation_b, temperature_c)| Observation {
        excitation_b,
        temperature_c,
        value: truth.predict(&excitation_b, temperature_c) + noise(),
    };
    excitations().into_iter().map(one).collect()
}

#[test]
fn bias_and_scale_over_temperature_come_back_in_one_fit() {
    // Rounding of some forty values near 400 counts.
    const ROUNDING: f64 = 1e-9;
    let found = Response::fit(&observed(|| 0.0), Orders { bias: 2, scale: 1 }).expect("fit");
    assert!((found.sensitivity_b - truth().sensitivity_b).norm() < ROUNDING);
    for (found, truth) in found
        .bias
        .iter()
        .zip(truth().bias)
        .chain(found.scale.iter().zip(truth().scale))
    {
        assert!((found - truth).abs() < ROUNDING, "{found} {truth}");
    }
    assert_eq!(found.valid_c, -10.0..=50.0);
}

#[test]
fn intervals_over_temperature_cover_95_of_100() {
    let orders = Orders { bias: 2, scale: 1 };
    let normal = Normal::new(0.0, 1.5).expect("sigma");
    let (mut inside, mut all) = ([0; 7], 0);
    for seed in 0..1000 {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
        let found = Response::fit(&observed(|| normal.sample(&mut random)), orders).expect("fit");
        let values = found.sensitivity_b.iter().chain(&found.bias).chain(&found.scale);
        let truths = truth();
        let truths = truths.sensitivity_b.iter().chain(&truths.bias).chain(&truths.scale);
        for (k, (found_one, truth)) in values.zip(truths).enumerate() {
            let half = student_95(found.freedom) * found.covariance[(k, k)].sqrt();
            inside[k] += usize::from((found_one - truth).abs() < half);
        }
        all += 1;
    }
    for (k, inside) in inside.iter().enumerate() {
        let share = *inside as f64 / f64::from(all);
        assert!((0.93..=0.97).contains(&share), "parameter {k}: {share}");
    }
}

#[test]
fn what_was_not_excited_is_named() {
    let flat: Vec<_> = observed(|| 0.0)
        .into_iter()
        .filter(|one| one.excitation_b.z == 0.0)
        .collect();
    let error = Response::fit(&flat, Orders::default()).expect_err("no z").to_string();
    assert_eq!(error, "not determined: excitation along z is missing");
    let warm: Vec<_> = observed(|| 0.0)
        .into_iter()
        .filter(|one| one.temperature_c > 40.0)
        .collect();
    let error = Response::fit(&warm, Orders { bias: 1, scale: 0 })
        .expect_err("one temperature")
        .to_string();
    assert!(error.contains("bias times temperature^1 is missing"), "{error}");
}

#[test]
fn sigmas_are_those_of_scale_and_axis() {
    // s = (2, 0, 0), P = diag(4, 1, 9)e-4: relative scale 0.02/2, axis sqrt((1 + 9)/2 e-4)/2.
    let mut response = truth();
    response.sensitivity_b = Vector3::new(2.0, 0.0, 0.0);
    response.covariance = DMatrix::from_diagonal(&DVector::from_row_slice(&[4e-4, 1e-4, 9e-4, 0.25]));
    assert!((response.scale_sigma() - 0.01).abs() < 1e-12);
    assert!((response.axis_sigma_rad() - 5e-4_f64.sqrt() / 2.0).abs() < 1e-12);
    assert!((response.bias_sigma() - 0.5).abs() < 1e-12);
}
