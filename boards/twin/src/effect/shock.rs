//! Shocks: taps, stops, separation. All accelerometers, and the gyros with them, jump together for a few samples.

use nalgebra::Vector3;

use super::spread::{Beneath, View, mixed, unusual_part};
use super::{Effect, Nature, Page, Scope, Symbol};
use crate::part::signal::Noise;
use crate::predict::Kind;

/// `shock`.
pub struct Shock;

const PAGE: Page = Page {
    name: "shock",
    physics: "Blows: now and then all accelerometers are far off together, and the gyros with them.",
    equation: "all y scatter W times as far, with probability p, together",
    source: "Taps and stops: 1 to 100 m/s2",
    excited_by: "blows",
    siblings: &["vibration", "packet-corruption", "accel-hysteresis"],
    confirm_by: "A faster log of one blow; damp the mounting.",
    nature: Nature::Spread,
    scope: Scope::Unit,
    sensors: &[Kind::Accelerometer, Kind::Gyro],
    parameters: &[Symbol::positive("p", "1", 0.01)],
    ..Page::SMOOTH
};

/// ln probability of all that was read in each cycle, without a blow and in one.
fn of_rows(views: &[View], variant: f64) -> Vec<[f64; 2]> {
    let count = views.iter().map(|view| view.measured.len()).max().unwrap_or(0);
    let mut rows = vec![[0.0; 2]; count];
    for view in views {
        let sigma = view.channel.sigma();
        for (k, residual) in view.residuals() {
            rows[k][0] += view.normal(residual, sigma);
            rows[k][1] += view.normal(residual, sigma * variant);
        }
    }
    rows
}

impl Effect for Shock {
    fn page(&self) -> &'static Page {
        &PAGE
    }

    fn log_likelihood(&self, theta: &[f64], variant: f64, views: &[View]) -> f64 {
        let p = theta[0].clamp(0.0, 0.999);
        let rows = of_rows(views, variant).into_iter();
        rows.map(|[usual, hit]| mixed(p, usual, hit)).sum()
    }

    fn beneath(&self, theta: &[f64], variant: f64, views: &[View]) -> Vec<Vec<Beneath>> {
        let p = theta[0].clamp(0.0, 0.999);
        let rows = of_rows(views, variant).into_iter();
        let worth: Vec<f64> = rows.map(|[usual, hit]| 1.0 - unusual_part(p, usual, hit)).collect();
        views.iter().map(|view| view.each_worth(|k, _| worth[k])).collect()
    }

    fn disturb(&self, theta: &[f64], variant: f64, views: &[View], noise: Noise) -> Vec<Vec<f64>> {
        // A blow pushes and turns the unit as a whole: sensors of a kind feel parts of one vector.
        let blow = |sensor: Kind, k: usize| {
            let first = if sensor == Kind::Gyro { 4 } else { 1 };
            Vector3::from_fn(|axis, _| noise.stream(first + axis as u64).normal(k as u64))
        };
        let hit = |view: &View| {
            let channel = view.channel;
            let sample = |(k, measured): (usize, &f64)| match noise.uniform(k as u64) < theta[0] {
                true => measured + variant * channel.sigma() * channel.axis_b.dot(&blow(channel.sensor, k)),
                false => *measured,
            };
            view.measured.iter().enumerate().map(sample).collect()
        };
        views.iter().map(hit).collect()
    }

    fn told(&self, variant: f64) -> Option<String> {
        Some(format!("blows of some {variant} times the noise"))
    }

    /// How many times as far they scatter.
    fn variants(&self, _starts_s: &[f64]) -> Vec<f64> {
        vec![5.0, 20.0, 100.0]
    }
}
