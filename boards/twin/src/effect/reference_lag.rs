//! Reference lag: the truth instrument's record is late, so that the unit seems early.

use super::{Effect, Page, Scope, Site, Symbol};
use crate::channel::{Chain, Kind};

/// `reference-lag`.
pub struct ReferenceLag;

const PAGE: Page = Page {
    name: "reference-lag",
    physics: "The reference filters or stamps its record late; against it the unit reads ahead of time.",
    equation: "y(t) = x(t + tau)",
    source: "Attitude references: 10 to 100 ms",
    excited_by: "dynamics",
    siblings: &[
        "latency",
        "gyro-latency",
        "accel-latency",
        "mag-latency",
        "read-skew",
        "gyro-lag",
    ],
    confirm_by: "A second reference, or a mark that both see: a contact, a flash.",
    scope: Scope::Unit,
    sensors: &[Kind::Accelerometer, Kind::Gyro, Kind::Magnetometer],
    parameters: &[Symbol::positive("tau", "s", 0.03)],
    ..Page::SMOOTH
};

impl Effect for ReferenceLag {
    fn page(&self) -> &'static Page {
        &PAGE
    }

    fn act<'a>(&self, theta: &'a [f64], _variant: f64, _site: &Site<'a>, chain: &mut Chain<'a>) {
        let tau_s = theta[0];
        chain.read_late(move |_| tau_s);
    }
}
