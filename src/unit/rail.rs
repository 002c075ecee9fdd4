//! The launch rail over the umbilical: G_RA with G_CK.
//!
//! A rail in use lasts over a reset, in retained memory, and over a power cut, in the recorder's superblock: that one is taken at the first
//! mount after power-on and never after a command. In WAIT the filter takes it once for
//! each attitude that is found, and the log keeps its numbers and when. One that contradicts the attitude is announced and left out. In
//! FLIGHT it is not looked at.

use super::shared::Shared;
use crate::{
    board::Retained,
    mode::Cause,
    rail::{RAIL_BYTES, Rail},
    retained::RAIL,
};

/// Uses a rail from now on, whose numbers were looked at when it was armed.
pub fn set(shared: &Shared, memory: &impl Retained, rail: Rail) {
    RAIL.keep(memory, &rail.bytes());
    take(shared, rail);
    shared.note(Cause::Rail);
    shared.say(format_args!("G_RA ok: {rail}"));
}

/// Takes the rail that was in use before a reset.
pub fn recall(shared: &Shared, memory: &impl Retained) {
    let mut bytes = [0; RAIL_BYTES];
    if RAIL.recall(memory, &mut bytes).map(<[u8]>::len) == Some(RAIL_BYTES) {
        take(shared, Rail::of_bytes(bytes));
    }
}

/// Takes the rail that was in use before a power cut, unless another is known.
pub fn found(shared: &Shared, memory: &impl Retained, rail: Rail) {
    if shared.rail_known.replace(true) || rail.is_none() || rail.fault().is_some() {
        return;
    }
    RAIL.keep(memory, &rail.bytes());
    take(shared, rail);
    shared.say(format_args!("rail as before the power cut: {rail}"));
}

fn take(shared: &Shared, rail: Rail) {
    shared.rail.set(rail);
    shared.rail_known.set(true);
    shared.rail_is_new.set(true);
}

/// Says what became of the rail.
pub fn met(shared: &Shared, met: Result<(), f32>) {
    shared.rail_is_new.set(false);
    match met {
        Ok(()) => {
            shared.note(Cause::RailTaken(shared.rail.get()));
            shared.say(format_args!("rail taken"));
        }
        Err(off) => shared.say(format_args!(
            "rail CONTRADICTS the attitude by {} deg, not used",
            (off.to_degrees() + 0.5) as u8
        )),
    }
}
