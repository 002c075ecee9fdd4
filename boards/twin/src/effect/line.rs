//! A line in the spectrum of what is left of some channels.
//!
//! In: their [`View`]s. Out: in blocks of time, by frequency, the power over the level of the frequencies around it (their
//! median), of mean 1 where there is no line, and what a line of some amplitude gains by it: in a bin with a line of amplitude
//! `a` sigma the power, exponential with mean 1 without it, has the mean v = 1 + n a^2/4 (Whittle).

use core::f64::consts::TAU;

use super::spread::View;
use crate::fourier::{self, Complex, Fft};

/// Samples of a block, of one line or the other: 100 s at 5 Hz, so that a line may wander by a hundredth of a hertz, or as
/// long as a flight, for one that does not: it pays for its phase once.
pub(super) const BLOCKS: [usize; 2] = [512, 2048];

/// Cycles of the shorter block below which a line is no line but a drift.
const FEWEST: usize = 10;

/// Bins of the shorter block on either side that tell the level about a bin, and the nearest of any: a line leaks into its
/// neighbours.
const AROUND: usize = 12;
const LEAKED: usize = 3;

/// Part of a block that must hold samples.
const FULL: f64 = 0.25;

/// Median over mean of an exponential variable.
const MEDIAN: f64 = core::f64::consts::LN_2;

/// The power of a line over the level of the powers around it, or over that of white noise if this is higher.
fn above_level(power: f64, mut around: Vec<f64>) -> f64 {
    let middle = around.len() / 2;
    let median = *around.select_nth_unstable_by(middle, f64::total_cmp).1;
    power / (median / MEDIAN).max(1.0)
}

/// Places in a block's spectrum that tell the level about so many cycles a block.
fn around(cycles: f64, length: usize) -> impl Iterator<Item = f64> {
    let offsets = (LEAKED..=AROUND * length / BLOCKS[0]).map(|offset| offset as f64);
    offsets
        .flat_map(move |offset| [cycles - offset, cycles + offset])
        .filter(move |cycles| (0.0..(length / 2) as f64).contains(cycles))
}

/// A stretch of the standardised residual, zero where there is none.
pub(super) struct Block {
    values: Vec<f64>,
    count: f64,
}

impl Block {
    /// All of a channel that have something in them, of this length.
    pub(super) fn all(view: &View, length: usize) -> Vec<Block> {
        let mut values = vec![0.0; view.measured.len().next_multiple_of(length)];
        let mut is_there = vec![false; values.len()];
        for (k, residual) in view.residuals() {
            values[k] = residual / view.channel.sigma();
            is_there[k] = true;
        }
        let count = |is_there: &[bool]| is_there.iter().filter(|is_there| **is_there).count() as f64;
        (values.chunks_exact(length).zip(is_there.chunks_exact(length)))
            .map(|(values, is_there)| Block {
                values: values.to_vec(),
                count: count(is_there),
            })
            .filter(|block| block.count >= FULL * BLOCKS[0] as f64)
            .collect()
    }

    /// Power at so many cycles a block, of mean 1 for white noise.
    pub(super) fn power(&self, cycles: f64) -> f64 {
        // A vector that turns on from sample to sample: sines cost ten times as much.
        let (turn_s, turn_c) = (TAU * cycles / self.values.len() as f64).sin_cos();
        let (mut s, mut c, mut sin, mut cos) = (0.0, 1.0, 0.0, 0.0);
        for z in &self.values {
            (sin, cos) = (sin + z * s, cos + z * c);
            (s, c) = (s * turn_c + c * turn_s, c * turn_c - s * turn_s);
        }
        (sin * sin + cos * cos) / self.count
    }

    /// The same, over the level about it.
    pub(super) fn line(&self, cycles: f64) -> f64 {
        let around = around(cycles, self.values.len());
        above_level(self.power(cycles), around.map(|cycles| self.power(cycles)).collect())
    }

    /// The same in each bin from that of [`FEWEST`] on.
    fn lines(&self, transform: &dyn Fft<f64>) -> Vec<f64> {
        let length = self.values.len();
        let mut bins: Vec<Complex<f64>> = self.values.iter().map(|value| Complex::from(*value)).collect();
        transform.process(&mut bins);
        let powers: Vec<f64> = bins[..length / 2]
            .iter()
            .map(|bin| bin.norm_sqr() / self.count)
            .collect();
        let line = |bin: usize| {
            let around = around(bin as f64, length).map(|bin| powers[bin as usize]);
            above_level(powers[bin], around.collect())
        };
        (first_bin(length)..length / 2).map(line).collect()
    }

