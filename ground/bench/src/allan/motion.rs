//! Whether a record moves instead of standing still.
//!
//! In: a [`Series`]. Out: a [`Motion`] where its level swings smoothly, far beyond what its samples scatter, with the rows
//! between which it does. Noise of every kind that an Allan fit knows is rough: of the differences between the means of
//! neighbouring blocks, white noise turns every second one round (their correlation is -1/2), a random walk leaves them
//! hardly alike (+1/4: what is left of blocks that share a half), and flicker lies between. A movement that the blocks can
//! follow makes neighbours nearly equal, towards +1. So a record moves if at some length of block that correlation is beyond
//! [`SMOOTH`] and the range of the means beyond [`FAR`] times what white noise of its samples would leave.
//!
//! Blocks are [`SHORTEST_S`] at least, since the parts' own filters make shorter ones smooth. Not told apart from motion: a
//! warm-up. It is no noise either, and the ramp says so too.

use super::series::Series;

/// Correlation of neighbouring differences: halfway from a random walk (1/4) to a straight line (1), rounded down.
const SMOOTH: f64 = 0.6;

/// Range of the means over the sigma of one mean of white samples: 4096 means of white noise have 8.
const FAR: f64 = 12.0;

/// \[s\] the slowest filter of the parts (ADIS16265: 64 taps at 256 Hz): means over less of its output are alike without motion.
const SHORTEST_S: f64 = 0.25;

/// Blocks in a record: fewer leave their correlation open.
const LEAST_BLOCKS: usize = 16;

/// A record that moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    /// Samples from and to which the level was lowest and highest, in the order of time.
    pub rows: [usize; 2],
    /// The level there.
    pub levels: [f64; 2],
    /// The difference over the scatter of a sample.
    pub sigmas: f64,
}

/// The motion in a record, at the shortest block that shows it.
pub fn motion(series: &Series) -> Option<Motion> {
    let scatter = scatter(series)?;
    let mut block = ((SHORTEST_S / series.step_s).round() as usize).max(1);
    while series.values.len() / block >= LEAST_BLOCKS {
        if let Some(found) = at(series, block, scatter) {
            return Some(found);
        }
        block *= 2;
    }
    None
}

/// Standard deviation of white samples, from their second differences, in which a motion leaves little; `None` without any.
fn scatter(series: &Series) -> Option<f64> {
    let (mut sum, mut count) = (0.0, 0.0);
    for stretch in series.stretches() {
        for three in series.values[stretch].windows(3) {
            sum += (three[2] - 2.0 * three[1] + three[0]).powi(2);
            count += 6.0;
        }
    }
    (count > 0.0 && sum > 0.0).then(|| f64::sqrt(sum / count))
}

fn at(series: &Series, block: usize, scatter: f64) -> Option<Motion> {
    // Means of blocks that are whole, with the sample that each begins at.
    let mut means: Vec<(usize, f64)> = Vec::new();
    let (mut products, mut squares) = (0.0, 0.0);
    for stretch in series.stretches() {
        let from = means.len();
        let blocks = series.values[stretch.clone()].chunks_exact(block);
        means.extend(
            blocks
                .enumerate()
                .map(|(k, values)| (stretch.start + k * block, values.iter().sum::<f64>() / block as f64)),
        );
        let steps: Vec<f64> = means[from..].windows(2).map(|pair| pair[1].1 - pair[0].1).collect();
        products += steps.windows(2).map(|pair| pair[0] * pair[1]).sum::<f64>();
        squares += steps.iter().map(|step| step * step).sum::<f64>();
    }
    if means.len() < LEAST_BLOCKS || products <= SMOOTH * squares {
        return None;
    }
    let by_level = |a: &&(usize, f64), b: &&(usize, f64)| a.1.total_cmp(&b.1);
    let (low, high) = (means.iter().min_by(by_level)?, means.iter().max_by(by_level)?);
    if high.1 - low.1 <= FAR * scatter / (block as f64).sqrt() {
        return None;
    }
    let (first, last) = if low.0 < high.0 { (low, high) } else { (high, low) };
    Some(Motion {
        rows: [first.0, last.0],
        levels: [first.1, last.1],
        sigmas: (high.1 - low.1) / scatter,
    })
}

#[cfg(test)]
mod tests {
    use rand_distr::{Distribution, Normal};
    use rand_xoshiro::{Xoshiro256PlusPlus, rand_core::SeedableRng};

    use super::*;

    /// Two minutes or an hour at 5 Hz of noise, its walk and something else.
    fn record(count: usize, white: f64, walk: f64, also: impl Fn(f64) -> f64) -> Series {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(7);
        let normal = Normal::new(0.0, 1.0).expect("sigma");
        let mut level = 0.0;
        let value = |k: usize| {
            level += walk * normal.sample(&mut random);
            level + white * normal.sample(&mut random) + also(0.2 * k as f64)
        };
        Series::complete(0.2, (0..count).map(value).collect()).expect("series")
    }

    #[test]
    fn a_tumbling_flight_moves_and_says_where() {
        for (count, period_s) in [(300, 3.0), (600, 12.0), (600, 60.0), (18_000, 12.0)] {
            let series = record(count, 0.045, 0.0, |t_s| {
                10.0 * (std::f64::consts::TAU * t_s / period_s).sin()
            });
            let found = motion(&series).expect("motion");
            assert!(found.sigmas > 3.0 && found.rows[0] < found.rows[1], "{found:?}");
        }
    }

    #[test]
    fn noise_of_every_kind_stands_still() {
        for (white, walk) in [(1.0, 0.0), (1.0, 0.01), (1.0, 0.3), (1e-3, 1.0)] {
            for count in [600, 18_000] {
                assert_eq!(
                    motion(&record(count, white, walk, |_| 0.0)),
                    None,
                    "{white} {walk} {count}"
                );
            }
        }
    }

    #[test]
    fn a_movement_as_small_as_the_noise_is_left_to_the_fit() {
        assert_eq!(motion(&record(600, 1.0, 0.0, |t_s| 0.5 * (t_s / 2.0).sin())), None);
    }
}
