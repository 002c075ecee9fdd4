//! Set and reset: from an event on, the film is magnetised the other way or only in part.

use super::{Effect, Page, Site, Symbol, onsets};
use crate::channel::{Chain, Kind};

/// `mag-set-reset`.
pub struct SetReset;

const PAGE: Page = Page {
    name: "mag-set-reset",
    physics: "A strong field or a missing set pulse has flipped or partly demagnetised the bridge: gain and offset step.",
    equation: "from t0 on: y = (1 + g) n.m + b",
    source: "HMC5883L data sheet, set/reset strap: gains down by 10 to 100 %",
    excited_by: "an event",
    siblings: &["hard-iron", "mag-scale-temperature", "current-field"],
    confirm_by: "Give a set pulse: it comes back at once.",
    sensors: &[Kind::Magnetometer],
    parameters: &[Symbol::signed("g", "1", 0.2), Symbol::signed("b", "uT", 1.0)],
    passes: true,
    ..Page::SMOOTH
};

impl Effect for SetReset {
    fn page(&self) -> &'static Page {
        &PAGE
    }

    fn act<'a>(&self, theta: &'a [f64], variant: f64, _site: &Site<'a>, chain: &mut Chain<'a>) {
        let (gain, offset) = (theta[0], theta[1]);
        chain.add(move |feel, input| f64::from(feel.t_s >= variant) * (gain * input + offset));
    }

    fn told(&self, variant: f64) -> Option<String> {
        Some(format!("from {variant:.0} s on"))
    }

    /// Onsets \[s\].
    fn variants(&self, starts_s: &[f64]) -> Vec<f64> {
        onsets(starts_s).collect()
    }
}
