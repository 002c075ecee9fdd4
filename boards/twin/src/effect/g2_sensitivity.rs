//! Quadratic g-sensitivity: a shift with the square of the acceleration, as vibration leaves it too.

use super::{Effect, Page, Site, Symbol};
use crate::channel::{Chain, Kind};

/// `gyro-g2`.
pub struct G2Sensitivity;

const PAGE: Page = Page {
    name: "gyro-g2",
    physics: "The square of the acceleration shifts the gyro's zero; vibration does so on average.",
    equation: "y = n.w + k |f|^2",
    source: "Tactical rate sensors: 0.02 deg/s per g^2",
    excited_by: "more than one g, or vibration",
    siblings: &["gyro-bias", "gyro-g-sensitivity"],
    confirm_by: "Spin off centre: at one g alone it is a bias.",
    common: true,
    sensors: &[Kind::Gyro],
    parameters: &[Symbol::signed("k", "(rad/s)/(m/s^2)^2", 4e-6)],
    ..Page::SMOOTH
};

impl Effect for G2Sensitivity {
    fn page(&self) -> &'static Page {
        &PAGE
    }

    fn act<'a>(&self, theta: &'a [f64], _variant: f64, _site: &Site<'a>, chain: &mut Chain<'a>) {
        let k = theta[0];
        chain.add(move |feel, _| k * feel.force_b.norm_squared());
    }
}
