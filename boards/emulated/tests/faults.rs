//! What befalls the unit, and how the release image goes on.

#[allow(dead_code, reason = "each test file uses its own share of the bench")]
mod bench;

use bench::{MS, Tape, flown};
use emems::{board::ResetCause, health::Health};
use emulated::Options;
use twin::run::{Fault, Scheduled};

/// \[us\] instants through a read cycle at which a bus may get stuck.
const THROUGH_A_CYCLE_US: [u64; 4] = [300, 1_100, 2_300, 3_700];

fn at_us(us: u64, fault: Fault) -> Scheduled {
    Scheduled { at: us * 1_000, fault }
}

fn at(ms: u64, fault: Fault) -> Scheduled {
    at_us(ms * 1_000, fault)
}

/// \[us\] when the fourth cycle begins: its packet is sent 10 ms later, which takes 13.5 ms.
fn cycle_us() -> u64 {
    let mut undisturbed = Tape::default();
    flown(&Options::default(), &[], 1_000, &mut undisturbed);
    undisturbed.packets()[3].0 / 1_000 - 13_541 - 10_000
}

fn errors(tape: &Tape) -> Vec<u16> {
    tape.packets().iter().map(|(_, reading)| reading.errors.0).collect()
}

#[test]
fn a_reset_in_flight_is_told_apart_and_the_count_goes_on() {
    let mut tape = Tape::default();
    let report = flown(&Options::default(), &[at(800, Fault::Reset)], 1_700, &mut tape);
    assert_eq!(report.resets.len(), 1);
    let (struck, cause) = report.resets[0];
    assert_eq!(cause, ResetCause::Pin);
    assert!(struck.abs_diff(800 * MS) < MS);
    assert!(tape.said().contains("Pin"), "{}", tape.said());
    let counters: Vec<u16> = tape.packets().iter().map(|(_, reading)| reading.counter).collect();
    assert!(counters.windows(2).all(|pair| pair[1] == pair[0] + 1), "{counters:?}");
    assert_eq!(errors(&tape).last(), Some(&0));
}

#[test]
fn a_silent_sensor_has_its_error_bit_until_it_answers_again() {
    let mut tape = Tape::default();
    // Slot 5: the magnetometer of the second plate. Slot 9: its gyro.
    let faults = [
        at(700, Fault::Silent(5)),
        at(700, Fault::Silent(9)),
        at(1_300, Fault::Restored(5)),
        at(1_300, Fault::Restored(9)),
    ];
    flown(&Options::default(), &faults, 2_500, &mut tape);
    let errors = errors(&tape);
    assert_eq!(errors[4], 1 << 5 | 1 << 9, "{errors:x?}");
    assert_eq!(errors.last(), Some(&0), "{errors:x?}");
}

#[test]
fn without_the_multiplexer_the_gyros_are_still_read() {
    let mut tape = Tape::default();
    let faults = [at(700, Fault::MuxSilent(true)), at(1_300, Fault::MuxSilent(false))];
    flown(&Options::default(), &faults, 2_500, &mut tape);
    let errors = errors(&tape);
    assert_eq!(errors[4], 0xF0FF, "{errors:x?}");
    assert_eq!(errors.last(), Some(&0), "{errors:x?}");
}

/// \[ns\] from the hang to the reset: the watchdog's second, and the 0.2 s in which it may last have been fed before.
const BITES: std::ops::Range<u64> = 800 * MS..1_250 * MS;

#[test]
fn a_part_that_stretches_the_clock_too_long_is_cut_off_and_all_others_are_read() {
    // The accelerometer, magnetometer and thermometer of three plates, each in one cycle of its own.
    let slots = [0, 5, 14];
    let stretched = slots.into_iter().zip([900, 1_700, 2_500]).flat_map(|(slot, ms)| {
        [
            at(ms, Fault::Stretching(slot, 20 * MS)),
            at(ms + 200, Fault::Stretching(slot, 0)),
        ]
    });
    let faults: Vec<Scheduled> = stretched.collect();
    let mut tape = Tape::default();
    let report = flown(&Options::default(), &faults, 3_500, &mut tape);
    assert_eq!(report.resets, []);
    let errors = errors(&tape);
    assert!(errors.len() >= 14, "a packet every 200 ms: {errors:x?}");
    let hit: Vec<u16> = errors.iter().copied().filter(|errors| *errors != 0).collect();
    assert!(hit.iter().all(|errors| errors.count_ones() == 1), "{errors:x?}");
    assert!(slots.iter().all(|slot| hit.contains(&(1 << slot))), "{errors:x?}");
    assert_eq!(errors.last(), Some(&0), "{errors:x?}");
}

#[test]
fn a_part_that_holds_the_clock_for_good_costs_its_own_plate_at_most() {
    // The magnetometer of the second plate, and so that plate's other two.
    let plate = 0b0010_0000_0010_0010;
    let mut tape = Tape::default();
    let faults = [at(900, Fault::Stretching(5, 60_000 * MS))];
    flown(&Options::default(), &faults, 2_300, &mut tape);
    let errors = errors(&tape);
    assert!(errors.len() >= 9, "a packet every 200 ms: {errors:x?}");
    let last = *errors.last().expect("packets");
    assert!(last & 1 << 5 != 0 && last & !plate == 0, "{errors:x?}");
}

