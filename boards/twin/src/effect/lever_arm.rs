//! Lever arm: the accelerometers are not where the description has them, or the unit does not turn about its centre.

use nalgebra::Vector3;

use super::{Effect, Nature, Page, Scope, Site, Symbol};
use crate::predict::{Chain, Kind};

/// `lever-arm`.
pub struct LeverArm;

const fn offset(name: &'static str) -> Symbol {
    Symbol {
        name,
        unit: "m",
        prior_sigma: 0.01,
        signed: true,
    }
}

const PAGE: Page = Page {
    name: "lever-arm",
    physics: "An accelerometer is off its described place, or the unit turns about another point than its centre; what it \
              feels of the rotation changes with it.",
    equation: "f = f_c + w' x (r + dr) + w x (w x (r + dr))",
    source: "Rigid-body kinematics; 10 mm at 200 deg/s is 12 mg",
    excited_by: "fast spin and angular acceleration",
    siblings: &["accel-nonlinearity", "plate-flexing"],
    confirm_by: "Spin at two rates: the residual goes with the square of the rate, and turns with its direction.",
    nature: Nature::Smooth,
    scope: Scope::Plate,
    common: true,
    sensors: &[Kind::Accelerometer],
    parameters: &[offset("dx"), offset("dy"), offset("dz")],
};

impl Effect for LeverArm {
    fn page(&self) -> &'static Page {
        &PAGE
    }

    fn act<'a>(&self, theta: &'a [f64], _variant: f64, _site: &Site<'a>, chain: &mut Chain<'a>) {
        chain.aim.lever_m += Vector3::from_column_slice(theta);
    }
}
