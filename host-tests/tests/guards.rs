//! Guards that no other test would miss: each test here fails without the one line that it names.

use emems::{derived::Derived, health::Health, sample::SENSOR_COUNT};
use host_tests::{Flight, Flown, MS, S, changed, world};
use twin::{host::timing::BOOT, run::Fault};

/// Slots of the gyros in the reading order.
const GYROS: std::ops::Range<usize> = 8..12;

fn still() -> Flight {
    Flight::ideal(world("still")).say(1, b"G_DL")
}

fn ever(flown: &Flown, health: Health) -> bool {
    flown.derived.iter().any(|frame| frame.health.contains(health))
}

/// S12: `Acquisition::verify` after each cycle. A part that browned out by itself answers as before, with other settings.
#[test]
fn s12_a_part_that_restarts_by_itself_is_found_by_the_verification_in_turn() {
    for slot in (0..SENSOR_COUNT).filter(|slot| !GYROS.contains(slot)) {
        let restarts = 3 * S + 50 * MS;
        let flown = still().fault(restarts, Fault::Restored(slot)).fly(restarts + 5 * S);
        // One sensor is verified a cycle, so each is within 3.2 s.
        assert!(ever(&flown, Health::RECONFIGURED), "slot {slot}");
        let (before, after) = (flown.second(2)[4], flown.second(7)[4]);
        assert_eq!((after.errors.0, before.errors.0), (0, 0), "slot {slot}");
        assert_eq!(
            (before.acc_p, before.mag_p, before.temperature),
            (after.acc_p, after.mag_p, after.temperature),
            "slot {slot}"
        );
    }
    assert!(!ever(&still().fly(5 * S), Health::RECONFIGURED));
}

/// S11: `Gyros::note`.
#[test]
fn s11_a_gyro_at_the_end_of_its_range_is_said_to_be_saturated() {
    // 400 deg/s about z: the gyro of plate 4 senses about -z, the others a third of it.
    let spin = changed("still", |t_s, truth| {
        if t_s > 3.0 {
            truth.rate_b.z = 400_f64.to_radians();
        }
    });
    let flown = Flight::ideal(spin).say(1, b"G_DL").fly(5 * S);
    let saturated = |from_us: u64, to_us: u64| -> Vec<bool> {
        let frames = flown.derived.iter();
        let within = frames.filter(|frame| (from_us..to_us).contains(&frame.start_us));
        within
            .map(|frame| frame.health.contains(Health::GYRO_SATURATED))
            .collect()
    };
    assert!(!saturated(0, 2_900_000).contains(&true));
    let after = saturated(3_300_000, 5_000_000);
    assert!(after.len() >= 6 && !after.contains(&false), "{after:?}");
}

/// S10: the overflow flag of a magnetometer's reading.
#[test]
fn s10_a_magnetometer_beyond_its_range_says_so() {
    // The range is 2047 counts of a 1090th of a gauss: 188 uT.
    let beside_a_magnet = changed("still", |t_s, truth| {
        if t_s > 3.0 {
            truth.field_b_ut *= 300.0 / truth.field_b_ut.norm();
        }
    });
    let flown = Flight::ideal(beside_a_magnet).say(1, b"G_DL").fly(5 * S);
    let overflows = |frame: &Derived| frame.health.contains(Health::MAGNETOMETER_OVERFLOW);
    let (early, late): (Vec<_>, Vec<_>) = flown.derived.iter().partition(|frame| frame.start_us < 2_900_000);
    assert!(!early.into_iter().any(overflows));
    assert!(late.into_iter().filter(|frame| overflows(frame)).count() >= 8);
    let flagged = flown.second(4)[2];
    assert!(flagged.mag_p.as_flattened().contains(&-4096), "{:?}", flagged.mag_p);
}

