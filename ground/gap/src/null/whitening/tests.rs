//! The pass against the dense Gaussian that it stands for, and against logs drawn from that.

use nalgebra::Cholesky;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::{Xoshiro256PlusPlus, rand_core::SeedableRng};
use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::*;

/// Double precision over some hundred samples.
const ROUNDING: f64 = 1e-8;

/// Covariance of a process' states `one` at `t_s` and `other` at `u_s`: the kernels as they are in books, and their derivatives.
fn kernel(process: Process, [one, other]: [usize; 2], [t_s, u_s]: [f64; 2]) -> f64 {
    let dt = t_s - u_s;
    match process {
        Process::Matern { sigma, alike_s } => {
            let pace = 3f64.sqrt() / alike_s;
            let fade = sigma * sigma * (-pace * dt.abs()).exp();
            match [one, other] {
                [0, 0] => fade * (1.0 + pace * dt.abs()),
                [1, 0] => -fade * pace * pace * dt,
                [0, 1] => fade * pace * pace * dt,
                _ => fade * pace * pace * (1.0 - pace * dt.abs()),
            }
        }
        Process::Alike { sigma, alike_s } => sigma * sigma * (-dt.abs() / alike_s).exp(),
        Process::Walk { per_root_s } => per_root_s * per_root_s * t_s.min(u_s),
    }
}

/// A small unit that turns: a gyro sees the rate of an attitude error, an accelerometer the error itself, two magnetometers the
/// field's and the error; each has a zero that wanders. The first sample is at zero, where walks begin.
fn log(sigma_rad: f64, alike_s: f64, wander_ut: f64, noise: f64) -> (Vec<Process>, Vec<Sample>) {
    let mut processes = vec![
        Process::Matern {
            sigma: sigma_rad,
            alike_s,
        },
        Process::Alike {
            sigma: wander_ut,
            alike_s: 0.5 * alike_s,
        },
    ];
    processes.extend([1e-4, 1e-3, 3e-2, 3e-2].map(|per_root_s| Process::Walk { per_root_s }));
    let mut samples = Vec::new();
    for k in 0..40 {
        let t_s = 0.7 * f64::from(k) + 0.2 * f64::from(k % 3);
        let turned = (0.3 * t_s).cos();
        let sees = [
            (vec![(1, 1.0), (3, 1.0)], 0.002),
            (vec![(0, 9.8 * turned), (4, 1.0)], 0.01),
            (vec![(0, 20.0 * turned), (2, 1.0), (5, 1.0)], 0.3),
            (vec![(0, -15.0), (2, turned), (6, 1.0)], 0.3),
        ];
        samples.extend(sees.map(|(sees, sigma)| Sample {
            t_s,
            sees,
            variance: (noise * sigma).powi(2),
        }));
    }
    (processes, samples)
}

/// Covariance of all samples.
fn dense(processes: &[Process], samples: &[Sample]) -> DMatrix<f64> {
    let (places, states) = places(processes);
    let mut owners = vec![(0, 0); states];
    for (process, at) in places.iter().enumerate() {
        (0..processes[process].states()).for_each(|own| owners[at + own] = (process, own));
    }
    DMatrix::from_fn(samples.len(), samples.len(), |row, column| {
        let (one, other) = (&samples[row], &samples[column]);
        let mut sum = if row == column { one.variance } else { 0.0 };
        for (own, part) in &one.sees {
            for (others, other_part) in &other.sees {
                let ((process, mine), (same, its)) = (owners[*own], owners[*others]);
                if process == same {
                    sum += part * other_part * kernel(processes[process], [mine, its], [one.t_s, other.t_s]);
                }
            }
        }
        sum
    })
}

fn normal(random: &mut Xoshiro256PlusPlus, count: usize) -> DVector<f64> {
    DVector::from_fn(count, |_, _| StandardNormal.sample(&mut *random))
}

#[test]
fn likelihood_and_inner_products_are_those_of_the_dense_gaussian() {
    for (sigma_rad, alike_s, wander_ut) in [
        (0.003, 20.0, 0.15),
        (0.02, 4.0, 1.0),
        (0.0, 20.0, 0.0),
        (0.003, 1e6, 0.3),
    ] {
        let (processes, samples) = log(sigma_rad, alike_s, wander_ut, 1.0);
        let whitening = Whitening::new(&processes, &samples);
        let factor = Cholesky::new(dense(&processes, &samples)).expect("positive definite");
        let mut random = Xoshiro256PlusPlus::seed_from_u64(5);
        let columns = DMatrix::from_columns(&[
            factor.l() * normal(&mut random, samples.len()),
            normal(&mut random, samples.len()),
            DVector::from_fn(samples.len(), |row, _| (0.1 * row as f64).sin()),
        ]);
        let white = whitening.whiten(&columns);
        let (found, expected) = (white.tr_mul(&white), columns.tr_mul(&factor.solve(&columns)));
        for (found, expected) in found.iter().zip(expected.iter()) {
            let scale = (expected.abs()).max(1.0);
            assert!((found - expected).abs() < ROUNDING * scale * 1e2, "{found} {expected}");
        }
        let residual = columns.column(0).into_owned();
        let log_determinant: f64 = factor.l().diagonal().iter().map(|value| 2.0 * value.ln()).sum();
        let energy = residual.dot(&factor.solve(&residual));
        let expected = -0.5 * (log_determinant + energy + samples.len() as f64 * std::f64::consts::TAU.ln());
        let found = whitening.log_likelihood(&residual);
        assert!(
            (found - expected).abs() < ROUNDING * expected.abs(),
            "{found} {expected}"
        );
    }
}

