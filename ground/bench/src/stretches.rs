//! Where a raw log stands still.
//!
//! In: samples of several channels, evenly in time. Out: the stretches in which nothing but noise moves, each with the
//! mean, scatter and count of every channel.
//!
//! A window is still if in every channel its scatter about a line, and what the line rises over the window, are within
//! [`QUIET`] and [`LEVEL`] of the channel's noise, and the noise is learned from the log: the lower quartile of all windows'
//! scatter. So half a log may be movement. Stretches are trimmed by half a window at each end, where the movement begins
//! or rings out. Samples that were not read (`NaN`) are passed over; a window needs half of its samples.

/// Scatter allowed in a still window, in noises. The lower quartile over windows of ten is 0.8 of the true noise, so this
/// is 2.4 of it, which chance passes once in a million windows.
const QUIET: f64 = 3.0;

/// Rise allowed over a still window, in noises: chance alone lifts windows of ten by 1.1 true noises, this is 4.4 of that.
const LEVEL: f64 = 6.0;

/// Shortest window \[samples\].
const SHORTEST_WINDOW: usize = 5;

/// A stretch at rest.
#[derive(Clone, Debug, PartialEq)]
pub struct Stretch {
    /// First sample.
    pub from: usize,
    /// One past the last.
    pub to: usize,
    /// Mean of every channel.
    pub mean: Vec<f64>,
    /// Standard deviation of every channel's samples.
    pub sigma: Vec<f64>,
    /// Samples read of every channel.
    pub count: Vec<usize>,
}

/// Finds the stretches of at least `shortest` samples; `samples[k]` holds all channels at instant `k`.
pub fn still(samples: &[Vec<f64>], shortest: usize) -> Vec<Stretch> {
    let window = (shortest / 2).max(SHORTEST_WINDOW);
    let channels = samples.first().map_or(0, Vec::len);
    if samples.len() < window || channels == 0 {
        return Vec::new();
    }
    let judged: Vec<Vec<Option<(f64, f64)>>> = samples
        .windows(window)
        .map(|part| (0..channels).map(|k| line(part, k)).collect())
        .collect();
    let noise: Vec<f64> = (0..channels)
        .map(|k| {
            let mut scatter: Vec<f64> = judged
                .iter()
                .filter_map(|window| window[k])
                .map(|(scatter, _)| scatter)
                .collect();
            scatter.sort_by(f64::total_cmp);
            // A count of a coarse converter may never change; then its rounding is the noise.
            scatter
                .get(scatter.len() / 4)
                .copied()
                .unwrap_or(0.0)
                .max(f64::MIN_POSITIVE)
        })
        .collect();
    let quiet = |window: &[Option<(f64, f64)>]| {
        let within = |(line, noise): (&Option<(f64, f64)>, &f64)| match line {
            Some((scatter, rise)) => *scatter <= QUIET * noise.max(0.3) && rise.abs() <= LEVEL * noise.max(0.3),
            None => false,
        };
        window.iter().zip(&noise).all(within)
    };
    let mut stretches = Vec::new();
    let mut begun: Option<usize> = None;
    for start in 0..=judged.len() {
        let is_quiet = judged.get(start).is_some_and(|window| quiet(window));
        match (begun, is_quiet) {
            (None, true) => begun = Some(start),
            (Some(from), false) => {
                let (from, to) = (from + window / 2, start - 1 + window - window / 2);
                if to >= from + shortest.saturating_sub(window).max(SHORTEST_WINDOW) {
                    stretches.push(measure(samples, from, to, channels));
                }
                begun = None;
            }
            _ => {}
        }
    }
    stretches
}

/// Scatter about the best line and its rise over the window; `None` with less than half the samples.
fn line(part: &[Vec<f64>], channel: usize) -> Option<(f64, f64)> {
    let points = part.iter().enumerate().map(|(k, sample)| (k as f64, sample[channel]));
    let points: Vec<(f64, f64)> = points.filter(|(_, value)| value.is_finite()).collect();
    let n = points.len() as f64;
    if 2 * points.len() < part.len() || points.len() < 4 {
        return None;
    }
    let (x, y) = points.iter().fold((0.0, 0.0), |(a, b), (x, y)| (a + x / n, b + y / n));
    let (xx, xy, yy) = points.iter().fold((0.0, 0.0, 0.0), |(a, b, c), (u, v)| {
        (a + (u - x) * (u - x), b + (u - x) * (v - y), c + (v - y) * (v - y))
    });
    let slope = xy / xx;
    Some((
        ((yy - slope * xy).max(0.0) / (n - 2.0)).sqrt(),
        slope * part.len() as f64,
    ))
}

