//! The derived frame: what a packet has no room for.
//!
//! In: a [`Derived`]; out: 902 characters `$...*CCCC\n`, and back. Its start `$` is not a packet's `@` and it holds
//! neither `@` nor `#`, so a reader of 156-byte packets passes over it; it is off unless asked for (G_DL).
//!
//! Between `$` and `*` stand upper-case hexadecimal fields, fixed width, most significant digit first; `CCCC` is
//! CRC-16/CCITT-FALSE over them. Layout, with the digits of each field:
//!
//! ```text
//! version 2 | counter 4 | start_us 12 | mode 1 | health 8 | start 8 | cycle_us 5 | slot_us 5 x 16 (FFFFF: not sampled)
//! covered_us 6 | end_us 12 | angle_b 8 x 3 | for each gyro: integral 8, least 4, most 4, count 2
//! for each reading of the accelerometers in between: covered_us 6, after_us 5, angle_b 8 x 3, counts 4 x 12
//! for each slice of the gyros: before_us 5, lasts_us 4, quarters of counts 4 x 4
//! estimate_us 5 | force_b 8 x 3 | field_b_ut 8 x 3 | rate_b 8 x 3 | sensors 8 | triad_nb 8 x 4 (0: none)
//! q_nb 8 x 4 (0: none) | covariance_n 8 x 6 | bias_b 8 x 3 | bias_sd 8 x 3
//! ```
//!
//! `start` says how the unit started: reset cause 1 (1 power-on, 2 watchdog, 3 software, 4 pin), crash 1 (0 none, 1 panic, 2
//! hard fault, 3 unhandled exception, 4 stack overflow), starts since power-on 4, 0 2. Version 5 is written; version 4, which had no `start` and 16
//! digits for both times, is read.
//!
//! Numbers of 8 digits are IEEE 754, but for `start`, `health` and `sensors`, which are bits. With the packet of the same counter
//! a frame holds all that [`estimate`](crate::estimate) was given, so a stream of both from the start gives its result again.

use core::fmt;

use crc::{CRC_16_IBM_3740, Crc};

use crate::{
    board::ResetCause,
    crash::CrashCause,
    estimate::Estimate,
    faults::SensorHealth,
    health::Health,
    increments::{Force, GyroCycle, Increments, SLICES, Slice, forces::READINGS},
    mode::Mode,
    packet::hex_value,
    sample::{NO_SLOT, SENSOR_COUNT},
};

/// First byte of a derived frame.
pub const DERIVED_START: u8 = b'$';

/// Bytes of a derived frame.
pub const DERIVED_BYTES: usize = 1 + FIELD_DIGITS + 1 + 4 + 1;

const VERSION: u64 = 5;
/// The version before.
const WITHOUT_START: u64 = 4;
const FIELD_DIGITS: usize = CYCLE_DIGITS + GYRO_DIGITS + FORCE_DIGITS + SLICE_DIGITS + ESTIMATE_DIGITS;
const CYCLE_DIGITS: usize = 2 + 4 + TIME_DIGITS + 1 + 8 + 8 + 5 + 5 * SENSOR_COUNT;
const GYRO_DIGITS: usize = 6 + TIME_DIGITS + 8 * 3 + 4 * (8 + 4 + 4 + 2);
const FORCE_DIGITS: usize = READINGS * (6 + 5 + 8 * 3 + 4 * 12);
const SLICE_DIGITS: usize = SLICES * (5 + 4 + 4 * 4);
const ESTIMATE_DIGITS: usize = 5 + 8 * (3 + 3 + 3 + 1 + 4 + 4 + 6 + 3 + 3);
/// Microseconds of nine years.
const TIME_DIGITS: usize = 12;
const NO_SLOT_CODE: u64 = 0xF_FFFF;

/// CRC-16/CCITT-FALSE, which the catalogue calls IBM-3740; "123456789" gives 29B1.
const CRC: Crc<u16> = Crc::<u16>::new(&CRC_16_IBM_3740);

/// How the unit started.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
pub struct Start {
    /// Why.
    pub reset: ResetCause,
    /// The crash before it that is not in the log yet.
    pub crash: Option<CrashCause>,
    /// How often since power-on, this start among them.
    pub starts: u16,
}

/// What a derived frame says.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
pub struct Derived {
    /// Counter of the packet it belongs to.
    pub counter: u16,
    /// \[us\] start of the cycle, since the unit's clock started.
    pub start_us: u64,
    /// Mode of the unit.
    pub mode: Mode,
    /// Health, error identifier included.
    pub health: Health,
    /// How the unit started; `None` in frames of version 4.
    pub start: Option<Start>,
    /// \[us\] from the start of the cycle to the closing of its packet.
    pub cycle_us: u32,
    /// \[us\] when each sensor was sampled after `start_us`, reading order; [`NO_SLOT`] if it was not.
    pub slots_us: [u32; SENSOR_COUNT],
    /// The gyros since the packet before.
    pub increments: Increments,
    /// \[us\] the estimation took on the unit's clock.
    pub estimate_us: u32,
    /// What it all says of the attitude.
    pub estimate: Estimate,
}

