//! Linear g-sensitivity: the vibrating mass of the gyro also yields to acceleration.

use nalgebra::Vector3;

use super::{Effect, Page, Site, Symbol};
use crate::channel::{Chain, Kind};

/// `gyro-g-sensitivity`.
pub struct GSensitivity;

const PAGE: Page = Page {
    name: "gyro-g-sensitivity",
    physics: "Acceleration pulls on the gyro's vibrating mass and reads as a rate.",
    equation: "y = n.w + k.f, k a vector in b",
    source: "ADIS16265 data sheet: 0.2 deg/s per g",
    excited_by: "many attitudes at rest, or acceleration",
    siblings: &["gyro-bias", "gyro-g2"],
    confirm_by: "Six attitudes at rest: the shift turns over with the unit.",
    sensors: &[Kind::Gyro],
    parameters: &[
        Symbol::signed("kx", "(rad/s)/(m/s^2)", 2e-4),
        Symbol::signed("ky", "(rad/s)/(m/s^2)", 2e-4),
        Symbol::signed("kz", "(rad/s)/(m/s^2)", 2e-4),
    ],
    ..Page::SMOOTH
};

impl Effect for GSensitivity {
    fn page(&self) -> &'static Page {
        &PAGE
    }

    fn act<'a>(&self, theta: &'a [f64], _variant: f64, _site: &Site<'a>, chain: &mut Chain<'a>) {
        let k_b = Vector3::from_column_slice(theta);
        chain.add(move |feel, _| k_b.dot(&feel.force_b));
    }
}
