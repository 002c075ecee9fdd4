//! Misalignment: the sensitive axis does not point where the description has it.

use super::{CorrectedAs, Effect, Page, Site, Symbol};
use crate::channel::{Chain, Kind};

/// The effects of this file, told apart by their pages.
pub struct Misalignment(pub &'static Page);

impl Effect for Misalignment {
    fn page(&self) -> &'static Page {
        self.0
    }

    fn act<'a>(&self, theta: &'a [f64], _variant: f64, site: &Site<'a>, chain: &mut Chain<'a>) {
        let [first, second] = site.channel.across();
        chain.aim.axis_b += first * theta[0] + second * theta[1];
    }
}

/// `gyro-misalignment`.
pub const GYRO: Page = Page {
    name: "gyro-misalignment",
    physics: "The gyro's sensitive axis is tilted from its nominal direction.",
    equation: "y = (n + e1 a1 + e2 a2).w, with e1 and e2 across n",
    source: "Thesis of the tetrahedron, Table 7.5: 1.5 to 10 deg as found; 0.2 to 1 deg by mounting",
    excited_by: "rates about three axes",
    siblings: &["mounting", "plate-rotation"],
    confirm_by: "Turn about an axis across the gyro's: what it reads is the tilt.",
    sensors: &[Kind::Gyro],
    parameters: &[Symbol::signed("a1", "rad", 0.01), Symbol::signed("a2", "rad", 0.01)],
    corrected_as: Some(CorrectedAs::Chain),
    ..Page::SMOOTH
};

/// `accel-misalignment`.
pub const ACCEL: Page = Page {
    name: "accel-misalignment",
    physics: "The accelerometer's axes are tilted, or not at right angles to each other.",
    equation: "y = (n + e1 a1 + e2 a2).f, with e1 and e2 across n",
    source: "0.3 to 1 deg by mounting; cross-axis sensitivity of the LIS331HH 2 %",
    excited_by: "a dozen attitudes",
    siblings: &["mounting", "plate-rotation", "accel-scale", "table-tilt"],
    confirm_by: "A dozen attitudes at rest: one axis must answer to gravity across it.",
    sensors: &[Kind::Accelerometer],
    parameters: &[Symbol::signed("a1", "rad", 0.01), Symbol::signed("a2", "rad", 0.01)],
    corrected_as: Some(CorrectedAs::Chain),
    ..Page::SMOOTH
};
