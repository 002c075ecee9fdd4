//! Noise level: the white noise is stronger or weaker than described.

use super::spread::{Beneath, View};
use super::{Effect, Nature, Page, Symbol, Texture};
use crate::channel::Kind;
use crate::part::signal::Noise;

/// `noise-level`.
pub struct NoiseLevel;

const PAGE: Page = Page {
    name: "noise-level",
    physics: "The white noise of the channel is not the described one: another bandwidth, averaging, or a noisy supply.",
    equation: "sigma exp(a)",
    source: "Data sheets give typical noise; by settings a factor 1.2 to 3",
    excited_by: "rest",
    siblings: &["sampling-jitter", "vibration"],
    confirm_by: "A minute at rest.",
    nature: Nature::Spread,
    common: true,
    sensors: &[Kind::Accelerometer, Kind::Gyro, Kind::Magnetometer, Kind::Thermometer],
    parameters: &[Symbol::signed("a", "1", 0.5)],
    texture: Texture::Louder,
    ..Page::SMOOTH
};

impl Effect for NoiseLevel {
    fn page(&self) -> &'static Page {
        &PAGE
    }

    fn log_likelihood(&self, theta: &[f64], variant: f64, views: &[View]) -> f64 {
        let _ = variant;
        let of = |view: &View| -> f64 {
            let law = view.normal_law(view.channel.sigma() * theta[0].exp());
            view.residuals().map(|(_, residual)| law(residual)).sum()
        };
        views.iter().map(of).sum()
    }

    fn beneath(&self, theta: &[f64], _variant: f64, views: &[View]) -> Vec<Vec<Beneath>> {
        let worth = (-2.0 * theta[0]).exp();
        views.iter().map(|view| view.each_worth(|_, _| worth)).collect()
    }

    fn disturb(&self, theta: &[f64], variant: f64, views: &[View], noise: Noise) -> Vec<Vec<f64>> {
        let _ = (variant, noise);
        let scaled = |view: &View| {
            let pairs = view.measured.iter().zip(view.predicted);
            pairs
                .map(|(measured, predicted)| predicted + (measured - predicted) * theta[0].exp())
                .collect()
        };
        views.iter().map(scaled).collect()
    }
}
