//! The recorder in the unit: what the umbilical orders, and what resets, cuts and a dead chip do to it.

use std::collections::BTreeSet;

use emems::{
    flight_log::{
        LOG_START,
        dump::{self, DUMP_START},
        page,
        record::{self, Content, Key},
    },
    nand::{K9F1208_BLOCKS, PAGE_BYTES, PageAddress},
    packet::{self, PACKET_BYTES},
};
use host_tests::{Flight, Flown, MS, S, recorder::logged, world};
use twin::{part::Nanos, run::Fault};

/// \[ns\] lift-off of the rocket motion.
const LIFT_OFF: Nanos = 30 * S;

/// \[ns\] from a reset to the first record that is durable: two packets may be missing.
const BACK: Nanos = 400 * MS;

fn rocket() -> Flight {
    Flight::ideal(world("rocket"))
}

fn still() -> Flight {
    Flight::ideal(world("still"))
}

/// In FLIGHT and recording from 2 s on, without lift-off.
fn recording() -> Flight {
    still().say(S, b"G_MVG_MV").say(2 * S, b"G_MGG_MG")
}

fn counters(logged: &[(Key, [u8; PACKET_BYTES])]) -> Vec<u16> {
    let counter = |(_, packet): &(Key, [u8; PACKET_BYTES])| packet::decode(packet).expect("a whole packet").counter;
    logged.iter().map(counter).collect()
}

/// What a dump said: pages and records.
fn dumped(flown: &Flown) -> Vec<(u32, Content)> {
    let bytes = &flown.umbilical;
    let mut dumped = Vec::new();
    for (at, _) in bytes.iter().enumerate().filter(|(_, byte)| **byte == DUMP_START) {
        let end = bytes[at..].iter().position(|byte| *byte == b'\n');
        let frame = &bytes[at..at + end.map_or(0, |end| end + 1)];
        let packet = at
            .checked_sub(PACKET_BYTES)
            .and_then(|from| bytes[from..at].first_chunk());
        if let Some((page, record)) = dump::decode(frame, packet) {
            dumped.push((page, record::decode(&record).expect("a whole record").1));
        }
    }
    dumped
}

/// Every packet that telemetry sent between the first and the last one in the log is in the log.
fn check_no_gap_but_at(flown: &Flown, resets: &[Nanos]) {
    let logged = logged(flown.nand.clone().expect("a chip"));
    let kept: BTreeSet<_> = logged.iter().map(|(_, packet)| *packet).collect();
    let is_kept = |reading| kept.contains(&packet::encode(reading));
    let begun = flown.packets.iter().skip_while(|(_, reading)| !is_kept(reading));
    let missing: Vec<_> = begun.filter(|(_, reading)| !is_kept(reading)).collect();
    assert!(!kept.is_empty());
    for (at, reading) in missing {
        let excused =
            resets.iter().any(|reset| (*reset..*reset + BACK).contains(at)) || flown.report.flown - at < 50 * MS;
        assert!(excused, "packet {} at {at} was sent and not kept", reading.counter);
    }
}

#[test]
fn recording_begins_at_g_mg() {
    let flown = recording().say(4 * S, b"G_ST").fly(5 * S);
    assert!(flown.replied("G_ST recorder: last record"), "{:?}", flown.replies());
    assert!(logged(flown.nand.clone().expect("a chip")).len() >= 14);
    check_no_gap_but_at(&flown, &[]);
}

#[test]
fn recording_begins_at_lift_off_with_the_packet_that_shows_it() {
    let flown = rocket().fly(LIFT_OFF + 3 * S);
    let logged = logged(flown.nand.clone().expect("a chip"));
    let shows = flown
        .packets
        .iter()
        .find(|(_, reading)| reading.lift_off)
        .expect("lift-off")
        .1;
    let first = counters(&logged)[0];
    assert!(first <= shows.counter, "{first} {}", shows.counter);
    check_no_gap_but_at(&flown, &[]);
}

#[test]
fn f09_a_power_cut_in_flight_ends_in_flight_and_recording() {
    for (number, after) in [0, 37, 81, 123, 160, 199].into_iter().enumerate() {
        let strikes = LIFT_OFF + 5 * S + after * MS;
        let flown = rocket()
            .fault(strikes, Fault::PowerCut(number))
            .say(strikes + S, b"G_ST")
            .fly(strikes + 3 * S);
        assert!(
            flown.replied("G_ST FLIGHT task none recording 1"),
            "{:?}",
            flown.replies()
        );
        // Power-on: the gyros take 250 ms to answer before the first cycle.
        check_no_gap_but_at(&flown, &[strikes]);
        let boots: BTreeSet<u32> = logged(flown.nand.clone().expect("a chip"))
            .iter()
            .map(|(key, _)| key.boot)
            .collect();
        assert_eq!(boots.len(), 2);
    }
}

