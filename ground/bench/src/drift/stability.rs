//! How a gyro's drift wanders: white noise, random walk and ramp, by maximum likelihood.
//!
//! In: the output at rest on a uniform grid, `y_k = b + R t_k + w_k + n_k`, `n` white of deviation `sigma_w`, `w` a walk
//! of steps of deviation `sigma_u` (eq. 8 of the dry-tuned gyro paper, whose `s_w` is `sigma_w` and whose `s_r`, per
//! second and held over a sample, is `sigma_u / step`). Out: [`Stability`], each with a 95 % interval.
//!
//! The differences of `y` are a moving average of order one about `R step`, whose exact Gaussian likelihood the
//! innovations recursion gives in O(N) (Brockwell and Davis, *Time Series: Theory and Methods*, section 5.2). Ramp and
//! level are solved for on the way, so that the search is over the ratio of the two deviations alone. Intervals are
//! from the curvature of the likelihood in the logarithms, and for the ramp from its generalised least squares.
//!
//! A walk whose likelihood is not [`DISTINCT`] above that of no walk is refused and bounded from above. A record
//! shorter than [`FEWEST_SAMPLES`] samples, or constant, is refused.

use nalgebra::Matrix2;

/// Fewest samples: the curvature of shorter records does not give intervals.
pub const FEWEST_SAMPLES: usize = 100;
/// Twice the log-likelihood by which a walk must beat none: one-sided 99 % of its distribution at the boundary.
const DISTINCT: f64 = 5.41;
/// Twice the log-likelihood given up at a one-sided 95 % bound.
const BOUND: f64 = 2.71;
/// Half-width of a 95 % interval in standard deviations.
const TWO_SIDED: f64 = 1.96;
/// Range of `ln(sigma_u / sigma_w)` searched: steps of a ten-thousandth to a thousand of the white noise.
const RATIOS: (f64, f64) = (-9.2, 6.9);

/// A value and its 95 % interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    /// Most likely value.
    pub value: f64,
    /// Low bound.
    pub low: f64,
    /// High bound.
    pub high: f64,
}

/// Drift stability, in the record's unit (rate) and seconds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stability {
    /// Deviation of the white noise of one sample \[rate\].
    pub white: Interval,
    /// Deviation of a step of the walk over a sampling interval \[rate\]; its `high` alone means something if it was not seen.
    pub walk_step: Interval,
    /// Whether the walk was seen.
    pub is_walk_seen: bool,
    /// Ramp [rate/s]; zero may lie within.
    pub ramp: Interval,
    /// Sampling interval \[s\].
    pub step_s: f64,
}

impl Stability {
    /// Angle random walk `N = sigma_w sqrt(step)` [rate sqrt(s)].
    pub fn angle_walk(&self) -> f64 {
        self.white.value * self.step_s.sqrt()
    }

    /// Rate random walk `K = sigma_u / sqrt(step)` [rate/sqrt(s)].
    pub fn rate_walk(&self) -> f64 {
        self.walk_step.value / self.step_s.sqrt()
    }

    /// The paper's `s_r = sigma_u / step` [rate/s], of a sequence held over the sampling interval.
    pub fn held_walk(&self) -> f64 {
        self.walk_step.value / self.step_s
    }
}

/// Why a record has no drift stability.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum StabilityError {
    /// Too short.
    #[error("{0} samples; drift stability needs at least {FEWEST_SAMPLES}, and hours of them to see a walk")]
    TooShort(usize),
    /// No noise at all.
    #[error("the record is constant: its resolution hides the drift")]
    Constant,
}

