//! Packets that something happens to on their way from the unit to whoever watches.
//!
//! In: the lines of a flight, and what happens to its packets ([`Transit`]). Out: the same lines to the watcher. Where something
//! happens to packets they are held back until the flight is over, for a transit sees all of them; everything else passes at
//! once.

use emems::packet;
use trials::scene::Transit;
use twin::{
    part::Nanos,
    run::{Bench, Flow},
};

/// Stands between the unit and the watcher.
pub struct Through<'a> {
    watch: &'a mut dyn Bench,
    transit: Vec<Transit>,
    held: Vec<(Nanos, Vec<u8>)>,
}

impl<'a> Through<'a> {
    /// Before take-off.
    pub fn new(watch: &'a mut dyn Bench, transit: Vec<Transit>) -> Self {
        Through {
            watch,
            transit,
            held: Vec::new(),
        }
    }

    /// After landing: what was held back goes on.
    pub fn finish(self) {
        let mut readings: Vec<_> = self
            .held
            .iter()
            .filter_map(|(_, bytes)| packet::decode(bytes).ok())
            .collect();
        for transit in &self.transit {
            transit(&mut readings);
        }
        let mut readings = readings.into_iter();
        for (at, bytes) in &self.held {
            match packet::decode(bytes) {
                Err(_) => self.watch.telemetry(*at, bytes),
                // There are fewer where some were lost.
                Ok(_) => {
                    if let Some(reading) = readings.next() {
                        self.watch.telemetry(*at, &packet::encode(&reading));
                    }
                }
            }
        }
    }
}

impl Bench for Through<'_> {
    fn telemetry(&mut self, at: Nanos, bytes: &[u8]) {
        match self.transit.is_empty() {
            true => self.watch.telemetry(at, bytes),
            false => self.held.push((at, bytes.to_vec())),
        }
    }

    fn umbilical(&mut self, at: Nanos, bytes: &[u8]) {
        self.watch.umbilical(at, bytes);
    }

    fn log(&mut self, at: Nanos, line: &str) {
        self.watch.log(at, line);
    }

    fn commands(&mut self, now: Nanos) -> Vec<u8> {
        self.watch.commands(now)
    }

    fn advanced(&mut self, now: Nanos) -> Flow {
        self.watch.advanced(now)
    }
}
