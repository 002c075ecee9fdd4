//! High-pass left on: the accelerometer's filter for motion detection takes gravity away.

use core::f64::consts::TAU;

use super::{Effect, Nature, Page, Scope, Site};
use crate::channel::{Chain, Kind};

/// `accel-high-pass`.
pub struct HighPass;

/// \[Hz\] corners to begin from: of those of the LIS331HH (CTRL_REG2, table of HPCF1 and HPCF0; in proportion to the data rate,
/// so lower in its low-power modes) as many as a log of 5 Hz tells apart.
const CORNERS_HZ: [f64; 9] = [0.03, 0.06, 0.125, 0.25, 0.5, 1.0, 2.0, 5.0, 20.0];

const PAGE: Page = Page {
    name: "accel-high-pass",
    physics: "The accelerometer's high-pass filter is on: what stands still, gravity above all, disappears.",
    equation: "tau y' + y = tau (n.f)'",
    source: "LIS331HH data sheet, CTRL_REG2 bit FDS",
    excited_by: "rest",
    siblings: &["stuck-channel"],
    confirm_by: "Read CTRL_REG2; tilt the unit by hand and watch the reading die away.",
    nature: Nature::Discrete,
    scope: Scope::Plate,
    common: true,
    sensors: &[Kind::Accelerometer],
    ..Page::SMOOTH
};

impl Effect for HighPass {
    fn page(&self) -> &'static Page {
        &PAGE
    }

    fn act<'a>(&self, _theta: &'a [f64], variant: f64, _site: &Site<'a>, chain: &mut Chain<'a>) {
        chain.high_pass_s = Some(1.0 / (TAU * variant));
    }

    fn told(&self, variant: f64) -> Option<String> {
        Some(format!("with a corner of {variant:.3} Hz"))
    }

    /// Corners \[Hz\].
    fn variants(&self, _starts_s: &[f64]) -> Vec<f64> {
        CORNERS_HZ.to_vec()
    }

    fn has_values_between(&self) -> bool {
        true
    }
}
