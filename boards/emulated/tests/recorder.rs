//! The recorder of the release image: its NAND on the FSMC, its supply, and power cuts and resets at random instants of a flight.
//!
//! Per change [`CUTS`] cuts; the long set is in `.ci/long`. Cuts are drawn
//! from the number of their run, which a failure names.

mod bench;

use std::collections::{BTreeMap, BTreeSet};

use bench::{MS, Tape, image, world};
use emems::{
    flight_log::{
        LOG_START, page,
        record::{self, Content, Entry, Key},
    },
    nand::{PAGES_PER_BLOCK, PageAddress},
    packet,
};
use emulated::{Options, flight::fly_keeping};
use twin::{
    part::{Nanos, nand::latch::K9f1208},
    plant::Plant,
    run::{Fault, Scheduled},
};

/// Cuts per change, over runs of [`CUTS_A_RUN`]: a run for each of two cores.
const CUTS: u64 = 16;
const CUTS_A_RUN: u64 = 8;
/// \[ns\] from reset to the first durable record. A cut of the supply takes 250 ms of it: the gyros' start.
const BACK: Nanos = 400 * MS;
/// \[ns\] from one cut to the next at most. One in three comes when the unit has to be back, and not later.
const LONGEST: Nanos = 1_300 * MS;

fn logged(chip: &K9f1208) -> BTreeMap<Key, Entry> {
    let mut chip = chip.cells.clone();
    let mut found = BTreeMap::new();
    for block in LOG_START..LOG_START + 60 {
        for page in 0..PAGES_PER_BLOCK {
            let mut bytes = chip.read(PageAddress { block, page });
            let whole = page::correct(&mut bytes);
            for half in (0..2).filter(|half| whole[*half].is_ok()) {
                if let Ok((key, Content::Packet(entry))) = record::decode(page::record(&bytes, half)) {
                    found.insert(key, entry);
                }
            }
        }
    }
    found
}

/// A flight that records from 0.6 s on.
fn flown(faults: &[Scheduled], ends: Nanos) -> (Tape, K9f1208) {
    let mut tape = Tape {
        script: vec![(600 * MS, b"G_MVG_MVG_MGG_MG".to_vec())],
        ..Tape::default()
    };
    let plant = Plant::ideal(world("still"));
    let (_, plant) = fly_keeping(&Options::default(), image(), plant, faults, ends, &mut tape)
        .unwrap_or_else(|error| panic!("{error}"));
    let chip = plant.lock().nand.clone();
    assert_eq!(chip.cells.breaks, []);
    (tape, chip)
}

/// Packets that were sent while recording and are not in the log.
fn missing(tape: &Tape, logged: &BTreeMap<Key, Entry>) -> Vec<Nanos> {
    let kept: BTreeSet<_> = logged.values().map(|entry| entry.packet).collect();
    let sent = tape.packets().into_iter().filter(|(at, _)| *at > 1_000 * MS);
    sent.filter(|(_, reading)| !kept.contains(&packet::encode(reading)))
        .map(|(at, _)| at)
        .collect()
}

fn boots(logged: &BTreeMap<Key, Entry>) -> usize {
    logged.keys().map(|key| key.boot).collect::<BTreeSet<_>>().len()
}

#[test]
fn the_image_records_every_packet_from_g_mg_on() {
    let (tape, chip) = flown(&[], 2_500 * MS);
    let logged = logged(&chip);
    assert_eq!(missing(&tape, &logged), Vec::<Nanos>::new(), "{}", tape.said());
    assert!(logged.len() >= 8, "{}", tape.said());
    assert!(chip.is_protected(), "WP# is low but for the time of an operation");
}

/// Fault F20: the voltage detector sees the supply below 2.9 V, and nothing is begun until it is back.
#[test]
fn a_failing_supply_begins_no_operation() {
    let (fails, returns) = (2_030 * MS, 3_500 * MS);
    let at = |at, failing| Scheduled {
        at,
        fault: Fault::SupplyFailing(failing),
    };
    let faults = [at(fails, true), at(returns, false)];
    let until_back = || (flown(&faults, fails + MS).1, flown(&faults, returns));
    // It looks again every 2 s.
    let ((before, (tape, during)), (looked_again, after)) = std::thread::scope(|scope| {
        let until_back = scope.spawn(until_back);
        let afterwards = flown(&faults, returns + 3_000 * MS);
        (until_back.join().expect("it flies"), afterwards)
    });
    assert!(
        tape.said().contains("recorder: the supply is failing"),
        "{}",
        tape.said()
    );
    assert_eq!(during.cells.operations, before.cells.operations);
    let late = |at: &&Nanos| **at > returns + 2_200 * MS;
    let missing = missing(&looked_again, &logged(&after));
    let said = looked_again.said();
    assert_eq!(missing.iter().filter(late).count(), 0, "{missing:?} {said}");
}

