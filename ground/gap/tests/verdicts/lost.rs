//! Packets that were lost and that nobody counted, without a reference.

use gap::{
    input::log::Log,
    parity::{
        ATTITUDE, analysed,
        flight::Flight,
        lost::{Losses, put_back},
    },
};
use serde_json::Value;
use tempfile::TempDir;
use twin::{
    effect::{Active, Cause, Locality, by_name},
    predict::Kind,
};

use crate::parity::flown;

/// \[s\] from which on the log is early.
const FROM_S: f64 = 41.1;

/// So many packets lost.
fn lost(packets: usize) -> Active {
    Active {
        cause: Cause {
            effect: by_name("packet-loss").expect("is in the library"),
            locality: Locality::Unit,
            variant: FROM_S,
        },
        theta: vec![0.2 * packets as f64],
    }
}

fn opened(folder: &TempDir) -> Flight {
    Flight::open(folder.path()).expect("opens")
}

fn tumbling(active: &[Active]) -> Flight {
    opened(&flown("tumble", 0.0, 3, active, |_| true))
}

/// A log with the values of a kind changed in some rows.
fn changed(log: &Log, flight: &Flight, kind: Kind, rows: std::ops::Range<u32>, by: impl Fn(usize) -> f64) -> Log {
    let mut log = log.clone();
    for (index, (channel, series)) in flight.unit.channels.iter().zip(&mut log.channels).enumerate() {
        for (row, value) in series.rows.iter().zip(&mut series.values) {
            if channel.sensor == kind && rows.contains(row) {
                *value += by(index);
            }
        }
    }
    log
}

#[test]
fn lost_packets_are_named_counted_and_put_back() {
    let folder = flown("tumble", 0.0, 3, &[lost(2)], |_| true);
    let texts = analysed(folder.path(), &[], &|_, _| ()).expect("has redundancy");
    let text = |wanted: &str| &texts.iter().find(|(name, _)| name == wanted).expect("is written").1;
    let verdict: Value = serde_json::from_str(text("verdict.json")).expect("reads");
    assert_eq!(verdict["outcome"], "named");
    let [cause] = verdict["causes"].as_array().expect("causes").as_slice() else {
        panic!("{}", verdict["causes"])
    };
    assert_eq!(
        (&cause["effect"], &cause["by"]),
        (&"packet-loss".into(), &"turns".into())
    );
    let [loss] = cause["losses"].as_array().expect("losses").as_slice() else {
        panic!("{cause}")
    };
    assert_eq!(loss["packets"], 2);
    assert!(
        (loss["after_s"].as_f64().expect("a time") - FROM_S).abs() < 0.2,
        "{loss}"
    );
    assert!(
        verdict["gap"]["after"].as_f64().expect("a gap") < 1.05,
        "{}",
        verdict["gap"]
    );
    // The last packet of the fit windows, 0.4 s later than told.
    let last = text(ATTITUDE).lines().last().expect("rows");
    assert!(last.starts_with("110.2"), "{last}");
    let page = text("index.html");
    assert!(page.contains("Packets were lost that nobody counted. The sensors agree with each other"));
}

#[test]
fn a_whole_log_has_lost_nothing_and_says_how_often_a_loss_would_show() {
    let flight = tumbling(&[]);
    let losses = Losses::of(&flight.whole, &flight.unit);
    assert_eq!(losses.found, []);
    assert!(losses.shown.is_some_and(|share| share > 0.5), "{:?}", losses.shown);
}

#[test]
fn a_unit_that_lies_still_shows_no_loss() {
    let flight = opened(&flown("still", 0.0, 3, &[lost(2)], |_| true));
    let losses = Losses::of(&flight.whole, &flight.unit);
    assert_eq!(losses.found, []);
    assert!(losses.shown.is_some_and(|share| share < 0.01), "{:?}", losses.shown);
}

#[test]
fn a_field_that_steps_and_one_row_that_is_off_are_no_loss() {
    let flight = tumbling(&[]);
    for step in [3.0, 10.0, 30.0] {
        for kind in [Kind::Magnetometer, Kind::Accelerometer] {
            // The three axes of a plate get different parts of the step.
            let by = |index: usize| step * [1.0, -0.6, 0.3][index % 3];
            for rows in [200..201, 200..u32::MAX] {
                let log = changed(&flight.whole, &flight, kind, rows.clone(), by);
                assert_eq!(Losses::of(&log, &flight.unit).found, [], "{kind:?} {step} {rows:?}");
            }
        }
    }
}

#[test]
fn two_losses_are_both_put_back() {
    let flight = tumbling(&[]);
    let mut log = flight.whole.clone();
    // Rows are taken out by telling all later ones a cycle earlier and leaving out the row itself.
    for row in [400, 180] {
        log.start_s.remove(row);
        log.start_s[row..].iter_mut().for_each(|start_s| *start_s -= 0.2);
        for series in &mut log.channels {
            *series = series.only(|own| own != row);
            series
                .rows
                .iter_mut()
                .filter(|own| **own > row as u32)
                .for_each(|own| *own -= 1);
        }
    }
    let losses = Losses::of(&log, &flight.unit).found;
    let told: Vec<(f64, usize)> = losses.iter().map(|loss| (loss.after_s, loss.packets)).collect();
    assert_eq!(told.len(), 2, "{told:?}");
    for ((after_s, packets), expected_s) in told.iter().zip([179.0 * 0.2, 398.0 * 0.2]) {
        assert!((after_s - expected_s).abs() < 0.1 && *packets == 1, "{told:?}");
    }
    put_back(&mut log.start_s, &losses);
    let (last, whole) = (log.start_s.last(), flight.whole.start_s.last());
    assert!((last.expect("rows") - whole.expect("rows")).abs() < 1e-6);
}
