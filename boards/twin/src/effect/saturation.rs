//! Saturation: the gyro is set to a smaller range than described, and clips.

use core::f64::consts::PI;

use super::{Effect, Nature, Page, Site};
use crate::predict::{Chain, Kind};

/// `gyro-saturation`.
pub struct Saturation;

/// [deg/s] the ranges of the ADIS16265, and what they clip at with their fourth of headroom (data sheet: 80 reads up to 100).
const RANGES_DEG: [f64; 6] = [80.0, 100.0, 160.0, 200.0, 320.0, 400.0];

const PAGE: Page = Page {
    name: "gyro-saturation",
    physics: "The gyro is set to a smaller range than described: faster turns read as the limit.",
    equation: "y = clip(n.w, +-R)",
    source: "ADIS16265 data sheet: 80, 160, 320 deg/s",
    excited_by: "rates beyond the range",
    siblings: &["gyro-nonlinearity"],
    confirm_by: "Read SENS_AVG; the top of the readings is flat.",
    nature: Nature::Discrete,
    common: true,
    sensors: &[Kind::Gyro],
    ..Page::SMOOTH
};

impl Effect for Saturation {
    fn page(&self) -> &'static Page {
        &PAGE
    }

    fn act<'a>(&self, _theta: &'a [f64], variant: f64, _site: &Site<'a>, chain: &mut Chain<'a>) {
        let limit = variant * PI / 180.0;
        chain.then(move |_, readings| {
            for reading in readings {
                *reading = reading.clamp(-limit, limit);
            }
        });
    }

    /// Limits [deg/s].
    fn variants(&self, _starts_s: &[f64]) -> Vec<f64> {
        RANGES_DEG.to_vec()
    }
}
