//! Phases of a flight, found and told: the twin's sounding rocket, and a recording by hand.

use std::path::PathBuf;

use crate::twin_case::Log;
use gap::parity::{
    flight::Flight,
    lost::Loss,
    phases::{Phase, is_begun_in_flight},
};
use tempfile::TempDir;
use twin::motion;

/// \[s\] of lift-off.
const LIFT_OFF_S: f64 = 30.0;

/// The twin's unit on its rocket, from an instant on, with more in `case.toml`.
fn flown(from_s: f64, more: &str) -> TempDir {
    let world = motion::world_by_name("rocket").expect("a motion");
    let settings = format!("[motion_known]\nnone = true\n{more}");
    Log::nominal(&world.motion, world.environment, (from_s, 595.0)).folder("rocket", || 0.0, "", &settings)
}

fn open(folder: &TempDir) -> Flight {
    Flight::open(folder.path()).expect("opens")
}

#[test]
fn a_rocket_of_two_stages_is_parted_into_its_phases() {
    let flight = open(&flown(0.0, ""));
    println!("{}", flight.phases_line());
    let along: Vec<_> = flight.phases.iter().filter(|own| own.phase != Phase::Spin).collect();
    use Phase::{Coast, Entry, Parachute, Rest, Thrust};
    // \[s\] after lift-off, and how near: means over half a second, and an entry that grows for twenty.
    let known = [
        (Rest, -30.0, 1.0),
        (Thrust, 0.0, 1.0),
        (Coast, 12.0, 1.5),
        (Thrust, 15.0, 1.5),
        (Coast, 38.2, 2.0),
        (Entry, 449.0, 6.0),
        (Parachute, 523.0, 4.0),
    ];
    assert_eq!(along.len(), known.len(), "{}", flight.phases_line());
    for (own, (phase, from_s, near_s)) in along.iter().zip(known) {
        assert_eq!(own.phase, phase, "{}", flight.phases_line());
        assert!((own.from_s - LIFT_OFF_S - from_s).abs() < near_s, "{own:?}");
    }
    let spins = flight
        .phases
        .iter()
        .any(|own| own.phase == Phase::Spin && own.from_s < 40.0 && own.to_s > 80.0);
    assert!(spins, "{}", flight.phases_line());
    assert!(flight.phases_line().starts_with("PHASES  found: rest 0.0 to"));
    assert!(!flight.phases_line().contains("BEGIN"));
}

#[test]
fn a_log_that_begins_in_flight_says_so() {
    for from_s in [36.0, 50.0] {
        let flight = open(&flown(from_s, ""));
        assert!(is_begun_in_flight(&flight.phases, from_s), "{}", flight.phases_line());
        assert!(
            flight.phases_line().contains("BEGIN   the log begins in flight"),
            "{}",
            flight.phases_line()
        );
    }
}

#[test]
fn told_phases_are_taken_instead_and_wrong_ones_are_refused_naming_both() {
    let told =
        "[phases]\nrest = [[0.0, 29.0]]\nthrust = [[30.0, 42.0]]\nfree_fall = [[42.0, 469.0]]\nspin = [[31.0, 84.0]]\n";
    let flight = open(&flown(0.0, told));
    assert!(flight.are_phases_told);
    assert_eq!(flight.phases.iter().filter(|own| own.phase == Phase::Coast).count(), 1);
    assert_eq!(flight.rests(&flight.log, &flight.unit, &[]), [(0.0, 29.0)]);
    // What was lost during a rest makes it longer.
    let lost = Loss {
        after_s: 10.0,
        packets: 5,
        by_s: 1.0,
        probability: 1.0,
    };
    assert_eq!(flight.rests(&flight.log, &flight.unit, &[lost]), [(0.0, 30.0)]);
    let refused = |more: &str| {
        let error = Flight::open(flown(0.0, more).path())
            .err()
            .expect("is refused")
            .to_string();
        assert!(error.contains("case.toml"), "{error}");
        error
    };
    let order = refused("[phases]\nparachute = [[10.0, 20.0]]\nthrust = [[30.0, 42.0]]\n");
    assert!(
        order.contains("phases.thrust: [30, 42] follows parachute [10, 20]"),
        "{order}"
    );
    assert!(
        order.contains("a flight goes rest, thrust, coast, entry, parachute, landed"),
        "{order}"
    );
    let over = refused("[phases]\nthrust = [[30.0, 42.0]]\ncoast = [[40.0, 60.0]]\n");
    assert!(
        over.contains("phases.coast: [40, 60] overlaps thrust [30, 42]"),
        "{over}"
    );
    let backwards = refused("[phases]\nrest = [[5.0, 1.0]]\n");
    assert!(backwards.contains("phases.rest: [5, 1] has no length"), "{backwards}");
    let unknown = refused("[phases]\nre_entry = [[5.0, 9.0]]\n");
    assert!(unknown.contains("re_entry"), "{unknown}");
}

#[test]
#[ignore = "the recordings are not in data/: EMEMS_DATA=FOLDER says where the whole set lies"]
fn a_hand_does_not_fly() {
    let root = PathBuf::from(std::env::var_os("EMEMS_DATA").expect("EMEMS_DATA=FOLDER"));
    for folder in ["practice/R01", "practice/R05", "blind/B54", "blind/B58"] {
        let flight = Flight::open(&root.join(folder)).expect(folder);
        println!("{folder} {}", flight.phases_line());
        assert!(
            flight.phases.iter().all(|own| own.phase == Phase::Rest),
            "{}",
            flight.phases_line()
        );
        assert!(!flight.phases.is_empty());
    }
}
