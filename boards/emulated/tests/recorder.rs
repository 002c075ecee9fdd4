//! The recorder of the release image: its NAND on the FSMC, and power cuts at random instants of a flight.
//!
//! Per change `CUTS` cuts; the long set is `EMEMS_CUTS=5000 cargo host-test --test recorder`.

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
    part::{Nanos, nand::Cells},
    plant::Plant,
    run::{Fault, Scheduled},
};

/// Cuts per change, over runs of [`CUTS_A_RUN`].
const CUTS: u64 = 200;
const CUTS_A_RUN: u64 = 20;
/// [ns] from one cut to the next, before the draw.
const BETWEEN: Nanos = 900 * MS;
/// [ns] from reset to the first durable record. Half of it is the gyros' start after power-on.
const BACK: Nanos = 400 * MS + 250 * MS;

fn logged(mut chip: Cells) -> BTreeMap<Key, Entry> {
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

/// What is on the telemetry line until `BACK` before a cut or the end must be in the log.
fn flown(faults: &[Scheduled], ends: Nanos) -> (Tape, BTreeMap<Key, Entry>, Cells) {
    let mut tape = Tape {
        script: vec![(600 * MS, b"G_MVG_MVG_MG".to_vec())],
        ..Tape::default()
    };
    let plant = Plant::ideal(world("still"));
    let (_, plant) = fly_keeping(&Options::default(), image(), plant, faults, ends, &mut tape)
        .unwrap_or_else(|error| panic!("{error}"));
    let chip = plant.lock().nand.cells.clone();
    (tape, logged(chip.clone()), chip)
}

#[test]
fn the_image_records_every_packet_from_g_mg_on() {
    let (tape, logged, chip) = flown(&[], 2_500 * MS);
    let kept: BTreeSet<_> = logged.values().map(|entry| entry.packet).collect();
    let sent = tape.packets();
    let missing = sent
        .iter()
        .filter(|(at, reading)| *at > 1_000 * MS && !kept.contains(&packet::encode(reading)));
    let missing: Vec<_> = missing.map(|(at, _)| at).collect();
    assert_eq!(missing, Vec::<&Nanos>::new(), "{}", tape.said());
    assert!(kept.len() >= 8, "{}", tape.said());
    assert_eq!(chip.breaks, []);
}

#[test]
fn cuts_at_random_instants_lose_no_record_and_end_in_flight() {
    let cuts = std::env::var("EMEMS_CUTS")
        .ok()
        .and_then(|text| text.parse().ok())
        .unwrap_or(CUTS);
    let runs = cuts.div_ceil(CUTS_A_RUN);
    // A run is minutes of one core: odd and even ones side by side.
    std::thread::scope(|scope| {
        for first in 0..2 {
            scope.spawn(move || (first..runs).step_by(2).for_each(cut_again_and_again));
        }
    });
    println!("{} cuts", runs * CUTS_A_RUN);
}

/// One flight with [`CUTS_A_RUN`] cuts.
fn cut_again_and_again(run: u64) {
    let mut at = 1_200 * MS;
    let mut faults = Vec::new();
    for number in 0..CUTS_A_RUN {
        // A draw from the run's number, so that a failing run is flown again by it.
        let draw = (run * CUTS_A_RUN + number + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 20;
        at += BETWEEN + draw % (200 * MS);
        faults.push(Scheduled {
            at,
            fault: Fault::PowerCut(draw as usize % 9),
        });
    }
    let ends = at + 1_000 * MS;
    let (tape, logged, chip) = flown(&faults, ends);
    assert_eq!(chip.breaks, [], "run {run}");
    let kept: BTreeSet<_> = logged.values().map(|entry| entry.packet).collect();
    let boots: BTreeSet<u32> = logged.keys().map(|key| key.boot).collect();
    assert_eq!(
        boots.len() as u64,
        CUTS_A_RUN + 1,
        "run {run}: back in FLIGHT and recording each time"
    );
    for (sent, reading) in tape.packets().iter().filter(|(sent, _)| *sent > 1_000 * MS) {
        let excused = faults.iter().any(|fault| (fault.at..fault.at + BACK).contains(sent));
        let struck = faults.iter().any(|fault| (*sent..*sent + 5 * MS).contains(&fault.at));
        assert!(
            excused || struck || kept.contains(&packet::encode(reading)),
            "run {run}: sent at {sent}, not kept"
        );
    }
}
