//! Saturation: the gyro is set to a smaller range than described, or something behind it clips.

use core::f64::consts::PI;

use super::{Effect, Nature, Page, Site};
use crate::channel::{Chain, Kind};

/// `gyro-saturation`.
pub struct Saturation;

/// [deg/s] the least limit tried, and of how many: each is a twelfth above the one before, up to 386. The ADIS16265's largest
/// range is 320 (data sheet), and it reads a little beyond.
const LEAST_DEG: f64 = 20.0;
const LIMITS: i32 = 38;

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

    fn told(&self, variant: f64) -> Option<String> {
        Some(format!("at {variant:.1} deg/s"))
    }

    /// Limits [deg/s].
    fn variants(&self, _starts_s: &[f64]) -> Vec<f64> {
        (0..LIMITS)
            .map(|step| LEAST_DEG * (13.0 / 12.0_f64).powi(step))
            .collect()
    }

    fn has_values_between(&self) -> bool {
        true
    }
}
