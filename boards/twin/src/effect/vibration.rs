//! Vibration: a line in the spectrum, from machinery or the supply, wherever sampling folds it to.
//!
//! The residual, in blocks, is transformed; in a bin with a line of amplitude `a` sigma the power, exponential with mean 1
//! without it, has the mean v = 1 + n a^2/4 (Whittle). The frequency is unknown: the likelihood is averaged over all bins.
//!
//! What shakes with a motor's wear, or is folded about by a slow log, is no line of a hundredth of a hertz. It is a sine all the
//! same, of any phase at any sample ([`WANDERS`]): most often near its largest, never beyond, which neither louder noise
//! nor blows are. It is on half of the time, more or less, and stands far above the noise.
//!
//! A line stands above its neighbours. What is slow has them too, whatever it is: each bin is taken over the level of the bins
//! around it (their median), and bins of few cycles a block are not looked at.

use core::f64::consts::{PI, TAU};

use super::spread::{View, mixed};
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

/// Part of a block that must hold samples.
const FULL: f64 = 0.25;

/// Steps a bin in which the frequency is sought: between two of them a line loses a hundredth of its power.
const FINE: usize = 8;

/// Median over mean of an exponential variable.
const MEDIAN: f64 = core::f64::consts::LN_2;

/// The variant of a sine whose frequency is any at any time.
const WANDERS: f64 = -1.0;

/// Sigmas that such a sine reaches at least, and what sizes are sought in multiples of.
const LEAST: f64 = 5.0;
const FAR: f64 = 10.0;

/// Part of the samples that must be this many sigma off: of a sine that is on for a quarter of the time. What is off for seconds is
/// no shaking.
const LONG: f64 = 0.15;
const OFF: f64 = 3.0;

/// ln of the density at `z` sigma of a sine of amplitude `a` sigma and any phase, with noise: `1/(pi sqrt(a^2 - z^2))` rounded off
/// over a sigma at its ends, and by that a little too low everywhere.
fn of_any_phase(z: f64, a: f64) -> f64 {
    let z = z.abs();
    let inside = z.min(a);
    -PI.ln() - 0.5 * (a * a - inside * inside + 2.0 * a).ln() - 0.5 * (z - inside).powi(2)
}

/// The power of a line over the level of the powers around it, or over that of white noise if this is higher.
fn above_level(power: f64, mut around: Vec<f64>) -> f64 {
    let middle = around.len() / 2;
    let median = *around.select_nth_unstable_by(middle, f64::total_cmp).1;
    power / (median / MEDIAN).max(1.0)
}

/// Bins that tell the level about so many cycles a block.
fn around(cycles: f64) -> impl Iterator<Item = f64> {
    let offsets = (LEAKED..=AROUND).map(|offset| offset as f64);
    offsets
        .flat_map(move |offset| [cycles - offset, cycles + offset])
        .filter(|cycles| (0.0..(BLOCK / 2) as f64).contains(cycles))
}

/// A stretch of the standardised residual, zero where there is none.
struct Block {
    values: Vec<f64>,
    count: f64,
}

impl Block {
    /// All of a channel that have something in them.
    fn all(view: &View) -> Vec<Block> {
        let mut values = vec![0.0; view.measured.len()];
        let mut is_there = vec![false; view.measured.len()];
        for (k, residual) in view.residuals() {
            values[k] = residual / view.channel.sigma();
            is_there[k] = true;
        }
        let count = |is_there: &[bool]| is_there.iter().filter(|is_there| **is_there).count() as f64;
        (values.chunks_exact(BLOCK).zip(is_there.chunks_exact(BLOCK)))
            .map(|(values, is_there)| Block {
                values: values.to_vec(),
                count: count(is_there),
            })
            .filter(|block| block.count >= FULL * BLOCK as f64)
            .collect()
    }

