//! One flight of a drill: on the host board, or the image on the emulated one; the same faults, words and judge.

use std::panic::{AssertUnwindSafe, catch_unwind};

use emems::{
    derived::{DERIVED_BYTES, DERIVED_START},
    packet::{PACKET_BYTES, START},
};
use host_tests::{Flight, Flown, world};
use twin::{
    fault::{Planned, schedule},
    host::HostReport,
    part::{Nanos, nand::Cells},
    plant::Plant,
    run::{Bench, Flow, Scheduled},
};

use crate::catalogue::Fly;

/// Flies a plant on the emulated board until an instant: what is reported, and the recorder's cells afterwards. Given by the
/// ground program, so that this package is compiled and tested without the emulator.
pub type OnImage<'a> = dyn Fn(Plant, &[Scheduled], Nanos, &mut dyn Bench) -> Result<(HostReport, Cells), String> + 'a;

/// What flies the unit.
pub enum Board<'a> {
    /// The unit's code in virtual time.
    Host,
    /// The release image on the emulated board.
    Image(&'a OnImage<'a>),
}

impl Board<'_> {
    /// The letter of its place in [`twin::fault::Word::places`].
    pub fn letter(&self) -> char {
        match self {
            Board::Host => 'h',
            Board::Image(_) => 'i',
        }
    }
}

/// Which specimen is flown: parts with noise, since values that repeat are taken for frozen.
const UNIT: u64 = 1;

/// Faults of one flight, as written in the catalogue.
pub fn planned(text: &str) -> Vec<Planned> {
    // " x20" belongs to the word before it.
    let joined = text.replace(" x", "x");
    let words = joined.split_whitespace();
    words
        .map(|word| word.parse().unwrap_or_else(|error| panic!("the catalogue: {error}")))
        .collect()
}

/// Flies one plan of a drill; the reason if the unit's code panicked.
pub fn fly(board: &Board<'_>, drill: &Fly, plan: &str, seed: u64) -> Result<Flown, String> {
    let said = drill
        .said
        .iter()
        .map(|(ms, words)| (ms * host_tests::MS, words.as_bytes().to_vec()));
    let plant = Plant::new(world(drill.motion), UNIT);
    let strokes = schedule(&planned(plan), seed);
    flown(board, plant, strokes, said.collect(), drill.ms * host_tests::MS)
}

/// Flies a plant until an instant, with what befalls it and what is said on the umbilical and when.
///
/// # Errors
/// The unit's code panicked on the host, or the image cannot be flown.
pub fn flown(
    board: &Board<'_>,
    plant: Plant,
    strokes: Vec<Scheduled>,
    said: Vec<(Nanos, Vec<u8>)>,
    end: Nanos,
) -> Result<Flown, String> {
    match board {
        Board::Host => {
            let mut flight = Flight::ideal(world("still"));
            (flight.plant, flight.faults, flight.said) = (plant, strokes, said);
            // A panic of the unit's code is what a drill may find.
            catch_unwind(AssertUnwindSafe(|| flight.fly(end))).map_err(|panic| {
                let text = panic.downcast_ref::<String>().cloned();
                let text = text.or_else(|| panic.downcast_ref::<&str>().map(ToString::to_string));
                format!("the unit panics: {}", text.unwrap_or_default())
            })
        }
        Board::Image(image) => {
            let mut framed = Framed {
                flown: Flown::listening(said),
                frame: Vec::new(),
            };
            let (report, cells) = image(plant, &strokes, end, &mut framed)?;
            let mut flown = framed.flown;
            (flown.report, flown.nand) = (report, Some(cells));
            Ok(flown)
        }
    }
}

/// The emulated board's bytes as the frames that the host board gives.
struct Framed {
    flown: Flown,
    frame: Vec<u8>,
}

impl Bench for Framed {
    fn telemetry(&mut self, at: Nanos, bytes: &[u8]) {
        for byte in bytes {
            if [START, DERIVED_START].contains(byte) && !self.frame.is_empty() {
                self.flown.telemetry(at, &std::mem::take(&mut self.frame));
            }
            self.frame.push(*byte);
            let whole = match self.frame[0] {
                START => PACKET_BYTES,
                _ => DERIVED_BYTES,
            };
            if self.frame.len() == whole {
                self.flown.telemetry(at, &std::mem::take(&mut self.frame));
            }
        }
    }

    fn umbilical(&mut self, at: Nanos, bytes: &[u8]) {
        self.flown.umbilical(at, bytes);
    }

    fn log(&mut self, at: Nanos, line: &str) {
        self.flown.log(at, line);
    }

    fn commands(&mut self, now: Nanos) -> Vec<u8> {
        self.flown.commands(now)
    }

    fn advanced(&mut self, now: Nanos) -> Flow {
        self.flown.advanced(now)
    }
}
