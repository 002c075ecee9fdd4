//! Mounting: the unit sits turned on what carries it, so that all its sensors are turned together.

use nalgebra::{UnitQuaternion, Vector3};

use super::{Effect, Page, Scope, Site, Symbol};
use crate::channel::{Chain, Kind};

/// `mounting`.
pub struct Mounting;

const PAGE: Page = Page {
    name: "mounting",
    physics: "The unit is turned against the body whose attitude the reference tells: one rotation explains all channels.",
    equation: "v_unit = R(phi)' v_b for every vector",
    source: "Brackets and pins: 0.2 to 1 deg",
    excited_by: "any motion",
    siblings: &[
        "plate-rotation",
        "gyro-misalignment",
        "accel-misalignment",
        "table-tilt",
    ],
    confirm_by: "Turn the unit by 180 deg in its mounting: the angle changes sign.",
    scope: Scope::Unit,
    sensors: &[Kind::Accelerometer, Kind::Gyro, Kind::Magnetometer],
    parameters: &[
        Symbol::signed("rx", "rad", 0.01),
        Symbol::signed("ry", "rad", 0.01),
        Symbol::signed("rz", "rad", 0.01),
    ],
    ..Page::SMOOTH
};

impl Effect for Mounting {
    fn page(&self) -> &'static Page {
        &PAGE
    }

    fn act<'a>(&self, theta: &'a [f64], _variant: f64, _site: &Site<'a>, chain: &mut Chain<'a>) {
        let turn = UnitQuaternion::from_scaled_axis(Vector3::from_column_slice(theta));
        chain.aim.axis_b = turn * chain.aim.axis_b;
        chain.aim.lever_m = turn * chain.aim.lever_m;
    }
}