    /// Power at so many cycles a block, of mean 1 for white noise.
    fn power(&self, cycles: f64) -> f64 {
        // A vector that turns on from sample to sample: sines cost ten times as much, and this is all that is computed here.
        let (turn_s, turn_c) = (TAU * cycles / BLOCK as f64).sin_cos();
        let (mut s, mut c, mut sin, mut cos) = (0.0, 1.0, 0.0, 0.0);
        for z in &self.values {
            (sin, cos) = (sin + z * s, cos + z * c);
            (s, c) = (s * turn_c + c * turn_s, c * turn_c - s * turn_s);
        }
        (sin * sin + cos * cos) / self.count
    }

    /// The same, over the level about it.
    fn line(&self, cycles: f64) -> f64 {
        above_level(
            self.power(cycles),
            around(cycles).map(|cycles| self.power(cycles)).collect(),
        )
    }

    /// The same in each bin from [`FEWEST`] on.
    fn lines(&self) -> Vec<f64> {
        let powers: Vec<f64> = (0..BLOCK / 2).map(|bin| self.power(bin as f64)).collect();
        let line = |bin: usize| {
            above_level(
                powers[bin],
                around(bin as f64).map(|bin| powers[bin as usize]).collect(),
            )
        };
        (FEWEST..BLOCK / 2).map(line).collect()
    }

    /// [nats] that a line of amplitude `a` sigma gains whose power is `line`.
    fn gain(&self, a: f64, line: f64) -> f64 {
        let v = 1.0 + self.count * a * a / 4.0;
        line * (1.0 - 1.0 / v) - v.ln()
    }
}

/// [s] between samples.
fn step_s(view: &View) -> f64 {
    view.t_s.windows(2).map(|pair| pair[1] - pair[0]).next().unwrap_or(1.0)
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
        if variant == WANDERS {
            return views.iter().map(|view| wandering(theta[0], view)).sum();
        }
        let of = |view: &View| -> f64 {
            let blocks = Block::all(view);
            if variant > 0.0 {
                let cycles = variant * BLOCK as f64 * step_s(view);
                let gain = blocks.iter().map(|block| block.gain(theta[0], block.line(cycles)));
                return view.nominal() + gain.sum::<f64>();
            }
            // A line through all blocks stays in its bin.
            let mut gains = vec![0.0; BLOCK / 2 - FEWEST];
            for block in &blocks {
                (gains.iter_mut().zip(block.lines())).for_each(|(gain, line)| *gain += block.gain(theta[0], line));
            }
            let most = gains.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            let mean = gains.iter().map(|gain| (gain - most).exp()).sum::<f64>() / gains.len() as f64;
            view.nominal() + most + mean.ln()
        };
        views.iter().map(of).sum()
    }

    fn disturb(&self, theta: &[f64], variant: f64, views: &[View], noise: Noise) -> Vec<Vec<f64>> {
        let humming = |(number, view): (usize, &View)| {
            let phase = TAU * noise.uniform(number as u64);
            let any_hz = 0.5 / step_s(view) * noise.stream(1).uniform(0);
            let frequency_hz = if variant > 0.0 { variant } else { any_hz };
            let amplitude = theta[0] * view.channel.sigma();
            let own = noise.stream(2 + number as u64);
            let at = |(k, t_s): (usize, &f64)| match variant == WANDERS {
                true => (TAU * own.uniform(2 * k as u64)).sin() * own.uniform(2 * k as u64 + 1).round(),
                false => (TAU * frequency_hz * t_s + phase).sin(),
            };
            let samples = view.measured.iter().zip(view.t_s.iter().enumerate().map(at));
            samples.map(|(measured, at)| measured + amplitude * at).collect()
        };
        views.iter().enumerate().map(humming).collect()
    }

    /// What shakes one sensor shakes others at the same frequency: the one at which all of them have most.
    fn settled(&self, views: &[View]) -> Option<f64> {
        let blocks: Vec<Block> = views.iter().flat_map(Block::all).collect();
        let power = |cycles: &f64| -> f64 { blocks.iter().map(|block| block.power(*cycles)).sum() };
        let most = |all: &mut dyn Iterator<Item = f64>| {
            let powers = all.map(|cycles| (power(&cycles), cycles));
            powers
                .max_by(|one, other| one.0.total_cmp(&other.0))
                .map(|(_, cycles)| cycles)
        };
        let mut sums = vec![0.0; BLOCK / 2 - FEWEST];
        for block in &blocks {
            (sums.iter_mut().zip(block.lines())).for_each(|(sum, line)| *sum += line);
        }
        let bin = (0..sums.len()).max_by(|one, other| sums[*one].total_cmp(&sums[*other]))? + FEWEST;
        let about = |step: usize| bin as f64 - 1.0 + step as f64 / FINE as f64;
        let cycles = most(&mut (0..=2 * FINE).map(about))?;
        Some(cycles / (BLOCK as f64 * step_s(views.first()?)))
    }

    fn told(&self, variant: f64) -> Option<String> {
        Some(match variant {
            WANDERS => "of a frequency that wanders".to_owned(),
            hz if hz > 0.0 => format!("at {hz:.3} Hz, as sampled"),
            _ => return None,
        })
    }

    /// Any frequency: the likelihood averages over them, unless the variant says which [Hz]. To inject, 0 is a drawn one.
    fn variants(&self, _starts_s: &[f64]) -> Vec<f64> {
        vec![0.0, WANDERS]
    }

    fn reach(&self, variant: f64) -> f64 {
        if variant == WANDERS { FAR } else { 1.0 }
    }
}

