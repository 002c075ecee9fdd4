//! The release image on the stand: when packets come, what befalls the unit and how it goes on.

mod bench;

use bench::{MS, Tape, flown};
use emems::board::ResetCause;
use emulated::{Covers, Error, Options};
use twin::{
    part::Nanos,
    run::{Fault, Scheduled},
};

/// [ns] between packets.
const PERIOD: Nanos = 200 * MS;
/// [ns] what the issue allows the period to jitter.
const JITTER: Nanos = MS / 10;

fn at(ms: u64, fault: Fault) -> Scheduled {
    Scheduled { at: ms * MS, fault }
}

#[test]
fn a_packet_comes_every_200_ms_and_the_log_is_text() {
    let mut tape = Tape::default();
    let report = flown(&Options::default(), &[], 2_500, &mut tape);
    let packets = tape.packets();
    assert!(packets.len() >= 12, "{} packets", packets.len());
    for pair in packets.windows(2) {
        assert_eq!(pair[1].1.counter, pair[0].1.counter + 1);
        let period = pair[1].0 - pair[0].0;
        assert!(period.abs_diff(PERIOD) <= JITTER, "{period} ns");
    }
    assert!(tape.log.iter().any(|line| line.contains("PowerOn")), "{:?}", tape.log);
    assert_eq!(report.flown, 2_500 * MS);
    assert!(report.unanswered.is_empty(), "{:?}", report.unanswered);
    assert!(report.resets.is_empty());
}

#[test]
fn two_runs_are_the_same_to_the_nanosecond_and_the_instruction() {
    let mut tapes = [Tape::default(), Tape::default()];
    let reports = tapes.each_mut().map(|tape| flown(&Options::default(), &[], 700, tape));
    assert_eq!(tapes[0], tapes[1]);
    assert_eq!(reports[0], reports[1]);
}

#[test]
fn a_reset_in_flight_is_told_apart_and_the_count_goes_on() {
    let mut tape = Tape::default();
    let report = flown(&Options::default(), &[at(500, Fault::Reset)], 1_000, &mut tape);
    assert_eq!(report.resets.len(), 1);
    assert_eq!(report.resets[0].1, ResetCause::Pin);
    assert!(report.resets[0].0.abs_diff(500 * MS) < MS);
    assert!(tape.log.iter().any(|line| line.contains("Pin")), "{:?}", tape.log);
    let counters: Vec<u16> = tape.packets().iter().map(|(_, reading)| reading.counter).collect();
    assert!(counters.windows(2).all(|pair| pair[1] == pair[0] + 1), "{counters:?}");
}

#[test]
fn a_part_that_holds_sda_costs_a_cycle_and_is_clocked_free() {
    let mut tape = Tape::default();
    flown(&Options::default(), &[at(300, Fault::SdaHeld)], 1_500, &mut tape);
    let errors: Vec<u16> = tape.packets().iter().map(|(_, reading)| reading.errors.0).collect();
    assert_ne!(errors[2], errors[1], "the cycle at 400 ms missed the bus");
    assert_eq!(errors[4..], vec![errors[1]; errors.len() - 4]);
}

#[test]
fn a_bus_stuck_for_a_while_is_used_again_when_it_is_free() {
    let mut tape = Tape::default();
    let faults = [at(300, Fault::BusStuck(true)), at(900, Fault::BusStuck(false))];
    flown(&Options::default(), &faults, 1_900, &mut tape);
    let packets = tape.packets();
    assert!(packets.len() >= 9, "a packet every 200 ms whatever the bus does");
    let errors: Vec<u16> = packets.iter().map(|(_, reading)| reading.errors.0).collect();
    assert_ne!(errors[3], errors[1]);
    assert_eq!(errors.last(), Some(&errors[1]));
}

#[test]
fn a_read_is_one_byte_off_without_the_cover_of_last() {
    let [mut covered, mut bare] = [Tape::default(), Tape::default()];
    let options = Options {
        covers: Covers {
            i2c_last: false,
            ..Covers::default()
        },
        ..Options::default()
    };
    flown(&Options::default(), &[], 900, &mut covered);
    flown(&options, &[], 900, &mut bare);
    let read = |tape: &Tape| {
        tape.packets()
            .into_iter()
            .map(|(_, reading)| reading)
            .collect::<Vec<_>>()
    };
    assert_ne!(read(&covered), read(&bare));
}

#[test]
fn a_command_reaches_the_unit_at_its_millisecond() {
    let mut tape = Tape {
        script: vec![(333 * MS, b"G".to_vec())],
        ..Tape::default()
    };
    flown(&Options::default(), &[], 400, &mut tape);
    let first = tape.umbilical.iter().find(|(at, _)| *at >= 333 * MS).map(|&(at, _)| at);
    // One byte each way at 115200 8N1 takes 87 us.
    assert!(first.is_some_and(|at| at < 334 * MS), "{:?}", tape.umbilical);
}

#[test]
fn a_static_is_read_by_its_name_and_a_wrong_name_is_refused() {
    let mut options = Options {
        statics: vec![("_SEGGER_RTT".into(), 10)],
        ..Options::default()
    };
    let report = flown(&options, &[], 10, &mut Tape::default());
    assert_eq!(report.statics, [b"SEGGER RTT".to_vec()]);
    options.statics[0].0 = "NO_SUCH_STATIC".into();
    let image = emulated::image::build("obc").unwrap_or_else(|error| panic!("{error}"));
    let plant = twin::plant::Plant::ideal(bench::world("still"));
    let refused = emulated::fly_with(&options, &image, plant, &[], MS, &mut Tape::default());
    assert!(matches!(&refused, Err(Error::Image(error)) if error.to_string().contains("NO_SUCH_STATIC")));
}
