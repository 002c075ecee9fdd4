//! Saturation: the gyro is set to a smaller range than described, or something behind it clips.
//!
//! A register clips at once; an amplifier or a converter bends some percent before its limit. Both are Rapp's law (C. Rapp, "Effects
//! of HPA-nonlinearity on a 4-DPSK/OFDM-signal", 1991): `y = x (1 + |x/R|^n)^(-1/n)`, which clips for a large n.

use core::f64::consts::PI;

use super::{Effect, Nature, Page, Site, Symbol};
use crate::channel::{Chain, Kind};

/// `gyro-saturation`.
pub struct Saturation;

/// [deg/s] the least limit tried, and of how many: each is a twelfth above the one before, up to 386. The ADIS16265's largest
/// range is 320 (data sheet), and it reads a little beyond.
const LEAST_DEG: f64 = 20.0;
const LIMITS: i32 = 38;

/// n where the knee is 0: at the limit a reading is 2 % short. A knee of 1 divides it by e: 11 is as soft as amplifiers are. A knee of
/// -1 multiplies it: 80 clips.
const SHARPNESS: f64 = 30.0;

const PAGE: Page = Page {
    name: "gyro-saturation",
    physics: "The gyro is set to a smaller range than described: faster turns read as the limit, and turns near it a little short.",
    equation: "y = n.w (1 + |n.w/R|^n)^(-1/n), n = 30 exp(-knee)",
    source: "ADIS16265 data sheet: 80, 160, 320 deg/s; Rapp 1991 for the knee",
    excited_by: "rates beyond the range",
    siblings: &["gyro-nonlinearity"],
    confirm_by: "Read the register of the range (ADIS16265: SENS_AVG); the top of the readings is flat.",
    nature: Nature::Discrete,
    common: true,
    sensors: &[Kind::Gyro],
    parameters: &[Symbol::signed("knee", "1", 1.0)],
    ..Page::SMOOTH
};

/// Rapp's law.
fn clipped(rate: f64, limit: f64, n: f64) -> f64 {
    let part = (rate / limit).abs();
    // The power of the smaller of part and 1/part, which cannot overflow.
    let short = (1.0 + part.min(1.0 / part).powf(n)).powf(-1.0 / n);
    short * rate.clamp(-limit, limit)
}

impl Effect for Saturation {
    fn page(&self) -> &'static Page {
        &PAGE
    }

    fn act<'a>(&self, theta: &'a [f64], variant: f64, _site: &Site<'a>, chain: &mut Chain<'a>) {
        let limit = variant * PI / 180.0;
        // Nothing is told of the knee where only aim and place are asked for.
        let n = SHARPNESS * (-theta.first().copied().unwrap_or(0.0)).exp();
        chain.then(move |_, readings| {
            for reading in readings {
                *reading = clipped(*reading, limit, n);
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_clips_as_sharply_as_n_says() {
        for rate in [0.0, 1e-9, 0.3, -0.8, 1.0, -1.2, 50.0] {
            // Rapp's law as it is printed, where that does not overflow.
            let printed = |n: f64| rate / (1.0 + f64::abs(rate / 0.9).powf(n)).powf(1.0 / n);
            assert!((clipped(rate, 0.9, 14.0) - printed(14.0)).abs() < 1e-12, "{rate}");
            assert!((clipped(rate, 0.9, 1e4) - rate.clamp(-0.9, 0.9)).abs() < 1e-4, "{rate}");
        }
        assert!((clipped(1e30, 0.9, 200.0) - 0.9).abs() < 1e-12);
    }
}
