//! Cross-field: a field across an anisotropic magnetoresistive bridge changes how it answers along its axis.
//!
//! The bridge's sensitivity goes with one over the field that holds its film, which a field across adds to. The axis across
//! is the next one of the chip.

use super::{Effect, Page, Scope, Site, Symbol};
use crate::channel::{Chain, Kind};

/// \[uT\] the field that holds the film: 8 G.
const HOLDING_UT: f64 = 800.0;

/// `mag-cross-field`.
pub struct CrossField;

const PAGE: Page = Page {
    name: "mag-cross-field",
    physics: "A field across the bridge's axis changes its sensitivity.",
    equation: "y = u - k u v/H0, v the field along the next axis of the chip, H0 = 800 uT",
    source: "Honeywell application note AN-215; HMC1002: up to 11 mG, 2.4 deg of azimuth",
    excited_by: "turning through all attitudes",
    siblings: &["soft-iron", "field-gradient"],
    confirm_by: "Turn by 180 deg: it is even in the field, soft iron is odd.",
    scope: Scope::Plate,
    common: true,
    sensors: &[Kind::Magnetometer],
    parameters: &[Symbol::signed("k", "1", 0.3)],
    ..Page::SMOOTH
};

impl Effect for CrossField {
    fn page(&self) -> &'static Page {
        &PAGE
    }

    fn act<'a>(&self, theta: &'a [f64], _variant: f64, site: &Site<'a>, chain: &mut Chain<'a>) {
        let k = theta[0];
        let chip: Vec<usize> = site.triad();
        let Some(place) = chip.iter().position(|&index| index == site.index) else {
            return;
        };
        let across_b = site.unit.channels[chip[(place + 1) % chip.len()]].axis_b;
        chain.add(move |feel, input| -k * input * across_b.dot(&feel.field_b_ut) / HOLDING_UT);
    }
}
