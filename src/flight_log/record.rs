//! A record: what is kept of one cycle, of one boot, or of a change of mode, in 256 bytes that stand for themselves.
//!
//! In: an [`Entry`], a [`BootHeader`] or a [`Change`] and its [`Key`]. Out: the bytes, and back. Little endian, version 1:
//!
//! | bytes | packet record (type 1) | boot header (type 2) |
//! |---|---|---|
//! | 0-1 | E7 4D | the same |
//! | 2, 3 | version, type | the same |
//! | 4-7, 8-11, 12-13 | number within the boot, boot, epoch: the key | the same |
//! | 14-15 | flags: 1 FLIGHT, 2 with an attitude | flags: 4 with how it started |
//! | 16-23 | \[us\] start of the cycle, since the unit's clock started | \[us\] when the log was opened |
//! | 24-179 | the packet, verbatim | firmware (16, text), unit (16, text), calibration set (16, text), 156-byte |
//! | 180-211 | 16 x u16: when each sensor was sampled after the start [4 us], FFFF not sampled | packet's period \[us\] u32, |
//! | 212-219 | 4 x i16: attitude q_nb, 1/32767 | then what the fields of a packet record are, in |
//! | 220-231 | 3 x f32: gyro bias in b [rad/s] | words, so that a log is read without this page |
//! | 232-243 | 6 x upper half of an f32: deviation of attitude \[rad\] and bias [rad/s] | |
//! | 244-247 | health | |
//! | 248-251 | health of the sensors; zero without an attitude | zero |
//! | 252-255 | CRC-32 (ISO-HDLC) of bytes 0 to 251 | the same |
//!
//! How a boot started stands at the end of its header (logs of older firmware have description there, and no flag):
//! `216` reset cause (1 power-on, 2 watchdog, 3 software, 4 pin), `217` crash (0 none, 1 panic, 2 hard fault, 3 unhandled
//! exception), `218-219` starts since power-on, `220-223` line or pc, `224-227` lr, `228-231` CFSR, `232-235` \[ms\] it ran, `236-251`
//! tail of the source file's name.
//!
//! A change of mode (type 3): `14-15` flags (1 FLIGHT from then on), `16-23` \[us\] when, `24` recording from then on, `25` cause
//! (1 command, 2 lift-off, 3 log; without a change 4 an erase was armed, 5 the log was erased, 6 the launch rail
//! was set, 7 the attitude took it, 8 the estimation began afresh at a launch site), `26-31` with cause 7 the rail ([`Rail::bytes`], big
//! endian), `26-38` with cause 8 the site ([`site::Told::bytes`], big endian), the rest zero. A rail was taken after the latest cycle that had
//! begun by then, and before the next; a site before the first cycle that began then or later: whoever replays the cycles takes them
//! there.
//!
//! The key is never used twice, so a record that turns up again is the same record. Refuses what the checksum does not
//! fit, a newer version by its number, and a type it does not know.

use core::fmt;

use crate::{
    board::ResetCause,
    checksum::CRC,
    crash::{CrashCause, CrashRecord},
    faults::SensorHealth,
    health::Health,
    mode::{Cause, Change, Mode},
    packet::PACKET_BYTES,
    rail::Rail,
    sample::{NO_SLOT, SENSOR_COUNT},
    site,
};

/// Bytes of a record: half a page.
pub const RECORD_BYTES: usize = 256;

/// The version this code writes and the newest it reads.
pub const VERSION: u8 = 1;

/// A record as it is kept.
pub type RecordBytes = [u8; RECORD_BYTES];

/// What a packet record holds, in words, in every boot header: whoever finds the chip needs no other document.
pub const DESCRIPTION: &str = "e-MEMS log 1 LE: seq4@4 boot4@8 epoch2@12 us8@16 packet156@24 \
16u16@180(4us) q4i16@212/32767 bias3f32@220 sd6bf16@232 health@244 crc32@252";

const _: () = assert!(at::DESCRIPTION + DESCRIPTION.len() <= at::START);

const PACKET: u8 = 1;
const HEADER: u8 = 2;
const CHANGE: u8 = 3;
const MAGIC: [u8; 2] = [0xE7, 0x4D];
const CHECKED: usize = RECORD_BYTES - 4;

