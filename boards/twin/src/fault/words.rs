//! The vocabulary of faults: one row a name.
//!
//! A row says what its target and its size are, which boards can make the fault, whether a log can be rewritten with it, and
//! the strokes that begin and end it.

use emems::sample::{Kind, SENSOR_COUNT, SENSORS};

use crate::run::{End, Fault, Level};

/// Short names of the sensors, in the reading order.
pub const SENSOR_NAMES: [&str; SENSOR_COUNT] = [
    "a1", "a2", "a3", "a4", "m1", "m2", "m3", "m4", "g1", "g2", "g3", "g4", "t1", "t2", "t3", "t4",
];

/// What a fault befalls.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Target {
    /// The unit: there is nothing to choose.
    Unit,
    /// A sensor, a1 to t4.
    Sensor,
    /// A sensor on the I2C bus.
    I2c,
    /// One of the processor's ends.
    End,
    /// What a line does: high, low or bouncing.
    Line,
    /// A plate, 1 to 3: its channel and the next.
    Plate,
}

impl Target {
    /// The number of a target by its name.
    pub(super) fn number(self, name: Option<&str>) -> Result<usize, String> {
        let names = self.names();
        match (name, names.is_empty()) {
            (None, true) => Ok(0),
            (Some(name), true) => Err(format!("there is nothing to choose, leave out :{name}")),
            (None, false) => Err(format!("say which: {}", names.join(" "))),
            (Some(name), false) => {
                let number = names.iter().position(|known| *known == name);
                let number = number.filter(|slot| self != Target::I2c || SENSORS[*slot].kind != Kind::Gyro);
                number.ok_or_else(|| format!("{name} is none of {}", names.join(" ")))
            }
        }
    }

    /// The name of a target; `None` where there is nothing to choose.
    pub fn name(self, number: usize) -> Option<&'static str> {
        self.names().get(number).copied()
    }

    fn names(self) -> &'static [&'static str] {
        match self {
            Target::Unit => &[],
            Target::Sensor | Target::I2c => &SENSOR_NAMES,
            Target::End => &END_NAMES,
            Target::Line => &["high", "low", "bouncing"],
            Target::Plate => &["1", "2", "3"],
        }
    }
}

const END_NAMES: [&str; End::ALL.len()] = [
    "sensors",
    "gyros",
    "telemetry",
    "umbilical-out",
    "umbilical-in",
    "lines",
    "nand",
];

/// A fault's name and all that belongs to it.
#[derive(Clone, Copy, Debug)]
pub struct Word {
    /// Its name.
    pub name: &'static str,
    /// What it is.
    pub meaning: &'static str,
    /// What it befalls.
    pub on: Target,
    /// What its size is, with its unit; empty if it has none.
    pub size: &'static str,
    /// Where it can be made: `h` on the host board, `i` on the image, `l` in a log.
    pub places: &'static str,
    /// The stroke that begins it, from target, size and a drawn number.
    pub(super) begin: fn(usize, Option<f64>, u64) -> Fault,
    /// The stroke that ends it; `None` if it does not last.
    pub(super) end: Option<fn(usize) -> Fault>,
}

impl PartialEq for Word {
    fn eq(&self, other: &Word) -> bool {
        self.name == other.name
    }
}

impl Word {
    /// Its place in [`WORDS`].
    pub(super) fn number(&self) -> u64 {
        WORDS.iter().position(|word| word == self).unwrap_or(0) as u64
    }

    /// Whether it lasts until it is ended.
    pub fn lasts(&self) -> bool {
        self.end.is_some()
    }
}

const fn word(
    name: &'static str,
    on: Target,
    size: &'static str,
    places: &'static str,
    meaning: &'static str,
    begin: fn(usize, Option<f64>, u64) -> Fault,
    end: Option<fn(usize) -> Fault>,
) -> Word {
    Word {
        name,
        meaning,
        on,
        size,
        places,
        begin,
        end,
    }
}

/// \[ns\] of a size in ms.
fn ms(size: Option<f64>, otherwise: f64) -> u64 {
    (size.unwrap_or(otherwise).max(0.0) * 1e6) as u64
}

