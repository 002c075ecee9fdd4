//! Warm-up: after switching on, the zero settles exponentially.

use super::{Effect, Page, Site, Symbol};
use crate::channel::{Chain, Kind};

/// `gyro-warm-up`.
pub struct WarmUp;

const PAGE: Page = Page {
    name: "gyro-warm-up",
    physics: "From switching on, the gyro's zero settles as its die warms.",
    equation: "y = n.w + A exp(-t/tau)",
    source: "Estimate for coreless rate sensors: 0.05 to 0.3 deg/s within 30 to 300 s",
    excited_by: "the first minutes after a cold start",
    siblings: &[
        "gyro-bias-temperature",
        "gyro-bias",
        "gyro-temperature-hysteresis",
        "gyro-bias-walk",
    ],
    confirm_by: "Switch off and on again while warm: a warm-up comes back, a temperature coefficient does not.",
    sensors: &[Kind::Gyro],
    parameters: &[Symbol::signed("A", "rad/s", 3e-3)],
    ..Page::SMOOTH
};

impl Effect for WarmUp {
    fn page(&self) -> &'static Page {
        &PAGE
    }

    fn act<'a>(&self, theta: &'a [f64], variant: f64, _site: &Site<'a>, chain: &mut Chain<'a>) {
        let amplitude = theta[0];
        chain.add(move |feel, _| amplitude * (-feel.t_s / variant).exp());
    }

    fn told(&self, variant: f64) -> Option<String> {
        Some(format!("with a time constant of {variant:.0} s"))
    }

    /// Time constants \[s\].
    fn variants(&self, _starts_s: &[f64]) -> Vec<f64> {
        vec![20.0, 40.0, 80.0, 160.0, 320.0]
    }

    fn has_values_between(&self) -> bool {
        true
    }
}
