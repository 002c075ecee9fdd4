//! Sine response of an open-loop fibre-optic gyro: its light interferes as the sine of the Sagnac phase.
//!
//! `sin(B u)/B` is smooth in `kappa = B^2`, which is the parameter, at zero and (as a hyperbolic sine) below it.

use super::{Effect, Needs, Page, Site, Symbol};
use crate::channel::{Chain, Kind};

/// [s^2/rad^2] usual size of kappa: `B^2`.
const KAPPA: f64 = 10.0;

/// [rad/s] where the sine of that size turns over, `pi / (2 B)`: a gyro is given a range within it, or its readings mean two rates.
pub(super) const TURNS_OVER_RAD_S: f64 = core::f64::consts::FRAC_PI_2 / 3.162_277_660_168_379_5;

/// sin(B u)/B for kappa = B^2. Near zero the quotient is its series, where sine and root lose digits.
fn sine(kappa: f64, u: f64) -> f64 {
    let square = kappa * u * u;
    if square.abs() < 1e-3 {
        // The next term is square^4/362880 of u.
        return u * (1.0 - square / 6.0 * (1.0 - square / 20.0 * (1.0 - square / 42.0)));
    }
    let root = square.abs().sqrt();
    u * if square > 0.0 { root.sin() } else { root.sinh() } / root
}

/// `gyro-sine-response`.
pub struct SineResponse;

const PAGE: Page = Page {
    name: "gyro-sine-response",
    physics: "An open-loop fibre-optic gyro answers with the sine of the Sagnac phase, not with the phase.",
    equation: "y = sin(B u)/B, u = n.w, kappa = B^2",
    source: "Thesis 000, section 3.2, and its Table 7.4: 0.1 to 1 % at 6 deg/s",
    excited_by: "three rates",
    siblings: &["gyro-nonlinearity", "gyro-scale"],
    confirm_by: "A staircase of rates up to the range: the answer turns over.",
    common: true,
    sensors: &[Kind::Gyro],
    parameters: &[Symbol::positive("kappa", "s^2/rad^2", KAPPA)],
    needs: Some(Needs::Light),
    ..Page::SMOOTH
};

impl Effect for SineResponse {
    fn page(&self) -> &'static Page {
        &PAGE
    }

    fn act<'a>(&self, theta: &'a [f64], _variant: f64, _site: &Site<'a>, chain: &mut Chain<'a>) {
        let kappa = theta[0];
        chain.add(move |_, input| sine(kappa, input) - input);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::predict::{emems, thesis_slot_s};

    #[test]
    fn a_gyro_that_sends_codes_or_turns_further_than_the_sine_has_none() {
        let gyros = |bits: Option<u32>, range: f64| {
            let mut unit = emems(thesis_slot_s);
            unit.channels.retain(|channel| channel.sensor == Kind::Gyro);
            for channel in &mut unit.channels {
                (channel.bits, channel.range) = (bits, [-range, range]);
            }
            Needs::Light.is_met(&unit)
        };
        // Fibre-optic gyros of thesis 000; a vibrating one in a nine-axis unit, 2000 deg/s; the ADIS16265.
        assert!(gyros(None, 0.3) && !gyros(None, 34.9) && !gyros(Some(14), 0.3));
    }
}
