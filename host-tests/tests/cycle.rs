//! The read cycle: what a packet holds, when it comes, and what failures cost.

use emems::{
    health::Health,
    sample::{NO_SLOT, NOT_READ, SENSOR_COUNT},
};
use host_tests::world;
use host_tests::{Flight, MS, S};
use twin::run::Fault;

/// \[ns\] the clock's microsecond, twice.
const JITTER: u64 = 2_000;

fn still() -> Flight {
    Flight::ideal(world("still"))
}

#[test]
fn a_packet_comes_every_200_ms_and_holds_all_sixteen_sensors() {
    let flown = still().fly(10 * S);
    assert!(flown.strange.is_empty());
    assert!(
        flown.periods().iter().all(|period| period.abs_diff(200 * MS) <= JITTER),
        "{:?}",
        flown.periods()
    );
    let counters: Vec<u16> = flown.packets.iter().map(|(_, reading)| reading.counter).collect();
    assert_eq!(counters, (0..counters.len() as u16).collect::<Vec<_>>());
    assert!(counters.len() >= 48);
    for (_, reading) in &flown.packets {
        assert_eq!(reading.errors.0, 0, "{reading:?}");
    }
    // Level and still: plate 4 looks down its own z axis, 9.7864 m/s2 of 3 mg counts.
    let (_, last) = flown.packets.last().expect("packets");
    assert_eq!(last.acc_p[3], [0, 0, 333]);
    assert_eq!(last.gyro, [0; 4]);
}

#[test]
fn k_silent_sensors_cost_their_own_values_only() {
    for k in 0..=SENSOR_COUNT {
        let flight = (0..k).fold(still(), |flight, slot| flight.fault(3 * S, Fault::Silent(slot)));
        let flown = flight.fly(6 * S);
        assert!(
            flown.periods().iter().all(|period| period.abs_diff(200 * MS) <= JITTER),
            "{k}"
        );
        for reading in &flown.second(5) {
            assert_eq!(reading.errors.0.count_ones(), k as u32, "{k}: {:04X}", reading.errors.0);
            assert!(
                (0..SENSOR_COUNT).all(|slot| reading.errors.contains(slot) == (slot < k)),
                "{k}"
            );
            assert_eq!(reading.acc_p[0] == [NOT_READ; 3], k > 0);
            assert_eq!(reading.temperature[3] == NOT_READ, k == SENSOR_COUNT);
        }
    }
}

#[test]
fn a_sensor_that_comes_back_is_configured_and_read_again() {
    for slot in 0..SENSOR_COUNT {
        let flown = still()
            .fault(3 * S, Fault::Silent(slot))
            .fault(4 * S, Fault::Restored(slot))
            .fly(6 * S);
        assert!(
            flown.second(3)[1..].iter().all(|reading| reading.errors.contains(slot)),
            "slot {slot}"
        );
        assert!(
            flown.second(5).iter().all(|reading| reading.errors.0 == 0),
            "slot {slot}"
        );
    }
}

#[test]
fn a_stuck_bus_costs_no_packet_and_no_gyro_and_comes_back() {
    let flown = still()
        .fault(3 * S, Fault::BusStuck(true))
        .fault(5 * S, Fault::BusStuck(false))
        .fly(8 * S);
    assert!(
        flown.periods().iter().all(|period| *period <= 400 * MS),
        "{:?}",
        flown.periods()
    );
    for reading in &flown.second(4) {
        assert_eq!(reading.errors.0, 0xF0FF, "every I2C part and no gyro");
        assert_eq!(reading.gyro, [0; 4]);
    }
    assert!(flown.second(7).iter().all(|reading| reading.errors.0 == 0));
    let counters: Vec<u16> = flown.packets.iter().map(|(_, reading)| reading.counter).collect();
    assert_eq!(
        counters,
        (0..counters.len() as u16).collect::<Vec<_>>(),
        "no packet is missing"
    );
}

#[test]
fn a_part_that_holds_sda_is_freed_by_clock_pulses() {
    let flown = still().fault(3 * S, Fault::SdaHeld(9)).say(1, b"G_DL").fly(6 * S);
    assert!(
        flown
            .derived
            .iter()
            .any(|frame| frame.health.contains(Health::BUS_RECOVERED))
    );
    assert!(flown.second(5).iter().all(|reading| reading.errors.0 == 0));
}

/// \[ns\] longer than any read may take.
const TOO_LONG: u64 = 20 * MS;
/// \[ns\] shorter than any.
const A_WHILE: u64 = MS / 5;
/// \[ns\] by how much the packet of a cycle with such a part may come later than 10 ms after the cycle's start.
const LATER: u64 = 15 * MS;
/// Slots of the magnetometers, which are asked before they are read.
const MAGNETOMETERS: std::ops::Range<usize> = 4..8;
/// Slots of the gyros, which are on another bus.
const GYROS: std::ops::Range<usize> = 8..12;

