//! Axis order: the magnetometer's registers come as X, Z, Y, and its gain has eight settings; either is easily mistaken.

use emems::sensor::hmc5883l::Gain;

use super::{CorrectedAs, Effect, Nature, Page, Scope, Site};
use crate::channel::{Chain, Kind};

/// `mag-axis-order`.
pub struct AxisOrder;

/// The orders of three axes; the first is as described.
const ORDERS: [[usize; 3]; 6] = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];
/// Signed orders: six orders by eight signs. The variant is their number; the first is as described.
const SIGNED: u32 = 48;
/// Variants from [`SIGNED`] on are gains instead of the nominal one.
const NOMINAL_GAIN: Gain = Gain::PerGauss1090;

/// [counts/G]
fn counts(gain: Gain) -> f64 {
    f64::from(gain.counts_per_gauss())
}

const PAGE: Page = Page {
    name: "mag-axis-order",
    physics: "The magnetometer's axes are taken in the wrong order or sign, or its gain for another setting.",
    equation: "(x, y, z) = signed permutation of what the chip feels, or gain/1090 of it",
    source: "HMC5883L data sheet: output registers X, Z, Y; gain settings of CRB",
    excited_by: "any attitude",
    siblings: &["plate-rotation", "plate-swap"],
    confirm_by: "Point one axis after the other along the field.",
    nature: Nature::Discrete,
    scope: Scope::Plate,
    common: true,
    sensors: &[Kind::Magnetometer],
    corrected_as: Some(CorrectedAs::Chain),
    ..Page::SMOOTH
};

impl Effect for AxisOrder {
    fn page(&self) -> &'static Page {
        &PAGE
    }

    fn act<'a>(&self, _theta: &'a [f64], variant: f64, site: &Site<'a>, chain: &mut Chain<'a>) {
        let (number, chip) = (variant as u32, site.triad());
        if number >= SIGNED {
            let gain = Gain::ALL
                .get((number - SIGNED) as usize)
                .copied()
                .unwrap_or(NOMINAL_GAIN);
            chain.aim.axis_b *= counts(gain) / counts(NOMINAL_GAIN);
            return;
        }
        let order = ORDERS[(number / 8) as usize];
        let Some(place) = chip
            .iter()
            .position(|&index| index == site.index)
            .filter(|_| chip.len() == 3)
        else {
            return;
        };
        let sign = if number >> place & 1 == 1 { -1.0 } else { 1.0 };
        chain.aim.axis_b = site.unit.channels[chip[order[place]]].axis_b * sign;
    }

    fn told(&self, variant: f64) -> Option<String> {
        let number = variant as u32;
        if number >= SIGNED {
            let gain = Gain::ALL.get((number - SIGNED) as usize)?.counts_per_gauss();
            return Some(format!("the gain is that of {gain} counts per gauss"));
        }
        let (order, axes) = (ORDERS[(number / 8) as usize], ["x", "y", "z"]);
        let reads = |place: usize| {
            let sign = if number >> place & 1 == 1 { "-" } else { "" };
            format!("{} reads {sign}{}", axes[place], axes[order[place]])
        };
        Some((0..3).map(reads).collect::<Vec<_>>().join(", "))
    }

    /// All but the described order, then all but the nominal gain.
    fn variants(&self, _starts_s: &[f64]) -> Vec<f64> {
        let gains = (0..Gain::ALL.len()).filter(|&i| Gain::ALL[i] != NOMINAL_GAIN);
        (1..SIGNED)
            .map(f64::from)
            .chain(gains.map(|i| f64::from(SIGNED) + i as f64))
            .collect()
    }
}