const SLOT_US: u32 = 4;
const NO_SLOT_CODE: u16 = u16::MAX;
const QUATERNION_ONE: f32 = 32_767.0;

/// Offsets of the fields.
mod at {
    pub const VERSION: usize = 2;
    pub const TYPE: usize = 3;
    pub const SEQ: usize = 4;
    pub const BOOT: usize = 8;
    pub const EPOCH: usize = 12;
    pub const FLAGS: usize = 14;
    pub const TIME: usize = 16;
    pub const PACKET: usize = 24;
    pub const SLOTS: usize = 180;
    pub const QUATERNION: usize = 212;
    pub const BIAS: usize = 220;
    pub const SIGMA: usize = 232;
    pub const HEALTH: usize = 244;
    pub const SENSORS: usize = 248;
    pub const FIRMWARE: usize = 24;
    pub const UNIT: usize = 40;
    pub const CALIBRATION: usize = 56;
    pub const PERIOD: usize = 72;
    pub const DESCRIPTION: usize = 76;
    pub const START: usize = 216;
    pub const PLACE: usize = 236;
    pub const RECORDING: usize = 24;
    pub const CAUSE: usize = 25;
    pub const RAIL: usize = 26;
    pub const SITE: usize = 26;
}

/// Which record: the order of keys is the order in which they were made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
pub struct Key {
    /// How often the log had been erased.
    pub epoch: u16,
    /// Which start of the unit, counted over the chip's life.
    pub boot: u32,
    /// Which record of that boot; 0 is its header.
    pub seq: u32,
}

/// The estimator's state, where there is one.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
pub struct Estimate {
    /// Attitude, body to north-east-down; kept to 3e-5.
    pub q_nb: [f32; 4],
    /// [rad/s] gyro bias in b.
    pub bias_b: [f32; 3],
    /// Standard deviations: attitude about b's axes \[rad\], then bias [rad/s]; kept to 8 bits.
    pub sigma: [f32; 6],
    /// Which axes were not used, and what is not isolable.
    pub sensors: SensorHealth,
}

/// What is kept of one cycle.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
pub struct Entry {
    /// \[us\] start of the cycle, since the unit's clock started.
    pub start_us: u64,
    /// The packet, verbatim.
    pub packet: [u8; PACKET_BYTES],
    /// \[us\] when each sensor was sampled after `start_us`, reading order; kept to 4 us; [`NO_SLOT`] if it was not.
    pub slots_us: [u32; SENSOR_COUNT],
    /// The unit was in FLIGHT.
    pub flight: bool,
    /// Health, error identifier included.
    pub health: Health,
    /// The estimator's state.
    pub estimate: Option<Estimate>,
}

/// A text of at most sixteen letters.
pub type Name = heapless::String<16>;

/// What every boot says of itself.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BootHeader {
    /// \[us\] when the log was opened, since the unit's clock started.
    pub opened_us: u64,
    /// Version of the firmware.
    pub firmware: Name,
    /// Which unit.
    pub unit: Name,
    /// Which set of calibration parameters; empty for none.
    pub calibration: Name,
    /// \[us\] from packet to packet.
    pub period_us: u32,
    /// How the unit started; `None` in logs of older firmware.
    pub start: Option<Start>,
}

/// How the unit started.
#[derive(Clone, Debug, PartialEq)]
pub struct Start {
    /// Why.
    pub reset: ResetCause,
    /// How often since power-on, this start among them.
    pub starts: u16,
    /// The crash before it; kept to milliseconds and to the last sixteen letters of its place.
    pub crash: Option<CrashRecord>,
}

/// What a record holds.
#[derive(Clone, Debug, PartialEq)]
#[allow(
    clippy::large_enum_variant,
    reason = "nothing is allocated here, and one is decoded at a time"
)]
pub enum Content {
    /// One cycle.
    Packet(Entry),
    /// The header of a boot.
    Header(BootHeader),
    /// A change of mode.
    Change(Change),
}

/// Why bytes are not a record.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
pub enum RecordError {
    /// They do not begin as one.
    Magic,
    /// The checksum does not fit.
    Checksum,
    /// Written by a newer firmware.
    Newer(u8),
    /// A type that does not exist.
    Type(u8),
}

