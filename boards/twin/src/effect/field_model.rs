//! Field model: the site's field is not the one assumed.

use nalgebra::Vector3;

use super::{Effect, Page, Scope, Site, Symbol};
use crate::channel::{Chain, Kind};

/// `field-model`.
pub struct FieldModel;

const PAGE: Page = Page {
    name: "field-model",
    physics: "The geomagnetic field of the site is not the assumed one: model error, the hour of the day, or the building.",
    equation: "m = C_bn (field_n + d_n)",
    source: "World Magnetic Model: 150 nT; diurnal 20 to 100 nT; microteslas in buildings",
    excited_by: "turning through all attitudes",
    siblings: &[
        "hard-iron",
        "soft-iron",
        "table-tilt",
        "field-gradient",
        "mag-scale-temperature",
        "mains-alias",
    ],
    confirm_by: "A proton magnetometer, or the same turns outdoors.",
    scope: Scope::Unit,
    sensors: &[Kind::Magnetometer],
    parameters: &[
        Symbol::signed("dn", "uT", 0.5),
        Symbol::signed("de", "uT", 0.5),
        Symbol::signed("dd", "uT", 0.5),
    ],
    // 65 uT, the strongest field at the Earth's surface: a case may have the field of another site. Whatever stands still in space beside a
    // known attitude is the field, however large.
    largest: 130.0,
    passes: true,
    ..Page::SMOOTH
};

impl Effect for FieldModel {
    fn page(&self) -> &'static Page {
        &PAGE
    }

    fn act<'a>(&self, theta: &'a [f64], _variant: f64, site: &Site<'a>, chain: &mut Chain<'a>) {
        let (change_n, axis_b) = (Vector3::from_column_slice(theta), site.channel.axis_b);
        chain.add(move |feel, _| axis_b.dot(&feel.to_b(change_n)));
    }
}
