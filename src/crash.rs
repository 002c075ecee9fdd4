//! The crash record: what a panic or fault leaves behind in memory that survives the reset.
//!
//! In: what the handler knows. Out: 64 bytes, which the retained memory keeps twice, with a CRC-32 (ISO-HDLC) over the first 60, little endian:
//! `0-3` magic, `4` cause, `5` length of the place, `6-7` spare, `8-11` pc or line, `12-15` lr, `16-19` CFSR,
//! `20-27` uptime \[us\], `28-59` last characters of the place (source file). Anything whose checksum is wrong is refused.

use crc::{CRC_32_ISO_HDLC, Crc, NoTable};
use heapless::String;

use crate::{board::Retained, retained::CRASH};

/// Bytes of an encoded record.
pub const CRASH_BYTES: usize = 64;

const MAGIC: [u8; 4] = *b"EMCR";
const CHECKED: usize = CRASH_BYTES - 4;
const PLACE: usize = 28;
const PLACE_BYTES: usize = CHECKED - PLACE;
/// Without a table, which would take a kilobyte of flash.
const CRC: Crc<u32, NoTable> = Crc::<u32, NoTable>::new(&CRC_32_ISO_HDLC);

/// What ended the previous run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
pub enum CrashCause {
    /// A Rust panic.
    Panic,
    /// A HardFault or an escalated fault.
    HardFault,
    /// An exception without a handler.
    UnhandledException,
    /// The program ran off its stack.
    StackOverflow,
}

impl CrashCause {
    /// Every cause, in the order of their codes.
    const ALL: [CrashCause; 4] = [
        CrashCause::Panic,
        CrashCause::HardFault,
        CrashCause::UnhandledException,
        CrashCause::StackOverflow,
    ];

    /// Its number in records and frames, from 1.
    pub fn code(self) -> u8 {
        self as u8 + 1
    }

    /// The cause with this number.
    pub fn of_code(code: u8) -> Option<Self> {
        CrashCause::ALL.get(usize::from(code).checked_sub(1)?).copied()
    }
}

/// What is known about a crash.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CrashRecord {
    /// What happened.
    pub cause: CrashCause,
    /// Source line of a panic, stack pointer of a program that ran off its stack, else the program counter.
    pub at: u32,
    /// Link register of a fault.
    pub lr: u32,
    /// Configurable fault status register of a fault (ARMv7-M ARM, B3.2.15).
    pub cfsr: u32,
    /// \[us\] since the unit's clock started.
    pub uptime_us: u64,
    /// Tail of the source file's name of a panic.
    pub place: String<PLACE_BYTES>,
}

impl CrashRecord {
    /// A record with the tail of `place` that fits, cut at a character boundary.
    pub fn new(cause: CrashCause, at: u32, lr: u32, cfsr: u32, uptime_us: u64, place: &str) -> Self {
        let first = place.len().saturating_sub(PLACE_BYTES);
        let tail = (first..=place.len()).find_map(|from| place.get(from..)).unwrap_or("");
        let place = String::try_from(tail).unwrap_or_default();
        CrashRecord {
            cause,
            at,
            lr,
            cfsr,
            uptime_us,
            place,
        }
    }

    /// Keeps it for the next start.
    pub fn keep(&self, memory: &impl Retained) {
        CRASH.keep(memory, &self.encode());
    }

    /// The crash before this start.
    pub fn recall(memory: &impl Retained) -> Option<Self> {
        let mut bytes = [0; CRASH_BYTES];
        CRASH.recall(memory, &mut bytes)?;
        CrashRecord::decode(&bytes)
    }

    /// The 64 bytes that are kept.
    pub fn encode(&self) -> [u8; CRASH_BYTES] {
        let mut bytes = [0; CRASH_BYTES];
        bytes[0..4].copy_from_slice(&MAGIC);
        bytes[4] = self.cause.code();
        bytes[5] = self.place.len() as u8;
        bytes[8..12].copy_from_slice(&self.at.to_le_bytes());
        bytes[12..16].copy_from_slice(&self.lr.to_le_bytes());
        bytes[16..20].copy_from_slice(&self.cfsr.to_le_bytes());
        bytes[20..28].copy_from_slice(&self.uptime_us.to_le_bytes());
        for (slot, byte) in bytes[PLACE..CHECKED].iter_mut().zip(self.place.bytes()) {
            *slot = byte;
        }
        let crc = CRC.checksum(&bytes[..CHECKED]);
        bytes[CHECKED..].copy_from_slice(&crc.to_le_bytes());
        bytes
    }

    /// The record, or `None` if the bytes are not one.
    pub fn decode(bytes: &[u8; CRASH_BYTES]) -> Option<Self> {
        let word = |at: usize| u32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]]);
        if bytes[0..4] != MAGIC || word(CHECKED) != CRC.checksum(&bytes[..CHECKED]) {
            return None;
        }
        let cause = CrashCause::of_code(bytes[4])?;
        let place = core::str::from_utf8(bytes[PLACE..CHECKED].get(..bytes[5] as usize)?).ok()?;
        let uptime_us = u64::from(word(20)) | u64::from(word(24)) << 32;
        Some(CrashRecord::new(cause, word(8), word(12), word(16), uptime_us, place))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record() -> CrashRecord {
        CrashRecord::new(
            CrashCause::Panic,
            123,
            0,
            0,
            5_000_000_000,
            "a/rather/long/path/to/src/unit/acquire.rs",
        )
    }

    #[test]
    fn a_record_survives_its_own_encoding() {
        let kept = CrashRecord::decode(&record().encode());
        assert_eq!(kept, Some(record()));
        assert!(record().place.ends_with("src/unit/acquire.rs"));
    }

    #[test]
    fn every_one_bit_error_is_refused() {
        for bit in 0..CRASH_BYTES * 8 {
            let mut bytes = record().encode();
            bytes[bit / 8] ^= 1 << (bit % 8);
            assert_eq!(CrashRecord::decode(&bytes), None, "bit {bit}");
        }
    }

    #[test]
    fn memory_after_power_on_is_no_record() {
        assert_eq!(CrashRecord::decode(&[0; CRASH_BYTES]), None);
        assert_eq!(CrashRecord::decode(&[0xFF; CRASH_BYTES]), None);
    }
}
