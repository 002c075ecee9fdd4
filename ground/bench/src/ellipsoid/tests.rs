use rand_distr::{Distribution, Normal, UnitSphere};
use rand_xoshiro::{Xoshiro256PlusPlus, rand_core::SeedableRng};

use super::*;
use crate::least_squares::student_95;

/// Angles of "large" distortion, seed case: a, b, c, x0, y0, z0, rho, phi, lambda (3, -2, 1.5 deg).
fn large() -> [f64; 9] {
    let rad = f64::to_radians;
    [1.05, 0.93, 1.12, 25.0, -40.0, 60.0, rad(3.0), rad(-2.0), rad(1.5)]
}

/// Values of Table 6.1 of Marinho (2017).
fn table_6_1() -> [f64; 9] {
    let rad = f64::to_radians;
    [
        1.0855,
        1.034,
        1.0529,
        199.9729,
        80.5599,
        -110.4864,
        rad(0.0514),
        rad(0.0488),
        rad(-0.0033),
    ]
}

fn offset(nine: &[f64; 9]) -> Vector3<f64> {
    Vector3::new(nine[3], nine[4], nine[5])
}

fn cloud(nine: &[f64; 9], strength: f64, count: usize, sigma: f64, seed: u64) -> Vec<Vector3<f64>> {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    let normal = Normal::new(0.0, sigma).expect("sigma");
    let t = shape(nine, Convention::Standard);
    let point = |_| {
        let way: [f64; 3] = UnitSphere.sample(&mut random);
        let noise = Vector3::from_fn(|_, _| normal.sample(&mut random));
        t * Vector3::from(way) * strength + offset(nine) + noise
    };
    (0..count).map(point).collect()
}

#[test]
fn both_conventions_give_the_golden_fields() {
    // Seed values of A.5, to their ten digits.
    const DIGITS: f64 = 6e-11;
    for (nine, counts, standard, thesis) in [
        (
            table_6_1(),
            [300.0, 250.0, 50.0],
            [92.1484108706, 163.7859683139, 152.2890750600],
            [92.1484108706, 163.7859683139, 152.3542162921],
        ),
        (
            large(),
            [150.0, -200.0, 90.0],
            [119.0476190476, -178.5181346332, 17.4579664826],
            [119.0476190476, -178.5181346332, 35.6459746526],
        ),
    ] {
        for (convention, expected) in [(Convention::Standard, standard), (Convention::Thesis, thesis)] {
            let t = shape(&nine, convention);
            let field = t
                .solve_lower_triangular(&(Vector3::from(counts) - offset(&nine)))
                .expect("triangle");
            assert!(
                (field - Vector3::from(expected)).amax() < DIGITS,
                "{convention:?} {field}"
            );
        }
    }
}

#[test]
fn noise_free_points_give_all_nine_back_in_either_convention() {
    // Gauss-Newton stops at 1e-12 of the cloud's size, some 300 counts.
    const SETTLED: f64 = 1e-8;
    let points = cloud(&large(), 230.0, 40, 0.0, 7);
    let found = Ellipsoid::fit(&points, 230.0).expect("fit");
    for (found, truth) in found.nine(Convention::Standard).values.iter().zip(large()) {
        assert!((found - truth).abs() < SETTLED, "{found} {truth}");
    }
    let thesis = found.nine(Convention::Thesis).values;
    assert!((shape(&thesis, Convention::Thesis) - found.shape).norm() < SETTLED);
    assert!(
        (thesis[7] - large()[8]).abs() < 0.01 && (thesis[8] - large()[7]).abs() < 0.01,
        "phi and lambda change places"
    );
}

#[test]
fn intervals_cover_95_of_100_and_a_large_offset_does_not_bias() {
    let runs = 1000;
    let mut inside = [0; 9];
    let (mut sum, mut squares) = ([0.0; 9], [0.0; 9]);
    for seed in 0..runs {
        // 1 % noise, so that what is left of the bias would show; offset as large as the field.
        let found = Ellipsoid::fit(&cloud(&table_6_1(), 230.0, 230, 2.3, seed), 230.0).expect("fit");
        let nine = found.nine(Convention::Standard);
        for (k, truth) in table_6_1().into_iter().enumerate() {
            let error = nine.values[k] - truth;
            sum[k] += error;
            squares[k] += error * error;
            inside[k] += usize::from(error.abs() < student_95(found.freedom) * nine.sigmas[k]);
        }
    }
    for k in 0..9 {
        let share = inside[k] as f64 / runs as f64;
        assert!((0.93..=0.97).contains(&share), "parameter {k}: {share}");
        // Mean error of 1,000 within four of its own standard deviations: biased a tenth of a sigma it would not be.
        let mean = sum[k] / runs as f64;
        let spread = (squares[k] / runs as f64).sqrt();
        assert!(
            mean.abs() < 4.0 * spread / (runs as f64).sqrt(),
            "parameter {k}: {mean} of {spread}"
        );
    }
}

#[test]
fn left_at_the_algebraic_start_it_would_be_biased() {
    let (mut algebraic_sum, mut fitted_sum) = (0.0, 0.0);
    for seed in 0..200 {
        let points = cloud(&large(), 230.0, 230, 6.9, seed);
        let unit: Vec<_> = points.iter().map(|v| v / 230.0).collect();
        algebraic_sum += algebraic(&unit).expect("start").0[(0, 0)] - 1.05;
        fitted_sum += Ellipsoid::fit(&points, 230.0).expect("fit").shape[(0, 0)] - 1.05;
    }
    let (algebraic, fitted) = (algebraic_sum / 200.0, fitted_sum / 200.0);
    assert!(
        fitted.abs() < 5e-4 && algebraic.abs() > 3.0 * fitted.abs(),
        "{algebraic} {fitted}"
    );
}

#[test]
fn what_is_no_ellipsoid_is_refused() {
    let flat: Vec<_> = cloud(&large(), 230.0, 50, 0.0, 1)
        .iter()
        .map(|v| Vector3::new(v.x, v.y, 3.0))
        .collect();
    assert_eq!(Ellipsoid::fit(&flat, 230.0), Err(EllipsoidError::Open));
    let few = cloud(&large(), 230.0, 9, 0.0, 1);
    assert_eq!(Ellipsoid::fit(&few, 230.0), Err(EllipsoidError::Few(9)));
    let ways = |k: i32| f64::from(k % 5 - 2);
    let saddle: Vec<_> = (0..25)
        .map(|k| Vector3::new(ways(k), ways(k / 5), 0.5 * ways(k) * ways(k / 5) + ways(k * 7) * 0.1))
        .collect();
    assert!(Ellipsoid::fit(&saddle, 1.0).is_err());
    assert_eq!(
        Ellipsoid::fit(&[Vector3::zeros(); 20], 1.0),
        Err(EllipsoidError::Shapeless)
    );
}
