//! Residuals to look at: of the channels that stand out most in full, of all channels in stretches of time.
//!
//! In: the [`Problem`] and a finished [`Model`]. Out: what the page draws.

use crate::{
    null::{model::Model, problem::Problem},
    unknown::adequacy::{STRETCHES, View},
};

/// Channels whose residuals are shown.
const TRACES: usize = 6;

/// Points of a trace: more are not told apart on a page.
const POINTS: usize = 1500;

/// One channel's residual on the fit windows.
#[derive(Clone, Debug)]
pub struct Trace {
    /// Its channel.
    pub name: String,
    /// (\[s\], \[sigma\]) by the nominal twin.
    pub before: Vec<(f64, f64)>,
    /// (\[s\], \[sigma\]) with effect and calibration in.
    pub after: Vec<(f64, f64)>,
}

/// Residuals of the channels whose gap is largest.
pub fn traces(problem: &Problem, model: &Model) -> Vec<Trace> {
    let twin = problem.twin;
    // In standard deviations of a sample: in units of noise a channel that scatters more than described is as quiet as any.
    let gap = |channel: usize| {
        let standard = problem.in_sigmas(channel, &problem.residual(channel, &[]));
        standard.norm_squared() / standard.len().max(1) as f64
    };
    let mut order: Vec<(usize, f64)> = (0..problem.frames.len())
        .map(|channel| (channel, gap(channel)))
        .collect();
    order.sort_by(|one, other| other.1.total_cmp(&one.1));
    let trace = |(channel, _): &(usize, f64)| {
        let series = &problem.frames[*channel].series;
        let nominal = problem.predict(*channel, &[]);
        let step = series.rows.len().div_ceil(POINTS).max(1);
        let points = |predicted: &[f64]| {
            let pairs = series.rows.iter().zip(&series.values).step_by(step);
            pairs
                .map(|(row, value)| {
                    (
                        twin.starts_s()[*row as usize],
                        (value - predicted[*row as usize]) / problem.sigmas[*channel][*row as usize],
                    )
                })
                .collect()
        };
        Trace {
            name: twin.unit().channels[*channel].name.clone(),
            before: points(&nominal),
            after: points(&model.predicted[*channel]),
        }
    };
    order.iter().take(TRACES).map(trace).collect()
}

/// The gap of each channel in each stretch of the fit windows.
pub fn cells(problem: &Problem, views: &[View]) -> Vec<(String, Vec<f64>)> {
    let cell = |(channel, view): (usize, &View)| {
        let mut sums = vec![(0.0, 0.0); STRETCHES];
        let standard = problem.in_sigmas(channel, &problem.residual(channel, &[]));
        for (phase, value) in view.phase.iter().zip(standard.iter()) {
            let sum = &mut sums[((phase * STRETCHES as f64) as usize).min(STRETCHES - 1)];
            *sum = (sum.0 + value * value, sum.1 + 1.0);
        }
        (
            view.name.clone(),
            sums.into_iter()
                .map(|(energy, samples)| f64::sqrt(energy / samples))
                .collect(),
        )
    };
    views.iter().enumerate().map(cell).collect()
}
