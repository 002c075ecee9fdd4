//! Gravity value: the site's gravity is not the one assumed.

use nalgebra::Vector3;

use super::{Effect, Page, Scope, Site, Symbol};
use crate::channel::{Chain, Kind};

/// `gravity-value`.
pub struct GravityValue;

const PAGE: Page = Page {
    name: "gravity-value",
    physics: "Local gravity differs from the assumed: all accelerometers are off by one ratio.",
    equation: "f = C_bn (a_n - (0, 0, g + dg))",
    source: "9.780 to 9.832 m/s2 over the Earth",
    excited_by: "rest",
    siblings: &["accel-scale"],
    confirm_by: "Look the site's gravity up.",
    scope: Scope::Unit,
    sensors: &[Kind::Accelerometer],
    parameters: &[Symbol::signed("dg", "m/s^2", 0.02)],
    ..Page::SMOOTH
};

impl Effect for GravityValue {
    fn page(&self) -> &'static Page {
        &PAGE
    }

    fn act<'a>(&self, theta: &'a [f64], _variant: f64, site: &Site<'a>, chain: &mut Chain<'a>) {
        let (excess_n, axis_b) = (Vector3::new(0.0, 0.0, -theta[0]), site.channel.axis_b);
        chain.add(move |feel, _| axis_b.dot(&feel.to_b(excess_n)));
    }
}