/// S2: `Budget`. Up to all twelve parts of the I2C bus hold the clock at once, each until it is cut off.
#[test]
fn s2_parts_that_run_out_of_time_at_once_leave_the_packet_its_deadline() {
    for k in 1..=12 {
        let slots = (0..SENSOR_COUNT).filter(|slot| !GYROS.contains(slot)).take(k);
        let flight = slots.fold(still(), |flight, slot| {
            flight.fault(3 * S, Fault::Stretching(slot, 60 * S))
        });
        let flown = flight.fly(6 * S);
        let cycle_us = flown.derived.iter().map(|frame| frame.cycle_us).max().unwrap_or(0);
        // A part that holds on takes its plate with it, so from the fourth on all plates are gone. Of a plate two parts are cut off in
        // the cycle, for 16 ms each; its magnetometer is where it is asked to measure, before the cycle.
        assert!(cycle_us > 32_000 && cycle_us <= 190_000, "{k}: {cycle_us} us");
        let counters: Vec<u16> = flown.packets.iter().map(|(_, reading)| reading.counter).collect();
        assert!(counters.is_sorted() && counters.len() >= 26, "{k}: {counters:?}");
        assert!(
            flown.second(5).iter().all(|reading| reading.errors.0 & 0x0F00 == 0),
            "{k}: the gyros are read"
        );
        let late = flown.second(4).len() + flown.second(5).len();
        assert_eq!(late, 10, "{k}: one packet every 200 ms");
    }
}

/// S2, U2: what is left when the time is up is not read, and the flag DEADLINE says so.
#[test]
fn u2_a_processor_that_is_kept_busy_through_a_cycle_closes_the_packet_and_says_so() {
    // Cycles begin 150 ms into the second and every 200 ms.
    let flown = still().fault(3 * S + 151 * MS, Fault::Busy(195 * MS)).fly(6 * S);
    let closed: Vec<&Derived> = (flown.derived.iter())
        .filter(|frame| frame.health.contains(Health::DEADLINE))
        .collect();
    assert_eq!(closed.len(), 1, "one cycle was cut");
    assert!(closed[0].health.0 as u16 != 0, "what was not read is marked");
    assert!(flown.second(5).iter().all(|reading| reading.errors.0 == 0));
    let counters: Vec<u16> = flown.packets.iter().map(|(_, reading)| reading.counter).collect();
    assert!(counters.windows(2).all(|pair| pair[1] == pair[0] + 1), "{counters:?}");
}

/// The self-test looks at the mode before each sensor.
#[test]
fn a_self_test_ends_when_flight_begins() {
    let flown = still().say(2 * S, b"G_AT").say(3 * S, b"G_MVG_MV").fly(8 * S);
    let done = flown.replies().into_iter().find(|line| line.starts_with("G_AT done"));
    let done = done.expect("the self-test ends");
    let passed: usize = done.split(' ').nth(2).and_then(|n| n.parse().ok()).expect("a number");
    assert!(passed < SENSOR_COUNT, "{done}");
    // The sensor under test when FLIGHT began has 600 ms at most; then all are read.
    for second in [4, 5, 6, 7] {
        let errors: Vec<u16> = flown.second(second).iter().map(|reading| reading.errors.0).collect();
        assert!(
            errors.iter().all(|errors| *errors == 0),
            "second {second}: {errors:04X?}"
        );
    }
}

/// S8: `Gyros::fast` leaves out the word of a dead line, which would be a rate of zero.
#[test]
fn s8_a_gyro_that_dies_between_two_cycles_adds_no_zeros_to_its_increments() {
    for plate in 0..4 {
        let flight = Flight::ideal(world("tumble")).say(1, b"G_DL");
        let flown = flight.fault(20 * S + 100 * MS, Fault::Silent(8 + plate)).fly(22 * S);
        let counts: Vec<_> = (flown.derived.iter())
            .filter(|frame| (19_700_000..20_700_000).contains(&frame.start_us))
            .map(|frame| frame.increments.gyro[plate].count)
            .collect();
        // Cycles begin 150 ms into the second and every 200 ms: of the third it was alive for 150 ms, then silent.
        assert!(counts[..2].iter().all(|count| *count >= 19), "{counts:?}");
        assert!(
            counts.len() > 3 && counts[2..].iter().all(|count| *count <= 16),
            "{counts:?}"
        );
    }
}

