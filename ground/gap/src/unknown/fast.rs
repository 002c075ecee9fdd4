//! What a model leaves of one channel whatever its course: energy above the floor.
//!
//! In: the problem, the model and the floor of each sample. Out: for each channel the mean square above the floor, in squares of sigma,
//! with its standard deviation: of all frequencies together, or of the octaves that stand out of the floor, whichever is surer. Where the
//! reference errs more than the sensor scatters, in a colour that nobody knows, only all together are looked at. White, nearly Gaussian
//! energy is noise that is louder than described and no unknown effect; it is left out.

use super::octaves;
use crate::{
    null::{misfit::correlation_time, model::Model, problem::Problem},
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

/// Of every channel that has samples; `louder` is how much more each scatters by the model.
pub fn excesses(problem: &Problem, model: &Model, floor: &[Vec<f64>], louder: &[f64]) -> Vec<Fast> {
    (0..problem.frames.len())
        .filter_map(|channel| excess(problem, model, channel, &floor[channel], louder[channel]))
        .collect()
}

fn excess(problem: &Problem, model: &Model, channel: usize, floor: &[f64], louder: f64) -> Option<Fast> {
    let rows = &problem.frames[channel].series.rows;
    let rest = problem.in_sigmas(channel, &model.fitted.rest[channel]) / louder;
    let count = rest.len() as f64;
    let square = rest.norm_squared() / count;
    if rows.len() < 2 || !square.is_finite() || square <= 0.0 {
        return None;
    }
    let mean = |of: &dyn Fn(usize) -> f64| rows.iter().map(|row| of(*row as usize)).sum::<f64>() / count;
    let floor = mean(&|row| floor[row]);
    let squares = mean(&|row| problem.sigmas[channel][row].powi(2));
    let tails = rest.iter().map(|value| value.powi(4)).sum::<f64>() / count / (square * square) - 3.0;
    let alike = correlation_time(rest.as_slice(), rest.norm_squared());
    // Half as far below a Gaussian's is no sum of many small things: evenly spread values have -1.2, two values -2.
    let is_noise = tails > -0.5 * NOISE_TAILS && tails < NOISE_TAILS && alike < MISFIT_CALM;
    let excess = square - floor;
    // Under nothing.
    let expected = floor * ((2.0 + NOISE_TAILS) / count).sqrt();
    let z = (excess / expected).max(0.0);
    let all = Fast {
        channel,
        excess,
        floor,
        // As it is.
        error: square * ((2.0 + tails.max(0.0)) * alike / count).sqrt(),
        reference: mean(&|row| problem.instrument.fast_sigma(channel, row).powi(2)) / squares,
        log_bayes_factor: if is_noise { 0.0 } else { 0.5 * (z * z - count.ln()) },
        sigma: squares.sqrt(),
    };
    let by_octave = octaves::excess(rest.as_slice(), floor, NOISE_TAILS);
    if is_noise || problem.is_limited(channel) || by_octave.log_bayes_factor < all.log_bayes_factor {
        return Some(all);
    }
    Some(Fast {
        excess: by_octave.energy / count,
        error: by_octave.error / count,
        log_bayes_factor: by_octave.log_bayes_factor,
        ..all
    })
}