    /// \[nats\] that a line of amplitude `a` sigma gains whose power is `line`.
    pub(super) fn gain(&self, a: f64, line: f64) -> f64 {
        let v = 1.0 + self.count * a * a / 4.0;
        line * (1.0 - 1.0 / v) - v.ln()
    }
}

/// The first bin of a block of this length that is looked at.
pub(super) fn first_bin(length: usize) -> usize {
    FEWEST * length / BLOCKS[0]
}

/// Of every block of this length of all of these, how many samples it has and its line in each bin that is looked at.
pub(super) fn spectra(views: &[View], length: usize) -> Vec<(Block, Vec<f64>)> {
    let transform = fourier::forward(length);
    let blocks = views.iter().flat_map(|view| Block::all(view, length));
    blocks
        .map(|block| {
            let lines = block.lines(transform.as_ref());
            (block, lines)
        })
        .collect()
}

/// In each bin, the sum over blocks of what their lines are worth.
pub(super) fn summed(spectra: &[(Block, Vec<f64>)], worth: impl Fn(&Block, f64) -> f64) -> Vec<f64> {
    let mut sums = vec![0.0; spectra.first().map_or(0, |(_, lines)| lines.len())];
    for (block, lines) in spectra {
        (sums.iter_mut().zip(lines)).for_each(|(sum, line)| *sum += worth(block, *line));
    }
    sums
}

/// ln of the mean of what these are logarithms of; of nothing, that nothing is said.
pub(super) fn mean_of(logarithms: &[f64]) -> f64 {
    if logarithms.is_empty() {
        return 0.0;
    }
    let most = logarithms.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let sum: f64 = logarithms.iter().map(|own| (own - most).exp()).sum();
    most + (sum / logarithms.len() as f64).ln()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::part::signal::Noise;

    #[test]
    fn a_line_stands_above_its_neighbours_and_a_drift_does_not() {
        const LENGTH: usize = BLOCKS[0];
        // Whatever is slow: a spectrum that falls with the square of the frequency.
        let drift: Vec<f64> = (0..LENGTH / 2)
            .map(|bin| 1.0 + 1e5 / (1.0 + bin as f64).powi(2))
            .collect();
        let mut line = drift.clone();
        line[100] += 500.0;
        let over = |powers: &[f64], bin: usize| {
            above_level(
                powers[bin],
                around(bin as f64, LENGTH).map(|bin| powers[bin as usize]).collect(),
            )
        };
        let most = |powers: &[f64]| (FEWEST..powers.len()).map(|bin| over(powers, bin)).fold(0.0, f64::max);
        assert!(most(&drift) < 4.0, "{}", most(&drift));
        assert!(most(&line) > 30.0, "{}", most(&line));
        // A level below that of white noise makes no line of white noise.
        assert!(most(&[1.0; LENGTH / 2]) <= 1.0);
    }

    #[test]
    fn a_line_too_weak_for_each_of_several_channels_shows_in_all_of_them() {
        let channel = crate::predict::emems(|_| 0.0).channels[0].clone();
        let t_s: Vec<f64> = (0..1500).map(|k| 0.2 * f64::from(k)).collect();
        let predicted = vec![0.0; t_s.len()];
        let shaken = |number: u64, a: f64| -> Vec<f64> {
            let stream = Noise::new(7).stream(number);
            let sample = |(k, t_s): (usize, &f64)| {
                channel.sigma() * (stream.normal(k as u64) + a * (4.2 * t_s + number as f64).sin())
            };
            t_s.iter().enumerate().map(sample).collect()
        };
        let gain = |measured: &[Vec<f64>], length: usize| {
            let view = |measured| View {
                channel: &channel,
                t_s: &t_s,
                predicted: &predicted,
                measured,
                step: 0.0,
            };
            let views: Vec<View> = measured.iter().map(|own| view(own)).collect();
            mean_of(&summed(&spectra(&views, length), |block, line| block.gain(0.12, line)))
        };
        let all = |a: f64| -> Vec<Vec<f64>> { (0..12).map(|number| shaken(number, a)).collect() };
        let (quiet, shaken) = (all(0.0), all(0.12));
        for own in &shaken {
            assert!(gain(std::slice::from_ref(own), BLOCKS[1]) < 7.0);
        }
        assert!(gain(&shaken, BLOCKS[1]) > 15.0, "{}", gain(&shaken, BLOCKS[1]));
        // A line that stays pays for its phase once.
        assert!(gain(&shaken, BLOCKS[1]) > gain(&shaken, BLOCKS[0]) + 5.0);
        for length in BLOCKS {
            assert!(gain(&quiet, length) < 0.0, "{}", gain(&quiet, length));
        }
    }
}
