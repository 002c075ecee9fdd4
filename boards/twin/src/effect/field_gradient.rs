//! Field gradient: iron or a magnet standing in the room makes the field differ from place to place.
//!
//! Without currents or iron inside the volume the gradient is symmetric and traceless (div B = 0, curl B = 0): five numbers. A
//! description tells where accelerometers are; a magnetometer is somewhere on the same plate, on all plates at the same place.
//! The place p of a recorded motion counts from the middle of the record ([`crate::motion::Recorded`]): there the field is as told.

use nalgebra::{Matrix3, Vector3};

use super::{Effect, Page, Scope, Site, Symbol};
use crate::channel::{Chain, Kind};

/// `field-gradient`.
pub struct FieldGradient;

const PAGE: Page = Page {
    name: "field-gradient",
    physics: "The field of the room differs from place to place; the plates, and the places the unit is carried to, see it differently.",
    equation: "y = n.C_bn (field_n + G (C_nb (r + o) + p)), G symmetric and traceless in n, o along the plate's axes",
    source: "Indoors 1 to 30 uT/m",
    excited_by: "turning with the sensors off centre, or carrying the unit about",
    siblings: &["hard-iron", "field-model", "soft-iron"],
    confirm_by: "Carry the unit by 0.2 m without turning it.",
    scope: Scope::Unit,
    sensors: &[Kind::Magnetometer],
    parameters: &[
        Symbol::signed("gxx", "uT/m", 5.0),
        Symbol::signed("gyy", "uT/m", 5.0),
        Symbol::signed("gxy", "uT/m", 5.0),
        Symbol::signed("gxz", "uT/m", 5.0),
        Symbol::signed("gyz", "uT/m", 5.0),
        Symbol::signed("ox", "m", 0.02),
        Symbol::signed("oy", "m", 0.02),
        Symbol::signed("oz", "m", 0.02),
    ],
    passes: true,
    ..Page::SMOOTH
};

impl Effect for FieldGradient {
    fn page(&self) -> &'static Page {
        &PAGE
    }

    fn act<'a>(&self, theta: &'a [f64], _variant: f64, site: &Site<'a>, chain: &mut Chain<'a>) {
        let &[xx, yy, xy, xz, yz, ox, oy, oz] = theta else {
            return;
        };
        let gradient_n = Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, -xx - yy);
        let axes_b = [1.0, 2.0, 3.0].map(|which| site.plate_axis_b(which).unwrap_or_default());
        let aside_b: Vector3<f64> = axes_b
            .iter()
            .zip([ox, oy, oz])
            .map(|(axis_b, aside)| axis_b * aside)
            .sum();
        let (axis_b, place_b) = (site.channel.axis_b, site.unit.place_b(site.channel) + aside_b);
        chain.add(move |feel, _| {
            let place_n = feel.position_n + feel.q_nb * place_b;
            axis_b.dot(&feel.to_b(gradient_n * place_n))
        });
    }
}
