//! Table tilt: the reference's horizon is not horizontal.

use nalgebra::{UnitQuaternion, Vector3};

use super::{Effect, Page, Scope, Site, Symbol};
use crate::channel::{Chain, Kind};

/// `table-tilt`.
pub struct TableTilt;

const PAGE: Page = Page {
    name: "table-tilt",
    physics: "The table or the reference's navigation frame is tilted: gravity and field come from elsewhere, the same in n for all plates.",
    equation: "v_b = C_bn R(a_n, a_e, 0)' v_n for gravity and field",
    source: "Levelling: 0.05 to 0.5 deg",
    excited_by: "six attitudes",
    siblings: &["accel-bias", "accel-misalignment", "field-model", "mounting"],
    confirm_by: "A spirit level on the table.",
    scope: Scope::Unit,
    sensors: &[Kind::Accelerometer, Kind::Magnetometer],
    parameters: &[
        Symbol::signed("north", "rad", 5e-3),
        Symbol::signed("east", "rad", 5e-3),
    ],
    passes: true,
    ..Page::SMOOTH
};

impl Effect for TableTilt {
    fn page(&self) -> &'static Page {
        &PAGE
    }

    fn act<'a>(&self, theta: &'a [f64], _variant: f64, site: &Site<'a>, chain: &mut Chain<'a>) {
        let turn = UnitQuaternion::from_scaled_axis(Vector3::new(theta[0], theta[1], 0.0)).inverse();
        let of_n = match site.channel.sensor {
            Kind::Accelerometer => -site.environment.gravity_n(),
            _ => site.environment.field_n_ut,
        };
        let (change_n, axis_b) = (turn * of_n - of_n, site.channel.axis_b);
        chain.add(move |feel, _| axis_b.dot(&feel.to_b(change_n)));
    }
}
