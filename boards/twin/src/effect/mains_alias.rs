//! Mains alias: the field of the mains, sampled a few times a second, comes out as a slow drift.
//!
//! 60 Hz is twelve times 5 Hz: it lands at zero but for the errors of both clocks. The line itself is modelled, at its frequency
//! and at each channel's own instant, so the plates' phases come out right. Something slow that is no alias has one phase in all
//! of them (a frequency below zero here).

use nalgebra::Vector3;

use super::{Effect, Page, Scope, Site, Symbol, Wave};
use crate::channel::{Chain, Kind};

/// \[Hz\] how far the mains and the clock of the unit are off together.
const SPREAD_HZ: f64 = 0.03;

/// `mains-alias`.
pub struct MainsAlias;

const PAGE: Page = Page {
    name: "mains-alias",
    physics: "The alternating field of the mains is sampled so slowly that it looks like a slow change.",
    equation: "y = n.C_bn (a sin(2 pi f t) + c cos(2 pi f t)), f near 50 or 60 Hz",
    source: "0.1 to 2 uT near cables",
    excited_by: "cables, a sample rate that divides the mains frequency",
    siblings: &["hard-iron", "field-model"],
    confirm_by: "Change the sample rate by 1 %: it moves.",
    scope: Scope::Unit,
    sensors: &[Kind::Magnetometer],
    parameters: &[
        Symbol::signed("ax", "uT", 0.5),
        Symbol::signed("ay", "uT", 0.5),
        Symbol::signed("az", "uT", 0.5),
        Symbol::signed("cx", "uT", 0.5),
        Symbol::signed("cy", "uT", 0.5),
        Symbol::signed("cz", "uT", 0.5),
    ],
    passes: true,
    ..Page::SMOOTH
};

/// The line of a variant.
fn line(variant: f64) -> Wave {
    Wave {
        hz: variant.abs(),
        is_of_cycle: variant < 0.0,
    }
}

impl Effect for MainsAlias {
    fn page(&self) -> &'static Page {
        &PAGE
    }

    fn act<'a>(&self, theta: &'a [f64], variant: f64, site: &Site<'a>, chain: &mut Chain<'a>) {
        let (sine_n, cosine_n) = (
            Vector3::from_column_slice(&theta[..3]),
            Vector3::from_column_slice(&theta[3..]),
        );
        let axis_b = site.channel.axis_b;
        let (wave, slot_s) = (line(variant), site.channel.slot_s);
        chain.add(move |feel, _| {
            let (sin, cos) = wave.sine_cosine(feel.t_s, slot_s);
            axis_b.dot(&feel.to_b(sine_n * sin + cosine_n * cos))
        });
    }

    fn told(&self, variant: f64) -> Option<String> {
        Some(format!("at {variant:.3} Hz"))
    }

    /// Frequencies \[Hz\], as close as the log can tell apart.
    fn variants(&self, starts_s: &[f64]) -> Vec<f64> {
        let span_s = starts_s.last().unwrap_or(&0.0) - starts_s.first().unwrap_or(&0.0);
        let step_hz = (1.0 / span_s.max(1.0)).max(2.0 * SPREAD_HZ / 64.0);
        let steps = (SPREAD_HZ / step_hz) as i32;
        let around = |hz: f64| (-steps..=steps).map(move |k| hz + f64::from(k) * step_hz);
        around(60.0).chain(around(50.0)).collect()
    }

    fn wave(&self, variant: f64) -> Option<Wave> {
        Some(line(variant))
    }

    fn without_its_physics(&self, variant: f64) -> Option<f64> {
        Some(-variant)
    }

    /// Half a step off, a line has turned over at the end of the log.
    fn has_values_between(&self) -> bool {
        true
    }
}