/// What takes more than six seconds of a core.
mod long {
    use super::*;

    #[test]
    #[ignore = "takes more than six seconds: cargo host-test-long runs it"]
    fn a_bus_stuck_in_mid_transfer_is_used_again_when_it_is_free() {
        let begun_us = cycle_us();
        for offset_us in THROUGH_A_CYCLE_US {
            let mut tape = Tape::default();
            let faults = [
                at_us(begun_us + offset_us, Fault::BusStuck(true)),
                at_us(begun_us + 300_000, Fault::BusStuck(false)),
            ];
            let report = flown(&Options::default(), &faults, 2_700, &mut tape);
            assert!(
                report.struck.get("bus-stuck").is_some_and(|times| *times > 0),
                "{offset_us} us"
            );
            let errors = errors(&tape);
            assert!(errors.len() >= 11, "a packet every 200 ms whatever the bus does");
            assert!(
                errors.iter().skip(2).any(|&errors| errors != 0),
                "{offset_us} us: {errors:x?}"
            );
            assert_eq!(errors.last(), Some(&0), "{offset_us} us: {errors:x?}");
        }
    }

    #[test]
    #[ignore = "takes more than six seconds: cargo host-test-long runs it"]
    fn a_part_that_holds_sda_is_clocked_free() {
        // In a cycle it costs readings, between two the next reading of the accelerometers finds it.
        for (into_cycle_us, costs) in [(1_100, true), (30_000, false)] {
            let mut tape = Tape {
                script: vec![(MS, b"G_DL".to_vec())],
                ..Tape::default()
            };
            let held = at_us(cycle_us() + into_cycle_us, Fault::SdaHeld(9));
            flown(&Options::default(), &[held], 2_500, &mut tape);
            let errors = errors(&tape);
            let mut frames = tape.derived().into_iter();
            assert!(
                frames.any(|frame| frame.health.contains(Health::BUS_RECOVERED)),
                "{into_cycle_us} us"
            );
            assert_eq!(
                errors.iter().skip(2).any(|&errors| errors != 0),
                costs,
                "{into_cycle_us} us: {errors:x?}"
            );
            assert_eq!(errors.last(), Some(&0), "{into_cycle_us} us: {errors:x?}");
        }
    }

    #[test]
    #[ignore = "takes more than six seconds: cargo host-test-long runs it"]
    fn a_part_that_hangs_lets_the_watchdog_bite_and_flight_is_resumed() {
        let hangs = 1_777;
        let mut tape = Tape {
            script: vec![
                (900 * MS, b"G_MVG_MV".to_vec()),
                ((hangs + 2_000) * MS, b"G_ST".to_vec()),
            ],
            ..Tape::default()
        };
        let report = flown(
            &Options::default(),
            &[at(hangs, Fault::DmaHung)],
            hangs + 2_500,
            &mut tape,
        );
        let [(struck, cause)] = report.resets[..] else {
            panic!("{:?}", report.resets)
        };
        assert_eq!(cause, ResetCause::Watchdog);
        assert!(BITES.contains(&(struck - hangs * MS)), "{struck}");
        for reply in ["started: Watchdog", "G_ST FLIGHT", "started Watchdog resets 1"] {
            assert!(tape.said().contains(reply), "{reply} in {}", tape.said());
        }
        let (before, after): (Vec<_>, Vec<_>) = tape.packets().into_iter().partition(|(at, _)| *at < struck);
        assert!(after.len() >= 5, "{} packets after the reset", after.len());
        assert!(after.iter().all(|(_, reading)| reading.errors.0 == 0), "{after:?}");
        let step = after[0].1.counter - before.last().expect("packets").1.counter;
        assert!((1..=2).contains(&step), "the counter went on by {step}");
    }

    #[test]
    #[ignore = "takes more than six seconds: cargo host-test-long runs it"]
    fn a_controller_that_sends_no_start_is_reset() {
        let begun_us = cycle_us();
        for into_cycle_us in [1_100, 3_700] {
            let mut tape = Tape {
                script: vec![(MS, b"G_DL".to_vec())],
                ..Tape::default()
            };
            let misplaced = at_us(begun_us + into_cycle_us, Fault::StopMisplaced);
            let report = flown(&Options::default(), &[misplaced], 1_900, &mut tape);
            assert_eq!(report.struck.get("stop-misplaced"), Some(&1), "{:?}", report.struck);
            assert_eq!(report.resets, []);
            let mut frames = tape.derived().into_iter();
            assert!(
                frames.any(|frame| frame.health.contains(Health::BUS_RECOVERED)),
                "{into_cycle_us} us"
            );
            let errors = errors(&tape);
            assert_eq!(errors.last(), Some(&0), "{into_cycle_us} us: {errors:x?}");
        }
    }
}
