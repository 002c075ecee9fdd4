//! A unit that does not stay up: after three starts that ended within a minute each, the next one reads, sends and records,
//! and leaves out what may be at fault.

use emems::{derived::Derived, health::Health};
use host_tests::{Flight, Flown, S, world};
use twin::{plant::Plant, run::Fault};

/// Resets at these seconds; derived frames and FLIGHT asked for in each start.
fn reset_at(seconds: &[u64], ask_at: u64, ends: u64) -> Flown {
    let mut flight = Flight::ideal(world("still"))
        .say(S, b"G_MVG_MV")
        .say(S + S / 2, b"G_MGG_MG");
    for at in seconds {
        flight = flight.fault(at * S, Fault::Reset);
    }
    flight.say(ask_at * S, b"G_STG_DLG_ME").fly(ends * S)
}

#[test]
fn the_fourth_start_without_a_minute_of_health_is_in_safe_mode_and_says_so() {
    let flown = reset_at(&[3, 5, 7], 9, 12);
    assert!(flown.replied("SAFE MODE: start 4"), "{:?}", flown.replies());
    assert!(
        flown.replied("G_ST FLIGHT task none recording 1"),
        "{:?}",
        flown.replies()
    );
    assert!(
        flown.replied("G_ME no: safe mode, G_XN leaves it"),
        "{:?}",
        flown.replies()
    );
    let late = flown.packets.iter().filter(|(at, _)| *at > 8 * S);
    assert!(late.clone().count() >= 19 && late.clone().all(|(_, reading)| reading.errors.0 == 0));
    let records = flown.nand.as_ref().map(|chip| chip.operations);
    let before = reset_at(&[3, 5, 7], 9, 9).nand.map(|chip| chip.operations);
    assert!(records > before, "packets are recorded");
}

#[test]
fn three_starts_are_none_too_many() {
    let flown = reset_at(&[3, 5], 7, 9);
    assert!(!flown.replied("SAFE MODE"), "{:?}", flown.replies());
    assert!(flown.replied("G_DL ok"), "{:?}", flown.replies());
}

#[test]
fn a_word_leaves_safe_mode_and_the_attitude_comes_back() {
    // Noise, because readings that never change are judged stuck.
    let flight = Flight {
        plant: Plant::new(world("still"), 7),
        ..Flight::ideal(world("still"))
    };
    let flown = flight
        .say(S, b"G_DL")
        .fault(2 * S, Fault::Reset)
        .fault(3 * S, Fault::Reset)
        .fault(4 * S, Fault::Reset)
        .say(6 * S, b"G_XN")
        .fly(14 * S);
    assert!(flown.replied("G_XN ok: safe mode left"), "{:?}", flown.replies());
    let is_safe = |frame: &&Derived| frame.health.contains(Health::SAFE_MODE);
    let safe: Vec<&Derived> = flown.derived.iter().filter(is_safe).collect();
    assert!(!safe.is_empty() && safe.iter().all(|frame| frame.estimate.q_nb.is_none()));
    let last = flown.derived.last().expect("derived frames");
    assert!(!is_safe(&last) && last.estimate.q_nb.is_some());
}

#[test]
fn a_minute_of_health_begins_the_count_anew() {
    let flown = reset_at(&[3, 5, 67, 69, 71], 73, 75);
    // The start at 5 s was healthy at 65 s: those at 67, 69 and 71 s are the first, second and third since.
    assert!(!flown.replied("SAFE MODE"), "{:?}", flown.replies());
    let sooner = reset_at(&[3, 5, 60], 62, 64);
    assert!(sooner.replied("SAFE MODE: start 4"), "{:?}", sooner.replies());
}
