//! The self-test in the unit: one that cannot go on is cut off, and leaves the bus to the others.

use host_tests::{Flight, MS, S, world};
use twin::run::Fault;

/// The accelerometer of plate 1 holds the clock while it is tested. It does not hold the packets, and once it has let go
/// every sensor is read that is not under test itself.
#[test]
fn a_part_that_holds_the_clock_in_its_self_test_holds_neither_packets_nor_the_bus() {
    let tested = 2 * S + 20 * MS;
    let flown = Flight::ideal(world("still"))
        .say(tested, b"G_AT")
        .fault(tested, Fault::Stretching(0, 900 * MS))
        .fault(tested + 60 * MS, Fault::Stretching(0, 0))
        .fly(12 * S);
    assert!(
        flown.replied("accelerometer 1 failed: no answer in time"),
        "{:?}",
        flown.replies()
    );
    assert!(flown.replied("G_AT accelerometer 2 ok"), "{:?}", flown.replies());
    // A cycle closes at the latest 190 ms after its start, and 10 ms after it where no sensor is silent.
    let first = flown.packets.first().map_or(0, |(at, _)| *at);
    for (index, (at, reading)) in flown.packets.iter().enumerate() {
        let late = at - first - index as u64 * 200 * MS;
        assert!(late <= 180 * MS, "packet {index} is {late} ns late");
        assert_eq!(usize::from(reading.counter), index, "a packet is missing");
    }
    let errors = |from: u64| -> Vec<u16> {
        let after = flown.packets.iter().filter(|(at, _)| *at > from);
        after.map(|(_, reading)| reading.errors.0).collect()
    };
    // The held channel is plate 1's: its accelerometer, magnetometer and thermometer. Of the others one is under test, and
    // the one before it is configured again.
    let others = errors(tested)
        .into_iter()
        .filter(|errors| (errors & !0x1111).count_ones() > 2);
    assert_eq!(others.count(), 0, "{:x?}", errors(tested));
    assert!(
        errors(tested + 1_400 * MS)
            .iter()
            .all(|errors| errors.count_ones() <= 2),
        "{:x?}",
        errors(tested)
    );
    assert_eq!(flown.packets.last().map(|(_, reading)| reading.errors.0), Some(0));
}

/// What its registers hold when they stop is what they hold ever after, the mode of a part that has measured among it. It fails its test
/// and is then read as before, so that its one value is seen: it has not lost its settings.
#[test]
fn a_magnetometer_whose_registers_stand_still_is_read_after_its_self_test() {
    let frozen_slot = 5;
    let flown = Flight::ideal(world("still"))
        .fault(900 * MS, Fault::Frozen(frozen_slot, true))
        .say(2 * S + 20 * MS, b"G_AT")
        .fly(14 * S);
    assert!(flown.replied("magnetometer 2 failed"), "{:?}", flown.replies());
    assert!(flown.replied("G_AT done"), "{:?}", flown.replies());
    let last: Vec<_> = flown
        .packets
        .iter()
        .rev()
        .take(10)
        .map(|(_, reading)| *reading)
        .collect();
    for reading in &last {
        assert_eq!(reading.errors.0, 0);
        assert_eq!(reading.mag_p[1], last[0].mag_p[1]);
    }
}
