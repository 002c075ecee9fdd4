//! Vibration rectification: what vibrates about zero leaves a mean, because the sensor is not linear.
//!
//! The log has no vibration meter, so its course is tried: with the square of the turning rate (bearings, motor), or on from
//! an instant.

use super::{Effect, Page, Site, Symbol, onsets};
use crate::channel::{Chain, Kind};

/// The variant that goes with the square of the rate.
const TURNING: f64 = -1.0;

/// `accel-vibration-rectification`.
pub struct VibrationRectification;

const PAGE: Page = Page {
    name: "accel-vibration-rectification",
    physics: "Vibration leaves a mean in the accelerometer.",
    equation: "y = n.f + k s^2, s^2 = (w/w0)^2, w0 = 1 rad/s; or on from an instant",
    source: "Capacitive accelerometers: mg under g of vibration",
    excited_by: "vibration switched on and off",
    siblings: &["accel-bias", "accel-hysteresis", "accel-nonlinearity"],
    confirm_by: "Motor on and off in one attitude.",
    sensors: &[Kind::Accelerometer],
    parameters: &[Symbol::signed("k", "m/s^2", 0.03)],
    passes: true,
    ..Page::SMOOTH
};

impl Effect for VibrationRectification {
    fn page(&self) -> &'static Page {
        &PAGE
    }

    fn act<'a>(&self, theta: &'a [f64], variant: f64, _site: &Site<'a>, chain: &mut Chain<'a>) {
        let k = theta[0];
        chain.add(move |feel, _| match variant {
            TURNING => k * feel.rate_b.norm_squared(),
            onset_s => k * f64::from(feel.t_s >= onset_s),
        });
    }

    fn told(&self, variant: f64) -> Option<String> {
        Some(match variant {
            TURNING => "with the square of the rate".to_owned(),
            onset_s => format!("from {onset_s:.0} s on"),
        })
    }

    /// With the turning rate, then onsets \[s\].
    fn variants(&self, starts_s: &[f64]) -> Vec<f64> {
        core::iter::once(TURNING).chain(onsets(starts_s)).collect()
    }
}
