//! Sums of residuals that are squares or as good as such: of one channel, and of bursts in several.
//!
//! In: residuals in units of noise. Out: numbers that noise alone keeps small, for [`super::aspects`].

use super::view::{LEVELS, place};

/// Lags of the whiteness tests.
const LAGS: usize = 10;

/// [units of noise] to which samples are cut before their squares are compared: one blow is no noise that comes and goes.
const CUT: f64 = 3.0;

/// [units of noise] to which samples are cut before fourth powers are summed: one sample that is farther out has its say in
/// the energy; here it would only make the simulated logs' own few hide everyone else's.
const FAR: f64 = 5.0;

/// Places of what is far out.
pub fn outliers(values: &[f64]) -> impl Iterator<Item = usize> + Clone {
    (0..values.len()).filter(|at| values[*at].abs() > FAR)
}

/// Fourth powers, which tell heavy tails.
pub fn tails(values: &[f64]) -> f64 {
    values.iter().map(|value| value.clamp(-FAR, FAR).powi(4)).sum()
}

/// Mean logarithm of sizes; zero where there are none.
pub fn mean_logarithm(sizes: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = sizes.fold((0.0, 0.0), |(sum, count), size| (sum + size.ln(), count + 1.0));
    if count > 0.0 { sum / count } else { 0.0 }
}

/// Squares of the covariances of neighbours, in units of the energy.
pub fn alike(values: &[f64]) -> f64 {
    let energy: f64 = values.iter().map(|value| value * value).sum();
    // All lags in one pass: a sum by itself waits for every one of its additions.
    let mut covariances = [0.0; LAGS];
    let mut add = |value: f64, after: &[f64]| {
        (covariances.iter_mut().zip(after)).for_each(|(sum, other)| *sum += value * other);
    };
    for own in values.windows(LAGS + 1) {
        add(own[0], &own[1..=LAGS]);
    }
    for at in values.len().saturating_sub(LAGS)..values.len() {
        add(values[at], &values[at + 1..]);
    }
    let squares = covariances.iter().map(|sum: &f64| sum.powi(2));
    squares.sum::<f64>() / energy.max(1.0)
}

/// Squares about their mean.
pub fn squares(values: &[f64]) -> Vec<f64> {
    let square = |value: &f64| value.clamp(-CUT, CUT).powi(2);
    let mean = values.iter().map(square).sum::<f64>() / values.len().max(1) as f64;
    values.iter().map(|value| square(value) - mean).collect()
}

/// Squares of several channels in stretches of time: noise that comes and goes does so in all of a kind at once, and in each
/// of them it may be weak.
pub struct Bursts {
    /// Of each half of a stretch the sum, and of how many.
    halves: Vec<(f64, f64)>,
}

impl Bursts {
    /// None yet, in so many stretches.
    pub fn new(stretches: usize) -> Self {
        Bursts {
            halves: vec![(0.0, 0.0); 2 * stretches],
        }
    }

    /// Adds a channel: squares about their mean, and the place of each sample in time, 0 to 1. Over their spread, or louder
    /// noise would come and go more.
    pub fn add(&mut self, phases: &[f64], squares: &[f64]) {
        let of = self.halves.len();
        let energy: f64 = squares.iter().map(|square| square * square).sum();
        let spread = (energy / squares.len().max(1) as f64).sqrt().max(f64::MIN_POSITIVE);
        for (phase, square) in phases.iter().zip(squares) {
            let (sum, count) = &mut self.halves[place(*phase, of)];
            (*sum, *count) = (*sum + square / spread, *count + 1.0);
        }
    }

    /// The energy of their means. Stretches overlap by half, or a burst across the edge of two would be half as loud in each.
    pub fn sum(&self) -> f64 {
        let energy = |pair: &[(f64, f64)]| (pair[0].0 + pair[1].0).powi(2) / f64::max(pair[0].1 + pair[1].1, 1.0);
        self.halves.windows(2).map(energy).sum()
    }
}

/// Energy of the means of the levels.
pub fn between_levels(levels: &[u8], values: &[f64]) -> f64 {
    let mut sums = [(0.0, 0.0); LEVELS];
    for (level, value) in levels.iter().zip(values) {
        let (sum, count) = &mut sums[usize::from(*level).min(LEVELS - 1)];
        (*sum, *count) = (*sum + value, *count + 1.0);
    }
    sums.iter().map(|(sum, count)| sum * sum / f64::max(*count, 1.0)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_burst_across_the_edge_of_two_stretches_is_as_loud_as_within_one() {
        const SAMPLES: usize = 1000;
        let phases: Vec<f64> = (0..SAMPLES).map(|row| row as f64 / SAMPLES as f64).collect();
        let loud = |from: usize| {
            let square = |row: usize| f64::from(u8::from((from..from + 100).contains(&row))) - 0.1;
            let mut bursts = Bursts::new(10);
            bursts.add(&phases, &(0..SAMPLES).map(square).collect::<Vec<_>>());
            bursts.sum()
        };
        let (within, across) = (loud(300), loud(350));
        assert!((across / within - 1.0).abs() < 0.01, "{across} {within}");
    }
}
