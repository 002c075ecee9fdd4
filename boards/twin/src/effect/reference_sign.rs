//! Reference sign: a command, a row or an axis of the reference has the wrong sign.

use nalgebra::Vector3;

use super::{Effect, Nature, Page, Scope, Site};
use crate::predict::{Chain, Kind};

/// `reference-sign`.
pub struct ReferenceSign;

/// Which components of the rate change sign: bits 0, 1, 2 are x, y, z of b.
const SIGNS: core::ops::Range<u32> = 1..8;
/// A log of at most this many rows is a table, whose rows may be wrong one by one: variants are then `8 row + signs`, rows
/// counted from one.
const MOST_ROWS: usize = 64;

const PAGE: Page = Page {
    name: "reference-sign",
    physics: "The reference has the wrong sign: of a commanded rate in one row, or of an axis throughout.",
    equation: "w_b with the sign of x, y or z reversed, on all rows or on one",
    source: "Thesis 000, Table 7.3: rows 7, 8, 11, 12 and 15; thesis 002, Table 4.1",
    excited_by: "rates of both signs",
    siblings: &["mag-axis-order", "gyro-misalignment", "plate-rotation"],
    confirm_by: "Turn by hand and watch both signs.",
    nature: Nature::Discrete,
    scope: Scope::Unit,
    sensors: &[Kind::Gyro],
    ..Page::SMOOTH
};

impl Effect for ReferenceSign {
    fn page(&self) -> &'static Page {
        &PAGE
    }

    fn act<'a>(&self, _theta: &'a [f64], variant: f64, site: &Site<'a>, chain: &mut Chain<'a>) {
        let (signs, row) = (variant as u32 % 8, (variant / 8.0).floor());
        let kept = Vector3::from_fn(|axis, _| if signs >> axis & 1 == 1 { -1.0 } else { 1.0 });
        if row == 0.0 {
            chain.aim.axis_b.component_mul_assign(&kept);
            return;
        }
        // The rows of a table stand at 0, 1, 2 s.
        let row_s = row - 1.0;
        let axis_b = chain.aim.axis_b;
        let slot_s = site.channel.slot_s;
        chain.add(move |feel, input| match (feel.t_s - slot_s - row_s).abs() < 0.5 {
            true => axis_b.component_mul(&kept).dot(&feel.rate_b) - input,
            false => 0.0,
        });
    }

    /// Signs on all rows, then, in a table, on each.
    fn variants(&self, starts_s: &[f64]) -> Vec<f64> {
        let rows = if starts_s.len() <= MOST_ROWS { starts_s } else { &[] };
        let rows = core::iter::once(0.0).chain(rows.iter().map(|start_s| start_s.round() + 1.0));
        rows.flat_map(|row| SIGNS.map(move |signs| 8.0 * row + f64::from(signs)))
            .collect()
    }
}
