//! What is found of packets that are taken out of whole logs: `cargo run --example lost -- CASE...`.
//!
//! In: folders of cases whose logs are whole; a motion that is there is not looked at. Out: of each what is found in it as it is, where one
//! lost packet would show, and how many of [`CUTS`] losses of one, two and five packets are found, each alone, with their number or with
//! another.

use std::{path::Path, time::Instant};

use gap::{
    input::log::{Log, Series},
    parity::{
        flight::Flight,
        lost::{Loss, Losses},
    },
};

/// Places of a log at which packets are taken out, evenly apart.
const CUTS: usize = 7;

fn main() {
    for folder in std::env::args().skip(1) {
        match Flight::open(Path::new(&folder)) {
            Ok(flight) => tell(&folder, &flight),
            Err(error) => println!("{folder}: {error}"),
        }
    }
}

fn tell(folder: &str, flight: &Flight) {
    let began = Instant::now();
    let whole = Losses::of(&flight.whole, &flight.unit);
    let seconds = began.elapsed().as_secs_f64();
    println!("{folder}: {:?}; shown {:.2?}; {seconds:.2} s", whole.found, whole.shown);
    let Some(cycle_s) = flight.unit.cycle_s.filter(|_| whole.shown.is_some()) else {
        return;
    };
    for packets in [1, 2, 5] {
        let (mut right, mut another, mut elsewhere) = (0, 0, 0);
        for cut in 1..=CUTS {
            let row = cut * flight.whole.start_s.len() / (CUTS + 1);
            let log = without(&flight.whole, row..row + packets, packets as f64 * cycle_s);
            let is_here = |loss: &Loss| (loss.after_s - log.start_s[row - 1]).abs() < 1.5 * cycle_s;
            for loss in Losses::of(&log, &flight.unit).found {
                match (is_here(&loss), loss.packets == packets) {
                    (true, true) => right += 1,
                    (true, false) => another += 1,
                    (false, _) => elsewhere += 1,
                }
            }
        }
        println!("  {packets} lost, {CUTS} times: {right} found, {another} with another number, {elsewhere} elsewhere");
    }
}

/// A log without some rows, all later ones that much earlier.
fn without(log: &Log, rows: std::ops::Range<usize>, by_s: f64) -> Log {
    let series = |own: &Series| {
        let kept = own.rows.iter().zip(&own.values);
        let kept = kept.filter(|(row, _)| !rows.contains(&(**row as usize)));
        let (rows, values) = kept
            .map(|(row, value)| {
                let earlier = if *row as usize >= rows.end {
                    rows.len() as u32
                } else {
                    0
                };
                (row - earlier, *value)
            })
            .unzip();
        Series { rows, values }
    };
    let start_s = (log.start_s.iter().enumerate())
        .filter(|(row, _)| !rows.contains(row))
        .map(|(row, start_s)| if row >= rows.end { start_s - by_s } else { *start_s })
        .collect();
    Log {
        start_s,
        channels: log.channels.iter().map(series).collect(),
        ..log.clone()
    }
}
