//! Lever arm: the accelerometers are not where the description has them, or the unit does not turn about its centre.

use nalgebra::Vector3;

use super::{CorrectedAs, Effect, Page, Scope, Site, Symbol};
use crate::channel::{Chain, Kind};

/// `lever-arm`.
pub struct LeverArm;

const PAGE: Page = Page {
    name: "lever-arm",
    physics: "An accelerometer is off its described place, or the unit turns about another point than its centre; what it \
              feels of the rotation changes with it.",
    equation: "f = f_c + w' x (r + dr) + w x (w x (r + dr))",
    source: "Rigid-body kinematics; 10 mm at 200 deg/s is 12 mg",
    excited_by: "fast spin and angular acceleration",
    siblings: &["accel-nonlinearity", "plate-flexing"],
    confirm_by: "Spin at two rates: the residual goes with the square of the rate, and turns with its direction.",
    scope: Scope::Plate,
    common: true,
    sensors: &[Kind::Accelerometer],
    parameters: &[
        Symbol::signed("dx", "m", 0.01),
        Symbol::signed("dy", "m", 0.01),
        Symbol::signed("dz", "m", 0.01),
    ],
    corrected_as: Some(CorrectedAs::Chain),
    ..Page::SMOOTH
};

impl Effect for LeverArm {
    fn page(&self) -> &'static Page {
        &PAGE
    }

    fn act<'a>(&self, theta: &'a [f64], _variant: f64, _site: &Site<'a>, chain: &mut Chain<'a>) {
        chain.aim.lever_m += Vector3::from_column_slice(theta);
    }
}
