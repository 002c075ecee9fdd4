//! Fields of currents: a motor or a line near the sensors adds a field that comes and goes with its current.
//!
//! Nobody logged the current, so its course is tried: with the turning rate (the table's or a wheel's motor), on while it turns,
//! on from an instant, or on and off again and again, as a transmitter with its beacon and a heater with its thermostat are.

use nalgebra::Vector3;

use super::{Effect, Page, Scope, Site, Symbol, onsets};
use crate::channel::{Chain, Kind};

const WITH_RATE: f64 = -1.0;
const WHILE_TURNING: f64 = -2.0;
const AGAIN: f64 = -3.0;
/// [rad/s] above which it turns: 1 deg/s.
const TURNING: f64 = 0.017;

/// `current-field`.
pub struct CurrentField;

const PAGE: Page = Page {
    name: "current-field",
    physics: "A current near the magnetometers (motor, wheel, transmitter) adds a field in proportion to it.",
    equation: "y = n.(m + k I(t)), I = |w|/(1 rad/s), or 1 while turning, or 1 from t0 on, or 1 in a part of each period",
    source: "1 to 30 mG by wiring",
    excited_by: "the motor on and off at rest",
    siblings: &["hard-iron", "eddy-current", "mag-offset-temperature"],
    confirm_by: "Motor on and off in one attitude.",
    scope: Scope::Plate,
    common: true,
    sensors: &[Kind::Magnetometer],
    parameters: &[
        Symbol::signed("kx", "uT", 1.0),
        Symbol::signed("ky", "uT", 1.0),
        Symbol::signed("kz", "uT", 1.0),
    ],
    passes: true,
    ..Page::SMOOTH
};

impl Effect for CurrentField {
    fn page(&self) -> &'static Page {
        &PAGE
    }

    fn act<'a>(&self, theta: &'a [f64], variant: f64, site: &Site<'a>, chain: &mut Chain<'a>) {
        let k = site.channel.axis_b.dot(&Vector3::from_column_slice(theta));
        chain.add(move |feel, _| {
            let rate = feel.rate_b.norm();
            k * match variant {
                WITH_RATE => rate,
                WHILE_TURNING => f64::from(rate > TURNING),
                AGAIN => 1.0,
                onset_s => f64::from(feel.t_s >= onset_s),
            }
        });
    }

    fn told(&self, variant: f64) -> Option<String> {
        Some(match variant {
            WITH_RATE => "with the turning rate".to_owned(),
            WHILE_TURNING => "while it turns".to_owned(),
            AGAIN => "on and off, again and again".to_owned(),
            onset_s => format!("from {onset_s:.0} s on"),
        })
    }

    fn repeats(&self, variant: f64) -> bool {
        variant == AGAIN
    }

    /// With the rate, while turning, again and again, then onsets \[s\].
    fn variants(&self, starts_s: &[f64]) -> Vec<f64> {
        [WITH_RATE, WHILE_TURNING, AGAIN]
            .into_iter()
            .chain(onsets(starts_s))
            .collect()
    }
}