/// Most likely white noise, walk and ramp of a record sampled every `step_s`.
pub fn stability(record: &[f64], step_s: f64) -> Result<Stability, StabilityError> {
    if record.len() < FEWEST_SAMPLES {
        return Err(StabilityError::TooShort(record.len()));
    }
    let steps: Vec<f64> = record.windows(2).map(|pair| pair[1] - pair[0]).collect();
    if steps.iter().all(|step| *step == 0.0) {
        return Err(StabilityError::Constant);
    }
    let at = |ratio: f64| Likelihood::of(&steps, ratio.exp());
    let ratio = maximum(|ratio| at(ratio).log, RATIOS);
    let best = at(ratio);
    let still = at(RATIOS.0);
    let is_walk_seen = 2.0 * (best.log - still.log) > DISTINCT;
    let (sigma_w, sigma_u) = (best.white, best.white * ratio.exp());
    let (white, walk_step) = if is_walk_seen {
        let sigmas = log_sigmas(&steps, sigma_w.ln(), sigma_u.ln());
        (around(sigma_w, sigmas.0), around(sigma_u, sigmas.1))
    } else {
        let highest = still_likely(&at, ratio, best.log - 0.5 * BOUND);
        let walk = Interval {
            value: 0.0,
            low: 0.0,
            high: at(highest).white * highest.exp(),
        };
        (around(still.white, (0.5 / steps.len() as f64).sqrt()), walk)
    };
    let chosen = if is_walk_seen { &best } else { &still };
    let (value, sigma) = (chosen.mean / step_s, chosen.white * chosen.mean_sigma / step_s);
    let ramp = Interval {
        value,
        low: value - TWO_SIDED * sigma,
        high: value + TWO_SIDED * sigma,
    };
    Ok(Stability {
        white,
        walk_step,
        is_walk_seen,
        ramp,
        step_s,
    })
}

fn around(value: f64, log_sigma: f64) -> Interval {
    let factor = (TWO_SIDED * log_sigma).exp();
    Interval {
        value,
        low: value / factor,
        high: value * factor,
    }
}

/// The likelihood at one ratio of the deviations, the rest solved for.
struct Likelihood {
    log: f64,
    /// Deviation of the white noise.
    white: f64,
    /// Mean step.
    mean: f64,
    /// Its deviation in units of the white noise's.
    mean_sigma: f64,
}

/// Sums of the innovations recursion for steps with unit white noise.
struct Innovations {
    log_determinant: f64,
    squares: f64,
    mean: f64,
    weight: f64,
}

impl Innovations {
    fn of(steps: &[f64], ratio: f64) -> Self {
        let power = ratio * ratio + 2.0;
        let (mut variance, mut step_error, mut one_error) = (power, 0.0, 0.0);
        let (mut log_determinant, mut cross, mut weight, mut squares) = (0.0, 0.0, 0.0, 0.0);
        for (k, step) in steps.iter().enumerate() {
            // The covariance with the step before is minus the white noise's variance.
            let gain = if k == 0 { 0.0 } else { -1.0 / variance };
            if k > 0 {
                variance = power - 1.0 / variance;
            }
            step_error = step - gain * step_error;
            one_error = 1.0 - gain * one_error;
            log_determinant += variance.ln();
            cross += step_error * one_error / variance;
            weight += one_error * one_error / variance;
            squares += step_error * step_error / variance;
        }
        let mean = cross / weight;
        Self {
            log_determinant,
            squares: (squares - mean * cross).max(0.0),
            mean,
            weight,
        }
    }
}

impl Likelihood {
    fn of(steps: &[f64], ratio: f64) -> Self {
        let sums = Innovations::of(steps, ratio);
        // One degree of freedom went into the mean.
        let count = steps.len() as f64 - 1.0;
        let variance = sums.squares / count;
        Self {
            log: -0.5 * (count * variance.ln() + sums.log_determinant + sums.weight.ln()),
            white: variance.sqrt(),
            mean: sums.mean,
            mean_sigma: sums.weight.sqrt().recip(),
        }
    }
}

/// Deviations of the logarithms of both deviations, from the curvature of the likelihood.
fn log_sigmas(steps: &[f64], log_w: f64, log_u: f64) -> (f64, f64) {
    /// Wide enough for rounding, narrow against the width of any likelihood of [`FEWEST_SAMPLES`] samples.
    const STEP: f64 = 1e-3;
    let log = |a: f64, b: f64| {
        let (log_w, log_u) = (log_w + a * STEP, log_u + b * STEP);
        let sums = Innovations::of(steps, (log_u - log_w).exp());
        let count = steps.len() as f64 - 1.0;
        -0.5 * (2.0 * count * log_w + sums.squares / (2.0 * log_w).exp() + sums.log_determinant + sums.weight.ln())
    };
    let centre = log(0.0, 0.0);
    let second = |a: f64, b: f64| (2.0 * centre - log(a, b) - log(-a, -b)) / (STEP * STEP);
    let (ww, uu) = (second(1.0, 0.0), second(0.0, 1.0));
    let wu = 0.5 * (second(1.0, 1.0) - ww - uu);
    let inverse = Matrix2::new(ww, wu, wu, uu).try_inverse().unwrap_or_default();
    (inverse[(0, 0)].max(0.0).sqrt(), inverse[(1, 1)].max(0.0).sqrt())
}

