//! Plate flexing: a plate bends under load and carries its sensors' axes along.

use nalgebra::Vector3;

use super::{Effect, Page, Scope, Site, Symbol};
use crate::channel::{Aim, Chain, Kind};

/// The variant of a load that is the force; its unit of compliance is then rad per m/s2.
const OF_FORCE: f64 = 1.0;

/// Of one that is the force on the face of the plate, along its third axis, in the same unit: a board on stand-offs is stiff
/// along itself.
const ON_FACE: f64 = 2.0;

/// `plate-flexing`.
pub struct PlateFlexing;

const PAGE: Page = Page {
    name: "plate-flexing",
    physics: "Centrifugal or inertial load bends a plate; its axes turn by an angle in proportion to it.",
    equation: "y = (n + phi x n).v, phi = c |w|^2, c |f| or c f.n_plate",
    source: "Thin boards on stand-offs: 0.1 to 0.5 deg",
    excited_by: "high rate or acceleration",
    // Where there is no force but weight, its size is one at all times: the plate is turned, or all are with the unit.
    siblings: &["lever-arm", "accel-nonlinearity", "plate-rotation", "mounting"],
    confirm_by: "Spin at two rates with the board stiffened and not.",
    scope: Scope::Plate,
    sensors: &[Kind::Accelerometer, Kind::Gyro, Kind::Magnetometer],
    parameters: &[
        Symbol::signed("cx", "rad s^2/rad^2", 5e-4),
        Symbol::signed("cy", "rad s^2/rad^2", 5e-4),
        Symbol::signed("cz", "rad s^2/rad^2", 5e-4),
    ],
    ..Page::SMOOTH
};

impl Effect for PlateFlexing {
    fn page(&self) -> &'static Page {
        &PAGE
    }

    fn act<'a>(&self, theta: &'a [f64], variant: f64, site: &Site<'a>, chain: &mut Chain<'a>) {
        let compliance = Vector3::from_column_slice(theta);
        let aim = chain.aim;
        let face_b = site.plate_axis_b(3.0).unwrap_or_default();
        chain.add(move |feel, _| {
            let load = match variant {
                OF_FORCE => feel.force_b.norm(),
                ON_FACE => feel.force_b.dot(&face_b),
                _ => feel.rate_b.norm_squared(),
            };
            let turned = Aim {
                axis_b: (compliance * load).cross(&aim.axis_b),
                ..aim
            };
            turned.input(feel)
        });
    }

    fn told(&self, variant: f64) -> Option<String> {
        let load = match variant {
            OF_FORCE => "the specific force",
            ON_FACE => "the specific force on its face",
            _ => "the square of the rate",
        };
        Some(format!("with {load}"))
    }

    /// With the square of the rate, with the force, with the force on the face.
    fn variants(&self, _starts_s: &[f64]) -> Vec<f64> {
        vec![0.0, OF_FORCE, ON_FACE]
    }
}
