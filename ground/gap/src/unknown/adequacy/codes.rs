//! Whether the bits of a channel's codes are set as often as noise about its prediction would set them.
//!
//! In: the codes of a channel, and what its sensor reads by itself at each sample. Out, of a log and of simulated ones, how
//! often each bit is set, and one sum of squares for all bits: a bit that sticks, or steps that are coarser than they should
//! be, leave codes out, whatever the size of what that adds.

use nalgebra::DVector;

/// Bits looked at, from the lowest: what sticks higher up is seen by its size.
const BITS: usize = 8;

/// How often each is set.
pub type Counts = [f64; BITS];

/// [square root of the samples] by which a count is known at best: by half of that it scatters where the bit is a toss.
const LEAST: f64 = 0.25;

/// What is looked at of a channel that sends codes.
#[derive(Clone, Debug)]
pub struct Codes {
    /// [physical unit] of a code.
    pub lsb: f64,
    /// As they were logged.
    pub logged: Vec<i64>,
    /// [physical unit] read at each sample by a sensor without noise.
    pub read: Vec<f64>,
    /// [physical unit] of noise at each sample.
    pub noise: Vec<f64>,
}

impl Codes {
    /// Of the log.
    pub fn counts(&self) -> Counts {
        counts(self.logged.iter().copied())
    }

    /// Of a log with these residuals, in units of noise.
    pub fn counts_with(&self, residuals: &DVector<f64>) -> Counts {
        let samples = self.read.iter().zip(&self.noise).zip(residuals.iter());
        counts(samples.map(|((read, noise), residual)| ((read + residual * noise) / self.lsb).round() as i64))
    }
}

fn counts(codes: impl Iterator<Item = i64>) -> Counts {
    let mut counts = [0u32; BITS];
    for code in codes {
        for (bit, count) in counts.iter_mut().enumerate() {
            *count += (code >> bit & 1) as u32;
        }
    }
    counts.map(f64::from)
}

/// How far counts are from those of simulated logs, as a sum of squares: of each simulated one, and of the log's.
pub fn rarities(simulated: &[Counts], logged: Counts, samples: usize) -> (Vec<f64>, f64) {
    let runs = simulated.len().max(1) as f64;
    let least = (LEAST * LEAST * samples as f64).max(f64::MIN_POSITIVE);
    let moments: Vec<(f64, f64)> = (0..BITS)
        .map(|bit| {
            let mean = simulated.iter().map(|counts| counts[bit]).sum::<f64>() / runs;
            let square = simulated.iter().map(|counts| (counts[bit] - mean).powi(2)).sum::<f64>();
            (mean, (square / runs).max(least))
        })
        .collect();
    let rarity = |counts: &Counts| -> f64 {
        let bits = counts.iter().zip(&moments);
        bits.map(|(count, (mean, variance))| (count - mean).powi(2) / variance)
            .sum()
    };
    (simulated.iter().map(rarity).collect(), rarity(&logged))
}
