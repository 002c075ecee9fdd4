//! Lift-off, resets, and the watchdog.

use emems::{board::ResetCause, mode::Mode};
use host_tests::world;
use host_tests::{Flight, MS, S};
use twin::run::Fault;

fn rocket() -> Flight {
    Flight::ideal(world("rocket"))
}

/// [ns] lift-off of the rocket motion.
const LIFT_OFF: u64 = 30 * S;

#[test]
fn lift_off_starts_flight_and_recording() {
    let flown = rocket().say(S, b"G_DL").fly(LIFT_OFF + 3 * S);
    assert!(flown.replied("lift-off: FLIGHT, recording"), "{:?}", flown.replies());
    let before = flown
        .packets
        .iter()
        .take_while(|(_, reading)| !reading.lift_off)
        .count();
    let edge = flown.packets[before].0;
    assert!((LIFT_OFF..LIFT_OFF + 400 * MS).contains(&edge), "{edge}");
    assert_eq!(flown.derived.first().map(|frame| frame.mode), Some(Mode::Wait));
    assert_eq!(flown.derived.last().map(|frame| frame.mode), Some(Mode::Flight));
}

#[test]
fn a_reset_in_flight_resumes_flight_within_400_ms() {
    let strikes = LIFT_OFF + 5 * S + 77 * MS;
    let flown = rocket()
        .fault(strikes, Fault::Reset)
        .say(strikes + S, b"G_ST")
        .fly(strikes + 3 * S);
    assert_eq!(flown.report.resets, [(strikes, ResetCause::Pin)]);
    let (first, _) = flown
        .packets
        .iter()
        .find(|(at, _)| *at > strikes)
        .expect("packets after the reset");
    assert!(*first - strikes <= 400 * MS, "{}", *first - strikes);
    assert!(
        flown.replied("G_ST FLIGHT task none recording 1"),
        "{:?}",
        flown.replies()
    );
    let gap = flown
        .packets
        .windows(2)
        .find(|pair| pair[0].0 < strikes && pair[1].0 > strikes)
        .expect("both sides");
    let step = gap[1].1.counter - gap[0].1.counter;
    assert!(
        (1..=2).contains(&step),
        "the counter goes on; at most the packet on the line is lost"
    );
}
