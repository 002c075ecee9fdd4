//! Vibration: a line in the spectrum, from machinery or the supply, wherever sampling folds it to.
//!
//! The residual, in blocks, is transformed; in a bin with a line of amplitude `a` sigma the power, exponential with mean 1
//! without it, has the mean v = 1 + n a^2/4 (Whittle). The frequency is unknown: the likelihood is averaged over all bins.
//!
//! A line stands above its neighbours. What is slow has them too, whatever it is: each bin is taken over the level of the bins
//! around it (their median), and bins of few cycles a block are not looked at.

use core::f64::consts::TAU;

use super::spread::View;
use super::{Effect, Nature, Page, Symbol};
use crate::part::signal::Noise;
use crate::predict::Kind;

/// Samples of a block: 100 s at 5 Hz, so that a line may wander by a hundredth of a hertz.
const BLOCK: usize = 512;

/// Cycles of a block below which a line is no line but a drift.
const FEWEST: usize = 10;

/// Bins on either side that tell the level about a bin, and the nearest of them: a line leaks into its neighbours.
const AROUND: usize = 12;
const LEAKED: usize = 3;

/// Median over mean of an exponential variable.
const MEDIAN: f64 = core::f64::consts::LN_2;

/// Powers over the level of those around each, or over that of white noise if this is higher.
fn above_level(powers: &[f64]) -> Vec<f64> {
    let over = |bin: usize| {
        let near = bin.saturating_sub(AROUND)..(bin + AROUND + 1).min(powers.len());
        let mut level: Vec<f64> = near
            .filter(|other| other.abs_diff(bin) >= LEAKED)
            .map(|other| powers[other])
            .collect();
        let middle = level.len() / 2;
        let median = *level.select_nth_unstable_by(middle, f64::total_cmp).1;
        powers[bin] / (median / MEDIAN).max(1.0)
    };
    (FEWEST..powers.len()).map(over).collect()
}

/// Power of the standardised residual in each bin from [`FEWEST`] on, block by block, of mean 1 for white noise.
fn powers(view: &View) -> Vec<Vec<f64>> {
    let mut whitened = vec![0.0; view.measured.len()];
    for (k, residual) in view.residuals() {
        whitened[k] = residual / view.channel.sigma();
    }
    let circle: Vec<(f64, f64)> = (0..BLOCK).map(|k| (TAU * k as f64 / BLOCK as f64).sin_cos()).collect();
    let power = |block: &[f64], bin: usize| {
        let turn = |k: usize| circle[k * bin % BLOCK];
        let sums = block.iter().enumerate().map(|(k, z)| (z * turn(k).0, z * turn(k).1));
        let (sin, cos) = sums.fold((0.0, 0.0), |sum, term| (sum.0 + term.0, sum.1 + term.1));
        (sin * sin + cos * cos) / BLOCK as f64
    };
    let blocks = whitened.chunks_exact(BLOCK);
    blocks
        .map(|block| above_level(&(0..BLOCK / 2).map(|bin| power(block, bin)).collect::<Vec<f64>>()))
        .collect()
}

/// `vibration`.
pub struct Vibration;

const PAGE: Page = Page {
    name: "vibration",
    physics: "Something vibrates or hums: a sine that the sampling may fold to any frequency below half its rate.",
    equation: "y + a sigma sin(2 pi f t + phase)",
    source: "Motors, reaction wheels, supplies; mg and mG",
    excited_by: "running machinery",
    siblings: &["noise-level", "mains-alias", "shock"],
    confirm_by: "Switch the machinery off; sample faster to see the true frequency.",
    nature: Nature::Spread,
    common: true,
    sensors: &[Kind::Accelerometer, Kind::Gyro, Kind::Magnetometer],
    parameters: &[Symbol::positive("a", "1", 1.0)],
    ..Page::SMOOTH
};

impl Effect for Vibration {
    fn page(&self) -> &'static Page {
        &PAGE
    }

    fn log_likelihood(&self, theta: &[f64], variant: f64, views: &[View]) -> f64 {
        let _ = variant;
        let of = |view: &View| -> f64 {
            let powers = powers(view);
            // A line through all blocks stays in its bin.
            let v = 1.0 + BLOCK as f64 * theta[0].powi(2) / 4.0;
            let gain = |bin: usize| {
                powers
                    .iter()
                    .map(|block| block[bin] * (1.0 - 1.0 / v) - v.ln())
                    .sum::<f64>()
            };
            let gains: Vec<f64> = (0..BLOCK / 2 - FEWEST).map(gain).collect();
            let most = gains.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            let mean = gains.iter().map(|gain| (gain - most).exp()).sum::<f64>() / gains.len() as f64;
            view.nominal() + most + mean.ln()
        };
        views.iter().map(of).sum()
    }

    fn disturb(&self, theta: &[f64], variant: f64, views: &[View], noise: Noise) -> Vec<Vec<f64>> {
        let humming = |(number, view): (usize, &View)| {
            let phase = TAU * noise.uniform(number as u64);
            let step_s = view.t_s.windows(2).map(|pair| pair[1] - pair[0]).next().unwrap_or(1.0);
            let any_hz = 0.5 / step_s * noise.stream(1).uniform(0);
            let frequency_hz = if variant > 0.0 { variant } else { any_hz };
            let amplitude = theta[0] * view.channel.sigma();
            let samples = view.measured.iter().zip(view.t_s);
            samples
                .map(|(measured, t_s)| measured + amplitude * (TAU * frequency_hz * t_s + phase).sin())
                .collect()
        };
        views.iter().enumerate().map(humming).collect()
    }

    /// Any frequency: the likelihood averages over them. To inject, the variant is the frequency [Hz], or 0 for a drawn one.
    fn variants(&self, _starts_s: &[f64]) -> Vec<f64> {
        vec![0.0]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_stands_above_its_neighbours_and_a_drift_does_not() {
        // Whatever is slow: a spectrum that falls with the square of the frequency.
        let drift: Vec<f64> = (0..BLOCK / 2)
            .map(|bin| 1.0 + 1e5 / (1.0 + bin as f64).powi(2))
            .collect();
        let mut line = drift.clone();
        line[100] += 500.0;
        let most = |powers: &[f64]| above_level(powers).into_iter().fold(0.0, f64::max);
        assert!(most(&drift) < 4.0, "{}", most(&drift));
        assert!(most(&line) > 30.0, "{}", most(&line));
        // A level below that of white noise makes no line of white noise.
        assert!(most(&[1.0; BLOCK / 2]) <= 1.0);
    }
}
