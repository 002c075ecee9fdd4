//! Hard iron: something magnetised is fixed to the unit.

use nalgebra::Vector3;

use super::{CorrectedAs, Effect, Page, Scope, Site, Symbol};
use crate::channel::{Chain, Kind};

/// `hard-iron`.
pub struct HardIron;

const PAGE: Page = Page {
    name: "hard-iron",
    physics: "Magnetised iron or a magnet turns with the unit and adds its own field, the same to all plates or more to the nearest.",
    equation: "y = n.(m + b), b in b",
    source: "5 to 100 mG by screws, batteries, connectors",
    excited_by: "turning through all attitudes",
    siblings: &[
        "field-model",
        "mag-offset-temperature",
        "current-field",
        "mag-set-reset",
        "mains-alias",
    ],
    confirm_by: "Turn in place: the shift turns with the unit, a field of the room does not.",
    scope: Scope::Plate,
    common: true,
    sensors: &[Kind::Magnetometer],
    parameters: &[
        Symbol::signed("bx", "uT", 2.0),
        Symbol::signed("by", "uT", 2.0),
        Symbol::signed("bz", "uT", 2.0),
    ],
    passes: true,
    // A magnet at a centimetre makes more than the Earth; the sigma is of screws, batteries and connectors.
    largest: 100.0,
    corrected_as: Some(CorrectedAs::Chain),
    ..Page::SMOOTH
};

impl Effect for HardIron {
    fn page(&self) -> &'static Page {
        &PAGE
    }

    fn act<'a>(&self, theta: &'a [f64], _variant: f64, site: &Site<'a>, chain: &mut Chain<'a>) {
        chain.bias += site.channel.axis_b.dot(&Vector3::from_column_slice(theta));
    }
}