impl fmt::Display for RecordError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            RecordError::Magic => f.write_str("no record: does not begin with E7 4D"),
            RecordError::Checksum => f.write_str("damaged record: its CRC-32 does not fit"),
            RecordError::Newer(version) => {
                write!(
                    f,
                    "record of format version {version}; this reader knows {VERSION}: update it"
                )
            }
            RecordError::Type(kind) => write!(f, "record of unknown type {kind}"),
        }
    }
}

impl core::error::Error for RecordError {}

/// Flag: the unit was in FLIGHT.
const FLIGHT: u16 = 1 << 0;
/// Flag: the estimator's fields are set.
const ESTIMATED: u16 = 1 << 1;
/// Flag of a header: it says how the unit started.
const STARTED: u16 = 1 << 2;

/// The bytes of a packet record.
pub fn encode_entry(key: Key, entry: &Entry) -> RecordBytes {
    let flags = (u16::from(entry.flight) * FLIGHT) | (u16::from(entry.estimate.is_some()) * ESTIMATED);
    let mut bytes = begin(key, PACKET, flags, entry.start_us);
    put(&mut bytes, at::PACKET, &entry.packet);
    for (slot, slot_us) in entry.slots_us.iter().enumerate() {
        let code = if *slot_us == NO_SLOT {
            NO_SLOT_CODE
        } else {
            (slot_us / SLOT_US).min(u32::from(NO_SLOT_CODE - 1)) as u16
        };
        put(&mut bytes, at::SLOTS + 2 * slot, &code.to_le_bytes());
    }
    if let Some(estimate) = &entry.estimate {
        for (axis, value) in estimate.q_nb.iter().enumerate() {
            // `as` saturates, and makes zero of what is not a number.
            let code = rounded_up_to_cut(value * QUATERNION_ONE) as i16;
            put(&mut bytes, at::QUATERNION + 2 * axis, &code.to_le_bytes());
        }
        for (axis, value) in estimate.bias_b.iter().enumerate() {
            put(&mut bytes, at::BIAS + 4 * axis, &value.to_le_bytes());
        }
        for (axis, value) in estimate.sigma.iter().enumerate() {
            let upper = (value.to_bits() >> 16) as u16;
            put(&mut bytes, at::SIGMA + 2 * axis, &upper.to_le_bytes());
        }
        put(&mut bytes, at::SENSORS, &estimate.sensors.0.to_le_bytes());
    }
    put(&mut bytes, at::HEALTH, &entry.health.0.to_le_bytes());
    seal(&mut bytes);
    bytes
}

/// The bytes of a boot header.
pub fn encode_header(key: Key, header: &BootHeader) -> RecordBytes {
    let flags = u16::from(header.start.is_some()) * STARTED;
    let mut bytes = begin(key, HEADER, flags, header.opened_us);
    for (at, name) in [
        (at::FIRMWARE, &header.firmware),
        (at::UNIT, &header.unit),
        (at::CALIBRATION, &header.calibration),
    ] {
        put(&mut bytes, at, name.as_bytes());
    }
    put(&mut bytes, at::PERIOD, &header.period_us.to_le_bytes());
    put(&mut bytes, at::DESCRIPTION, DESCRIPTION.as_bytes());
    if let Some(start) = &header.start {
        put(&mut bytes, at::START, &[start.reset.code()]);
        put(&mut bytes, at::START + 2, &start.starts.to_le_bytes());
        if let Some(crash) = &start.crash {
            put(&mut bytes, at::START + 1, &[crash.cause.code()]);
            let ran_ms = u32::try_from(crash.uptime_us / 1000).unwrap_or(u32::MAX);
            for (number, word) in [crash.at, crash.lr, crash.cfsr, ran_ms].into_iter().enumerate() {
                put(&mut bytes, at::START + 4 + 4 * number, &word.to_le_bytes());
            }
            // Names of source files are ASCII; of another the tail is no text, and is left out when it is read.
            let place = crash.place.as_bytes();
            let tail = place.len().saturating_sub(CHECKED - at::PLACE);
            put(&mut bytes, at::PLACE, place.get(tail..).unwrap_or_default());
        }
    }
    seal(&mut bytes);
    bytes
}

