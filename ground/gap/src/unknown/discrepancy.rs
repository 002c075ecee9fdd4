//! How large is something that no effect explains? Evidence for a free course of unknown size, and that size.
//!
//! In: the normal equations of the course's coefficients with everything else marginalised, in whitened units; its coefficients are
//! `N(0, a^2)`, and `a`, the root mean square of the course in physical units, is log-uniform on a grid. Out: the Bayes factor against
//! "nothing" and draws of the size from the posterior. With eigenvalues `l_i` of the information and scores `z_i` of unit variance,
//! `ln BF(a) = sum [z_i^2 a^2 l_i / (1 + a^2 l_i) - ln(1 + a^2 l_i)] / 2` (Kennedy and O'Hagan 2001 for the discrepancy; Rasmussen and
//! Williams 2006, equation 5.8).
//!
//! What the samples do not tell of (`a^2 l_i < 1`) counts nothing to the size: it would be the prior's.

use nalgebra::{DMatrix, DVector};
use rand_distr::{Distribution, StandardNormal, Uniform};
use rand_xoshiro::{Xoshiro256PlusPlus, rand_core::SeedableRng};

/// Sizes on the grid, and the decades that it spans.
const GRID: (usize, f64) = (36, 5.0);

/// Draws of the posterior: its 5 % quantile then stands on twenty.
const DRAWS: usize = 400;

/// Fixed, so that one case gives one verdict.
const SEED: u64 = 0x5eed_0006;

/// Of the largest eigenvalue; smaller ones are rounding.
const ROUNDING: f64 = 1e-12;

/// What samples say of a course.
#[derive(Clone, Debug, PartialEq)]
pub struct Posterior {
    /// ln of the odds of the course against nothing.
    pub log_bayes_factor: f64,
    /// Draws of its root mean square, rising, in physical units; none where nothing can be said.
    pub sizes: Vec<f64>,
}

impl Posterior {
    /// Of `information` and `score`; `scales` is what each coefficient adds to the root mean square, and the grid of `a` is about `about`.
    pub fn of(information: DMatrix<f64>, score: &DVector<f64>, scales: &[f64], about: f64) -> Self {
        let nothing = Posterior {
            log_bayes_factor: 0.0,
            sizes: Vec::new(),
        };
        if !(information.iter().chain(score.iter()).all(|value| value.is_finite()) && about > 0.0) {
            return nothing;
        }
        let eigen = information.symmetric_eigen();
        let least = ROUNDING * eigen.eigenvalues.max();
        let along = eigen.eigenvectors.tr_mul(score);
        // Each direction's information, its square of unit variance under nothing, and its place.
        let told: Vec<(f64, f64, usize)> = (eigen.eigenvalues.iter().zip(along.iter()).enumerate())
            .filter(|(_, (value, _))| **value > least && **value > 0.0)
            .map(|(place, (value, along))| (*value, along / value.sqrt(), place))
            .collect();
        if told.is_empty() {
            return nothing;
        }
        let (count, decades) = GRID;
        let grid = (0..count).map(|k| about * 10f64.powf(decades * (k as f64 / (count - 1) as f64 - 0.4)));
        let grid: Vec<f64> = grid.collect();
        let evidence = |a: &f64| -> f64 {
            let one = |(value, z, _): &(f64, f64, usize)| {
                let much = a * a * value;
                z * z * much / (1.0 + much) - much.ln_1p()
            };
            0.5 * told.iter().map(one).sum::<f64>()
        };
        let evidences: Vec<f64> = grid.iter().map(evidence).collect();
        let largest = evidences.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let masses: Vec<f64> = evidences.iter().map(|evidence| (evidence - largest).exp()).collect();
        let total: f64 = masses.iter().sum();
        let mut random = Xoshiro256PlusPlus::seed_from_u64(SEED);
        let Ok(share) = Uniform::new(0.0, total) else {
            return nothing;
        };
        let mut draw = || -> f64 {
            let mut left = share.sample(&mut random);
            let at = masses.iter().position(|mass| {
                left -= mass;
                left < 0.0
            });
            let a = grid[at.unwrap_or(count - 1)];
            let mut coefficients = DVector::zeros(scales.len());
            for (value, z, place) in &told {
                let much = a * a * value;
                if much >= 1.0 {
                    let normal: f64 = StandardNormal.sample(&mut random);
                    let drawn = (z * much / (1.0 + much) + normal * (much / (1.0 + much)).sqrt()) / value.sqrt();
                    coefficients.axpy(drawn, &eigen.eigenvectors.column(*place), 1.0);
                }
            }
            let squares = coefficients
                .iter()
                .zip(scales)
                .map(|(own, scale)| (own * scale).powi(2));
            squares.sum::<f64>().sqrt()
        };
        let mut sizes: Vec<f64> = (0..DRAWS).map(|_| draw()).collect();
        sizes.sort_by(f64::total_cmp);
        Posterior {
            log_bayes_factor: largest + (total / count as f64).ln(),
            sizes,
        }
    }

