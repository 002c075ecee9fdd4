//! Coarse quantisation: low bits are missing, rounded or cut off, because a mode has fewer of them or a shift went wrong.

use super::spread::{IMPOSSIBLE, View};
use super::{Effect, Nature, Page};
use crate::part::signal::Noise;
use crate::predict::Kind;

/// `coarse-quantisation`.
pub struct CoarseQuantisation;

const PAGE: Page = Page {
    name: "coarse-quantisation",
    physics: "The low bits of the channel are missing: a low-power mode, or a shift too many.",
    equation: "y = round(x/q) q or floor(x/q) q, q = 2, 4, 8 or 16 counts",
    source: "LIS331HH data sheet: low-power modes; HMC5883L: 12 bits",
    excited_by: "rest",
    siblings: &["accel-hysteresis", "bit-fault"],
    confirm_by: "A histogram of the codes: only every second, fourth, eighth is there.",
    nature: Nature::Spread,
    common: true,
    sensors: &[Kind::Accelerometer, Kind::Gyro, Kind::Magnetometer, Kind::Thermometer],
    ..Page::SMOOTH
};

impl Effect for CoarseQuantisation {
    fn page(&self) -> &'static Page {
        &PAGE
    }

    fn log_likelihood(&self, theta: &[f64], variant: f64, views: &[View]) -> f64 {
        let _ = theta;
        let of = |view: &View| -> f64 {
            let q = view.channel.lsb * variant.abs().exp2();
            let sample = |(k, residual): (usize, f64)| {
                let code = view.measured[k] / q;
                if view.channel.bits.is_none() || (code - code.round()).abs() > 0.25 * view.channel.lsb / q {
                    return view.explained(IMPOSSIBLE, residual);
                }
                // Rounded, the value was within half a step; cut off, within the step above.
                let low = if variant > 0.0 { residual - 0.5 * q } else { residual };
                view.explained(view.within(low, low + q), residual)
            };
            view.residuals().map(sample).sum()
        };
        views.iter().map(of).sum()
    }

    fn disturb(&self, theta: &[f64], variant: f64, views: &[View], noise: Noise) -> Vec<Vec<f64>> {
        let _ = (theta, noise);
        let coarse = |view: &View| {
            let q = view.channel.lsb * variant.abs().exp2();
            let code = |value: f64| if variant > 0.0 { value.round() } else { value.floor() };
            view.measured.iter().map(|measured| code(measured / q) * q).collect()
        };
        views.iter().map(coarse).collect()
    }

    /// Bits that are missing; negative where they are cut off instead of rounded.
    fn variants(&self, _starts_s: &[f64]) -> Vec<f64> {
        (1..=4).flat_map(|bits| [f64::from(bits), -f64::from(bits)]).collect()
    }
}