/// The bytes of a change of mode.
pub fn encode_change(key: Key, change: &Change) -> RecordBytes {
    let flags = u16::from(change.mode == Mode::Flight) * FLIGHT;
    let mut bytes = begin(key, CHANGE, flags, change.at_us);
    let cause = match change.cause {
        Cause::Command => 1,
        Cause::LiftOff => 2,
        Cause::Log => 3,
        Cause::EraseArmed => 4,
        Cause::Erased => 5,
        Cause::Rail => 6,
        Cause::RailTaken(rail) => {
            put(&mut bytes, at::RAIL, &rail.bytes());
            7
        }
        Cause::SiteTaken(site) => {
            put(&mut bytes, at::SITE, site.bytes());
            8
        }
    };
    put(&mut bytes, at::RECORDING, &[change.recording.into()]);
    put(&mut bytes, at::CAUSE, &[cause]);
    seal(&mut bytes);
    bytes
}

/// The key of a whole record of this version or an older one.
pub fn key(bytes: &RecordBytes) -> Result<Key, RecordError> {
    if bytes[..at::VERSION] != MAGIC {
        return Err(RecordError::Magic);
    }
    if bytes[CHECKED..] != CRC.checksum(&bytes[..CHECKED]).to_le_bytes() {
        return Err(RecordError::Checksum);
    }
    if bytes[at::VERSION] > VERSION {
        return Err(RecordError::Newer(bytes[at::VERSION]));
    }
    Ok(Key {
        seq: u32::from_le_bytes(take(bytes, at::SEQ)),
        boot: u32::from_le_bytes(take(bytes, at::BOOT)),
        epoch: u16::from_le_bytes(take(bytes, at::EPOCH)),
    })
}

/// Whether it is a packet record.
pub fn is_packet(bytes: &RecordBytes) -> bool {
    bytes[at::TYPE] == PACKET
}

/// The packet of a packet record, as it stands there.
pub fn packet(bytes: &RecordBytes) -> Option<&[u8; PACKET_BYTES]> {
    let packet = bytes.get(at::PACKET..)?.first_chunk()?;
    is_packet(bytes).then_some(packet)
}

/// Whether the record was made in FLIGHT, and when its cycle began \[us\].
pub fn mode_and_time(bytes: &RecordBytes) -> (bool, u64) {
    (flags(bytes) & FLIGHT != 0, u64::from_le_bytes(take(bytes, at::TIME)))
}

/// The mode that a packet or a change of mode tells: FLIGHT, recording.
pub fn mode(bytes: &RecordBytes) -> Option<(bool, bool)> {
    let (flight, _) = mode_and_time(bytes);
    match bytes[at::TYPE] {
        PACKET => Some((flight, flight)),
        CHANGE => Some((flight, bytes[at::RECORDING] != 0)),
        _ => None,
    }
}

/// The estimator's state of a packet record; `None` where there was none, and of another record.
pub fn estimate(bytes: &RecordBytes) -> Option<Estimate> {
    let is_there = is_packet(bytes) && flags(bytes) & ESTIMATED != 0;
    is_there.then(|| Estimate {
        q_nb: core::array::from_fn(|axis| {
            f32::from(i16::from_le_bytes(take(bytes, at::QUATERNION + 2 * axis))) / QUATERNION_ONE
        }),
        bias_b: core::array::from_fn(|axis| f32::from_le_bytes(take(bytes, at::BIAS + 4 * axis))),
        sigma: core::array::from_fn(|axis| {
            f32::from_bits(u32::from(u16::from_le_bytes(take(bytes, at::SIGMA + 2 * axis))) << 16)
        }),
        sensors: SensorHealth(u32::from_le_bytes(take(bytes, at::SENSORS))),
    })
}