#[test]
fn f09_a_power_cut_without_lift_off_resumes_from_the_log_alone() {
    let strikes = 5 * S + 77 * MS;
    let flown = recording()
        .fault(strikes, Fault::PowerCut(3))
        .say(strikes + S, b"G_ST")
        .fly(strikes + 2 * S);
    assert!(
        flown.replied("G_ST FLIGHT task none recording 1"),
        "{:?}",
        flown.replies()
    );
    let after_landing = recording()
        .say(4 * S, b"G_MEG_ME")
        .fault(strikes, Fault::PowerCut(3))
        .say(strikes + S, b"G_ST")
        .fly(strikes + 2 * S);
    assert!(
        after_landing.replied("G_ST WAIT task none recording 0"),
        "G_ME leaves FLIGHT for good"
    );
}

#[test]
fn f08_a_record_is_durable_400_ms_after_a_reset_in_flight() {
    durable_after(Fault::Reset);
}

/// F9: however the unit went down.
#[test]
fn f09_a_record_is_durable_400_ms_after_a_power_cut_in_flight() {
    durable_after(Fault::PowerCut(2));
    durable_after(Fault::PowerCut(8));
}

/// Whatever the unit was at.
fn durable_after(fault: Fault) {
    for after in [0, 3, 9, 12, 77, 150] {
        let strikes = LIFT_OFF + 5 * S + after * MS;
        let is_back = |wait: Nanos| {
            let flown = rocket().fault(strikes, fault).fly(strikes + wait);
            let logged = logged(flown.nand.clone().expect("a chip"));
            logged.iter().map(|(key, _)| key.boot).collect::<BTreeSet<_>>().len() == 2
        };
        assert!(is_back(BACK), "{fault:?} {after} ms into a cycle");
        // To a millisecond.
        let mut back = 0..BACK / MS;
        while back.end - back.start > 1 {
            let middle = back.start + (back.end - back.start) / 2;
            if is_back(middle * MS) {
                back.end = middle;
            } else {
                back.start = middle;
            }
        }
        println!("{fault:?} {after} ms into a cycle: durable after {} ms", back.end);
    }
}

