//! The unit's closed form against the textbook's singular values, for every set of axes.

use emems::{
    geometry::{gyro_axes_b, triad_axes_b},
    redundancy::{Known, solve},
};
use host_tests::reference::redundancy::least_squares;
use nalgebra::Vector3;
use twin::part::signal::Noise;

/// f32 against f64 in units of the solution's worst standard deviation and the vector: a few hundred roundings, as the
/// normal equations square the condition of the rows.
const ROUNDING: f32 = 3e-5;

fn rank(known: Known) -> usize {
    match known {
        Known::All => 3,
        Known::Across(_) => 2,
        Known::Along(_) => 1,
        Known::Nothing => 0,
    }
}

/// Random values and variances over a factor of ten on `axes_b`, for the sets in `sets`.
fn compare(axes_b: &[Vector3<f32>], sets: impl Iterator<Item = u16>, seed: u64) {
    let noise = Noise::new(seed);
    for wanted in sets {
        let stream = noise.stream(u64::from(wanted));
        let values: Vec<f32> = (0..axes_b.len() as u64)
            .map(|k| 10.0 * stream.normal(k) as f32)
            .collect();
        let variances: Vec<f32> = (0..axes_b.len() as u64)
            .map(|k| 10_f64.powf(stream.stream(1).uniform(k) - 1.0) as f32)
            .collect();
        let kept: Vec<usize> = (0..axes_b.len()).filter(|k| wanted >> k & 1 == 1).collect();
        let pick = |from: &[f32]| -> Vec<f64> { kept.iter().map(|k| f64::from(from[*k])).collect() };
        let rows: Vec<_> = kept.iter().map(|k| axes_b[*k].map(f64::from)).collect();
        let (vector, covariance, known) = least_squares(&rows, &pick(&values), &pick(&variances));
        let found = solve(axes_b, &values, &variances, wanted);
        assert_eq!(rank(found.known), known, "{wanted:b}");
        let worst = covariance.trace().sqrt() as f32;
        let off = (found.vector_b - vector.map(|x| x as f32)).norm();
        assert!(
            off < ROUNDING * (vector.norm() as f32 + worst) * 10.0,
            "{wanted:b}: {off}"
        );
        let off = (found.covariance_b - covariance.map(|x| x as f32)).norm();
        assert!(off < 10.0 * ROUNDING * worst * worst, "{wanted:b}: {off}");
    }
}

#[test]
fn every_set_of_twelve_axes_agrees_with_the_singular_values() {
    compare(&triad_axes_b(), 1..1 << 12, 1);
}

#[test]
fn every_set_of_gyros_agrees_with_the_singular_values() {
    let axes_b: [Vector3<f32>; 4] = std::array::from_fn(|plate| gyro_axes_b().row(plate).transpose());
    for seed in 0..100 {
        compare(&axes_b, 1..16, seed);
    }
}
