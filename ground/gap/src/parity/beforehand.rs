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
        garbled, wired,
    },
};

/// What the motion of a log is made with.
#[derive(Clone, Debug, Default)]
pub struct Beforehand {
    /// Effects that need no motion to be named. They are taken out.
    pub found: Vec<Finding>,
    /// Channels of a part that would bend the motion. They are judged about the motion of the others.
    pub bending: Vec<usize>,
}

impl Beforehand {
    /// Of a flight.
    ///
    /// # Errors
    /// When the unit's description names an effect there is not.
    pub fn of(flight: &Flight, withheld: &[String]) -> Result<Self, CaseError> {
        let mut found = codes::look_along(&flight.log, &flight.whole, &flight.unit);
        let is_known = |finding: &Finding| withheld.iter().all(|name| name != finding.effect);
        found.retain(is_known);
        let (mut log, mut unit) = (flight.log.clone(), flight.unit.clone());
        codes::taken_out(&mut log, &mut unit, &found);
        found.extend(garbled::look(&log, &unit));
        found.retain(is_known);
        found.extend(wired::look(flight, &found, withheld)?);
        let bending = bending::look(flight, &found)?;
        Ok(Self { found, bending })
    }

    /// Of these findings alone.
    pub fn found(found: &[Finding]) -> Self {
        Self {
            found: found.to_vec(),
            bending: Vec::new(),
        }
    }
}
