//! Scale error: the sensor answers `1 + s` for one.

use super::{CorrectedAs, Effect, Page, Site, Symbol};
use crate::channel::{Chain, Kind};

/// The effects of this file, told apart by their pages.
pub struct Scale(pub &'static Page);

impl Effect for Scale {
    fn page(&self) -> &'static Page {
        self.0
    }

    fn act<'a>(&self, theta: &'a [f64], _variant: f64, _site: &Site<'a>, chain: &mut Chain<'a>) {
        chain.aim.axis_b *= 1.0 + theta[0];
    }
}

/// `gyro-scale`.
pub const GYRO: Page = Page {
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
    common: true,
    sensors: &[Kind::Gyro],
    parameters: &[Symbol::signed("s", "1", 0.01)],
    corrected_as: Some(CorrectedAs::Chain),
    ..Page::SMOOTH
};

/// `accel-scale`.
pub const ACCEL: Page = Page {
    name: "accel-scale",
    physics: "The accelerometer's scale factor is not the calibrated one.",
    equation: "y = (1 + s) n.f",
    source: "LIS331HH data sheet: sensitivity 2.7 to 3.3 mg per digit; 0.5 to 3 % after a calibration",
    excited_by: "one g up and down on each axis",
    siblings: &[
        "gravity-value",
        "accel-scale-temperature",
        "accel-misalignment",
        "accel-nonlinearity",
        "accel-range",
    ],
    confirm_by: "Each axis up and down: half the difference over local gravity.",
    common: false,
    sensors: &[Kind::Accelerometer],
    parameters: &[Symbol::signed("s", "1", 0.01)],
    corrected_as: Some(CorrectedAs::Chain),
    ..Page::SMOOTH
};
