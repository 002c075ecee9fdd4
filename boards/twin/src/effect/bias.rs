//! Zero shift since the calibration: the sensor reads `b` where there is nothing to read.

use super::{CorrectedAs, Effect, Page, Site, Symbol};
use crate::channel::{Chain, Kind};

/// The effects of this file, told apart by their pages.
pub struct Bias(pub &'static Page);

impl Effect for Bias {
    fn page(&self) -> &'static Page {
        self.0
    }

    fn act<'a>(&self, theta: &'a [f64], _variant: f64, _site: &Site<'a>, chain: &mut Chain<'a>) {
        chain.bias += theta[0];
    }
}

/// `gyro-bias`.
pub const GYRO: Page = Page {
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
    sensors: &[Kind::Gyro],
    parameters: &[Symbol::signed("b", "rad/s", 0.01)],
    corrected_as: Some(CorrectedAs::Chain),
    ..Page::SMOOTH
};

/// `accel-bias`.
pub const ACCEL: Page = Page {
    name: "accel-bias",
    physics: "The accelerometer's zero has moved since the calibration.",
    equation: "y = n.f + b",
    source: "LIS331HH data sheet: zero-g offset 70 mg; a few mg after a calibration",
    excited_by: "any attitude; told from other causes by six",
    siblings: &[
        "table-tilt",
        "accel-bias-temperature",
        "accel-hysteresis",
        "accel-vibration-rectification",
    ],
    confirm_by: "The six faces up and down: the mean of opposite readings is the shift.",
    sensors: &[Kind::Accelerometer],
    parameters: &[Symbol::signed("b", "m/s^2", 0.1)],
    corrected_as: Some(CorrectedAs::Chain),
    ..Page::SMOOTH
};