/// S8: `Gyros::fast` leaves out the word of a line that died within the sample, after its identity was seen: it would be a rate of zero
/// in a unit that turns.
#[test]
fn s8_a_gyro_that_dies_within_a_fast_sample_adds_no_zero_to_its_increments() {
    // Each gyro sees at least a third of it. Between the two frames of a sample there is time for a fault where the others are gone: then
    // the second frame waits for 30 us from the first, which takes 18.
    let spin = || changed("still", |_, truth| truth.rate_b.z = 150_f64.to_radians());
    for plate in 0..4 {
        let flight = || {
            let others = (0..4).filter(|other| *other != plate);
            let flight = Flight::ideal(spin()).say(1, b"G_DL");
            others.fold(flight, |flight, other| flight.fault(S, Fault::Silent(8 + other)))
        };
        let sampled_us = flight().fly(3 * S).derived.last().expect("frames").increments.end_us;
        for offset_us in (0..60).step_by(2) {
            let at = BOOT + (sampled_us + 30_000 + offset_us) * 1_000;
            let flown = flight().fault(at, Fault::Silent(8 + plate)).fly(at + 300 * MS);
            assert!(flown.report.struck["silent"] > 0);
            let frames = flown.derived.iter().filter(|frame| frame.start_us > 2_000_000);
            let gyros: Vec<_> = frames.map(|frame| frame.increments.gyro[plate]).collect();
            let turned = gyros.iter().filter(|gyro| gyro.count > 0);
            let least = turned.map(|gyro| gyro.least.unsigned_abs().min(gyro.most.unsigned_abs()));
            let least = least.min().expect("it was alive");
            assert!(least > 200, "plate {plate}, {offset_us} us: {gyros:?}");
        }
    }
}

/// S8: the identity that ends each fast sample, and `Adis16265::confirm` after a wrong one. Half of all random words look new.
#[test]
fn s8_a_gyro_that_answers_at_random_is_marked_from_the_second_packet_on() {
    for plate in 0..4 {
        let flight = still().fault(3 * S + 10 * MS, Fault::Garbage(8 + plate, true));
        let flown = flight.fault(5 * S, Fault::Garbage(8 + plate, false)).fly(7 * S);
        assert!(flown.report.struck["garbage"] > 0);
        let marked = |second| flown.second(second).iter().all(|r| r.errors.0 == 1 << (8 + plate));
        assert!(marked(4) && flown.second(3)[1..].iter().all(|r| r.errors.0 == 1 << (8 + plate)));
        assert!(flown.second(6).iter().all(|reading| reading.errors.0 == 0));
    }
}

/// S6: the second try of `Acquisition::read`.
#[test]
fn s6_a_byte_that_is_not_acknowledged_once_costs_no_reading() {
    // Cycles begin 150 ms into the second and every 200 ms. In each the address of one accelerometer is refused for 20 us, each
    // time a little later: some of these meet it.
    let mut flight = still();
    for cycle in 0..140 {
        let at = 3 * S + 150 * MS + cycle * (200 * MS + 15_000);
        flight = flight
            .fault(at, Fault::Nack(1, Some(0)))
            .fault(at + 20_000, Fault::Nack(1, None));
    }
    let flown = flight.fly(32 * S);
    assert!(flown.report.struck["nack"] >= 1, "{:?}", flown.report.struck);
    let marked = flown.packets.iter().skip(3).filter(|(_, r)| r.errors.0 != 0).count();
    assert_eq!(marked, 0, "{:?}", flown.report.struck);
}

/// S3: `Standing::Doubted`. Whichever sensor is being read, it is back in the next packet.
#[test]
fn s3_a_part_that_holds_sda_costs_one_packet() {
    let mut flight = still().say(1, b"G_DL");
    for second in 3..16 {
        let at = second * S + 150 * MS + (second - 3) * 500_000;
        flight = flight.fault(at, Fault::SdaHeld(9));
    }
    let flown = flight.fly(17 * S);
    let marked = |second: u64| flown.second(second).iter().filter(|r| r.errors.0 != 0).count();
    let marked: Vec<usize> = (3..16).map(marked).collect();
    assert!(marked.iter().all(|packets| *packets <= 1), "{marked:?}");
    assert!(marked.iter().filter(|packets| **packets > 0).count() >= 6, "{marked:?}");
    assert!(ever(&flown, Health::BUS_RECOVERED));
}

