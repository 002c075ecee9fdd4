//! Swapped plates: two plates, or the same part of two plates, are wired to each other's place.

use super::{CorrectedAs, Effect, Nature, Page, Scope, Site};
use crate::channel::{Chain, Kind};

/// `plate-swap`.
pub struct PlateSwap;

const PAGE: Page = Page {
    name: "plate-swap",
    physics: "Two plates are plugged into each other's connector: each one's channels carry the other's values.",
    equation: "y_i = x_j, y_j = x_i",
    source: "Thesis 000: gyros SD-03 and SD-04 of Table 7.4 are exchanged",
    excited_by: "any attitude",
    siblings: &["plate-rotation", "mag-axis-order"],
    confirm_by: "Warm one plate with a finger and see which thermometer rises.",
    nature: Nature::Discrete,
    scope: Scope::Unit,
    sensors: &[Kind::Accelerometer, Kind::Gyro, Kind::Magnetometer],
    corrected_as: Some(CorrectedAs::Chain),
    ..Page::SMOOTH
};

/// Groups are told apart up to this many.
const GROUPS: usize = 16;
/// Which kinds are exchanged: all of the plate, or one.
const KINDS: [&[Kind]; 4] = [
    PAGE.sensors,
    &[Kind::Accelerometer],
    &[Kind::Gyro],
    &[Kind::Magnetometer],
];

impl Effect for PlateSwap {
    fn page(&self) -> &'static Page {
        &PAGE
    }

    fn act<'a>(&self, _theta: &'a [f64], variant: f64, site: &Site<'a>, chain: &mut Chain<'a>) {
        let number = variant as usize;
        let pair = [number % GROUPS, number / GROUPS % GROUPS];
        let groups = site.unit.groups();
        let Some(own) = pair
            .iter()
            .position(|&group| groups.get(group) == Some(&site.channel.group.as_str()))
        else {
            return;
        };
        if !KINDS[number / (GROUPS * GROUPS) % KINDS.len()].contains(&site.channel.sensor) {
            return;
        }
        let place = site.triad().iter().position(|&index| index == site.index);
        let other = groups
            .get(pair[1 - own])
            .map(|group| site.of_group(group, site.channel.sensor));
        if let (Some(place), Some(other)) = (place, other)
            && let Some(&index) = other.get(place)
        {
            let other = &site.unit.channels[index];
            (chain.aim.axis_b, chain.aim.lever_m) = (other.axis_b, other.lever_m);
        }
    }

    fn told(&self, variant: f64) -> Option<String> {
        let number = variant as usize;
        let pair = [number % GROUPS, number / GROUPS % GROUPS].map(|group| group + 1);
        let what = ["all sensors", "the accelerometers", "the gyros", "the magnetometers"];
        let what = what[number / (GROUPS * GROUPS) % KINDS.len()];
        Some(format!(
            "{what} of plates {} and {}, in the order of the file",
            pair[0], pair[1]
        ))
    }

    /// Pairs of up to four groups, whole or by kind: `first + 16 second + 256 kind`. Pairs that the unit has not change
    /// nothing.
    fn variants(&self, _starts_s: &[f64]) -> Vec<f64> {
        let pairs = (0..4_usize).flat_map(|first| (first + 1..4).map(move |second| first + GROUPS * second));
        let numbers = pairs.flat_map(|pair| (0..KINDS.len()).map(move |kinds| pair + GROUPS * GROUPS * kinds));
        numbers.map(|number| number as f64).collect()
    }
}
