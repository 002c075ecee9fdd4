//! How much less a channel's samples say than their number: what the best model leaves is louder than noise, or alike from
//! sample to sample.
//!
//! In: what is left of each channel, in units of noise. Out: a factor of the noise, 1 where the residual is white and of
//! the size described. A misfit of variance `v` and integrated autocorrelation `tau = 1 + 2 sum rho_k` carries as much
//! information about a slow effect as white noise of variance `v tau` does (Priestley 1981, 5.3.2); taking it for noise of
//! one is how a real log makes nonsense certain. The sum ends at the first lag that is not above twice the spread of
//! white noise's `1 / sqrt n`, for beyond it there is only noise to add up.
//!
//! It never makes evidence stronger, and a channel within [`MISFIT_CALM`] of white is left alone.

use crate::{null::problem::Frame, thresholds::MISFIT_CALM};
use nalgebra::DVector;

/// Factor of the variance beyond which it does not count: such a channel says nothing anyway.
const MOST: f64 = 1e6;

/// Part of the samples that lags go up to: beyond it a sum has too few terms to be one.
const LONGEST: usize = 8;

/// Factors of the noise, one a channel.
pub fn factors(rest: &[DVector<f64>]) -> Vec<f64> {
    rest.iter().map(|rest| factor(rest.as_slice())).collect()
}

/// Frames whose noise is so many times what it was, one factor a channel.
pub fn weighed(mut frames: Vec<Frame>, factors: &[f64]) -> Vec<Frame> {
    for (frame, factor) in frames.iter_mut().zip(factors).filter(|(_, factor)| **factor != 1.0) {
        frame.reweigh(&frame.weights.map(|_| *factor));
    }
    frames
}

fn factor(rest: &[f64]) -> f64 {
    let energy: f64 = rest.iter().map(|value| value * value).sum();
    if rest.len() < 2 || !energy.is_finite() || energy <= 0.0 {
        return 1.0;
    }
    let variance = energy / rest.len() as f64 * correlation_time(rest, energy);
    if variance > MISFIT_CALM {
        variance.min(MOST).sqrt()
    } else {
        1.0
    }
}

/// Samples that count as one, of a residual of this energy.
pub fn correlation_time(rest: &[f64], energy: f64) -> f64 {
    let least = 2.0 / (rest.len() as f64).sqrt();
    let alike = |lag: usize| rest.iter().zip(&rest[lag..]).map(|(a, b)| a * b).sum::<f64>() / energy;
    let sum: f64 = (1..rest.len() / LONGEST)
        .map(alike)
        .take_while(|alike| *alike > least)
        .sum();
    1.0 + 2.0 * sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_distr::{Distribution, StandardNormal};
    use rand_xoshiro::{Xoshiro256PlusPlus, rand_core::SeedableRng};

    /// Of the correlation time of four thousand samples: some hundred of them count, so one in ten, and twice that.
    const ROUGHLY: f64 = 0.2;

    fn noise(alike: f64) -> Vec<f64> {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(7);
        let mut last: f64 = StandardNormal.sample(&mut random);
        (0..4000)
            .map(|_| {
                let fresh: f64 = StandardNormal.sample(&mut random);
                last = alike * last + (1.0 - alike * alike).sqrt() * fresh;
                last
            })
            .collect()
    }

    #[test]
    fn white_noise_is_left_alone() {
        assert_eq!(factor(&noise(0.0)), 1.0);
    }

    #[test]
    fn noise_that_is_alike_counts_as_its_correlation_time_says() {
        // Of a first-order process: (1 + a) / (1 - a).
        let expected = f64::sqrt(1.8 / 0.2);
        assert!((factor(&noise(0.8)) / expected - 1.0).abs() < ROUGHLY);
    }

    #[test]
    fn an_empty_or_endless_residual_tempers_nothing() {
        assert_eq!(factor(&[]), 1.0);
        assert_eq!(factor(&[0.0, 0.0]), 1.0);
        assert_eq!(factor(&[f64::NAN, 1.0]), 1.0);
    }
}
