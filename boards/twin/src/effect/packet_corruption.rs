//! Corruption: a damaged packet passes for a whole one, and a value is anything.

use super::spread::{Beneath, View, mixture, unusual_part};
use super::{Effect, Nature, Page, Symbol, Texture};
use crate::channel::Kind;
use crate::part::signal::Noise;

/// `packet-corruption`.
pub struct PacketCorruption;

const PAGE: Page = Page {
    name: "packet-corruption",
    physics: "Bytes of a packet are damaged and nobody notices: now and then a value is anything within the range.",
    equation: "y uniform over the range with probability p",
    source: "A line without a check sum",
    excited_by: "any",
    siblings: &["bit-fault", "shock"],
    confirm_by: "Check sums; the outliers are in one channel at a time.",
    nature: Nature::Spread,
    common: true,
    sensors: &[Kind::Accelerometer, Kind::Gyro, Kind::Magnetometer, Kind::Thermometer],
    parameters: &[Symbol::positive("p", "1", 0.01)],
    texture: Texture::Shapeless,
    ..Page::SMOOTH
};

impl Effect for PacketCorruption {
    fn page(&self) -> &'static Page {
        &PAGE
    }

    fn log_likelihood(&self, theta: &[f64], variant: f64, views: &[View]) -> f64 {
        let _ = variant;
        let mixed = mixture(theta[0].clamp(0.0, 0.999));
        let of = |view: &View| -> f64 {
            let anything = (view.resolution() / view.span()).ln();
            let law = view.normal_law(view.channel.sigma());
            view.residuals()
                .map(|(_, residual)| mixed(law(residual), anything))
                .sum()
        };
        views.iter().map(of).sum()
    }

    fn beneath(&self, theta: &[f64], _variant: f64, views: &[View]) -> Vec<Vec<Beneath>> {
        let p = theta[0].clamp(0.0, 0.999);
        let of = |view: &View| {
            let (sigma, anything) = (view.channel.sigma(), (view.resolution() / view.span()).ln());
            view.each_worth(|_, residual| 1.0 - unusual_part(p, view.normal(residual, sigma), anything))
        };
        views.iter().map(of).collect()
    }

    fn disturb(&self, theta: &[f64], variant: f64, views: &[View], noise: Noise) -> Vec<Vec<f64>> {
        let _ = variant;
        let corrupted = |(number, view): (usize, &View)| {
            let (which, what) = (noise.stream(2 * number as u64), noise.stream(2 * number as u64 + 1));
            let [low, _] = view.limits();
            let sample = |(k, measured): (usize, &f64)| match which.uniform(k as u64) < theta[0] {
                true => low + view.span() * what.uniform(k as u64),
                false => *measured,
            };
            view.measured.iter().enumerate().map(sample).collect()
        };
        views.iter().enumerate().map(corrupted).collect()
    }
}