/// F8: 200 resets, each at another instant of the cycle, also in the middle of an operation, which they tear.
#[test]
fn f08_resets_at_random_instants_lose_no_record_and_end_in_flight() {
    const RESETS: u64 = 20;
    for run in 0..10 {
        let mut flight = rocket();
        let mut at = LIFT_OFF + S;
        for number in 0..RESETS {
            let draw = (run * RESETS + number + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 20;
            at += BACK + draw % (600 * MS);
            flight = flight.fault(at, Fault::Reset);
        }
        let flown = flight.fly(at + BACK);
        let logged = logged(flown.nand.clone().expect("a chip"));
        let boots: BTreeSet<u32> = logged.iter().map(|(key, _)| key.boot).collect();
        assert_eq!(boots.len() as u64, RESETS + 1, "run {run}");
        let kept: BTreeSet<_> = logged.iter().map(|(_, packet)| *packet).collect();
        let sent = flown.packets.iter().filter(|(at, _)| *at > LIFT_OFF + S);
        let missing = sent.filter(|(_, reading)| !kept.contains(&packet::encode(reading)));
        assert_eq!(missing.count(), 0, "run {run}");
        // What is missing is seen by its number: at most the packets of the time it took to be back.
        let counters = counters(&logged);
        assert!(
            counters
                .windows(2)
                .all(|pair| pair[1] > pair[0] && pair[1] - pair[0] <= 2),
            "{counters:?}"
        );
    }
}

/// Recording goes with the packets, as often as they come.
#[test]
fn at_50_hz_every_packet_is_recorded_and_the_room_left_is_said() {
    let mut flight = recording();
    flight.settings.period_ms = 20;
    let flown = flight.say(4 * S, b"G_ST").fly(6 * S);
    check_no_gap_but_at(&flown, &[]);
    assert!(logged(flown.nand.clone().expect("a chip")).len() >= 190);
    assert!(flown.replied("of 130816 pages, 0 bad blocks"), "{:?}", flown.replies());
    assert!(flown.replied("43 min left"), "{:?}", flown.replies());
}

/// F15, in the unit.
#[test]
fn f15_a_dead_or_absent_chip_costs_neither_packets_nor_the_console() {
    let dies = rocket().fault(LIFT_OFF + S, Fault::NandDead(true));
    let flown = dies.say(LIFT_OFF + 3 * S, b"G_DLG_ST").fly(LIFT_OFF + 6 * S);
    assert!(flown.replied("recorder: the NAND stays busy"), "{:?}", flown.replies());
    assert!(flown.periods().iter().all(|period| period.abs_diff(200 * MS) <= MS));
    assert!(
        flown
            .derived
            .iter()
            .all(|frame| frame.health.contains(emems::health::Health::RECORDER_REFUSED))
    );
    let absent = recording().fault(0, Fault::NandAbsent).say(3 * S, b"G_ST").fly(4 * S);
    assert!(
        absent.replied("recorder: no K9F1208 answers: identity FF FF"),
        "{:?}",
        absent.replies()
    );
    assert!(absent.periods().iter().all(|period| period.abs_diff(200 * MS) <= MS));
}

#[test]
fn a_chip_that_comes_back_is_used_again() {
    let flown = recording()
        .fault(4 * S, Fault::NandDead(true))
        .fault(6 * S, Fault::NandDead(false))
        .fly(12 * S);
    let kept = counters(&logged(flown.nand.clone().expect("a chip")));
    let last = flown.packets.last().expect("packets").1.counter;
    assert!(kept.last().expect("records") + 1 >= last, "{kept:?} {last}");
    assert!(flown.packets.len() > 50);
}

/// F20: nothing is begun once the supply fails.
#[test]
fn f20_a_failing_supply_begins_no_operation() {
    let fails = 4 * S + 30 * MS;
    let flown = recording().fault(fails, Fault::SupplyFailing(true)).fly(fails + 2 * S);
    assert!(
        flown.replied("recorder: the supply is failing"),
        "{:?}",
        flown.replies()
    );
    let kept = counters(&logged(flown.nand.clone().expect("a chip")));
    let sent_before = flown.packets.iter().filter(|(at, _)| *at < fails).count() as u16;
    assert!(*kept.last().expect("records") <= sent_before, "{kept:?} {sent_before}");
}

/// F19: a dump that was interrupted goes on at any page, and changes nothing.
#[test]
fn f19_a_dump_goes_on_where_it_was_interrupted() {
    let flight = || recording().say(8 * S, b"G_MEG_ME").say(9 * S, b"G_Ml");
    let whole = dumped(&flight().fly(14 * S));
    assert!(matches!(whole.first(), Some((0, Content::Header(_)))), "{whole:?}");
    let pages: BTreeSet<u32> = whole.iter().map(|(page, _)| *page).collect();
    assert!(pages.len() > 25 && whole.len() >= pages.len() - 1, "{pages:?}");
    let interrupted = flight()
        .say(9 * S + 500 * MS, b"G_MtG_Mt")
        .say(10 * S, b"G_LR00000AFFFFFF")
        .fly(14 * S);
    let resumed: BTreeSet<u32> = dumped(&interrupted).iter().map(|(page, _)| *page).collect();
    assert!(
        resumed.is_superset(&(10..*pages.last().expect("pages")).collect()),
        "{resumed:?}"
    );
    assert!(interrupted.replied("dump ends at page"), "{:?}", interrupted.replies());
}

/// F16, in the unit.
#[test]
fn f16_a_full_recorder_says_so_and_packets_go_on() {
    let mut flight = recording();
    // All blocks but two begin with a page of this log.
    let chip = &mut flight.plant.nand.cells;
    let tag = page::Tag {
        kind: page::PageKind::Log,
        epoch: 0,
        boot: 0,
    };
    for block in LOG_START..K9F1208_BLOCKS - 2 {
        let at = PageAddress { block, page: 0 };
        let mut bytes = [0; PAGE_BYTES];
        page::compose(&mut bytes, &[0; 256], &[0; 256]);
        page::address(&mut bytes, at, tag);
        chip.program(at, &bytes);
    }
    let flown = flight.say(18 * S, b"G_DL").say(19 * S, b"G_ST").fly(21 * S);
    assert!(flown.replied("recorder: full"), "{:?}", flown.replies());
    assert!(
        flown
            .derived
            .iter()
            .all(|frame| frame.health.contains(emems::health::Health::RECORDER_REFUSED))
    );
    assert!(flown.periods().iter().all(|period| period.abs_diff(200 * MS) <= MS));
}

#[test]
fn an_erase_empties_the_log_in_free_time_and_packets_go_on() {
    let flown = recording()
        .say(4 * S, b"G_MEG_ME")
        .say(5 * S, b"G_MAG_CA")
        .say(30 * S, b"G_ST")
        .fly(31 * S);
    assert!(flown.replied("G_MA done: recorder is empty"), "{:?}", flown.replies());
    // The header and its copy, and that an erase was armed and made.
    assert!(flown.replied("G_ST recorder 4 of"), "{:?}", flown.replies());
    assert!(flown.replied("G_ST recorder: empty"), "{:?}", flown.replies());
    assert!(flown.periods().iter().all(|period| period.abs_diff(200 * MS) <= MS));
    assert!(logged(flown.nand.clone().expect("a chip")).is_empty());
}

#[test]
fn lift_off_during_an_erase_is_recorded_all_the_same() {
    let flown = rocket().say(LIFT_OFF - S, b"G_MAG_CA").fly(LIFT_OFF + 4 * S);
    assert!(logged(flown.nand.clone().expect("a chip")).len() >= 18);
    check_no_gap_but_at(&flown, &[]);
}
