//! A part that would bend the motion.
//!
//! In: a [`Flight`], and what its codes and axes say. Out: the channels of one plate's accelerometers or magnetometers, if all others agree on a
//! motion that this part is not in.
//!
//! A motion is made of all readings alike. Accelerometers that lose gravity are a quarter of every force, and the motion turns with them: nothing is
//! linear about it, it does not settle, and what the part does is spread over all others. Made of the others, the motion is near the true one. The part
//! stays in the log, and its readings are judged about that motion as all are.
//!
//! Parity says which part: with it the packets keep more than [`PARITY_GAP`], and without it no more, in the fit windows and in the held-out ones. The
//! one that keeps most is asked. Of four gyros parity cannot tell which one is off, and of two plates neither: without the part its kind has to have
//! redundancy still ([`PARITY_FREE`]).

use std::collections::BTreeMap;

use twin::predict::Kind;

use crate::{
    input::{case::CaseError, log::Log},
    parity::{
        codes::Finding,
        flight::Flight,
        followed::{Beforehand, Followed},
        space::gap,
    },
    thresholds::{PARITY_FREE, PARITY_GAP},
};

/// Kinds of which one part of several can be told to be off.
const KINDS: [Kind; 2] = [Kind::Accelerometer, Kind::Magnetometer];

/// The channels of such a part; none of a log without one.
///
/// # Errors
/// When the unit's description names an effect there is not.
pub fn look(flight: &Flight, found: &[Finding]) -> Result<Vec<usize>, CaseError> {
    let found = Beforehand::found(found);
    let kept = |log: &Log| Followed::of(flight, log, &found).kept_by_packets();
    let whole = kept(&flight.log)?;
    if gap(&whole) <= PARITY_GAP {
        return Ok(Vec::new());
    }
    let Some(part) = loudest(flight, &whole) else {
        return Ok(Vec::new());
    };
    let kind = flight.unit.channels[part[0]].sensor;
    for log in [Some(&flight.log), flight.held.as_ref()].into_iter().flatten() {
        let others = kept(&log.without(&part))?;
        let of_kind = flight
            .unit
            .channels
            .iter()
            .zip(&others)
            .filter(|(channel, _)| channel.sensor == kind);
        let free = of_kind.map(|(_, (_, free))| free).sum::<f64>() / log.start_s.len() as f64;
        if gap(&others) > PARITY_GAP || free < PARITY_FREE {
            return Ok(Vec::new());
        }
    }
    Ok(part)
}

/// The part of which the packets keep most for each degree of freedom.
fn loudest(flight: &Flight, kept: &[(f64, f64)]) -> Option<Vec<usize>> {
    let mut parts: BTreeMap<(&str, usize), Vec<usize>> = BTreeMap::new();
    for (index, channel) in flight.unit.channels.iter().enumerate() {
        if let Some(kind) = KINDS.iter().position(|kind| *kind == channel.sensor) {
            parts.entry((channel.group.as_str(), kind)).or_default().push(index);
        }
    }
    let gap_of = |part: &[usize]| gap(&part.iter().map(|channel| kept[*channel]).collect::<Vec<_>>());
    parts
        .into_values()
        .max_by(|one, other| gap_of(one).total_cmp(&gap_of(other)))
}