/// U7: 2^32 us after the clock's start, which is 71.6 min of a flight.
#[test]
fn u7_a_clock_beyond_32_bits_of_microseconds_changes_nothing() {
    let flown = still().fault(0, Fault::ClockSteps(4_289_900_000)).fly(10 * S);
    assert_eq!(flown.report.struck["clock-step"], 1);
    let beyond = flown.derived.iter().any(|frame| frame.start_us > 1 << 32);
    assert!(beyond && flown.second(9).iter().all(|reading| reading.errors.0 == 0));
    assert!(flown.periods().iter().all(|period| period.abs_diff(200 * MS) <= 2 * MS));
}

/// `next_on_grid` in the gyros' part: after a pause of the processor it samples what comes, not what is past.
#[test]
fn a_clock_that_leaps_does_not_make_the_gyros_run_after_it() {
    let flown = still().fault(3 * S, Fault::ClockSteps(5_000_000)).fly(8 * S);
    assert_eq!(flown.report.struck["clock-step"], 1);
    let counts: Vec<_> = flown.derived.iter().map(|f| f.increments.gyro[0].count).collect();
    assert!(
        counts.len() > 20 && counts.iter().all(|count| *count <= 21),
        "{counts:?}"
    );
}

/// S8: `Gyros::fast` asks anew who answers before it takes a word. The identity before each sample tells a line of random words.
#[test]
fn s8_a_gyro_that_answers_at_random_adds_no_word_to_its_increments() {
    for plate in 0..4 {
        let begins = 20 * S + 100 * MS;
        let flight = Flight::ideal(world("tumble")).say(1, b"G_DL");
        let flown = flight.fault(begins, Fault::Garbage(8 + plate, true)).fly(23 * S);
        assert!(flown.report.struck["garbage"] > 20);
        let gyros: Vec<_> = (flown.derived.iter())
            .filter(|frame| frame.start_us > 19_700_000)
            .map(|frame| frame.increments.gyro[plate])
            .collect();
        // Cycles begin 150 ms into the second and every 200 ms: of the third it answered for 150 ms.
        assert!(gyros[..2].iter().all(|gyro| gyro.count >= 19), "{gyros:?}");
        assert!(
            gyros[2].count >= 10 && gyros[2..].iter().all(|gyro| gyro.count <= 16),
            "{gyros:?}"
        );
        // The tumble stays below 180 deg/s, 2457 counts; random words reach 8191.
        let most = gyros
            .iter()
            .filter(|gyro| gyro.count > 0)
            .map(|gyro| gyro.least.abs().max(gyro.most.abs()));
        assert!(most.max() < Some(2457), "{gyros:?}");
    }
}

/// C4: the parser forgets what came before a damaged byte. Otherwise G_ME sent twice, its fourth byte lost, would be heard as
/// G_MG, and begin to record.
#[test]
fn c4_a_damaged_byte_ends_the_word_that_it_is_in() {
    let noisy = |on| Fault::UmbilicalNoise(on);
    let flown = still()
        .say(S, b"G_MVG_MV")
        .say(2 * S, b"G_M")
        .fault(2 * S + 100 * MS, noisy(true))
        .say(2 * S + 200 * MS, b"E")
        .fault(2 * S + 300 * MS, noisy(false))
        .say(2 * S + 400 * MS, b"G_ME")
        .say(3 * S, b"G_ST")
        .fly(4 * S);
    assert_eq!(flown.report.struck["umbilical-noise"], 1);
    assert!(flown.replied("G_ME: send G_ME within 10 s"), "{:?}", flown.replies());
    assert!(
        flown.replied("G_ST FLIGHT task none recording 0"),
        "{:?}",
        flown.replies()
    );
}