#[test]
fn a_part_that_stretches_the_clock_too_long_is_cut_off_and_all_others_are_read() {
    for slot in (0..SENSOR_COUNT).filter(|slot| !GYROS.contains(slot)) {
        // Within the cycle that begins at 3.15 s, and not where settings are compared, at 3.0 and 3.2 s: that has 2 ms only.
        let flown = still()
            .fault(3 * S + 5 * MS, Fault::Stretching(slot, TOO_LONG))
            .fault(3 * S + 195 * MS, Fault::Stretching(slot, 0))
            .say(1, b"G_DL")
            .fly(5 * S);
        assert!(
            flown.periods().iter().all(|period| period.abs_diff(200 * MS) <= LATER),
            "slot {slot}: {:?}",
            flown.periods()
        );
        let hit = flown.derived.iter().find(|frame| frame.health.0 as u16 != 0);
        let hit = hit.expect("a cycle with an error");
        assert_eq!(hit.health.0 as u16, 1 << slot, "slot {slot}: nothing else is lost");
        assert!(hit.health.contains(Health::BUS_RECOVERED), "slot {slot}");
        // Sixteen milliseconds for the one; the others, freeing the bus and waiting for its plate take the rest. A magnetometer is cut
        // off where it is asked to measure, before the cycle.
        let least_us = if MAGNETOMETERS.contains(&slot) { 4_000 } else { 19_000 };
        assert!(
            (least_us..26_000).contains(&hit.cycle_us),
            "slot {slot}: {} us",
            hit.cycle_us
        );
        assert!(
            flown.second(4).iter().all(|reading| reading.errors.0 == 0),
            "slot {slot}"
        );
    }
}

#[test]
fn a_part_that_holds_the_clock_for_good_costs_its_own_plate_at_most() {
    for slot in [0, 5, 15] {
        let flown = still().fault(3 * S, Fault::Stretching(slot, 60 * S)).fly(6 * S);
        let plate = 0b0001_0000_0001_0001 << (slot % 4);
        for reading in &flown.second(5) {
            let errors = reading.errors.0;
            assert!(
                errors >> slot & 1 == 1 && errors & !plate == 0,
                "slot {slot}: {errors:04X}"
            );
        }
        // The three parts of its plate are each cut off once, in one cycle.
        assert!(
            flown
                .periods()
                .iter()
                .all(|period| period.abs_diff(200 * MS) <= 3 * 17 * MS)
        );
    }
}

#[test]
fn a_part_that_stretches_the_clock_for_a_while_is_waited_for() {
    let flown = still().fault(3 * S, Fault::Stretching(4, A_WHILE)).fly(6 * S);
    assert!(flown.packets.iter().all(|(_, reading)| reading.errors.0 == 0));
    assert!(flown.strange.is_empty());
}

#[test]
fn the_multiplexer_gone_takes_the_i2c_parts_and_nothing_else() {
    let flown = still()
        .fault(3 * S, Fault::MuxSilent(true))
        .fault(5 * S, Fault::MuxSilent(false))
        .fly(8 * S);
    assert!(
        flown
            .second(4)
            .iter()
            .all(|reading| reading.errors.0 == 0xF0FF && reading.gyro == [0; 4])
    );
    assert!(flown.second(7).iter().all(|reading| reading.errors.0 == 0));
}

#[test]
fn derived_frames_say_when_each_sensor_was_read_and_come_only_when_asked_for() {
    assert!(still().fly(3 * S).derived.is_empty());
    let flown = still().say(S, b"G_DL").say(4 * S, b"G_DX").fly(6 * S);
    assert!(flown.strange.is_empty());
    assert!(
        flown.derived.len() >= 14 && flown.derived.len() <= 16,
        "{}",
        flown.derived.len()
    );
    for frame in &flown.derived[2..] {
        assert!(
            frame.slots_us.is_sorted() && !frame.slots_us.contains(&NO_SLOT),
            "{frame:?}"
        );
        assert!(frame.cycle_us <= 8_000, "{frame:?}");
        // At rest and without noise an old zero cannot be told from a dead line, and is left out.
        assert!((19..=20).contains(&frame.increments.gyro[0].count), "{frame:?}");
        assert!((180_000..=200_000).contains(&frame.increments.covered_us), "{frame:?}");
    }
}

#[test]
fn the_period_is_a_parameter_from_1_to_50_hz() {
    for (period_ms, packets) in [(20, 100), (50, 40), (1000, 2)] {
        let mut flight = still();
        flight.settings.period_ms = period_ms;
        let flown = flight.fly(5 * S);
        let last_two: usize = flown.second(3).len() + flown.second(4).len();
        assert!(last_two.abs_diff(packets) <= 1, "{period_ms} ms: {last_two}");
        assert!(
            flown.second(3).iter().all(|reading| reading.errors.0 == 0),
            "{period_ms} ms"
        );
    }
}
