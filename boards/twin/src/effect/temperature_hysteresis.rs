//! Thermal hysteresis: while the temperature moves, the die is not at the temperature the thermometer tells.
//!
//! A zero that follows the die's temperature, which lags by `tau`, is off by `k_T tau dT/dt`: the loop in a plot of shift
//! against temperature has this width.

use super::{Effect, Page, Site, Symbol};
use crate::predict::{Chain, Kind};

/// `gyro-temperature-hysteresis`.
pub struct TemperatureHysteresis;

const PAGE: Page = Page {
    name: "gyro-temperature-hysteresis",
    physics: "Warming and cooling, the gyro's zero is different at the same temperature.",
    equation: "y = n.w + k dT/dt",
    source: "A cousin part (ADIS16460): up to 0.1 deg/s",
    excited_by: "a ramp of temperature up and down",
    siblings: &["gyro-bias-temperature", "gyro-warm-up"],
    confirm_by: "Plot the shift against temperature over a full cycle: it is a loop, not a line.",
    common: true,
    sensors: &[Kind::Gyro],
    parameters: &[Symbol::signed("k", "rad/degC", 0.05)],
    ..Page::SMOOTH
};

impl Effect for TemperatureHysteresis {
    fn page(&self) -> &'static Page {
        &PAGE
    }

    fn act<'a>(&self, theta: &'a [f64], _variant: f64, _site: &Site<'a>, chain: &mut Chain<'a>) {
        let k = theta[0];
        chain.add(move |feel, _| k * feel.temperature_rate);
    }
}
