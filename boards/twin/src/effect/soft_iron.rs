//! Soft iron: iron near the sensors bends the field in proportion to it.

use nalgebra::Matrix3;

use super::{CorrectedAs, Effect, Page, Scope, Site, Symbol};
use crate::channel::{Chain, Kind};

/// `soft-iron`.
pub struct SoftIron;

const PAGE: Page = Page {
    name: "soft-iron",
    physics: "Permeable iron near the magnetometers bends the field: a sphere of readings becomes an ellipsoid.",
    equation: "y = n.(I + S) m, S symmetric in b",
    source: "1 to 5 % near steel",
    excited_by: "turning through all attitudes",
    siblings: &["mag-cross-field", "field-model", "mag-scale-temperature"],
    confirm_by: "Ellipsoid of a full turn about two axes, with the suspected part in and out.",
    scope: Scope::Plate,
    common: true,
    sensors: &[Kind::Magnetometer],
    parameters: &[
        Symbol::signed("sxx", "1", 0.02),
        Symbol::signed("syy", "1", 0.02),
        Symbol::signed("szz", "1", 0.02),
        Symbol::signed("sxy", "1", 0.02),
        Symbol::signed("sxz", "1", 0.02),
        Symbol::signed("syz", "1", 0.02),
    ],
    passes: true,
    corrected_as: Some(CorrectedAs::Chain),
    ..Page::SMOOTH
};

impl Effect for SoftIron {
    fn page(&self) -> &'static Page {
        &PAGE
    }

    fn act<'a>(&self, theta: &'a [f64], _variant: f64, _site: &Site<'a>, chain: &mut Chain<'a>) {
        let &[xx, yy, zz, xy, xz, yz] = theta else { return };
        chain.aim.axis_b += Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz) * chain.aim.axis_b;
    }
}
