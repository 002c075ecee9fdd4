//! Latency: what is logged at `t` is what was there at `t - tau`.

use super::{CorrectedAs, Effect, Page, Scope, Site, Symbol};
use crate::channel::{Chain, Kind};

/// The effects of this file, told apart by their pages.
pub struct Latency(pub &'static Page);

impl Effect for Latency {
    fn page(&self) -> &'static Page {
        self.0
    }

    fn act<'a>(&self, theta: &'a [f64], _variant: f64, _site: &Site<'a>, chain: &mut Chain<'a>) {
        let tau_s = theta[0];
        chain.read_late(move |_| -tau_s);
    }
}

const DELAY: Symbol = Symbol::positive("tau", "s", 0.02);

/// `latency`.
pub const ALL: Page = Page {
    name: "latency",
    physics: "The packet's time is later than the instants at which its values were true, by the same for all.",
    equation: "y(t) = x(t - tau)",
    source: "5 to 200 ms in units that stamp a packet when it is sent",
    excited_by: "dynamics",
    siblings: &[
        "reference-lag",
        "gyro-latency",
        "accel-latency",
        "mag-latency",
        "gyro-lag",
        "eddy-current",
        "read-skew",
        "packet-loss",
        "clock-rate",
    ],
    confirm_by: "A sine of about 1 Hz: every sensor lags by the same time.",
    scope: Scope::Unit,
    sensors: &[Kind::Accelerometer, Kind::Gyro, Kind::Magnetometer],
    parameters: &[DELAY],
    corrected_as: Some(CorrectedAs::Delay),
    ..Page::SMOOTH
};

/// `gyro-latency`.
pub const GYRO: Page = Page {
    name: "gyro-latency",
    physics: "The gyros' values are older than the others: they are averaged or queued before they are sent.",
    equation: "y(t) = x(t - tau)",
    source: "2 to 60 ms by filter and sample rate",
    excited_by: "dynamics",
    siblings: &["gyro-lag", "latency", "read-skew", "reference-lag"],
    confirm_by: "A sine sweep: a delay keeps the amplitude, a low-pass does not.",
    scope: Scope::Plate,
    common: true,
    sensors: &[Kind::Gyro],
    parameters: &[DELAY],
    corrected_as: Some(CorrectedAs::Delay),
    ..Page::SMOOTH
};

/// `accel-latency`.
pub const ACCEL: Page = Page {
    name: "accel-latency",
    physics: "The accelerometers' values are older than the others.",
    equation: "y(t) = x(t - tau)",
    source: "2 to 60 ms by output data rate",
    excited_by: "turning in gravity, or acceleration",
    siblings: &["latency", "read-skew", "reference-lag"],
    confirm_by: "A sine of about 1 Hz across the vertical: the accelerometers alone lag.",
    scope: Scope::Plate,
    common: true,
    sensors: &[Kind::Accelerometer],
    parameters: &[DELAY],
    corrected_as: Some(CorrectedAs::Delay),
    ..Page::SMOOTH
};

/// `mag-latency`.
pub const MAG: Page = Page {
    name: "mag-latency",
    physics: "The magnetometers' values are older than the others: their conversion is slow, or one behind.",
    equation: "y(t) = x(t - tau)",
    source: "HMC5883L data sheet: 6 ms a measurement, up to one period of 13 ms at 75 Hz",
    excited_by: "turning",
    siblings: &["eddy-current", "latency", "read-skew", "reference-lag"],
    confirm_by: "Spin faster: a delay keeps the amplitude, eddy currents take from it.",
    scope: Scope::Plate,
    common: true,
    sensors: &[Kind::Magnetometer],
    parameters: &[DELAY],
    corrected_as: Some(CorrectedAs::Delay),
    ..Page::SMOOTH
};
