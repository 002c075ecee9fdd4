//! What can be wrong with a trial's unit, its world or its record.
//!
//! Each [`Disturbance`] changes a [`Scene`] by physics written for this purpose, often richer than the one-parameter law
//! a library would fit: coefficients bend with temperature, delays jitter, plates differ. Its strength multiplies a typical
//! size; everything else is drawn. Names are those of verdicts; [`novel`] ones have none.
//!
//! Every effect of the library has one but `gyro-sine-response`: it is the law of fibre-optic gyros, which this unit has not
//! and for which no verdict on a unit whose gyros send codes has a name.

mod accelerometer;
mod gyro;
mod magnetometer;
pub mod novel;
mod reference;
mod stream;

use packets::channel::{CHANNELS, Quantity};
use twin::geometry::PLATES;

use crate::{draw::Draw, scene::Scene};

/// Something that may be wrong.
#[derive(Clone, Copy)]
pub struct Disturbance {
    /// Its name in verdicts; for a novel one, its name in the answer.
    pub name: &'static str,
    /// Whether it needs a temperature that swings.
    pub warm: bool,
    /// Whether its size is a strength; if not it is there or not.
    pub graded: bool,
    /// Whether it is random from sample to sample: its variance goes with the square of its strength.
    pub random: bool,
    /// Disturbs; says which channels it touches (indices into [`CHANNELS`]).
    pub apply: fn(&mut Scene, &mut Draw, f64) -> Vec<usize>,
}

const fn graded(name: &'static str, apply: fn(&mut Scene, &mut Draw, f64) -> Vec<usize>) -> Disturbance {
    Disturbance {
        name,
        warm: false,
        graded: true,
        random: false,
        apply,
    }
}

const fn warm(name: &'static str, apply: fn(&mut Scene, &mut Draw, f64) -> Vec<usize>) -> Disturbance {
    Disturbance {
        warm: true,
        ..graded(name, apply)
    }
}

const fn random(name: &'static str, apply: fn(&mut Scene, &mut Draw, f64) -> Vec<usize>) -> Disturbance {
    Disturbance {
        random: true,
        ..graded(name, apply)
    }
}

const fn gross(name: &'static str, apply: fn(&mut Scene, &mut Draw, f64) -> Vec<usize>) -> Disturbance {
    Disturbance {
        graded: false,
        ..graded(name, apply)
    }
}

/// All that have a name.
pub fn named() -> Vec<Disturbance> {
    [
        gyro::ALL,
        accelerometer::ALL,
        magnetometer::ALL,
        reference::ALL,
        stream::ALL,
    ]
    .concat()
}

/// The plates a disturbance of single sensors strikes: mostly one, else all.
fn plates(draw: &mut Draw) -> Vec<usize> {
    let one = draw.below(PLATES);
    let is_one = draw.chance(0.6);
    match draw.asked() {
        Some(asked) => vec![asked.plate],
        None if is_one => vec![one],
        None => (0..PLATES).collect(),
    }
}

/// The plate a disturbance of one plate strikes.
fn plate(draw: &mut Draw) -> usize {
    let one = draw.below(PLATES);
    draw.asked().map_or(one, |asked| asked.plate)
}

/// Channels of a quantity on some plates.
fn channels(quantity: Quantity, plates: &[usize]) -> Vec<usize> {
    (0..CHANNELS.len())
        .filter(|index| CHANNELS[*index].quantity == quantity && plates.contains(&CHANNELS[*index].plate))
        .collect()
}

/// The twenty-eight channels that move with the unit.
fn moving() -> Vec<usize> {
    (0..CHANNELS.len())
        .filter(|index| {
            matches!(
                CHANNELS[*index].quantity,
                Quantity::SpecificForce | Quantity::Field | Quantity::Rate
            )
        })
        .collect()
}

const ALL_PLATES: [usize; PLATES] = [0, 1, 2, 3];
