//! What is known of a log before there is a motion.
//!
//! In: a [`Flight`]. Out: [`Beforehand`]: what codes and axes say by themselves, packets that were lost, and the part that a motion is made
//! without. All of it decides what a motion is made of, in the fit windows and in the held-out ones alike.

use twin::{
    effect::{Cause, Locality, by_name},
    predict::UnitDescription,
};

use crate::{
    input::case::CaseError,
    parity::{
        bending,
        codes::{self, Finding},
        flight::Flight,
        followed::Beforehand,
        garbled,
        lost::{self, Loss, Losses},
        taken_out::taken_out,
        wired,
    },
};

/// The effect's name in the library.
const PACKET_LOSS: &str = "packet-loss";

/// Of a flight.
///
/// # Errors
/// When the unit's description names an effect there is not.
pub fn look(flight: &Flight, withheld: &[String]) -> Result<Beforehand, CaseError> {
    let mut found = codes::look_along(&flight.log, &flight.whole, &flight.unit);
    let is_known = |finding: &Finding| withheld.iter().all(|name| name != finding.effect);
    found.retain(is_known);
    let (mut log, mut unit) = (flight.log.clone(), flight.unit.clone());
    taken_out(&mut log, &mut unit, &found);
    found.extend(garbled::look(&log, &unit));
    found.retain(is_known);
    found.extend(wired::look(flight, &found, withheld)?);
    let (mut log, mut unit) = (flight.whole.clone(), flight.unit.clone());
    taken_out(&mut log, &mut unit, &found);
    let losses = match withheld.iter().any(|name| name == PACKET_LOSS) {
        true => Losses::default(),
        false => Losses::of(&log, &unit),
    };
    found.extend(finding(&unit, losses.found));
    let bending = bending::look(flight, &found)?;
    Ok(Beforehand {
        found,
        bending,
        loss_shown: losses.shown,
    })
}

/// Packets that were lost, if any were.
fn finding(unit: &UnitDescription, losses: Vec<Loss>) -> Option<Finding> {
    let (effect, locality) = (by_name(PACKET_LOSS)?, Locality::Unit);
    (!losses.is_empty()).then(|| Finding {
        effect: effect.page().name,
        channels: Cause {
            effect,
            locality,
            variant: 0.0,
        }
        .channels(unit),
        what: lost::told(&losses),
        step: None,
        looks: Vec::new(),
        losses,
    })
}
