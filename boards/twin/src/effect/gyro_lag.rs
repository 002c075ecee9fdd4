//! Lag: another first-order low-pass, or filter taps nobody counted.

use super::{CorrectedAs, Effect, Page, Site, Symbol};
use crate::channel::{Chain, Kind};

/// `gyro-lag`.
pub struct GyroLag;

const PAGE: Page = Page {
    name: "gyro-lag",
    physics: "The gyro's filter is slower than described: taps were switched in, or the bandwidth is lower.",
    equation: "tau y' + y = n.w",
    source: "ADIS16265 data sheet, SENS_AVG: 2 to 60 ms by number of taps",
    excited_by: "steps of rate, or a sine above 0.5 Hz",
    siblings: &["gyro-latency", "latency", "read-skew"],
    confirm_by: "A sine sweep: the amplitude drops with the frequency; a delay would keep it.",
    common: true,
    sensors: &[Kind::Gyro],
    parameters: &[Symbol::signed("tau", "s", 0.015)],
    corrected_as: Some(CorrectedAs::Chain),
    ..Page::SMOOTH
};

impl Effect for GyroLag {
    fn page(&self) -> &'static Page {
        &PAGE
    }

    fn act<'a>(&self, theta: &'a [f64], _variant: f64, _site: &Site<'a>, chain: &mut Chain<'a>) {
        chain.lag_s += theta[0];
    }
}