/// Where a function of one hump is largest: a coarse scan, so that a flat side cannot mislead, then golden section.
fn maximum(f: impl Fn(f64) -> f64, (from, to): (f64, f64)) -> f64 {
    const SCAN: usize = 24;
    let width = (to - from) / SCAN as f64;
    let at = |k: usize| from + width * k as f64;
    let best = (0..=SCAN).max_by(|a, b| f(at(*a)).total_cmp(&f(at(*b)))).unwrap_or(0);
    let (mut low, mut high) = ((at(best) - width).max(from), (at(best) + width).min(to));
    let golden = 0.5 * (5.0_f64.sqrt() - 1.0);
    while high - low > 1e-5 {
        let (a, b) = (high - golden * (high - low), low + golden * (high - low));
        if f(a) > f(b) { high = b } else { low = a }
    }
    0.5 * (low + high)
}

/// The largest ratio whose likelihood is still `least`, by bisection above the maximum.
fn still_likely(at: &impl Fn(f64) -> Likelihood, maximum: f64, least: f64) -> f64 {
    let (mut low, mut high) = (maximum, RATIOS.1);
    while high - low > 1e-3 {
        let middle = 0.5 * (low + high);
        if at(middle).log > least {
            low = middle
        } else {
            high = middle
        }
    }
    high
}

#[cfg(test)]
mod tests {
    use rand_distr::{Distribution, StandardNormal};
    use rand_xoshiro::{Xoshiro256PlusPlus, rand_core::SeedableRng};
    use rayon::prelude::*;

    use super::*;

    fn record(count: usize, white: f64, walk: f64, ramp: f64, seed: u64) -> Vec<f64> {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
        let mut draw = move || -> f64 { StandardNormal.sample(&mut random) };
        let mut level = 3.0;
        (0..count)
            .map(|k| {
                level += walk * draw();
                level + white * draw() + ramp * k as f64
            })
            .collect()
    }

    /// The paper's gyro: 24 h at 0.2 Hz, 0.11 deg/h and 1.23e-3 deg/h/s.
    #[test]
    fn the_dry_tuned_gyro_of_the_paper_is_found_again() {
        let record = record(17_280, 0.11, 1.23e-3 * 5.0, 1e-4 * 5.0 / 3_600.0, 1);
        let found = stability(&record, 5.0).expect("stability");
        assert!(found.white.low < 0.11 && 0.11 < found.white.high, "{found:?}");
        assert!(found.is_walk_seen);
        // Its unit, degrees an hour a second, makes it a sequence held over the sample: K = 2.7504e-3 deg/h/sqrt(s).
        assert!((found.held_walk() / 1.23e-3 - 1.0).abs() < 0.1, "{found:?}");
        assert!((found.rate_walk() / 2.7504e-3 - 1.0).abs() < 0.1);
        assert!((found.angle_walk() / 0.245967 - 1.0).abs() < 0.02);
        assert!(found.ramp.low < 1e-4 / 3_600.0 && 1e-4 / 3_600.0 < found.ramp.high);
    }

    #[test]
    fn intervals_hold_the_truth_in_93_to_97_of_100_records() {
        let found: Vec<Stability> = (0..1_000)
            .into_par_iter()
            .map(|seed| stability(&record(1_500, 1.0, 0.1, 0.02, 100 + seed), 2.0).expect("stability"))
            .collect();
        let share = |name: &str, interval: fn(&Stability) -> Interval, truth: f64| {
            let held = found
                .iter()
                .map(interval)
                .filter(|found| found.low <= truth && truth <= found.high)
                .count();
            println!("{name}: held {held} of 1000");
            assert!((930..=970).contains(&held), "{name}: {held}");
        };
        share("white", |found| found.white, 1.0);
        share("walk", |found| found.walk_step, 0.1);
        share("ramp", |found| found.ramp, 0.01);
    }

    #[test]
    fn a_walk_that_is_not_there_is_refused_and_bounded() {
        let found = stability(&record(2_000, 1.0, 0.0, 0.0, 2), 1.0).expect("stability");
        assert!(!found.is_walk_seen && found.walk_step.value == 0.0);
        assert!(found.walk_step.high > 0.0 && found.walk_step.high < 0.05, "{found:?}");
    }

    #[test]
    fn short_and_constant_records_are_refused() {
        assert_eq!(stability(&[1.0; 99], 1.0), Err(StabilityError::TooShort(99)));
        assert_eq!(stability(&[1.0; 100], 1.0), Err(StabilityError::Constant));
    }
}
