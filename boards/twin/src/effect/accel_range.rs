//! Wrong full scale: the accelerometer's range register is not what the ground thinks, so its counts mean 2, 4 or 16 times as
//! much or as little, or it clips early.

use super::{Effect, Nature, Page, Scope, Site};
use crate::channel::{Chain, Kind};

/// `accel-range`.
pub struct AccelRange;

/// What a count means, as a multiple of what it is taken for: the three ranges of the part, and the shift by four bits of its
/// left-justified registers, done twice or not at all.
const FACTORS: [f64; 6] = [2.0, 4.0, 0.5, 0.25, 16.0, 1.0 / 16.0];
/// [m/s2] of 6 g and 12 g: limits, as negative variants.
const LIMITS: [f64; 2] = [-58.8399, -117.6798];

const PAGE: Page = Page {
    name: "accel-range",
    physics: "The accelerometer is set to another full scale than described: its counts mean a multiple, or it clips early.",
    equation: "y = (n.f + b)/factor, or clip(n.f + b, +-R)",
    source: "LIS331HH data sheet, CTRL_REG4: 6, 12, 24 g; 3, 6, 12 mg per digit",
    excited_by: "rest; more than the limit",
    siblings: &["accel-scale"],
    confirm_by: "Gravity at rest reads a half, a fourth, twice or four times.",
    nature: Nature::Discrete,
    scope: Scope::Plate,
    common: true,
    sensors: &[Kind::Accelerometer],
    ..Page::SMOOTH
};

impl Effect for AccelRange {
    fn page(&self) -> &'static Page {
        &PAGE
    }

    fn act<'a>(&self, _theta: &'a [f64], variant: f64, _site: &Site<'a>, chain: &mut Chain<'a>) {
        chain.then(move |_, readings| {
            for reading in readings {
                *reading = if variant > 0.0 {
                    *reading / variant
                } else {
                    reading.clamp(variant, -variant)
                };
            }
        });
    }

    fn told(&self, variant: f64) -> Option<String> {
        Some(match variant {
            factor if factor > 0.0 => format!("readings are divided by {factor}"),
            limit => format!("readings end at {:.0} m/s2", -limit),
        })
    }

    /// Factors, and limits [m/s2] negated.
    fn variants(&self, _starts_s: &[f64]) -> Vec<f64> {
        FACTORS.into_iter().chain(LIMITS).collect()
    }
}
