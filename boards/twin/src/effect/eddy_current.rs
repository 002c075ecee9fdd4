//! Eddy currents: a conducting case that turns in the field makes currents that oppose the change.
//!
//! Currents that decay within `tau` make the field inside the case a first-order low-pass of the one outside, as the case sees
//! it. To first order this is a delay of the magnetometers; to second it takes amplitude away, `(tau w)^2 / 2` of what turns
//! with `w`, which only fast turning shows.

use super::{Effect, Page, Scope, Site, Symbol};
use crate::channel::{Chain, Kind};

/// `eddy-current`.
pub struct EddyCurrent;

const PAGE: Page = Page {
    name: "eddy-current",
    physics: "Currents in the conducting case hold the field back while it turns.",
    equation: "tau y' + y = n.m, in b",
    source: "Spinning rockets: 3 deg and 0.1 deg/s of apparent motion (Rice 1979)",
    excited_by: "spin",
    siblings: &["mag-latency", "latency", "current-field"],
    confirm_by: "Another case; or spin faster: currents take amplitude away, a delay does not.",
    scope: Scope::Unit,
    sensors: &[Kind::Magnetometer],
    parameters: &[Symbol::positive("tau", "s", 5e-3)],
    ..Page::SMOOTH
};

impl Effect for EddyCurrent {
    fn page(&self) -> &'static Page {
        &PAGE
    }

    fn act<'a>(&self, theta: &'a [f64], _variant: f64, _site: &Site<'a>, chain: &mut Chain<'a>) {
        chain.lag_s += theta[0];
    }
}
