//! Temperature coefficient of the scale.

use super::{
    CorrectedAs, Effect, Page, Site, Symbol,
    bend::{self, bent},
};
use crate::channel::{Chain, Kind};

/// The effects of this file, told apart by their pages.
pub struct ScaleTemperature(pub &'static Page);

impl Effect for ScaleTemperature {
    fn page(&self) -> &'static Page {
        self.0
    }

    fn act<'a>(&self, theta: &'a [f64], bend: f64, site: &Site<'a>, chain: &mut Chain<'a>) {
        let reference_c = site.environment.temperature_c;
        let k = theta[0];
        chain.add(move |feel, input| k * bent(feel.temperature_c - reference_c, bend) * input);
    }

    fn told(&self, bend: f64) -> Option<String> {
        bend::told(bend)
    }

    fn has_values_between(&self) -> bool {
        true
    }

    fn between(&self, _starts_s: &[f64]) -> Vec<f64> {
        bend::RANGE.into()
    }
}

/// `gyro-scale-temperature`.
pub const GYRO: Page = Page {
    name: "gyro-scale-temperature",
    physics: "The gyro's scale factor moves with its temperature.",
    equation: "y = (1 + k h(T - T0)) n.w, h(d) = d (1 + c d)",
    source: "ADIS16265 data sheet: 40 to 110 ppm per degC",
    excited_by: "rates at two temperatures",
    siblings: &["gyro-scale", "gyro-bias-temperature", "gyro-nonlinearity"],
    confirm_by: "The same rates, both signs, cold and warm.",
    common: true,
    sensors: &[Kind::Gyro],
    parameters: &[Symbol::signed("k", "1/degC", 1e-4)],
    corrected_as: Some(CorrectedAs::ScalePerKelvin),
    ..Page::SMOOTH
};

/// `accel-scale-temperature`.
pub const ACCEL: Page = Page {
    name: "accel-scale-temperature",
    physics: "The accelerometer's scale factor moves with its temperature.",
    equation: "y = (1 + k h(T - T0)) n.f, h(d) = d (1 + c d)",
    source: "LIS331HH data sheet: 0.01 % per degC",
    excited_by: "one g up and down at two temperatures",
    siblings: &["accel-bias-temperature", "accel-scale"],
    confirm_by: "Heat in two opposite attitudes: the shift changes sign with the attitude.",
    common: true,
    sensors: &[Kind::Accelerometer],
    parameters: &[Symbol::signed("k", "1/degC", 2e-4)],
    corrected_as: Some(CorrectedAs::ScalePerKelvin),
    ..Page::SMOOTH
};

/// `mag-scale-temperature`.
pub const MAG: Page = Page {
    name: "mag-scale-temperature",
    physics: "The magnetometer's sensitivity falls as it warms, and nothing compensates it.",
    equation: "y = (1 + k h(T - T0)) n.m, h(d) = d (1 + c d)",
    source: "HMC5883L data sheet: -0.3 % per degC",
    excited_by: "temperature",
    siblings: &["mag-offset-temperature", "field-model"],
    confirm_by: "The self-test field, cold and warm: its ratio is the coefficient.",
    common: true,
    sensors: &[Kind::Magnetometer],
    parameters: &[Symbol::signed("k", "1/degC", 3e-3)],
    corrected_as: Some(CorrectedAs::ScalePerKelvin),
    ..Page::SMOOTH
};
