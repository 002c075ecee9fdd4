//! Reference rate scale: the table turns faster than it says, or its encoder ripples.
//!
//! The gyros, and the lever arms with the square, feel the true rate; the Earth's share is not the table's.

use super::{Effect, Page, Scope, Site, Symbol};
use crate::predict::{Chain, Kind};

/// `reference-rate-scale`.
pub struct ReferenceRateScale;

const PAGE: Page = Page {
    name: "reference-rate-scale",
    physics: "The rate of the table is not what it reports: all gyros are off by one ratio.",
    equation: "y = n.(w + s w_table)",
    source: "Rate tables: 0.1 to 1 %; better ones 10 ppm",
    excited_by: "rates",
    siblings: &["gyro-scale"],
    confirm_by: "Whole turns against a stopwatch and an index mark.",
    scope: Scope::Unit,
    sensors: &[Kind::Gyro],
    parameters: &[Symbol::signed("s", "1", 5e-3)],
    ..Page::SMOOTH
};

impl Effect for ReferenceRateScale {
    fn page(&self) -> &'static Page {
        &PAGE
    }

    fn act<'a>(&self, theta: &'a [f64], _variant: f64, site: &Site<'a>, chain: &mut Chain<'a>) {
        let (scale, axis_b, earth_n) = (theta[0], site.channel.axis_b, site.environment.earth_rate_n());
        chain.add(move |feel, input| scale * (input - axis_b.dot(&feel.to_b(earth_n))));
    }
}
