//! Sampling jitter: the instants of sampling scatter, so the faster a reading changes the more it scatters.

use super::spread::View;
use super::{Effect, Nature, Page, Scope, Symbol};
use crate::part::signal::Noise;
use crate::predict::Kind;

/// [physical unit/s] of the prediction at each sample. Central differences: at a few samples a second they are short of the
/// true slope where it changes, and the jitter comes out that much larger.
fn slopes(view: &View) -> Vec<f64> {
    let last = view.t_s.len().saturating_sub(1);
    let slope = |k: usize| {
        let (before, after) = (k.saturating_sub(1), (k + 1).min(last));
        let dt_s = view.t_s[after] - view.t_s[before];
        if dt_s > 0.0 {
            (view.predicted[after] - view.predicted[before]) / dt_s
        } else {
            0.0
        }
    };
    (0..view.t_s.len()).map(slope).collect()
}

/// `sampling-jitter`.
pub struct SamplingJitter;

const PAGE: Page = Page {
    name: "sampling-jitter",
    physics: "The sampling instants scatter about the stamped ones.",
    equation: "sigma^2 + (sigma_t dy/dt)^2",
    source: "Software timing: 0.1 to 5 ms",
    excited_by: "dynamics",
    siblings: &["noise-level", "stale-sample"],
    confirm_by: "Rest: the scatter is then gone.",
    nature: Nature::Spread,
    scope: Scope::Unit,
    sensors: &[Kind::Accelerometer, Kind::Gyro, Kind::Magnetometer],
    parameters: &[Symbol::positive("sigma_t", "s", 2e-3)],
    ..Page::SMOOTH
};

impl Effect for SamplingJitter {
    fn page(&self) -> &'static Page {
        &PAGE
    }

    fn log_likelihood(&self, theta: &[f64], variant: f64, views: &[View]) -> f64 {
        let _ = variant;
        let of = |view: &View| -> f64 {
            let slopes = slopes(view);
            let sigma = |k: usize| view.channel.sigma().hypot(theta[0] * slopes[k]);
            view.residuals()
                .map(|(k, residual)| view.normal(residual, sigma(k)))
                .sum()
        };
        views.iter().map(of).sum()
    }

    fn disturb(&self, theta: &[f64], variant: f64, views: &[View], noise: Noise) -> Vec<Vec<f64>> {
        let _ = variant;
        // One error of time an instant: what is read together is late together.
        let late_s = |t_s: f64| theta[0] * noise.normal(t_s.to_bits());
        let disturbed = |view: &View| {
            let slopes = slopes(view);
            let samples = view.measured.iter().zip(&slopes).zip(view.t_s);
            samples
                .map(|((measured, slope), t_s)| measured + slope * late_s(*t_s))
                .collect()
        };
        views.iter().map(disturbed).collect()
    }
}
