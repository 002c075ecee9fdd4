//! Plate rotation: all sensors of a plate point elsewhere, together.

use core::f64::consts::PI;

use nalgebra::{Unit, UnitQuaternion, Vector3};

use super::{CorrectedAs, Effect, Page, Scope, Site, Symbol};
use crate::channel::{Chain, Kind};

/// `plate-rotation`.
pub struct PlateRotation;

const PAGE: Page = Page {
    name: "plate-rotation",
    physics: "A plate is mounted, or described, turned: its accelerometer, magnetometer and gyro point elsewhere together.",
    equation: "y = n.R(phi)' v for every sensor of the plate",
    source: "A degree by mounting; half a turn by mistake",
    excited_by: "any motion",
    siblings: &["mounting", "accel-misalignment", "gyro-misalignment"],
    confirm_by: "Look: a plate on its side, or washers under one edge.",
    scope: Scope::Plate,
    sensors: &[Kind::Accelerometer, Kind::Gyro, Kind::Magnetometer],
    parameters: &[
        Symbol::signed("rx", "rad", 0.02),
        Symbol::signed("ry", "rad", 0.02),
        Symbol::signed("rz", "rad", 0.02),
    ],
    passes: true,
    corrected_as: Some(CorrectedAs::Chain),
    ..Page::SMOOTH
};

impl Effect for PlateRotation {
    fn page(&self) -> &'static Page {
        &PAGE
    }

    fn act<'a>(&self, theta: &'a [f64], variant: f64, site: &Site<'a>, chain: &mut Chain<'a>) {
        let half_turn = match site.plate_axis_b(variant) {
            Some(axis_b) => UnitQuaternion::from_axis_angle(&Unit::new_normalize(axis_b), PI),
            None => UnitQuaternion::identity(),
        };
        let turn = UnitQuaternion::from_scaled_axis(Vector3::from_column_slice(theta)) * half_turn;
        chain.aim.axis_b = turn * chain.aim.axis_b;
    }

    fn told(&self, variant: f64) -> Option<String> {
        let axis = ["x", "y", "z"].get((variant as usize).checked_sub(1)?)?;
        Some(format!("beyond half a turn about the plate's {axis}"))
    }

    /// As described, or half a turn about an axis of the plate: 1, 2, 3.
    fn variants(&self, _starts_s: &[f64]) -> Vec<f64> {
        vec![0.0, 1.0, 2.0, 3.0]
    }
}