fn level(number: usize, size: Option<f64>) -> Level {
    match number {
        0 => Level::High,
        1 => Level::Low,
        // Some 10 kHz, as of a relay's contact; at 0.05 each look of the unit, a whole millisecond after the last, saw the same side.
        _ => Level::Bouncing(ms(size, 0.053).max(1)),
    }
}

/// Every fault there is a name for.
pub const WORDS: [Word; 33] = [
    word(
        "silent",
        Target::Sensor,
        "",
        "hil",
        "the sensor does not answer",
        |n, _, _| Fault::Silent(n),
        Some(Fault::Restored),
    ),
    word(
        "restart",
        Target::Sensor,
        "",
        "hi",
        "the sensor browns out and is back with its power-on settings",
        |n, _, _| Fault::Restored(n),
        None,
    ),
    word(
        "garbage",
        Target::Sensor,
        "",
        "hil",
        "the sensor answers random words",
        |n, _, _| Fault::Garbage(n, true),
        Some(|n| Fault::Garbage(n, false)),
    ),
    word(
        "frozen",
        Target::Sensor,
        "",
        "hil",
        "the sensor answers as it first did, again and again",
        |n, _, _| Fault::Frozen(n, true),
        Some(|n| Fault::Frozen(n, false)),
    ),
    word(
        "nack",
        Target::I2c,
        "which byte written to it, 0 its address",
        "hi",
        "the sensor does not acknowledge a byte",
        |n, size, _| Fault::Nack(n, Some(size.unwrap_or(2.0) as u8)),
        Some(|n| Fault::Nack(n, None)),
    ),
    word(
        "stretch",
        Target::I2c,
        "ms",
        "hi",
        "the sensor holds the clock whenever it is called",
        |n, size, _| Fault::Stretching(n, ms(size, 20.0)),
        Some(|n| Fault::Stretching(n, 0)),
    ),
    word(
        "mux-silent",
        Target::Unit,
        "",
        "hil",
        "the multiplexer is gone",
        |_, _, _| Fault::MuxSilent(true),
        Some(|_| Fault::MuxSilent(false)),
    ),
    word(
        "sda-held",
        Target::Unit,
        "clock pulses",
        "hi",
        "a part holds SDA until it has seen clock pulses",
        |_, size, _| Fault::SdaHeld(size.unwrap_or(9.0) as u8),
        None,
    ),
    word(
        "bus-stuck",
        Target::Unit,
        "",
        "hil",
        "SDA is held for good",
        |_, _, _| Fault::BusStuck(true),
        Some(|_| Fault::BusStuck(false)),
    ),
    word(
        "stop-misplaced",
        Target::Unit,
        "",
        "hi",
        "the sensor bus' controller sends no START until it is reset",
        |_, _, _| Fault::StopMisplaced,
        None,
    ),
    word(
        "bridged",
        Target::Plate,
        "",
        "hi",
        "the parts of this plate and the next answer at once, each address twice",
        |n, _, _| Fault::Bridged(n, true),
        Some(|n| Fault::Bridged(n, false)),
    ),
    word(
        "nand-dead",
        Target::Unit,
        "",
        "hi",
        "the NAND stays busy",
        |_, _, _| Fault::NandDead(true),
        Some(|_| Fault::NandDead(false)),
    ),
    word(
        "nand-absent",
        Target::Unit,
        "",
        "hi",
        "there is no NAND",
        |_, _, _| Fault::NandAbsent,
        None,
    ),
    word(
        "nand-flips",
        Target::Unit,
        "per thousand reads",
        "hi",
        "reads of the NAND find a wrong bit in each half page",
        |_, size, _| Fault::NandFlips(size.unwrap_or(1000.0) as u32),
        Some(|_| Fault::NandFlips(0)),
    ),
    word(
        "supply",
        Target::Unit,
        "",
        "hi",
        "the supply is below what a program needs",
        |_, _, _| Fault::SupplyFailing(true),
        Some(|_| Fault::SupplyFailing(false)),
    ),
    word(
        "power-cut",
        Target::Unit,
        "way to tear, 0 to 8; drawn if not said",
        "hi",
        "the power goes and comes back",
        |_, size, draw| Fault::PowerCut(size.map_or(draw as usize % 9, |size| size as usize)),
        None,
    ),
    word(
        "reset",
        Target::Unit,
        "",
        "hi",
        "the reset pin",
        |_, _, _| Fault::Reset,
        None,
    ),
    word(
        "panic",
        Target::Unit,
        "",
        "h",
        "the firmware panics, leaves a crash record and resets itself",
        |_, _, _| Fault::Panic,
        None,
    ),
    word(
        "dma-hung",
        Target::Unit,
        "",
        "hi",
        "the sensor bus' DMA stands still and cannot be switched off",
        |_, _, _| Fault::DmaHung,
        None,
    ),
    word(
        "busy",
        Target::Unit,
        "ms",
        "h",
        "a storm of interrupts keeps the processor from the unit",
        |_, size, _| Fault::Busy(ms(size, 1.0)),
        None,
    ),
    word(
        "hang",
        Target::End,
        "",
        "h",
        "the processor runs in a circle the next time it serves this end",
        |n, _, _| Fault::Hang(End::ALL[n]),
        None,
    ),
    word(
        "clock-step",
        Target::Unit,
        "ms, negative: back",
        "h",
        "the unit's clock steps",
        |_, size, _| Fault::ClockSteps((size.unwrap_or(-65.536) * 1e3) as i64),
        None,
    ),
    word(
        "kept-flip",
        Target::Unit,
        "bit; drawn if not said",
        "hi",
        "a bit of the retained memory flips, and a reset follows",
        |_, size, draw| Fault::KeptFlip(size.map_or(draw as u32, |size| size as u32)),
        None,
    ),
    word(
        "ram-flip",
        Target::Unit,
        "bit; drawn if not said",
        "i",
        "a bit of the RAM flips",
        |_, size, draw| Fault::RamFlip(size.map_or(draw as u32, |size| size as u32)),
        None,
    ),
    word(
        "image-flip",
        Target::Unit,
        "bit; drawn if not said",
        "h",
        "a bit of the firmware's image in flash flips",
        |_, size, draw| Fault::ImageFlip(size.map_or(draw as u32, |size| size as u32)),
        None,
    ),
    word(
        "lift-off",
        Target::Line,
        "ms of half a bounce",
        "hi",
        "the lift-off line does as it likes",
        |n, size, _| Fault::LiftOff(level(n, size)),
        Some(|_| Fault::LiftOff(Level::World)),
    ),
    word(
        "micro-g",
        Target::Line,
        "ms of half a bounce",
        "hi",
        "the micro-gravity line does as it likes",
        |n, size, _| Fault::MicroG(level(n, size)),
        Some(|_| Fault::MicroG(Level::World)),
    ),
    word(
        "telemetry-stuck",
        Target::Unit,
        "",
        "h",
        "the telemetry line takes no byte",
        |_, _, _| Fault::TelemetryStuck(true),
        Some(|_| Fault::TelemetryStuck(false)),
    ),
    word(
        "umbilical-stuck",
        Target::Unit,
        "",
        "h",
        "the umbilical takes no byte from the unit",
        |_, _, _| Fault::UmbilicalStuck(true),
        Some(|_| Fault::UmbilicalStuck(false)),
    ),
    word(
        "umbilical-noise",
        Target::Unit,
        "",
        "hi",
        "every byte towards the unit arrives with an error",
        |_, _, _| Fault::UmbilicalNoise(true),
        Some(|_| Fault::UmbilicalNoise(false)),
    ),
    word(
        "umbilical-break",
        Target::Unit,
        "",
        "hi",
        "the umbilical towards the unit is held low: bytes without a stop bit at its rate",
        |_, _, _| Fault::UmbilicalBreak(true),
        Some(|_| Fault::UmbilicalBreak(false)),
    ),
    word(
        "lines-slow",
        Target::Unit,
        "times slower",
        "h",
        "both lines carry bytes at a fraction of their rate",
        |_, size, _| Fault::LinesSlow(size.unwrap_or(12.0) as u32),
        Some(|_| Fault::LinesSlow(1)),
    ),
    word(
        "crystal-lost",
        Target::Unit,
        "",
        "i",
        "the crystal stops",
        |_, _, _| Fault::CrystalLost,
        None,
    ),
];
