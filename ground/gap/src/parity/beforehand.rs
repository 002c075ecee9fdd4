//! What is known of a log before there is a motion.
//!
//! In: a [`Flight`]. Out: [`Beforehand`]: what codes and axes say by themselves, and the part that a motion is made without. All of it decides what a
//! motion is made of, in the fit windows and in the held-out ones alike.

use crate::{
    input::case::CaseError,
    parity::{
        bending,
        codes::{self, Finding},
        flight::Flight,
        followed::Beforehand,
        garbled,
        taken_out::taken_out,
        wired,
    },
};

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
    let bending = bending::look(flight, &found)?;
    Ok(Beforehand { found, bending })
}
