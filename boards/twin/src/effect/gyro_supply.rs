//! Supply sensitivity: the zero moves with the supply voltage, which sags along the log or steps with a load.
//!
//! No packet carries the voltage, so its course is tried: a ramp over the whole log (a battery), or a step (a load). Neither is
//! straight: a battery sags faster or slower as it empties, and after a step its electrodes follow (the second time constant of
//! the usual two-branch model of a cell, tens of seconds).

use super::{Effect, Page, Site, Symbol, onsets};
use crate::channel::{Chain, Kind};

/// The variant that is a ramp.
const RAMP: f64 = -1.0;

/// \[s\] in which electrodes follow a load.
const FOLLOWING_S: f64 = 15.0;

/// `gyro-supply`.
pub struct GyroSupply;

const PAGE: Page = Page {
    name: "gyro-supply",
    physics: "The gyro's zero follows its supply voltage.",
    equation: "y = n.w + k dV v(t), v = x + b x (x - 1) over the log, x from 0 to 1, or 1 - b exp(-t/15 s) after a step",
    source: "Gyros of this class: 0.5 deg/s per V",
    excited_by: "a sagging battery, load steps",
    siblings: &["gyro-bias", "gyro-warm-up", "gyro-bias-walk", "gyro-bias-temperature"],
    confirm_by: "Read SUPPLY_OUT, or run from a bench supply and step it by 0.2 V.",
    sensors: &[Kind::Gyro],
    parameters: &[Symbol::signed("k_dV", "rad/s", 2e-3), Symbol::signed("b", "1", 0.2)],
    ..Page::SMOOTH
};

impl Effect for GyroSupply {
    fn page(&self) -> &'static Page {
        &PAGE
    }

    fn act<'a>(&self, theta: &'a [f64], variant: f64, site: &Site<'a>, chain: &mut Chain<'a>) {
        let (shift, bend) = (theta[0], theta[1]);
        let (from_s, to_s) = site.log_s;
        let ramp = move |t_s: f64| {
            let part = (t_s - from_s) / (to_s - from_s).max(f64::MIN_POSITIVE);
            part + bend * part * (part - 1.0)
        };
        let step = move |since_s: f64| match since_s >= 0.0 {
            true => 1.0 - bend * (-since_s / FOLLOWING_S).exp(),
            false => 0.0,
        };
        chain.add(move |feel, _| match variant {
            RAMP => shift * ramp(feel.t_s),
            onset_s => shift * step(feel.t_s - onset_s),
        });
    }

    fn told(&self, variant: f64) -> Option<String> {
        Some(match variant {
            RAMP => "a ramp over the log".to_owned(),
            onset_s => format!("a step at {onset_s:.0} s"),
        })
    }

    /// A ramp, then onsets \[s\].
    fn variants(&self, starts_s: &[f64]) -> Vec<f64> {
        core::iter::once(RAMP).chain(onsets(starts_s)).collect()
    }
}
