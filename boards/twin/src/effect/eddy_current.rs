//! Eddy currents: a conducting case that turns in the field makes currents that oppose the change.
//!
//! The change of the field in b is `-w x m`; currents that decay within `tau` hold the field back by `tau` times it. To first
//! order this is a delay of the magnetometers, and no motion tells the two apart.

use super::{Effect, Page, Scope, Site, Symbol};
use crate::predict::{Chain, Kind};

/// `eddy-current`.
pub struct EddyCurrent;

const PAGE: Page = Page {
    name: "eddy-current",
    physics: "Currents in the conducting case hold the field back while it turns.",
    equation: "y = n.(m + tau w x m)",
    source: "Spinning rockets: 3 deg and 0.1 deg/s of apparent motion (Rice 1979)",
    excited_by: "spin",
    siblings: &["mag-latency", "latency", "current-field"],
    confirm_by: "Another case, or a coil driven at rest.",
    scope: Scope::Unit,
    sensors: &[Kind::Magnetometer],
    parameters: &[Symbol::positive("tau", "s", 5e-3)],
    ..Page::SMOOTH
};

impl Effect for EddyCurrent {
    fn page(&self) -> &'static Page {
        &PAGE
    }

    fn act<'a>(&self, theta: &'a [f64], _variant: f64, site: &Site<'a>, chain: &mut Chain<'a>) {
        let (tau_s, axis_b) = (theta[0], site.channel.axis_b);
        chain.add(move |feel, _| tau_s * axis_b.dot(&feel.rate_b.cross(&feel.field_b_ut)));
    }
}
