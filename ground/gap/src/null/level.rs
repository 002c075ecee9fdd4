//! How much a channel scatters at the time: noise that is louder in one stretch of a log than in another.
//!
//! In: what a model leaves of a channel, in units of noise, in the order of its samples. Out: for each sample the root mean square of
//! noise about it, in the same units.
//!
//! The errors of a real reference, and those of a sensor on an engine, change their size within a log by tens. Neighbours tell it: half the
//! mean square of the differences of neighbouring samples in a stretch of [`ALIKE`] (von Neumann 1941). A slow course hardly moves
//! between neighbours, so it is not taken for noise.

/// Samples over which noise is as loud: as few as tell a variance to a quarter, `sqrt(2 / 32)`. The excess kurtosis of Gaussian noise
/// in units of so short a level is lower by `6 / 34`.
const ALIKE: usize = 32;

/// Of each sample.
pub fn levels(rest: &[f64]) -> Vec<f64> {
    let stretches = rest.len().div_ceil(ALIKE).max(1);
    let long = rest.len().div_ceil(stretches).max(1);
    let of_stretch = |stretch: &[f64]| {
        let squares = stretch.windows(2).map(|pair| (pair[1] - pair[0]).powi(2));
        let count = stretch.len().saturating_sub(1).max(1) as f64;
        let level = (0.5 * squares.sum::<f64>() / count).sqrt();
        std::iter::repeat_n(level, stretch.len())
    };
    rest.chunks(long).flat_map(of_stretch).collect()
}

/// A residual in units of what it scatters at the time; zero where it does not move.
pub fn steadied(rest: &[f64]) -> Vec<f64> {
    let in_level = |(rest, level): (&f64, f64)| if level > 0.0 { rest / level } else { 0.0 };
    rest.iter().zip(levels(rest)).map(in_level).collect()
}

#[cfg(test)]
mod tests {
    use rand_distr::{Distribution, StandardNormal};
    use rand_xoshiro::{Xoshiro256PlusPlus, rand_core::SeedableRng};

    use super::*;

    #[test]
    fn noise_that_grows_tenfold_is_gaussian_in_units_of_its_level_and_a_drift_is_no_noise() {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(1);
        let mut noise = || -> f64 { StandardNormal.sample(&mut random) };
        let grown: Vec<f64> = (0..3200).map(|k| noise() * 10f64.powf(f64::from(k) / 3200.0)).collect();
        let steady = steadied(&grown);
        let squares: f64 = steady.iter().map(|value| value * value).sum::<f64>() / 3200.0;
        let fourths: f64 = steady.iter().map(|value| value.powi(4)).sum::<f64>() / 3200.0;
        assert!((fourths / (squares * squares) - 3.0).abs() < 0.4, "{squares} {fourths}");
        let drift: Vec<f64> = (0..3200).map(|k| f64::from(k) * 0.01 + noise()).collect();
        assert!(levels(&drift).iter().all(|level| (0.5..1.5).contains(level)));
    }

    #[test]
    fn a_residual_that_does_not_move_has_no_level() {
        assert_eq!(steadied(&[3.0; 40]), vec![0.0; 40]);
        assert_eq!(levels(&[]), Vec::<f64>::new());
        assert_eq!(levels(&[1.0]), vec![0.0]);
    }
}
