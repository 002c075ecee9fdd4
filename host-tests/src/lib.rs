//! Behaviours of the unit, under std and in virtual time: what the tests share.

mod coasting;
pub mod counts;
pub mod recorder;
pub mod reference;
pub mod replay;
pub mod watched;

use std::{cell::RefCell, rc::Rc, sync::Arc};

pub use coasting::Coasting;

use emems::{
    derived::{self, DERIVED_BYTES, DERIVED_START, Derived},
    packet,
    sample::{Reading, Sample},
    site::Site,
    unit::Settings,
};
use twin::{
    host::{self, HostReport},
    part::{Nanos, nand::Cells},
    plant::{Plant, Quality},
    run::{Bench, Fault, Flow, Scheduled},
    truth::{Truth, TruthSource},
};

/// \[ns\] a millisecond.
pub const MS: Nanos = 1_000_000;
/// \[ns\] a second.
pub const S: Nanos = 1_000 * MS;

/// A flight to be made on the host board.
pub struct Flight {
    /// The parts and the world around them.
    pub plant: Plant,
    /// The unit's settings.
    pub settings: Settings,
    /// What befalls it.
    pub faults: Vec<Scheduled>,
    /// What is said on the umbilical, and when.
    pub said: Vec<(Nanos, Vec<u8>)>,
}

impl Flight {
    /// A nominal unit without noise in `world`.
    pub fn ideal(world: Arc<dyn TruthSource>) -> Self {
        Flight {
            plant: Plant::ideal(world),
            settings: Settings::NOMINAL,
            faults: Vec::new(),
            said: Vec::new(),
        }
    }

    /// A unit whose parts have clocks of their own, at the launch site, with derived frames.
    pub fn at_alcantara(world: Arc<dyn TruthSource>) -> Self {
        Flight {
            plant: Plant::with(world.clone(), 7, Quality::FREE_CLOCKS),
            settings: Settings {
                site: Site::ALCANTARA,
                ..Settings::NOMINAL
            },
            ..Flight::ideal(world)
        }
        .say(MS, b"G_DL")
    }

    /// With a fault at an instant.
    pub fn fault(mut self, at: Nanos, fault: Fault) -> Self {
        self.faults.push(Scheduled { at, fault });
        self
    }

    /// With words on the umbilical at an instant.
    pub fn say(mut self, at: Nanos, words: &[u8]) -> Self {
        self.said.push((at, words.to_vec()));
        self
    }

    /// Flies for a while.
    pub fn fly(self, duration: Nanos) -> Flown {
        let mut flown = Flown::listening(self.said);
        let plant = Rc::new(RefCell::new(self.plant));
        flown.report = host::fly_around(&plant, self.settings, &self.faults, duration, &mut flown);
        flown.nand = Some(plant.borrow().nand.cells.clone());
        flown
    }
}

/// What came out of a flight.
#[derive(Default)]
pub struct Flown {
    said: Vec<(Nanos, Vec<u8>)>,
    /// Packets on the telemetry line, and when each was complete.
    pub packets: Vec<(Nanos, Reading)>,
    /// Derived frames on the telemetry line.
    pub derived: Vec<Derived>,
    /// Lines on the telemetry line.
    pub announced: String,
    /// Telemetry writes that are none of these: there must be none.
    pub strange: Vec<Vec<u8>>,
    /// Everything the umbilical said.
    pub umbilical: Vec<u8>,
    /// The recorder's memory afterwards.
    pub nand: Option<Cells>,
    /// What the host board says of the run.
    pub report: HostReport,
}

impl Flown {
    /// A bench that says this on the umbilical and has heard nothing yet.
    pub fn listening(said: Vec<(Nanos, Vec<u8>)>) -> Self {
        Flown {
            said,
            ..Flown::default()
        }
    }

    /// The console's reply lines.
    pub fn replies(&self) -> Vec<String> {
        let text = String::from_utf8_lossy(&self.umbilical).into_owned();
        let lines = text.split("\r\n").filter_map(|line| line.split_once('>'));
        lines.map(|(_, reply)| reply.to_string()).collect()
    }

