//! Scale error: the sensor answers `1 + s` for one.

use super::{Effect, Nature, Page, Scope, Site, Symbol};
use crate::predict::{Chain, Kind};

/// `gyro-scale`.
pub struct GyroScale;

const GYRO: Page = Page {
    name: "gyro-scale",
    physics: "The gyro's scale factor is not the calibrated one.",
    equation: "y = (1 + s) n.w",
    source: "ADIS16265 data sheet: initial sensitivity error 1 %",
    excited_by: "steady rates of both signs",
    siblings: &[
        "reference-rate-scale",
        "gyro-scale-temperature",
        "gyro-nonlinearity",
        "gyro-sine-response",
    ],
    confirm_by: "Whole turns against a stopwatch and an index mark, clockwise and back.",
    nature: Nature::Smooth,
    scope: Scope::Channel,
    common: true,
    sensors: &[Kind::Gyro],
    parameters: &[Symbol {
        name: "s",
        unit: "1",
        prior_sigma: 0.01,
        signed: true,
    }],
};

impl Effect for GyroScale {
    fn page(&self) -> &'static Page {
        &GYRO
    }

    fn act<'a>(&self, theta: &'a [f64], _variant: f64, _site: &Site<'a>, chain: &mut Chain<'a>) {
        chain.aim.axis_b *= 1.0 + theta[0];
    }
}