/// One flight with [`CUTS_A_RUN`] cuts. What telemetry has sent whole is in the log: a record is durable 2 ms after its
/// packet closes, the last byte of the packet is out after 14 ms. No time is excused after a cut.
fn cut_again_and_again(run: u64) {
    let mut at = 1_200 * MS;
    let mut faults = Vec::new();
    for number in 0..CUTS_A_RUN {
        let draw = (run * CUTS_A_RUN + number + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 20;
        at += if draw.is_multiple_of(3) {
            BACK
        } else {
            BACK + draw % (LONGEST - BACK)
        };
        // One in four is a reset.
        let fault = match draw >> 8 & 3 {
            0 => Fault::Reset,
            _ => Fault::PowerCut((draw >> 16) as usize % 9),
        };
        faults.push(Scheduled { at, fault });
    }
    let (tape, chip) = flown(&faults, at + BACK);
    let logged = logged(&chip);
    assert_eq!(
        boots(&logged) as u64,
        CUTS_A_RUN + 1,
        "run {run}: back in FLIGHT and recording each time"
    );
    assert_eq!(missing(&tape, &logged), Vec::<Nanos>::new(), "run {run}: {faults:?}");
}

/// What takes more than six seconds of a core.
mod long {
    use super::*;

    #[test]
    #[ignore = "takes more than six seconds: cargo host-test-long runs it"]
    fn cuts_at_random_instants_lose_no_record_and_end_in_flight() {
        let cuts = std::env::var("EMEMS_CUTS")
            .ok()
            .and_then(|text| text.parse().ok())
            .unwrap_or(CUTS);
        let runs = cuts.div_ceil(CUTS_A_RUN);
        // A run is half a minute of one core: odd and even ones side by side.
        std::thread::scope(|scope| {
            for first in 0..2 {
                scope.spawn(move || (first..runs).step_by(2).for_each(cut_again_and_again));
            }
        });
        println!("{} cuts, back each time, nothing lost", runs * CUTS_A_RUN);
    }

    /// The shortest time after which a record was durable, by faults that leave less and less of it.
    #[test]
    #[ignore = "takes more than six seconds: cargo host-test-long runs it"]
    fn a_record_is_durable_400_ms_after_a_power_cut_and_sooner_after_a_reset() {
        for (fault, longest) in [(Fault::PowerCut(2), BACK), (Fault::Reset, 150 * MS)] {
            let gaps: Vec<Nanos> = (0..6).map(|step| longest - step * 10 * MS).collect();
            let mut at = 1_500 * MS;
            let mut faults = vec![Scheduled { at, fault }];
            for gap in &gaps {
                at += gap;
                faults.push(Scheduled { at, fault });
            }
            let (_, chip) = flown(&faults, at + MS);
            let back = boots(&logged(&chip)) - 1;
            assert!(back > 0, "{fault:?}: no record {longest} ns after it");
            println!("{fault:?}: durable {} ms after it", gaps[back - 1] / MS);
        }
    }

    /// Fault F20: the voltage detector's interrupt draws WP# at once, whatever is under way.
    #[test]
    #[ignore = "takes more than six seconds: cargo host-test-long runs it"]
    fn a_supply_that_fails_in_the_middle_of_an_operation_draws_write_protect() {
        let (mut under_way, quarter) = (0, MS / 4);
        // A record is programmed soon after its packet closes, 10 ms after each cycle began.
        let cycle = flown(&[], 1_400 * MS).0.packets()[4].0 - 23_541 * 1_000;
        for step in 40..64 {
            let at = cycle + step * quarter;
            let (_, before) = flown(&[], at);
            if before.is_protected() {
                continue;
            }
            under_way += 1;
            let fails = Scheduled {
                at,
                fault: Fault::SupplyFailing(true),
            };
            let (_, after) = flown(&[fails], at + 5_000);
            assert!(after.is_protected(), "{step}: WP# is high 5 us after the supply failed");
            break;
        }
        assert!(under_way > 0, "no instant was in the middle of an operation");
    }

    /// F20: the supply is gone for 20 ms at some instants of a cycle. The record that it stopped is taken after it.
    #[test]
    #[ignore = "takes more than six seconds: cargo host-test-long runs it"]
    fn a_dip_of_20_ms_costs_no_record() {
        let mut stopped = 0;
        for after_ms in [0, 20, 60, 105, 150] {
            let fails = (2_000 + after_ms) * MS;
            let at = |at, failing| Scheduled {
                at,
                fault: Fault::SupplyFailing(failing),
            };
            let faults = [at(fails, true), at(fails + 20 * MS, false)];
            let (tape, chip) = flown(&faults, fails + 1_500 * MS);
            stopped += u64::from(tape.said().contains("recorder: the supply is failing"));
            let missing = missing(&tape, &logged(&chip));
            // The last packet may not have its record yet.
            assert!(
                missing.iter().all(|at| *at > fails + 1_400 * MS),
                "{after_ms} ms: {missing:?}"
            );
        }
        assert!(stopped > 0, "no dip met a record");
    }
}
