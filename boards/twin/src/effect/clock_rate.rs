//! Clock rate: the unit's seconds are not the reference's.

use super::{Effect, Page, Scope, Site, Symbol};
use crate::channel::{Chain, Kind};

/// `clock-rate`.
pub struct ClockRate;

const PAGE: Page = Page {
    name: "clock-rate",
    physics: "The unit's clock runs fast or slow: its log drifts against the reference.",
    equation: "y(t) = x(t (1 + e))",
    source: "Crystals: 20 to 100 ppm; RC oscillators: 1 %",
    excited_by: "a long log with dynamics",
    siblings: &["packet-loss", "latency"],
    confirm_by: "Two marks far apart that both see.",
    scope: Scope::Unit,
    sensors: &[Kind::Accelerometer, Kind::Gyro, Kind::Magnetometer],
    parameters: &[Symbol::signed("e", "1", 1e-4)],
    ..Page::SMOOTH
};

impl Effect for ClockRate {
    fn page(&self) -> &'static Page {
        &PAGE
    }

    fn act<'a>(&self, theta: &'a [f64], _variant: f64, _site: &Site<'a>, chain: &mut Chain<'a>) {
        let rate = theta[0];
        chain.read_late(move |t_s| rate * t_s);
    }
}