fn measure(samples: &[Vec<f64>], from: usize, to: usize, channels: usize) -> Stretch {
    let mut stretch = Stretch {
        from,
        to,
        mean: Vec::new(),
        sigma: Vec::new(),
        count: Vec::new(),
    };
    for k in 0..channels {
        let values: Vec<f64> = samples[from..to]
            .iter()
            .map(|sample| sample[k])
            .filter(|value| value.is_finite())
            .collect();
        let n = values.len() as f64;
        let mean = values.iter().sum::<f64>() / n;
        let squares = values.iter().map(|value| (value - mean).powi(2)).sum::<f64>();
        stretch.mean.push(mean);
        stretch.sigma.push((squares / (n - 1.0).max(1.0)).sqrt());
        stretch.count.push(values.len());
    }
    stretch
}

#[cfg(test)]
mod tests {
    use rand_distr::{Distribution, Normal};
    use rand_xoshiro::{Xoshiro256PlusPlus, rand_core::SeedableRng};

    use super::*;

    /// Holds of 100 samples at `levels`, joined by ramps of 20.
    fn log(levels: &[[f64; 2]], seed: u64) -> Vec<Vec<f64>> {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
        let normal = Normal::new(0.0, 1.5).expect("sigma");
        let mut samples = Vec::new();
        for pair in levels.windows(2) {
            for k in 0..120 {
                let share = (f64::from(k) - 100.0).max(0.0) / 20.0;
                let value = |axis: usize| pair[0][axis] + share * (pair[1][axis] - pair[0][axis]);
                samples.push(
                    (0..2)
                        .map(|axis| (value(axis) + normal.sample(&mut random)).round())
                        .collect(),
                );
            }
        }
        samples
    }

    #[test]
    fn every_hold_is_found_and_no_movement_is_in_it() {
        let levels: Vec<[f64; 2]> = (0..31)
            .map(|k| [f64::from(k * 37 % 300), f64::from(k * 91 % 250)])
            .collect();
        for seed in 0..20 {
            let found = still(&log(&levels, seed), 50);
            assert_eq!(found.len(), 30, "seed {seed}");
            for (k, stretch) in found.iter().enumerate() {
                assert!(
                    stretch.from >= 120 * k && stretch.to <= 120 * k + 106,
                    "{k}: {}..{}",
                    stretch.from,
                    stretch.to
                );
                for (mean, level) in stretch.mean.iter().zip(levels[k]) {
                    // Mean of 80 samples of 1.5 counts: sigma 0.17.
                    assert!((mean - level).abs() < 0.9, "{k}");
                }
            }
        }
    }

    #[test]
    fn a_hold_in_which_one_channel_moves_is_none() {
        let mut samples = log(&[[0.0, 0.0], [90.0, 0.0], [0.0, 90.0]], 3);
        for (k, sample) in samples.iter_mut().enumerate().take(110) {
            sample[1] += 0.5 * k as f64;
        }
        let found = still(&samples, 50);
        assert_eq!(found.len(), 1);
        assert!(found[0].from >= 120);
    }

    #[test]
    fn samples_that_were_not_read_are_passed_over() {
        let mut samples = log(&[[5.0, 7.0], [90.0, 0.0]], 4);
        for sample in samples.iter_mut().skip(3).step_by(4) {
            sample[0] = f64::NAN;
        }
        let found = still(&samples, 50);
        assert_eq!(found.len(), 1);
        assert!(found[0].count[0] < found[0].count[1] && found[0].mean[0].is_finite());
        assert_eq!(still(&[], 50), []);
        assert_eq!(still(&vec![vec![f64::NAN]; 200], 50), []);
    }
}