/// What the record holds.
pub fn decode(bytes: &RecordBytes) -> Result<(Key, Content), RecordError> {
    let key = key(bytes)?;
    let (flight, start_us) = mode_and_time(bytes);
    let content = match bytes[at::TYPE] {
        PACKET => Content::Packet(Entry {
            start_us,
            packet: take(bytes, at::PACKET),
            slots_us: core::array::from_fn(|slot| match u16::from_le_bytes(take(bytes, at::SLOTS + 2 * slot)) {
                NO_SLOT_CODE => NO_SLOT,
                code => u32::from(code) * SLOT_US,
            }),
            flight,
            health: Health(u32::from_le_bytes(take(bytes, at::HEALTH))),
            estimate: estimate(bytes),
        }),
        HEADER => Content::Header(BootHeader {
            opened_us: start_us,
            firmware: name(bytes, at::FIRMWARE),
            unit: name(bytes, at::UNIT),
            calibration: name(bytes, at::CALIBRATION),
            period_us: u32::from_le_bytes(take(bytes, at::PERIOD)),
            start: start(bytes),
        }),
        CHANGE => Content::Change(Change {
            at_us: start_us,
            mode: if flight { Mode::Flight } else { Mode::Wait },
            recording: bytes[at::RECORDING] != 0,
            cause: match bytes[at::CAUSE] {
                2 => Cause::LiftOff,
                3 => Cause::Log,
                4 => Cause::EraseArmed,
                5 => Cause::Erased,
                6 => Cause::Rail,
                7 => Cause::RailTaken(Rail::of_bytes(take(bytes, at::RAIL))),
                8 => Cause::SiteTaken(site::Told::of_bytes(take(bytes, at::SITE))),
                _ => Cause::Command,
            },
        }),
        kind => return Err(RecordError::Type(kind)),
    };
    Ok((key, content))
}

fn begin(key: Key, kind: u8, flags: u16, time_us: u64) -> RecordBytes {
    let mut bytes = [0; RECORD_BYTES];
    put(&mut bytes, 0, &MAGIC);
    bytes[at::VERSION] = VERSION;
    bytes[at::TYPE] = kind;
    put(&mut bytes, at::SEQ, &key.seq.to_le_bytes());
    put(&mut bytes, at::BOOT, &key.boot.to_le_bytes());
    put(&mut bytes, at::EPOCH, &key.epoch.to_le_bytes());
    put(&mut bytes, at::FLAGS, &flags.to_le_bytes());
    put(&mut bytes, at::TIME, &time_us.to_le_bytes());
    bytes
}

fn seal(bytes: &mut RecordBytes) {
    let crc = CRC.checksum(&bytes[..CHECKED]);
    put(bytes, CHECKED, &crc.to_le_bytes());
}

fn flags(bytes: &RecordBytes) -> u16 {
    u16::from_le_bytes(take(bytes, at::FLAGS))
}

/// How the unit started, where the header says it.
fn start(bytes: &RecordBytes) -> Option<Start> {
    if flags(bytes) & STARTED == 0 {
        return None;
    }
    let word = |number: usize| u32::from_le_bytes(take(bytes, at::START + 4 + 4 * number));
    let crash = CrashCause::of_code(bytes[at::START + 1]).map(|cause| {
        let place = &bytes[at::PLACE..CHECKED];
        let end = place.iter().position(|byte| *byte == 0).unwrap_or(place.len());
        let place = core::str::from_utf8(place.get(..end).unwrap_or_default()).unwrap_or_default();
        CrashRecord::new(cause, word(0), word(1), word(2), u64::from(word(3)) * 1000, place)
    });
    Some(Start {
        reset: ResetCause::of_code(bytes[at::START])?,
        starts: u16::from_le_bytes(take(bytes, at::START + 2)),
        crash,
    })
}

/// Rounds to the nearest integer: `as` would cut, and `core` has no `round`.
fn rounded_up_to_cut(value: f32) -> f32 {
    value + if value < 0.0 { -0.5 } else { 0.5 }
}

fn put(bytes: &mut RecordBytes, at: usize, field: &[u8]) {
    let place = bytes.iter_mut().skip(at);
    place.zip(field).for_each(|(slot, byte)| *slot = *byte);
}

fn take<const N: usize>(bytes: &RecordBytes, at: usize) -> [u8; N] {
    bytes.get(at..).and_then(<[u8]>::first_chunk).copied().unwrap_or([0; N])
}

/// A text as far as it is one.
fn name(bytes: &RecordBytes, at: usize) -> Name {
    let letters = bytes[at..at + 16].iter().map(|byte| char::from(*byte));
    letters.take_while(char::is_ascii_graphic).collect()
}

#[cfg(test)]
mod tests;