impl Derived {
    /// A cycle in WAIT in which nothing was sampled and of which nothing is known: what tests of readers build theirs on, so that
    /// a new field is none of their business.
    pub const NONE: Derived = Derived {
        counter: 0,
        start_us: 0,
        mode: Mode::Wait,
        health: Health(0),
        start: None,
        cycle_us: 0,
        slots_us: [NO_SLOT; SENSOR_COUNT],
        increments: Increments::NONE,
        estimate_us: 0,
        estimate: Estimate::NOTHING,
    };
}

/// Why bytes are not a derived frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
pub enum DerivedError {
    /// They are not [`DERIVED_BYTES`] long.
    Length(usize),
    /// The byte at this offset belongs to no frame.
    Byte(usize),
    /// The checksum does not fit.
    Checksum {
        /// Sent.
        sent: u16,
        /// Of the fields as received.
        computed: u16,
    },
    /// A version this reader does not know.
    Version(u8),
}

impl fmt::Display for DerivedError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            DerivedError::Length(found) => write!(f, "{found} bytes where a derived frame has {DERIVED_BYTES}"),
            DerivedError::Byte(at) => write!(f, "byte {at} belongs to no derived frame"),
            DerivedError::Checksum { sent, computed } => {
                write!(f, "checksum {sent:04X} was sent, the fields give {computed:04X}")
            }
            DerivedError::Version(found) => write!(f, "version {found}; this reader knows {VERSION}: update it"),
        }
    }
}

impl core::error::Error for DerivedError {}

/// The frame of a cycle.
pub fn encode(derived: &Derived) -> [u8; DERIVED_BYTES] {
    let mut frame = [0; DERIVED_BYTES];
    let mut fields = Writer {
        frame: &mut frame,
        at: 1,
    };
    fields.put(VERSION, 2);
    fields.put(derived.counter.into(), 4);
    fields.put(derived.start_us, TIME_DIGITS);
    fields.put((derived.mode == Mode::Flight).into(), 1);
    fields.put(derived.health.0.into(), 8);
    fields.put(derived.start.map_or(0, |start| start.reset.code()).into(), 1);
    let crash = derived.start.and_then(|start| start.crash);
    fields.put(crash.map_or(0, CrashCause::code).into(), 1);
    fields.put(derived.start.map_or(0, |start| start.starts).into(), 4);
    fields.put(0, 2);
    fields.put(u64::from(derived.cycle_us).min(NO_SLOT_CODE), 5);
    for slot_us in derived.slots_us {
        fields.put(
            if slot_us == NO_SLOT {
                NO_SLOT_CODE
            } else {
                u64::from(slot_us).min(NO_SLOT_CODE - 1)
            },
            5,
        );
    }
    fields.put(u64::from(derived.increments.covered_us).min(0xFF_FFFF), 6);
    fields.put(derived.increments.end_us, TIME_DIGITS);
    fields.reals(&derived.increments.angle_b);
    for channel in derived.increments.gyro {
        fields.reals(&[channel.integral_counts_s]);
        fields.put((channel.least as u16).into(), 4);
        fields.put((channel.most as u16).into(), 4);
        fields.put(channel.count.into(), 2);
    }
    for force in &derived.increments.forces {
        fields.put(u64::from(force.covered_us).min(0xFF_FFFF), 6);
        fields.put(u64::from(force.after_us).min(0xF_FFFF), 5);
        fields.reals(&force.angle_b);
        for counts in force.acc_p.as_flattened() {
            fields.put((*counts as u16).into(), 4);
        }
    }
    for slice in &derived.increments.slices {
        fields.put(u64::from(slice.before_us).min(0xF_FFFF), 5);
        fields.put(slice.lasts_us.into(), 4);
        for quarters in slice.quarters {
            fields.put((quarters as u16).into(), 4);
        }
    }
    fields.put(u64::from(derived.estimate_us).min(0xF_FFFF), 5);
    let estimate = &derived.estimate;
    for vector in [&estimate.force_b, &estimate.field_b_ut, &estimate.rate_b] {
        fields.reals(vector);
    }
    fields.put(estimate.sensors.0.into(), 8);
    for attitude in [estimate.triad_nb, estimate.q_nb] {
        fields.reals(&attitude.unwrap_or_default());
    }
    fields.reals(&estimate.covariance_n);
    for vector in [&estimate.bias_b, &estimate.bias_sd] {
        fields.reals(vector);
    }
    let crc = CRC.checksum(&frame[1..1 + FIELD_DIGITS]);
    let mut end = Writer {
        frame: &mut frame,
        at: 2 + FIELD_DIGITS,
    };
    end.put(crc.into(), 4);
    frame[0] = DERIVED_START;
    frame[1 + FIELD_DIGITS] = b'*';
    frame[DERIVED_BYTES - 1] = b'\n';
    frame
}