    /// Whether some reply line contains `text`.
    pub fn replied(&self, text: &str) -> bool {
        self.replies().iter().any(|line| line.contains(text))
    }

    /// \[ns\] times between packets.
    pub fn periods(&self) -> Vec<Nanos> {
        self.packets.windows(2).map(|pair| pair[1].0 - pair[0].0).collect()
    }

    /// What the unit estimated from in each cycle: the packet's reading at the instants of its derived frame, and that frame.
    ///
    /// # Panics
    /// When the packet of a frame is missing.
    pub fn sampled(&self) -> impl Iterator<Item = (Sample, &Derived)> {
        let of = |frame: &Derived| {
            self.packets
                .iter()
                .map(|(_, own)| own)
                .find(|own| own.counter == frame.counter)
        };
        self.derived.iter().map(move |frame| {
            let sample = Sample {
                reading: *of(frame).expect("a packet of each derived frame"),
                start_us: frame.start_us,
                slots_us: frame.slots_us,
            };
            (sample, frame)
        })
    }

    /// Packets of the second `n`, counted from power-on.
    pub fn second(&self, n: u64) -> Vec<Reading> {
        let within = |(at, _): &&(Nanos, Reading)| (n * S..(n + 1) * S).contains(at);
        self.packets
            .iter()
            .filter(within)
            .map(|(_, reading)| *reading)
            .collect()
    }
}

impl Bench for Flown {
    fn telemetry(&mut self, at: Nanos, bytes: &[u8]) {
        if let Ok(reading) = packet::decode(bytes) {
            self.packets.push((at, reading));
        } else if let (Some(&DERIVED_START), DERIVED_BYTES, Ok(derived)) =
            (bytes.first(), bytes.len(), derived::decode(bytes))
        {
            self.derived.push(derived);
        } else if bytes.is_ascii() && (bytes == b">" || bytes == b"\r\n" || self.announced.ends_with('>')) {
            self.announced.push_str(&String::from_utf8_lossy(bytes));
        } else {
            self.strange.push(bytes.to_vec());
        }
    }

    fn umbilical(&mut self, _at: Nanos, bytes: &[u8]) {
        self.umbilical.extend_from_slice(bytes);
    }

    fn log(&mut self, _at: Nanos, _line: &str) {}

    fn commands(&mut self, now: Nanos) -> Vec<u8> {
        let due = |said: &(Nanos, Vec<u8>)| said.0 <= now;
        let (now_said, later) = std::mem::take(&mut self.said).into_iter().partition(due);
        self.said = later;
        let now_said: Vec<(Nanos, Vec<u8>)> = now_said;
        now_said.into_iter().flat_map(|(_, words)| words).collect()
    }

    fn advanced(&mut self, _now: Nanos) -> Flow {
        Flow::Continue
    }
}

/// A world that is another one, changed.
pub struct Changed {
    world: Arc<dyn TruthSource>,
    change: fn(f64, &mut Truth),
}

impl TruthSource for Changed {
    fn at(&self, t_s: f64) -> Truth {
        let mut truth = self.world.at(t_s);
        (self.change)(t_s, &mut truth);
        truth
    }

    fn duration_s(&self) -> Option<f64> {
        self.world.duration_s()
    }
}

/// A motion of the twin in which `change` alters what is true at a time \[s\].
pub fn changed(name: &str, change: fn(f64, &mut Truth)) -> Arc<dyn TruthSource> {
    Arc::new(Changed {
        world: world(name),
        change,
    })
}

/// A motion of the twin at its default site.
pub fn world(name: &str) -> Arc<dyn TruthSource> {
    twin::motion::by_name(name)
        .unwrap_or_else(|| panic!("the twin has no motion {name}"))
        .into()
}

/// A calibration set as the words that send it.
pub fn set_words(set: &emems::calibration::Set) -> Vec<u8> {
    let bytes = set.encode();
    let word = |(place, bytes): (usize, &[u8; 4])| format!("G_CW{place:04X}{:08X}", u32::from_be_bytes(*bytes));
    let words = bytes.as_chunks::<4>().0.iter().enumerate();
    words.flat_map(|word_at| word(word_at).into_bytes()).collect()
}
