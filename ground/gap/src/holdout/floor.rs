//! What a perfect twin would leave of a log that judges it: more than its noise.
//!
//! In: the problem and the model fitted to it. Out: per channel and row, the mean square of the residual that is to be expected
//! if the model is right, in squares of sigma: 1 for the noise, and two things that no twin can know. A part with a clock of its
//! own reads values that are up to a period old, which scatters them by `(x' T)^2 / 12`; how much of that is there the fit windows
//! say, for a clock that keeps step with the cycle scatters nothing. And a calibration fitted to so many samples is off by what
//! they leave open. Neither is counted as a gap that an effect could close.

use crate::{
    null::{calibration::conversion_period_s, model::Model, problem::Problem},
    unknown::views,
};

/// The mean squares.
pub fn floor(problem: &Problem, model: &Model) -> Vec<Vec<f64>> {
    let of_channel = |channel: usize| {
        let own = &problem.twin.unit().channels[channel];
        let period_s = conversion_period_s(own);
        // As described, whatever the samples were weighed by.
        let noise = problem.frames[channel].own.map(|part| own.sigma() / part);
        let part = views::clock(problem, channel, &model.predicted[channel], &noise)
            .map_or(0.0, |(clock, left)| clock.part_shown(left.into_iter()).min(1.0));
        let slopes = problem.true_twin().by_instant(channel);
        let open = problem.still_open(channel);
        let at = |(row, sigma): (usize, &f64)| {
            let aged = part * (slopes[row] * period_s).powi(2) / 12.0;
            1.0 + (aged + open.column(row).norm_squared()) / (sigma * sigma)
        };
        problem.sigmas[channel].iter().enumerate().map(at).collect()
    };
    (0..problem.frames.len()).map(of_channel).collect()
}