    /// A quantile of the size.
    pub fn quantile(&self, share: f64) -> f64 {
        let last = self.sizes.len().saturating_sub(1);
        self.sizes
            .get((last as f64 * share).round() as usize)
            .copied()
            .unwrap_or(0.0)
    }

    /// Probability of a size above a bar, if it is there.
    pub fn above(&self, bar: f64) -> f64 {
        let within = self.sizes.partition_point(|size| *size <= bar);
        (self.sizes.len() - within) as f64 / self.sizes.len().max(1) as f64
    }
}

/// Courses in time: the constant and cosines of unit mean square, and the part of the size that each has a priori. Their amplitudes fall
/// with one over their number, as those of what drifts do.
pub fn courses(count: usize) -> (impl Fn(usize, f64) -> f64, Vec<f64>) {
    let squares = (0..count).map(|k| ((k + 1) as f64).powi(-2));
    let sum: f64 = squares.clone().sum();
    let scales = squares.map(|square| (square / sum).sqrt()).collect();
    let course = |k: usize, phase: f64| match k {
        0 => 1.0,
        _ => std::f64::consts::SQRT_2 * (std::f64::consts::PI * k as f64 * phase).cos(),
    };
    (course, scales)
}

#[cfg(test)]
mod tests {
    use super::*;

    const SAMPLES: usize = 400;
    const COURSES: usize = 32;

    /// The posterior of a course of this root mean square in white noise of unit variance, drawn with a seed.
    fn posterior(rms: f64, seed: u64) -> (Posterior, f64) {
        let (course, scales) = courses(COURSES);
        let phase = |row: usize| (row as f64 + 0.5) / SAMPLES as f64;
        let columns = DMatrix::from_fn(SAMPLES, COURSES, |row, k| scales[k] * course(k, phase(row)));
        let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
        let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
        let truth = &columns * DVector::from_fn(COURSES, |_, _| normal());
        let own = (truth.norm_squared() / SAMPLES as f64).sqrt();
        let residual = truth * (rms / own) + DVector::from_fn(SAMPLES, |_, _| normal());
        let found = Posterior::of(columns.tr_mul(&columns), &columns.tr_mul(&residual), &scales, 0.3);
        (found, rms)
    }

    #[test]
    fn the_interval_of_the_size_holds_the_truth_nine_times_in_ten() {
        for rms in [0.5, 2.0] {
            let within = (0..100).filter(|seed| {
                let (found, rms) = posterior(rms, *seed);
                found.quantile(0.05) <= rms && rms <= found.quantile(0.95)
            });
            // Three standard deviations of a hundred draws at nine in ten are 9; what falls off with the tails costs a little more.
            let within = within.count();
            assert!((78..=99).contains(&within), "{rms}: {within}");
        }
    }

    #[test]
    fn nothing_has_no_evidence_and_something_has() {
        let without = (0..100)
            .filter(|seed| posterior(0.0, *seed).0.log_bayes_factor > 3.0)
            .count();
        // Odds of twenty are reached by nothing once in twenty times at most (Markov).
        assert!(without <= 5, "{without}");
        assert!(posterior(0.5, 3).0.log_bayes_factor > 10.0);
        assert!(posterior(2.0, 3).0.above(1.0) > 0.99 && posterior(0.2, 3).0.above(1.0) < 0.01);
    }

    #[test]
    fn what_is_not_finite_says_nothing() {
        let found = Posterior::of(
            DMatrix::from_element(2, 2, f64::NAN),
            &DVector::zeros(2),
            &[1.0, 1.0],
            1.0,
        );
        assert_eq!((found.log_bayes_factor, found.above(0.0)), (0.0, 0.0));
    }
}
