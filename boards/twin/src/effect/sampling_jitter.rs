//! Sampling jitter: the instants of sampling scatter, so the faster a reading changes the more it scatters.
//!
//! Each reading may be late by itself, or a cycle as a whole: then one number explains what 28 channels read.

use super::spread::{Beneath, View};
use super::{Effect, Likelihood, Nature, Page, Scope, Symbol, Texture};
use crate::channel::Kind;
use crate::part::signal::Noise;

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

/// The variants: what is late by itself.
const OF_READINGS: f64 = 0.0;
const OF_CYCLE: f64 = 1.0;

/// Of each cycle what pulls its instant [sigma2/s] and how stiffly its readings hold it [1/s2].
fn cycles(views: &[View]) -> Vec<[f64; 2]> {
    let count = views.iter().map(|view| view.measured.len()).max().unwrap_or(0);
    let mut cycles = vec![[0.0; 2]; count];
    for view in views {
        let (slopes, weight) = (slopes(view), view.channel.sigma().powi(-2));
        for (k, residual) in view.residuals() {
            cycles[k][0] += weight * slopes[k] * residual;
            cycles[k][1] += weight * slopes[k] * slopes[k];
        }
    }
    cycles
}

/// `sampling-jitter`.
pub struct SamplingJitter;

const PAGE: Page = Page {
    name: "sampling-jitter",
    physics: "The sampling instants scatter about the stamped ones.",
    equation: "y + dy/dt e, e normal with sigma_t, each reading's own or the cycle's",
    source: "Software timing: 0.1 to 5 ms",
    excited_by: "dynamics",
    siblings: &["noise-level", "stale-sample"],
    confirm_by: "Rest: the scatter is then gone.",
    nature: Nature::Spread,
    scope: Scope::Unit,
    sensors: &[Kind::Accelerometer, Kind::Gyro, Kind::Magnetometer],
    parameters: &[Symbol::positive("sigma_t", "s", 2e-3)],
    texture: Texture::Shapeless,
    ..Page::SMOOTH
};

impl Effect for SamplingJitter {
    fn page(&self) -> &'static Page {
        &PAGE
    }

    fn log_likelihood(&self, theta: &[f64], variant: f64, views: &[View]) -> f64 {
        self.likelihood(variant, views)(theta)
    }

    fn likelihood<'a>(&'a self, variant: f64, views: &'a [View<'a>]) -> Likelihood<'a> {
        if variant == OF_CYCLE {
            let nominal: f64 = views.iter().map(View::nominal).sum();
            let cycles = cycles(views);
            return Box::new(move |theta| {
                let variance = theta[0] * theta[0];
                // The ratio of a normal law whose covariance has one direction more to one without.
                let change = |[pull, stiffness]: &[f64; 2]| {
                    let grown = 1.0 + variance * stiffness;
                    0.5 * (variance * pull * pull / grown - grown.ln())
                };
                nominal + cycles.iter().map(change).sum::<f64>()
            });
        }
        let slopes: Vec<Vec<f64>> = views.iter().map(slopes).collect();
        Box::new(move |theta| {
            let of = |(view, slopes): (&View, &Vec<f64>)| -> f64 {
                let sigma = |k: usize| view.channel.sigma().hypot(theta[0] * slopes[k]);
                view.residuals()
                    .map(|(k, residual)| view.normal(residual, sigma(k)))
                    .sum()
            };
            views.iter().zip(&slopes).map(of).sum()
        })
    }

    fn beneath(&self, theta: &[f64], variant: f64, views: &[View]) -> Vec<Vec<Beneath>> {
        let variance = theta[0] * theta[0];
        let cycles = if variant == OF_CYCLE { cycles(views) } else { Vec::new() };
        let of = |view: &View| -> Vec<Beneath> {
            let slopes = slopes(view);
            if variant != OF_CYCLE {
                return view.each_worth(|k, _| 1.0 / (1.0 + variance * (slopes[k] / view.channel.sigma()).powi(2)));
            }
            let late_s = |k: usize| variance * cycles[k][0] / (1.0 + variance * cycles[k][1]);
            let all = view.as_logged().into_iter().enumerate();
            all.map(|(k, logged)| Beneath {
                value: logged.value - slopes[k] * late_s(k),
                ..logged
            })
            .collect()
        };
        views.iter().map(of).collect()
    }

    fn disturb(&self, theta: &[f64], variant: f64, views: &[View], noise: Noise) -> Vec<Vec<f64>> {
        // One error of time an instant: what is read together is late together.
        let late_s = |k: usize, t_s: f64| {
            let number = if variant == OF_CYCLE { k as u64 } else { t_s.to_bits() };
            theta[0] * noise.normal(number)
        };
        let disturbed = |view: &View| {
            let slopes = slopes(view);
            let samples = view.measured.iter().zip(&slopes).zip(view.t_s).enumerate();
            samples
                .map(|(k, ((measured, slope), t_s))| measured + slope * late_s(k, *t_s))
                .collect()
        };
        views.iter().map(disturbed).collect()
    }

    fn told(&self, variant: f64) -> Option<String> {
        let what = if variant == OF_CYCLE {
            "a cycle as a whole"
        } else {
            "each reading by itself"
        };
        Some(format!("{what} is early or late"))
    }

    fn variants(&self, _starts_s: &[f64]) -> Vec<f64> {
        vec![OF_READINGS, OF_CYCLE]
    }
}
