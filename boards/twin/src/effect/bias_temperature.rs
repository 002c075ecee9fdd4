//! Temperature coefficient of the zero: it moves with the distance from the temperature of the calibration, nearly in
//! proportion.

use super::{
    CorrectedAs, Effect, Page, Site, Symbol,
    bend::{self, bent},
};
use crate::channel::{Chain, Kind};

/// The effects of this file, told apart by their pages.
pub struct BiasTemperature(pub &'static Page);

impl Effect for BiasTemperature {
    fn page(&self) -> &'static Page {
        self.0
    }

    fn act<'a>(&self, theta: &'a [f64], bend: f64, site: &Site<'a>, chain: &mut Chain<'a>) {
        let reference_c = site.environment.temperature_c;
        let k = theta[0];
        chain.add(move |feel, _| k * bent(feel.temperature_c - reference_c, bend));
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

/// `gyro-bias-temperature`.
pub const GYRO: Page = Page {
    name: "gyro-bias-temperature",
    physics: "The gyro's zero moves with its temperature.",
    equation: "y = n.w + k h(T - T0), h(d) = d (1 + c d)",
    source: "ADIS16265: 0.005 to 0.03 deg/s per degC, uncompensated",
    excited_by: "temperature, in both directions",
    siblings: &[
        "gyro-warm-up",
        "gyro-temperature-hysteresis",
        "gyro-bias",
        "gyro-bias-walk",
    ],
    confirm_by: "Cool and heat at rest, and wait at each end: the shift follows the temperature, not the time.",
    common: true,
    sensors: &[Kind::Gyro],
    parameters: &[Symbol::signed("k", "rad/s/degC", 3e-4)],
    corrected_as: Some(CorrectedAs::BiasPerKelvin),
    ..Page::SMOOTH
};

/// `accel-bias-temperature`.
pub const ACCEL: Page = Page {
    name: "accel-bias-temperature",
    physics: "The accelerometer's zero moves with its temperature.",
    equation: "y = n.f + k h(T - T0), h(d) = d (1 + c d)",
    source: "LIS331HH data sheet: 0.4 mg per degC",
    excited_by: "temperature",
    siblings: &["accel-scale-temperature", "accel-bias"],
    confirm_by: "Heat in two opposite attitudes: the shift has the same sign in both.",
    common: true,
    sensors: &[Kind::Accelerometer],
    parameters: &[Symbol::signed("k", "m/s^2/degC", 4e-3)],
    corrected_as: Some(CorrectedAs::BiasPerKelvin),
    ..Page::SMOOTH
};

/// `mag-offset-temperature`.
pub const MAG: Page = Page {
    name: "mag-offset-temperature",
    physics: "The magnetometer's bridge offset moves with its temperature, where no set and reset pulses remove it.",
    equation: "y = n.m + k h(T - T0), h(d) = d (1 + c d)",
    source: "Anisotropic magnetoresistive bridges: 0.1 to 0.5 mG per degC without set and reset",
    excited_by: "temperature, in two attitudes",
    siblings: &["mag-scale-temperature", "hard-iron", "current-field"],
    confirm_by: "Heat in two opposite attitudes: the shift has the same sign in both.",
    common: false,
    sensors: &[Kind::Magnetometer],
    parameters: &[Symbol::signed("k", "uT/degC", 0.03)],
    corrected_as: Some(CorrectedAs::BiasPerKelvin),
    ..Page::SMOOTH
};
