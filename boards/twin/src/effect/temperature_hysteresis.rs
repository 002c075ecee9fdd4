//! Thermal hysteresis: while the temperature moves, the die is not at the temperature the thermometer tells.
//!
//! A zero that follows the die's temperature, which follows the thermometer's with a time constant `tau`, is off by
//! `k_T (T - T_die) = k_T tau x`, where `x` is `dT/dt` through a low-pass of `tau`: the loop in a plot of shift against
//! temperature has this width.

use super::{Effect, Page, Site, Symbol};
use crate::channel::{Chain, Kind};

/// `gyro-temperature-hysteresis`.
pub struct TemperatureHysteresis;

const PAGE: Page = Page {
    name: "gyro-temperature-hysteresis",
    physics: "Warming and cooling, the gyro's zero is different at the same temperature.",
    equation: "y = n.w + k x, tau x' + x = dT/dt",
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

    fn act<'a>(&self, theta: &'a [f64], variant: f64, _site: &Site<'a>, chain: &mut Chain<'a>) {
        let k = theta[0];
        if variant > 0.0 {
            chain.add_thermal(variant, k);
        } else {
            chain.add(move |feel, _| k * feel.temperature_rate);
        }
    }

    fn told(&self, variant: f64) -> Option<String> {
        (variant > 0.0).then(|| format!("a die that follows in {variant:.0} s"))
    }

    /// Time constants [s]: at once, or as packages and boards follow.
    fn variants(&self, _starts_s: &[f64]) -> Vec<f64> {
        vec![0.0, 5.0, 15.0]
    }

    fn has_values_between(&self) -> bool {
        true
    }
}
