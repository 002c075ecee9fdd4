//! Read skew: the sensors are read one after the other, further apart or closer than the description has it.

use super::{CorrectedAs, Effect, Page, Scope, Site, Symbol};
use crate::channel::{Chain, Kind};

/// `read-skew`.
pub struct ReadSkew;

const PAGE: Page = Page {
    name: "read-skew",
    physics: "The sensors are read one after the other; each is later than described in proportion to its place in the order.",
    equation: "y_k(t) = x(t + k delta), k the place of the sensor in the reading order",
    source: "Thesis 002: 118.8 ms for sixteen sensors, 7.4 ms each",
    excited_by: "dynamics",
    siblings: &[
        "gyro-latency",
        "accel-latency",
        "mag-latency",
        "latency",
        "gyro-lag",
        "reference-lag",
    ],
    confirm_by: "A log with slot times, or a logic analyser on the buses.",
    scope: Scope::Unit,
    sensors: &[Kind::Accelerometer, Kind::Gyro, Kind::Magnetometer],
    parameters: &[Symbol::signed("delta", "s", 3e-3)],
    corrected_as: Some(CorrectedAs::Skew),
    ..Page::SMOOTH
};

impl Effect for ReadSkew {
    fn page(&self) -> &'static Page {
        &PAGE
    }

    fn act<'a>(&self, theta: &'a [f64], _variant: f64, site: &Site<'a>, chain: &mut Chain<'a>) {
        let late_s = theta[0] * site.read_position() as f64;
        chain.read_late(move |_| late_s);
    }
}
