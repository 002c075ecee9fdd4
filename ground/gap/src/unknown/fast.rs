//! What a model leaves of one channel whatever its course: energy above the floor.
//!
//! In: the problem, the model and the floor of each sample. Out: for each channel the mean square above the floor, in squares of sigma,
//! with its standard deviation: of all frequencies together, or of the octaves that stand out of the floor, whichever is surer. Where the
//! reference errs more than the sensor scatters, in a colour that nobody knows, only all together are looked at. White, nearly Gaussian
//! energy is noise that is louder than described and no unknown effect; it is left out. Where the reference is not exact it may be louder at
//! one time than at another ([`level`]): so are engines, and the errors of a reference.

use super::{
    octaves::{self, Excess},
    remainder::Setting,
};
use crate::{
    null::{level, misfit::correlation_time, model::Model, problem::Problem},
    thresholds::{MISFIT_CALM, NOISE_TAILS},
};

/// What one channel holds above its floor.
#[derive(Clone, Copy, Debug)]
pub struct Fast {
    /// Which.
    pub channel: usize,
    /// [sigma^2] mean square above the floor, and the floor.
    pub excess: f64,
    /// [sigma^2] the floor.
    pub floor: f64,
    /// [sigma^2] standard deviation of the excess.
    pub error: f64,
    /// [sigma^2] what of the described variance is the reference's.
    pub reference: f64,
    /// ln of the odds of something against the floor alone (Schwarz 1978).
    pub log_bayes_factor: f64,
    /// [physical unit] root mean square of sigma.
    pub sigma: f64,
}

/// Of every channel that has samples.
pub fn excesses(problem: &Problem, model: &Model, floor: &[Vec<f64>], setting: &Setting) -> Vec<Fast> {
    (0..problem.frames.len())
        .filter_map(|channel| excess(problem, model, channel, &floor[channel], setting))
        .collect()
}

fn excess(problem: &Problem, model: &Model, channel: usize, floor: &[f64], setting: &Setting) -> Option<Fast> {
    let rows = &problem.frames[channel].series.rows;
    let rest = problem.in_sigmas(channel, &model.fitted.rest[channel]) / setting.louder[channel];
    let is_exact = setting.slow.attitude_sigma_rad <= 0.0;
    let count = rest.len() as f64;
    let square = rest.norm_squared() / count;
    if rows.len() < 2 || !square.is_finite() || square <= 0.0 {
        return None;
    }
    let mean = |of: &dyn Fn(usize) -> f64| rows.iter().map(|row| of(*row as usize)).sum::<f64>() / count;
    let floor = mean(&|row| floor[row]);
    let squares = mean(&|row| problem.sigmas[channel][row].powi(2));
    let above = above(rest.as_slice(), floor, !problem.is_limited(channel), is_exact);
    Some(Fast {
        channel,
        excess: above.energy / count,
        floor,
        error: above.error / count,
        reference: mean(&|row| problem.instrument.fast_sigma(channel, row).powi(2)) / squares,
        log_bayes_factor: above.log_bayes_factor,
        sigma: squares.sqrt(),
    })
}

/// Excess kurtosis.
fn tails(rest: &[f64]) -> f64 {
    let energy: f64 = rest.iter().map(|value| value * value).sum();
    rest.len() as f64 * rest.iter().map(|value| value.powi(4)).sum::<f64>() / (energy * energy) - 3.0
}

/// What residuals in sigmas hold above a floor; octave by octave too where it `is_flat`.
fn above(rest: &[f64], floor: f64, is_flat: bool, is_steady: bool) -> Excess {
    let count = rest.len() as f64;
    let energy: f64 = rest.iter().map(|value| value * value).sum();
    let square = energy / count;
    let alike = correlation_time(rest, energy);
    let of_noise = if is_steady {
        tails(rest)
    } else {
        tails(&level::steadied(rest))
    };
    // Half as far below a Gaussian's is no sum of many small things: evenly spread values have -1.2, two values -2.
    let is_noise = of_noise > -0.5 * NOISE_TAILS && of_noise < NOISE_TAILS && alike < MISFIT_CALM;
    // Under nothing.
    let expected = floor * ((2.0 + NOISE_TAILS) / count).sqrt();
    let z = ((square - floor) / expected).max(0.0);
    let all = Excess {
        energy: energy - count * floor,
        // As it is.
        error: energy * ((2.0 + tails(rest).max(0.0)) * alike / count).sqrt(),
        log_bayes_factor: if is_noise { 0.0 } else { 0.5 * (z * z - count.ln()) },
    };
    if is_noise || !is_flat {
        return all;
    }
    let by_octave = octaves::excess(rest, floor, NOISE_TAILS);
    if by_octave.log_bayes_factor < all.log_bayes_factor {
        all
    } else {
        by_octave
    }
}

#[cfg(test)]
mod tests {
    use rand_distr::{Distribution, StandardNormal};
    use rand_xoshiro::{Xoshiro256PlusPlus, rand_core::SeedableRng};

    use super::*;

    /// White noise of this sigma, and a sine of this amplitude.
    fn noise_and(sigma: f64, amplitude: f64) -> Vec<f64> {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(1);
        let noise = |random: &mut Xoshiro256PlusPlus| -> f64 { StandardNormal.sample(random) };
        (0..1500)
            .map(|k| sigma * noise(&mut random) + amplitude * (f64::from(k) * 0.1).sin())
            .collect()
    }

    fn judged(rest: &[f64], is_flat: bool) -> Excess {
        above(rest, 1.0, is_flat, true)
    }

    #[test]
    fn a_tone_too_weak_for_the_whole_stands_out_of_its_octave_where_the_floor_is_flat() {
        let hummed = noise_and(1.0, 0.5);
        let (by_octave, whole) = (judged(&hummed, true), judged(&hummed, false));
        assert!(by_octave.log_bayes_factor > 10.0, "{by_octave:?}");
        assert!(whole.log_bayes_factor < 3.0, "{whole:?}");
    }

    /// Of a unit under thrust: a tenth as loud before.
    #[test]
    fn noise_that_comes_and_goes_is_nothing_unknown_where_the_reference_is_not_exact() {
        let mut noise = noise_and(0.3, 0.0);
        noise[1300..].iter_mut().for_each(|value| *value *= 10.0);
        let is_there = |is_steady: bool| above(&noise, 1.0, true, is_steady).log_bayes_factor > 3.0;
        assert!(is_there(true) && !is_there(false));
        let mut hummed = noise_and(0.3, 0.0);
        let hums = hummed[1300..].iter_mut().enumerate();
        hums.for_each(|(k, value)| *value += 4.0 * (k as f64 * 0.1).sin());
        assert!(above(&hummed, 1.0, true, false).log_bayes_factor > 3.0);
    }

    #[test]
    fn noise_that_is_louder_than_described_is_nothing_unknown() {
        assert_eq!(judged(&noise_and(1.5, 0.0), true).log_bayes_factor, 0.0);
    }
}
