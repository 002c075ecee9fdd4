//! Zero shift since the calibration: the sensor reads `b` where there is nothing to read.

use super::{Effect, Nature, Page, Scope, Site, Symbol};
use crate::predict::{Chain, Kind};

/// `gyro-bias`.
pub struct GyroBias;

const GYRO: Page = Page {
    name: "gyro-bias",
    physics: "The gyro reads a rate at rest: its zero has moved since the calibration, as after every switching on.",
    equation: "y = n.w + b",
    source: "ADIS16265 data sheet: turn-on bias up to 3 deg/s, run to run 0.03 deg/s",
    excited_by: "any motion, and rest",
    siblings: &[
        "gyro-g2",
        "gyro-supply",
        "gyro-bias-temperature",
        "gyro-warm-up",
        "gyro-bias-walk",
        "earth-rate",
    ],
    confirm_by: "Rest in two attitudes at one temperature: the shift is the same in both.",
    nature: Nature::Smooth,
    scope: Scope::Channel,
    common: false,
    sensors: &[Kind::Gyro],
    parameters: &[Symbol {
        name: "b",
        unit: "rad/s",
        prior_sigma: 0.01,
        signed: true,
    }],
};

impl Effect for GyroBias {
    fn page(&self) -> &'static Page {
        &GYRO
    }

    fn act<'a>(&self, theta: &'a [f64], _variant: f64, _site: &Site<'a>, chain: &mut Chain<'a>) {
        chain.bias += theta[0];
    }
}
