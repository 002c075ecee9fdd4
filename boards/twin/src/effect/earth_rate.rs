//! Earth rate: the gyros feel the Earth turn. The twin knows it; a gap of this shape says the latitude or the north is wrong.

use super::{Effect, Page, Scope, Site, Symbol};
use crate::channel::{Chain, Kind};

/// `earth-rate`.
pub struct EarthRate;

const PAGE: Page = Page {
    name: "earth-rate",
    physics: "The rate of the Earth is left out, counted twice, or seen at another latitude.",
    equation: "y = n.w + e n.(C_bn Omega_n)",
    source: "IERS: 15.041 deg/h",
    excited_by: "hours, or many attitudes",
    siblings: &["gyro-bias"],
    confirm_by: "Eight attitudes of minutes each, north and south: the shift follows the heading.",
    scope: Scope::Unit,
    sensors: &[Kind::Gyro],
    parameters: &[Symbol::signed("e", "1", 1.0)],
    ..Page::SMOOTH
};

impl Effect for EarthRate {
    fn page(&self) -> &'static Page {
        &PAGE
    }

    fn act<'a>(&self, theta: &'a [f64], _variant: f64, site: &Site<'a>, chain: &mut Chain<'a>) {
        let (part, axis_b, earth_n) = (theta[0], site.channel.axis_b, site.environment.earth_rate_n());
        chain.add(move |feel, _| part * axis_b.dot(&feel.to_b(earth_n)));
    }
}
