//! Packet loss that nobody counted: from some packet on, the log's time is short.
//!
//! Losses that the counter shows are gaps, not errors. The step is free, so that a pause of any length is found; a lost
//! packet makes it a multiple of the cycle.

use super::{Effect, Needs, Page, Scope, Site, Symbol, onsets};
use crate::channel::{Chain, Kind};

/// `packet-loss`.
pub struct PacketLoss;

const PAGE: Page = Page {
    name: "packet-loss",
    physics: "Packets were lost without a trace in the counter, or the unit paused: from then on all is later than its time.",
    equation: "y(t) = x(t + dt) from t0 on",
    source: "One cycle, 0.2 s, a packet",
    excited_by: "a gap, with dynamics after it",
    siblings: &["clock-rate", "latency", "read-skew"],
    confirm_by: "Count the packets on the line with another receiver.",
    scope: Scope::Unit,
    sensors: &[Kind::Accelerometer, Kind::Gyro, Kind::Magnetometer, Kind::Thermometer],
    parameters: &[Symbol::signed("dt", "s", 0.2)],
    needs: Some(Needs::Counter),
    ..Page::SMOOTH
};

impl Effect for PacketLoss {
    fn page(&self) -> &'static Page {
        &PAGE
    }

    fn act<'a>(&self, theta: &'a [f64], variant: f64, _site: &Site<'a>, chain: &mut Chain<'a>) {
        let step_s = theta[0];
        chain.read_late(move |t_s| step_s * f64::from(t_s >= variant));
    }

    fn told(&self, variant: f64) -> Option<String> {
        Some(format!("from {variant:.0} s on"))
    }

    /// Any packet may be the next that is lost.
    fn happened(&self) -> Option<f64> {
        Some(f64::NEG_INFINITY)
    }

    /// Onsets \[s\].
    fn variants(&self, starts_s: &[f64]) -> Vec<f64> {
        onsets(starts_s).collect()
    }
}