/// ln likelihood of a channel half of whose samples are off by a sine of amplitude `a` sigma and any phase.
fn wandering(a: f64, view: &View) -> f64 {
    if a < LEAST {
        return view.nominal();
    }
    let sigma = view.channel.sigma();
    let (off, all) = view.residuals().fold((0.0, 0.0), |(off, all), (_, residual)| {
        (off + f64::from(u8::from(residual.abs() > OFF * sigma)), all + 1.0)
    });
    if off < LONG * all {
        return view.nominal();
    }
    let sample = |(_, residual): (usize, f64)| {
        let shaken = of_any_phase(residual / sigma, a) + (view.resolution() / sigma).ln();
        mixed(0.5, view.normal(residual, sigma), shaken)
    };
    view.residuals().map(sample).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_density_of_a_sine_of_any_phase_is_one_and_rather_less() {
        for a in [5.0, 20.0, 60.0] {
            const STEP: f64 = 1e-3;
            let half = ((a + 8.0) / STEP) as usize;
            let whole: f64 = (0..half)
                .map(|k| 2.0 * STEP * of_any_phase(k as f64 * STEP, a).exp())
                .sum();
            assert!((0.85..1.0).contains(&whole), "{a}: {whole}");
        }
    }

    #[test]
    fn a_line_stands_above_its_neighbours_and_a_drift_does_not() {
        // Whatever is slow: a spectrum that falls with the square of the frequency.
        let drift: Vec<f64> = (0..BLOCK / 2)
            .map(|bin| 1.0 + 1e5 / (1.0 + bin as f64).powi(2))
            .collect();
        let mut line = drift.clone();
        line[100] += 500.0;
        let over = |powers: &[f64], bin: usize| {
            above_level(
                powers[bin],
                around(bin as f64).map(|bin| powers[bin as usize]).collect(),
            )
        };
        let most = |powers: &[f64]| (FEWEST..powers.len()).map(|bin| over(powers, bin)).fold(0.0, f64::max);
        assert!(most(&drift) < 4.0, "{}", most(&drift));
        assert!(most(&line) > 30.0, "{}", most(&line));
        // A level below that of white noise makes no line of white noise.
        assert!(most(&[1.0; BLOCK / 2]) <= 1.0);
    }
}
