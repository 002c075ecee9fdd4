//! Lift-off, resets, and the watchdog.

use emems::{board::ResetCause, mode::Mode};
use host_tests::world;
use host_tests::{Flight, MS, S};
use twin::run::Fault;

fn rocket() -> Flight {
    Flight::ideal(world("rocket"))
}

/// \[ns\] lift-off of the rocket motion.
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

/// \[ns\] the independent watchdog's second, the 0.2 s in which it may last have been fed before the hang, and those in which the
/// part that hangs was next used.
const WATCHDOG: std::ops::Range<u64> = S - 200 * MS..S + 250 * MS;

/// A flight in which a part of the unit hangs, and the words that show that it goes on.
fn a_hang_ends_in_a_reset_that_resumes_flight(fault: Fault) {
    let hangs = 5 * S + 77 * MS;
    let flown = Flight::ideal(world("still"))
        .say(S, b"G_MVG_MV")
        .say(2 * S, b"G_MGG_MG")
        .fault(hangs, fault)
        .say(hangs + 2 * S, b"G_ST")
        .fly(hangs + 4 * S);
    let [(struck, cause)] = flown.report.resets[..] else {
        panic!("{fault:?}: {:?}", flown.report.resets)
    };
    assert_eq!(cause, ResetCause::Watchdog, "{fault:?}");
    assert!(WATCHDOG.contains(&(struck - hangs)), "{fault:?}: {}", struck - hangs);
    for reply in [
        "started: Watchdog",
        "G_ST FLIGHT task none recording 1",
        "started Watchdog resets 1",
    ] {
        assert!(flown.replied(reply), "{fault:?}: {reply} in {:?}", flown.replies());
    }
    let after: Vec<u16> = (flown.packets.iter())
        .filter(|(at, reading)| *at > struck && reading.errors.0 == 0)
        .map(|(_, reading)| reading.counter)
        .collect();
    assert!(after.len() >= 10, "{fault:?}: {after:?}");
    let before = flown.packets.iter().rfind(|(at, _)| *at < struck);
    let step = after[0] - before.expect("packets before the reset").1.counter;
    assert!((1..=2).contains(&step), "{fault:?}: the counter went on by {step}");
}

#[test]
fn a_part_that_never_yields_lets_the_watchdog_bite_and_flight_is_resumed() {
    a_hang_ends_in_a_reset_that_resumes_flight(Fault::DmaHung);
}
