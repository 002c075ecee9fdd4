//! Samples averaged over short stretches of time: what is slow loses nothing by it, and the state-space pass has few of them.
//!
//! In: one channel's fitted samples and the standard deviation of each. Out: for any series at the samples its weighted mean in each
//! stretch that has one. White noise of a stretch then has the variance `1 / sum(1 / sigma^2)`, times a [`Binned::factor`] that the
//! differences of neighbouring stretches tell (von Neumann 1941): noise is often louder, quieter or coloured, and a slow course hardly
//! moves between neighbours.

use crate::null::problem::Problem;

/// Stretches of a log.
pub const BINS: usize = 600;

/// Noise is not taken for quieter than this part of its variance.
const QUIETEST: f64 = 0.25;

/// One channel's stretches.
pub struct Binned {
    /// Which stretch of the log each is.
    pub bins: Vec<usize>,
    /// Variance of the white noise of each.
    pub variances: Vec<f64>,
    /// Of each sample, its stretch among [`Binned::bins`] and its weight there.
    places: Vec<(usize, f64)>,
}

impl Binned {
    /// Of a channel along the whole log.
    pub fn along(problem: &Problem, channel: usize, louder: f64) -> Self {
        let starts_s = problem.twin.starts_s();
        let span_s = [starts_s.first(), starts_s.last()].map(|end| end.copied().unwrap_or(0.0));
        Binned::of(problem, channel, span_s, louder)
    }

    /// Of a channel; a sample of the log from `span_s` falls into its stretch, `louder` times its noise.
    pub fn of(problem: &Problem, channel: usize, span_s: [f64; 2], louder: f64) -> Self {
        let rows = &problem.frames[channel].series.rows;
        let own = problem.twin.unit().channels[channel].sigma();
        let long_s = (span_s[1] - span_s[0]).max(f64::MIN_POSITIVE);
        let (mut bins, mut sums): (Vec<usize>, Vec<f64>) = (Vec::new(), Vec::new());
        let mut places = Vec::with_capacity(rows.len());
        for row in rows {
            let phase = (problem.twin.starts_s()[*row as usize] - span_s[0]) / long_s;
            let bin = ((phase * BINS as f64) as usize).min(BINS - 1);
            if bins.last() != Some(&bin) {
                bins.push(bin);
                sums.push(0.0);
            }
            let weight = (problem.own_part(channel, *row as usize) / own / louder).powi(2);
            let at = bins.len() - 1;
            sums[at] += weight;
            places.push((at, weight));
        }
        places.iter_mut().for_each(|(at, weight)| *weight /= sums[*at]);
        Binned {
            bins,
            variances: sums.iter().map(|sum| sum.recip()).collect(),
            places,
        }
    }

    /// Means of a series at the samples.
    pub fn means(&self, series: impl Fn(usize) -> f64) -> Vec<f64> {
        let mut means = vec![0.0; self.bins.len()];
        for (sample, (at, weight)) in self.places.iter().enumerate() {
            means[*at] += weight * series(sample);
        }
        means
    }

    /// Energy that a series at the samples has in its mean over each stretch, every sample counting alike.
    pub fn energy(&self, series: &[f64]) -> f64 {
        let mut sums = vec![(0.0, 0.0); self.bins.len()];
        for ((at, _), value) in self.places.iter().zip(series) {
            sums[*at] = (sums[*at].0 + value, sums[*at].1 + 1.0);
        }
        sums.iter().map(|(sum, count)| sum * sum / count).sum()
    }

    /// By how much more than described the means of a residual vary from one stretch to the next.
    pub fn factor(&self, residual: &[f64]) -> f64 {
        let pairs = residual.windows(2).zip(self.variances.windows(2));
        let squares = pairs.map(|(values, variances)| (values[1] - values[0]).powi(2) / (variances[0] + variances[1]));
        let (sum, count) = squares
            .filter(|square| square.is_finite())
            .fold((0.0, 0.0), |(sum, count), own| (sum + own, count + 1.0));
        if count > 0.0 {
            f64::max(sum / count, QUIETEST)
        } else {
            1.0
        }
    }
}