/// U10: another pass over the image that gives another checksum.
#[test]
fn u10_a_bit_of_the_image_that_flips_is_said_and_in_the_status() {
    let told = |line: String| Some(line.strip_prefix("G_ST")?.rsplit_once(" image ")?.1.to_string());
    let flown = still()
        .say(4 * S, b"G_ST")
        .fault(5 * S, Fault::ImageFlip(77))
        .say(8 * S, b"G_ST")
        .fly(9 * S);
    let said: Vec<String> = flown.replies().into_iter().filter_map(told).collect();
    assert!(said.len() == 2 && said[0] != said[1], "{said:?}");
    let line = format!("firmware image CHANGED: checksum {}, was {}", said[1], said[0]);
    assert_eq!(
        flown.replies().iter().filter(|reply| **reply == line).count(),
        1,
        "{:?}",
        flown.replies()
    );
    assert!(!still().fly(9 * S).replied("CHANGED"));
}

/// C10: a frame has the time it takes at 9600 baud. A packet takes 163 ms there, and is whole.
#[test]
fn c10_on_a_slow_line_frames_are_whole_or_not_there() {
    for (derived, least) in [(false, 38), (true, 3)] {
        let flight = Flight::ideal(world("still")).fault(2 * S, Fault::LinesSlow(12));
        let flight = if derived { flight.say(S, b"G_DL") } else { flight };
        let flown = flight.fly(10 * S);
        assert!(flown.report.struck["lines-slow"] > 5);
        assert!(flown.strange.is_empty(), "{} bytes of a frame", flown.strange[0].len());
        let slow: Vec<_> = flown.packets.iter().filter(|(at, _)| *at > 2_300 * MS).collect();
        assert!(slow.len() >= least, "{} packets", slow.len());
        // No backlog: what comes is new.
        let late = |(at, reading): &(u64, emems::sample::Reading)| at.abs_diff(u64::from(reading.counter) * 200 * MS);
        let latest = slow.iter().map(|packet| late(packet)).max().unwrap_or(0);
        assert!(derived || latest < 600 * MS, "{latest} ns");
    }
}

/// C10: a line that takes no byte at all costs its frames, and the watchdog hears of the part all the same.
#[test]
fn c10_a_line_that_is_stuck_with_derived_frames_on_does_not_let_the_watchdog_bite() {
    let flown = still()
        .fault(3 * S, Fault::TelemetryStuck(true))
        .fault(3 * S, Fault::UmbilicalStuck(true))
        .say(2 * S, b"G_MTG_MT")
        .fault(9 * S, Fault::TelemetryStuck(false))
        .fault(9 * S, Fault::UmbilicalStuck(false))
        .fly(12 * S);
    assert!(flown.report.struck["telemetry-stuck"] > 3 && flown.report.struck["umbilical-stuck"] > 3);
    assert_eq!(flown.report.resets, []);
    assert_eq!(flown.second(11).len(), 5);
}

/// `BrownOut::falls_short`, at the start of `umbilical::send`.
#[test]
fn a_brown_out_level_below_what_the_board_asks_is_said_at_the_start() {
    for (set_mv, said) in [(0, true), (2_400, true), (2_700, false)] {
        let mut flight = still();
        flight.plant.options.brown_out.set_mv = set_mv;
        let flown = flight.fly(S);
        let line = format!("brown-out reset at {set_mv} mV, the board asks for 2700");
        assert_eq!(flown.replied(&line), said, "{:?}", flown.replies());
    }
}

/// `Resume::dips`: a reset does not make a bad supply a good one.
#[test]
fn dips_of_the_supply_are_counted_over_resets() {
    let dip = |flight: Flight, at| {
        let flight = flight.fault(at, Fault::SupplyFailing(true));
        flight.fault(at + 20 * MS, Fault::SupplyFailing(false))
    };
    let flight = dip(dip(still(), S), 2 * S).fault(3 * S, Fault::Reset);
    let flown = dip(flight, 4 * S)
        .say(2_900 * MS, b"G_ST")
        .say(5 * S, b"G_ST")
        .fly(6 * S);
    for dips in ["dips 2 ", "dips 3 "] {
        assert!(
            flown.replies().iter().any(|line| line.contains(dips)),
            "{:?}",
            flown.replies()
        );
    }
}
