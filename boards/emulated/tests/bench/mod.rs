//! A bench that keeps everything it hears and says what it was told to, and the image built once.

use std::sync::{Arc, OnceLock};

use emems::{
    derived::{self, Derived},
    packet::{self, PACKET_BYTES},
    sample::Reading,
};
use emulated::{Image, Options, Report, fly_with, toolchain};
use twin::{
    motion,
    part::Nanos,
    plant::Plant,
    run::{Bench, Flow, Scheduled},
    truth::TruthSource,
};

/// \[ns\] in a millisecond.
pub const MS: Nanos = 1_000_000;

/// Keeps what it hears.
#[derive(Debug, Default, PartialEq)]
pub struct Tape {
    /// Telemetry, with the instant each byte was complete.
    pub telemetry: Vec<(Nanos, u8)>,
    /// The umbilical, likewise.
    pub umbilical: Vec<(Nanos, u8)>,
    /// Log lines.
    pub log: Vec<String>,
    /// What to say, and from when on.
    pub script: Vec<(Nanos, Vec<u8>)>,
}

impl Bench for Tape {
    fn telemetry(&mut self, at: Nanos, bytes: &[u8]) {
        self.telemetry.extend(bytes.iter().map(|&byte| (at, byte)));
    }

    fn umbilical(&mut self, at: Nanos, bytes: &[u8]) {
        self.umbilical.extend(bytes.iter().map(|&byte| (at, byte)));
    }

    fn log(&mut self, _at: Nanos, line: &str) {
        self.log.push(line.into());
    }

    fn commands(&mut self, now: Nanos) -> Vec<u8> {
        let due = self.script.extract_if(.., |(at, _)| *at <= now);
        due.flat_map(|(_, bytes)| bytes).collect()
    }

    fn advanced(&mut self, _now: Nanos) -> Flow {
        Flow::Continue
    }
}

impl Tape {
    /// What was said on the umbilical.
    pub fn said(&self) -> String {
        let bytes: Vec<u8> = self.umbilical.iter().map(|&(_, byte)| byte).collect();
        String::from_utf8_lossy(&bytes).into_owned()
    }

    /// The packets heard whole, with the instant each was complete.
    pub fn packets(&self) -> Vec<(Nanos, Reading)> {
        let mut packets = Vec::new();
        let mut rest = &self.telemetry[..];
        while let Some(start) = rest.iter().position(|&(_, byte)| byte == packet::START) {
            rest = &rest[start..];
            let Some(frame) = rest.get(..PACKET_BYTES) else { break };
            let bytes: Vec<u8> = frame.iter().map(|&(_, byte)| byte).collect();
            match packet::decode(&bytes) {
                Ok(reading) => {
                    packets.push((frame[PACKET_BYTES - 1].0, reading));
                    rest = &rest[PACKET_BYTES..];
                }
                Err(_) => rest = &rest[1..],
            }
        }
        packets
    }

    /// The derived frames heard whole.
    #[allow(dead_code, reason = "not every test file asks for them")]
    pub fn derived(&self) -> Vec<Derived> {
        let bytes: Vec<u8> = self.telemetry.iter().map(|(_, byte)| *byte).collect();
        let frames = bytes.split_inclusive(|byte| *byte == b'\n');
        frames
            .filter_map(|line| derived::decode(line.get(line.len().checked_sub(derived::DERIVED_BYTES)?..)?).ok())
            .collect()
    }
}

/// The world of a named motion.
pub fn world(name: &str) -> Arc<dyn TruthSource> {
    motion::by_name(name).expect("a motion of the twin").into()
}

/// The image of the reference board, built once.
pub fn image() -> &'static Image {
    static IMAGE: OnceLock<Image> = OnceLock::new();
    IMAGE.get_or_init(|| toolchain::build().unwrap_or_else(|error| panic!("{error}")))
}

#[allow(dead_code, reason = "not every test file flies this way")]
/// Flies the image for `ms` milliseconds from power-on, at rest, with parts free of noise and bias.
pub fn flown(options: &Options, faults: &[Scheduled], ms: u64, tape: &mut Tape) -> Report {
    let plant = Plant::ideal(world("still"));
    fly_with(options, image(), plant, faults, ms * MS, tape).unwrap_or_else(|error| panic!("{error}"))
}
