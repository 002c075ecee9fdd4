//! A calibration set loaded over the umbilical: the estimation uses it, the log names it, a refused one changes nothing.

use emems::{
    calibration::{Ranges, Set},
    derived::Derived,
    estimate::Estimator,
    flight_log::{
        LOG_START, page,
        record::{self, Content},
    },
    nand::{PAGES_PER_BLOCK, PageAddress},
    unit::Settings,
};
use host_tests::{Flight, Flown, MS, S, replay, set_words, world};
use twin::plant::Plant;

fn nominal() -> Set {
    Set::nominal(Ranges::of(&Settings::NOMINAL))
}

/// Every accelerometer's count is worth two percent more, gyro 4 is thirty counts off.
fn other() -> Set {
    let mut set = nominal();
    set.identity.set = 5;
    set.acc.iter_mut().for_each(|axis| axis.scale *= 1.02);
    set.gyro[3].bias_counts = 30.0;
    set
}

/// A unit with noise and biases in a rotation test, derived frames on from the first.
fn flight() -> Flight {
    let world = world("rotation-1");
    let plant = Plant::new(world.clone(), 7);
    Flight {
        plant,
        ..Flight::ideal(world)
    }
    .say(MS, b"G_DL")
}

/// Cycles whose frame is not, bit for bit, what `sets` make of it, each from its cycle on.
fn differing(flown: &Flown, sets: &[(u16, Set)]) -> Vec<u16> {
    let mut estimator = Estimator::of(&Settings::NOMINAL);
    replay::differing(flown, |frame, sample| {
        if let Some((_, set)) = sets.iter().find(|(from, _)| *from == frame.counter) {
            estimator = Estimator::new(*set, &Settings::NOMINAL.site);
        }
        estimator.step(sample, &frame.increments)
    })
}

#[test]
fn a_loaded_set_makes_the_estimate_from_the_next_cycle_on_and_replays() {
    let sent = set_words(&other());
    let flown = flight().say(4 * S, &sent).say(8 * S, b"G_CLG_CK").fly(30 * S);
    assert!(flown.replied("G_CL ok: set 5"), "{:?}", flown.replies());
    let first = differing(&flown, &[])[0];
    // 8 s after power-on, the first cycle some 0.4 s after it.
    assert!((37..41).contains(&first), "{first}");
    assert_eq!(differing(&flown, &[(first, other())]), []);
    let mean_force = |frames: &[Derived]| {
        let norms = frames
            .iter()
            .map(|frame| nalgebra::Vector3::from(frame.estimate.force_b).norm());
        norms.sum::<f32>() / frames.len() as f32
    };
    let ratio = mean_force(&flown.derived[40..]) / mean_force(&flown.derived[..36]);
    // The unit turns between and its biases stand elsewhere: half a percent.
    assert!((ratio / 1.02 - 1.0).abs() < 5e-3, "{ratio}");
}

#[test]
fn a_refused_set_changes_no_bit_of_the_estimate() {
    let mut spoilt = set_words(&other());
    spoilt[16 * 40 + 10] ^= 1;
    let flown = flight().say(4 * S, &spoilt).say(8 * S, b"G_CLG_CK").fly(15 * S);
    assert!(flown.replied("G_CL no: checksum"), "{:?}", flown.replies());
    assert_eq!(differing(&flown, &[]), []);
}

/// The sets that the headers on the chip name, oldest first.
fn named(flown: Flown) -> Vec<String> {
    let mut chip = flown.nand.expect("a chip");
    let mut found = std::collections::BTreeMap::new();
    for (block, page) in
        (LOG_START..LOG_START + 20).flat_map(|block| (0..PAGES_PER_BLOCK).map(move |page| (block, page)))
    {
        let mut bytes = chip.read(PageAddress { block, page });
        let whole = page::correct(&mut bytes);
        for half in (0..2).filter(|half| whole[*half].is_ok()) {
            if let Ok((key, Content::Header(header))) = record::decode(page::record(&bytes, half)) {
                found.insert(key, header.calibration.as_str().to_string());
            }
        }
    }
    found.into_values().collect()
}

#[test]
fn the_log_names_the_set_it_was_recorded_with() {
    let name = format!("5:{:08X}", other().checksum());
    let words = set_words(&other());
    let recorded = |flight: Flight, at: u64| flight.say(at * S, b"G_MVG_MV").say((at + 1) * S, b"G_MGG_MG");
    let before = recorded(flight().say(2 * S, &words).say(6 * S, b"G_CLG_CK"), 7).fly(12 * S);
    assert_eq!(named(before), std::slice::from_ref(&name));
    let between = recorded(flight(), 2)
        .say(6 * S, b"G_MEG_ME")
        .say(7 * S, &words)
        .say(11 * S, b"G_CLG_CK");
    assert_eq!(named(recorded(between, 12).fly(18 * S)), [String::new(), name]);
}
