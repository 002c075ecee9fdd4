//! A log rewritten as if faults had struck while it was made.
//!
//! In: readings with the instants of their cycles, what is planned, a seed. Out: the readings as the unit would have packed
//! them, and how often each fault changed one. Only the words whose places have an `l` can be made in a log: the others
//! change what the unit does next, and a log cannot tell that.

use emems::sample::{Kind, Reading, SENSORS};

use super::{Fault, Planned, Struck, schedule};
use crate::part::{Nanos, signal::Noise};

/// What cannot be made in a log.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0} cannot be made in a log: it changes what the unit does next; fly it with --host or on the image")]
pub struct NotInALog(&'static str);

/// Rewrites `readings`, each with the instant of its cycle.
///
/// # Errors
/// When a planned fault cannot be made in a log.
pub fn rewrite(readings: &mut [(Nanos, Reading)], planned: &[Planned], seed: u64) -> Result<Struck, NotInALog> {
    if let Some(planned) = planned.iter().find(|planned| !planned.word.places.contains('l')) {
        return Err(NotInALog(planned.word.name));
    }
    let strokes = schedule(planned, seed);
    let mut strokes = strokes.iter().peekable();
    let mut present: Vec<(Fault, Option<Reading>)> = Vec::new();
    let mut struck = Struck::new();
    for (at, reading) in readings {
        while let Some(stroke) = strokes.next_if(|stroke| stroke.at <= *at) {
            match ended(stroke.fault) {
                Some(begun) => present.retain(|(fault, _)| *fault != begun),
                None => present.push((stroke.fault, None)),
            }
        }
        for (fault, frozen) in &mut present {
            let words = Noise::new(seed).stream(u64::from(reading.counter));
            if let Some(name) = befall(reading, *fault, frozen, words) {
                *struck.entry(name).or_default() += 1;
            }
        }
    }
    Ok(struck)
}

/// The stroke that this one ends.
fn ended(fault: Fault) -> Option<Fault> {
    Some(match fault {
        Fault::Restored(slot) => Fault::Silent(slot),
        Fault::Garbage(slot, false) => Fault::Garbage(slot, true),
        Fault::Frozen(slot, false) => Fault::Frozen(slot, true),
        Fault::MuxSilent(false) => Fault::MuxSilent(true),
        Fault::BusStuck(false) => Fault::BusStuck(true),
        _ => return None,
    })
}

/// Changes one reading; the name of the fault if it did.
fn befall(reading: &mut Reading, fault: Fault, frozen: &mut Option<Reading>, words: Noise) -> Option<&'static str> {
    let counts = |n: usize, shift: u32| words.word(n as u64).cast_signed() >> shift;
    match fault {
        Fault::Silent(slot) => {
            put(reading, slot, &Reading::unread(reading.counter));
            reading.errors.insert(slot);
            Some("silent")
        }
        Fault::MuxSilent(true) | Fault::BusStuck(true) => {
            for slot in (0..SENSORS.len()).filter(|slot| SENSORS[*slot].kind != Kind::Gyro) {
                befall(reading, Fault::Silent(slot), frozen, words);
            }
            Some(if fault == Fault::BusStuck(true) {
                "bus-stuck"
            } else {
                "mux-silent"
            })
        }
        Fault::Garbage(slot, true) => {
            let random = Reading {
                acc_p: std::array::from_fn(|p| std::array::from_fn(|k| counts(3 * p + k, 4))),
                mag_p: std::array::from_fn(|p| std::array::from_fn(|k| counts(12 + 3 * p + k, 4))),
                gyro: std::array::from_fn(|p| counts(24 + p, 2)),
                gyro_temperature: std::array::from_fn(|p| counts(28 + p, 4)),
                temperature: std::array::from_fn(|p| counts(32 + p, 4)),
                ..*reading
            };
            put(reading, slot, &random);
            Some("garbage")
        }
        Fault::Frozen(slot, true) => {
            let first = *frozen.get_or_insert(*reading);
            put(reading, slot, &first);
            Some("frozen")
        }
        _ => None,
    }
}

/// Puts one sensor's values of another reading in place of its own; NOT_READ where that one has none.
fn put(reading: &mut Reading, slot: usize, other: &Reading) {
    let sensor = SENSORS[slot];
    let plate = sensor.plate;
    match sensor.kind {
        Kind::Accelerometer => reading.acc_p[plate] = other.acc_p[plate],
        Kind::Magnetometer => reading.mag_p[plate] = other.mag_p[plate],
        Kind::Gyro => {
            reading.gyro[plate] = other.gyro[plate];
            reading.gyro_temperature[plate] = other.gyro_temperature[plate];
        }
        Kind::Thermometer => reading.temperature[plate] = other.temperature[plate],
    }
}