#[test]
fn a_sample_that_says_nothing_is_passed_over() {
    let (processes, mut samples) = log(0.003, 20.0, 0.15, 1.0);
    samples[7].variance = f64::INFINITY;
    samples[9].variance = 0.0;
    let whitening = Whitening::new(&processes, &samples);
    let left: Vec<Sample> = (samples.iter().enumerate())
        .filter(|(at, _)| ![7, 9].contains(at))
        .map(|(_, sample)| sample.clone())
        .collect();
    let mut random = Xoshiro256PlusPlus::seed_from_u64(6);
    let residual = normal(&mut random, samples.len());
    let kept = residual.clone().remove_rows_at(&[7, 9]);
    let (all, few) = (
        whitening.log_likelihood(&residual),
        Whitening::new(&processes, &left).log_likelihood(&kept),
    );
    assert!((all - few).abs() < ROUNDING * few.abs(), "{all} {few}");
}

/// Largest difference between the share of values up to each and that value (Kolmogorov and Smirnov), times the root of their number.
fn uniformity(mut p: Vec<f64>) -> f64 {
    p.sort_by(f64::total_cmp);
    let count = p.len() as f64;
    let apart = |(at, p): (usize, &f64)| (p - at as f64 / count).abs().max((p - (at + 1) as f64 / count).abs());
    p.iter().enumerate().map(apart).fold(0.0, f64::max) * count.sqrt()
}

/// p-values of healthy logs drawn from the dense Gaussian, by settings of reference and noise: of all that is left, and of what is
/// left along the eight slowest courses of the accelerometer. `believed` is the reference's correlation time over the true one.
fn p_values(believed: f64) -> [Vec<f64>; 2] {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(11);
    let mut p = [Vec::new(), Vec::new()];
    for sigma_rad in [0.0005, 0.0015, 0.003] {
        for alike_s in [5.0, 20.0, 60.0] {
            for noise in [0.5, 1.0, 1.5] {
                let (processes, samples) = log(sigma_rad, alike_s, 0.15, noise);
                let factor = Cholesky::new(dense(&processes, &samples))
                    .expect("positive definite")
                    .unpack();
                let (taken, _) = log(sigma_rad, believed * alike_s, 0.15, noise);
                let whitening = Whitening::new(&taken, &samples);
                let courses = DMatrix::from_fn(samples.len(), 8, |row, course| match row % 4 {
                    1 => (std::f64::consts::PI * course as f64 * samples[row].t_s / 28.0).cos(),
                    _ => 0.0,
                });
                let slow = whitening.whiten(&courses).qr().q();
                for _ in 0..12 {
                    let drawn = &factor * normal(&mut random, samples.len());
                    let white = whitening.whiten(&DMatrix::from_columns(&[drawn]));
                    let energies = [
                        (white.norm_squared(), samples.len()),
                        (slow.tr_mul(&white).norm_squared(), 8),
                    ];
                    for (p, (energy, freedom)) in p.iter_mut().zip(energies) {
                        p.push(1.0 - ChiSquared::new(freedom as f64).expect("positive").cdf(energy));
                    }
                }
            }
        }
    }
    p
}

/// [root of the number of values] what uniform values exceed once in a thousand times (Smirnov 1948).
const ONCE_IN_A_THOUSAND: f64 = 1.95;

#[test]
fn what_is_left_of_healthy_logs_is_uniform_over_settings_of_reference_and_noise() {
    for p in p_values(1.0) {
        let off = uniformity(p);
        assert!(off < ONCE_IN_A_THOUSAND, "{off}");
    }
}

#[test]
fn a_reference_whose_error_is_taken_for_faster_than_it_is_is_not_uniform() {
    let [_, slow] = p_values(0.05);
    let off = uniformity(slow);
    assert!(off > ONCE_IN_A_THOUSAND, "{off}");
}

#[test]
fn a_dual_has_the_inner_products_of_what_is_whitened() {
    let (processes, mut samples) = log(0.01, 5.0, 0.5, 1.0);
    samples[7].variance = 0.0;
    let whitening = Whitening::new(&processes, &samples);
    let column = |rate: f64| DVector::from_fn(samples.len(), |at, _| (rate * at as f64).sin());
    let (one, other) = (column(0.7), column(1.9));
    let white = whitening.whiten(&DMatrix::from_columns(std::slice::from_ref(&one)));
    let [of_white, of_dual] = [white.column(0).dot(&other), one.dot(&whitening.dual(&other))];
    assert!(
        (of_white - of_dual).abs() < ROUNDING * of_white.abs(),
        "{of_white} {of_dual}"
    );
}
