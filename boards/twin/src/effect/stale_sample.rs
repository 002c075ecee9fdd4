//! Stale samples: now and then a read times out and the value before is sent again.

use super::spread::{Beneath, View, mixture, unusual_part};
use super::{Effect, Likelihood, Nature, Page, Symbol};
use crate::channel::Kind;
use crate::part::signal::Noise;

/// `stale-sample`.
pub struct StaleSample;

const PAGE: Page = Page {
    name: "stale-sample",
    physics: "A read fails and the value of the cycle before is sent again.",
    equation: "y_k = y_(k-1) with probability p",
    source: "Timeouts on a shared bus: 0.1 to 5 %",
    excited_by: "dynamics, or noise above a count",
    siblings: &["sampling-jitter", "stuck-channel"],
    confirm_by: "Error bits; codes that repeat more often than noise lets them.",
    nature: Nature::Spread,
    common: true,
    sensors: &[Kind::Accelerometer, Kind::Gyro, Kind::Magnetometer],
    parameters: &[Symbol::positive("p", "1", 0.02)],
    ..Page::SMOOTH
};

/// \[sigma\] within which a reading is of what is measured.
const FRESH: f64 = 8.0;

/// ln probability of each sample if it is one that was sent before.
fn stale(view: &View) -> Vec<f64> {
    let sigma = view.channel.sigma();
    // Where the value that a sample has was fresh.
    let mut first = 0;
    let sample = |k: usize| {
        let repeats = k > 0 && (view.measured[k] - view.measured[k - 1]).abs() < 0.5 * view.resolution();
        first = if repeats { first } else { k };
        // What was no reading of the sensor when it was fresh is none when it is sent again.
        let was_read = (view.measured[first] - view.predicted[first]).abs() < FRESH * sigma;
        if first < k && was_read { 0.0 } else { f64::NEG_INFINITY }
    };
    (0..view.measured.len()).map(sample).collect()
}

impl Effect for StaleSample {
    fn page(&self) -> &'static Page {
        &PAGE
    }

    fn log_likelihood(&self, theta: &[f64], variant: f64, views: &[View]) -> f64 {
        self.likelihood(variant, views)(theta)
    }

    fn likelihood<'a>(&'a self, _variant: f64, views: &'a [View<'a>]) -> Likelihood<'a> {
        let stale: Vec<Vec<f64>> = views.iter().map(stale).collect();
        Box::new(move |theta| {
            let mixed = mixture(theta[0].clamp(0.0, 0.999));
            let of = |(view, stale): (&View, &Vec<f64>)| -> f64 {
                let law = view.normal_law(view.channel.sigma());
                let sample = |(k, residual): (usize, f64)| mixed(law(residual), stale[k]);
                view.residuals().map(sample).sum()
            };
            views.iter().zip(&stale).map(of).sum()
        })
    }

    fn beneath(&self, theta: &[f64], _variant: f64, views: &[View]) -> Vec<Vec<Beneath>> {
        let p = theta[0].clamp(0.0, 0.999);
        let of = |view: &View| {
            let stale = stale(view);
            view.each_worth(|k, residual| 1.0 - unusual_part(p, view.normal(residual, view.channel.sigma()), stale[k]))
        };
        views.iter().map(of).collect()
    }

    fn disturb(&self, theta: &[f64], variant: f64, views: &[View], noise: Noise) -> Vec<Vec<f64>> {
        let _ = variant;
        let repeated = |view: &View| {
            let mut held: Option<f64> = None;
            let sample = |(k, measured): (usize, &f64)| {
                // The channels of one chip are read at one instant and are stale together.
                let stale = noise.uniform(k as u64) < theta[0];
                let value = held.filter(|_| stale).unwrap_or(*measured);
                held = Some(value);
                value
            };
            view.measured.iter().enumerate().map(sample).collect()
        };
        views.iter().map(repeated).collect()
    }
}