/// What a frame says.
pub fn decode(bytes: &[u8]) -> Result<Derived, DerivedError> {
    let frame: &[u8; DERIVED_BYTES] = bytes.try_into().map_err(|_| DerivedError::Length(bytes.len()))?;
    let fits = |(at, byte): &(usize, &u8)| match *at {
        0 => **byte == DERIVED_START,
        at if at == 1 + FIELD_DIGITS => **byte == b'*',
        at if at == DERIVED_BYTES - 1 => **byte == b'\n',
        _ => hex_value(**byte).is_some(),
    };
    if let Some((at, _)) = frame.iter().enumerate().find(|entry| !fits(entry)) {
        return Err(DerivedError::Byte(at));
    }
    let sent = Reader {
        frame,
        at: 2 + FIELD_DIGITS,
    }
    .word();
    let computed = CRC.checksum(&frame[1..1 + FIELD_DIGITS]);
    if sent != computed {
        return Err(DerivedError::Checksum { sent, computed });
    }
    let mut fields = Reader { frame, at: 1 };
    let version = fields.take(2);
    let time_digits = match version {
        VERSION => TIME_DIGITS,
        WITHOUT_START => 16,
        _ => return Err(DerivedError::Version(version as u8)),
    };
    Ok(Derived {
        counter: fields.word(),
        start_us: fields.take(time_digits),
        mode: if fields.take(1) == 1 { Mode::Flight } else { Mode::Wait },
        health: Health(fields.take(8) as u32),
        start: if version == VERSION { fields.start() } else { None },
        cycle_us: fields.take(5) as u32,
        slots_us: core::array::from_fn(|_| match fields.take(5) {
            NO_SLOT_CODE => NO_SLOT,
            slot_us => slot_us as u32,
        }),
        increments: Increments {
            covered_us: fields.take(6) as u32,
            end_us: fields.take(time_digits),
            angle_b: fields.reals(),
            gyro: core::array::from_fn(|_| {
                let [integral_counts_s] = fields.reals();
                GyroCycle {
                    integral_counts_s,
                    least: fields.word() as i16,
                    most: fields.word() as i16,
                    count: fields.take(2) as u8,
                }
            }),
            forces: core::array::from_fn(|_| Force {
                covered_us: fields.take(6) as u32,
                after_us: fields.take(5) as u32,
                angle_b: fields.reals(),
                acc_p: core::array::from_fn(|_| core::array::from_fn(|_| fields.word() as i16)),
            }),
            slices: core::array::from_fn(|_| Slice {
                before_us: fields.take(5) as u32,
                lasts_us: fields.word(),
                quarters: core::array::from_fn(|_| fields.word() as i16),
            }),
        },
        estimate_us: fields.take(5) as u32,
        estimate: Estimate {
            force_b: fields.reals(),
            field_b_ut: fields.reals(),
            rate_b: fields.reals(),
            sensors: SensorHealth(fields.take(8) as u32),
            triad_nb: fields.attitude(),
            q_nb: fields.attitude(),
            covariance_n: fields.reals(),
            bias_b: fields.reals(),
            bias_sd: fields.reals(),
        },
    })
}

struct Writer<'a> {
    frame: &'a mut [u8; DERIVED_BYTES],
    at: usize,
}

impl Writer<'_> {
    fn put(&mut self, value: u64, digits: usize) {
        for digit in (0..digits).rev() {
            if let Some(place) = self.frame.get_mut(self.at) {
                *place = b"0123456789ABCDEF"[(value >> (4 * digit) & 0xF) as usize];
            }
            self.at = self.at.wrapping_add(1);
        }
    }

    fn reals(&mut self, values: &[f32]) {
        for value in values {
            self.put(value.to_bits().into(), 8);
        }
    }
}

/// Reads fields whose digits have been checked.
struct Reader<'a> {
    frame: &'a [u8; DERIVED_BYTES],
    at: usize,
}

impl Reader<'_> {
    fn take(&mut self, digits: usize) -> u64 {
        let field = &self.frame[self.at..self.at + digits];
        self.at += digits;
        field
            .iter()
            .fold(0, |value, digit| value << 4 | u64::from(hex_value(*digit).unwrap_or(0)))
    }

    fn word(&mut self) -> u16 {
        self.take(4) as u16
    }

    fn reals<const N: usize>(&mut self) -> [f32; N] {
        core::array::from_fn(|_| f32::from_bits(self.take(8) as u32))
    }

    fn start(&mut self) -> Option<Start> {
        let reset = ResetCause::of_code(self.take(1) as u8);
        let crash = CrashCause::of_code(self.take(1) as u8);
        let starts = self.word();
        self.take(2);
        reset.map(|reset| Start { reset, crash, starts })
    }

    fn attitude(&mut self) -> Option<[f32; 4]> {
        Some(self.reals()).filter(|parts| *parts != [0.0; 4])
    }
}

#[cfg(test)]
mod tests;
