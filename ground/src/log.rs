//! A byte stream to readings, however damaged.
//!
//! In: bytes, in pieces of any size. Out: every intact packet with its offset, and for each stretch of bytes between
//! intact packets one [`Reject`] with offset, length and reason. Refuses nothing and never panics; line ends between
//! frames are passed over without a word, since one packet a line is how people keep streams.
//!
//! Nothing but `@` starts a packet and no packet holds another `@` (Tab. A.3: digits, then `#`), so a reader that starts
//! anew at every `@` finds every intact packet, and two candidates never overlap. That is all the memory it needs.

pub mod sequence;

use crc::{CRC_16_IBM_3740, Crc};
use emems::{
    packet::{self, ERROR_IDENTIFIER, PACKET_BYTES, PacketError, START},
    sample::{Errors, Reading},
};

use crate::channel::{self, CHANNELS};

/// CRC-16/CCITT-FALSE, by its catalogued name.
const CRC: Crc<u16> = Crc::<u16>::new(&CRC_16_IBM_3740);

/// What bytes 5 to 8 of a packet are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Bytes5To8 {
    /// The error identifier of Tab. A.3, one bit a sensor.
    #[default]
    Errors,
    /// CRC-16/CCITT-FALSE over the 152 other bytes, as Tab. A.2 has it; which sensors failed is told by their values.
    Crc,
}

/// Something found in a stream.
#[derive(Clone, Debug, PartialEq)]
pub enum Item {
    /// An intact packet.
    Packet {
        /// Offset of its `@`.
        offset: u64,
        /// What it says.
        reading: Reading,
    },
    /// Bytes that are not an intact packet.
    Reject(Reject),
}

/// A stretch of bytes between intact packets.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("offset {offset}, {length} bytes: {reason}")]
pub struct Reject {
    /// Offset of its first byte.
    pub offset: u64,
    /// Bytes in it.
    pub length: u64,
    /// What was wrong first.
    pub reason: Reason,
}

/// Why bytes were rejected.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Reason {
    /// They stand outside any packet.
    #[error("not part of a packet")]
    OutsidePacket,
    /// They begin like a packet.
    #[error("begins like a packet, then {0}")]
    Malformed(PacketError),
    /// The next packet or the end of the stream came too early.
    #[error("packet cut off after {0} of {PACKET_BYTES} bytes")]
    CutOff(usize),
    /// The packet has the right form and the wrong check sum.
    #[error("check sum {found:04X} in bytes 5 to 8, {expected:04X} over the rest")]
    Crc {
        /// In the packet.
        found: u16,
        /// Over its other bytes.
        expected: u16,
    },
}

/// Reads a stream piece by piece.
#[derive(Debug, Default)]
pub struct Decoder {
    bytes_5_to_8: Bytes5To8,
    position: u64,
    candidate: Vec<u8>,
    stretch: Option<(u64, Reason)>,
}

impl Decoder {
    /// A reader at the start of a stream.
    pub fn new(bytes_5_to_8: Bytes5To8) -> Self {
        Decoder {
            bytes_5_to_8,
            ..Decoder::default()
        }
    }

    /// Takes the next bytes; returns what they completed.
    pub fn push(&mut self, bytes: &[u8]) -> Vec<Item> {
        let mut items = Vec::new();
        for byte in bytes {
            self.push_byte(*byte, &mut items);
            self.position += 1;
        }
        items
    }

    /// Ends the stream; returns the last stretch, if any.
    pub fn finish(mut self) -> Option<Reject> {
        if !self.candidate.is_empty() {
            self.abandon_candidate();
        }
        self.close_stretch(self.position)
    }

    fn push_byte(&mut self, byte: u8, items: &mut Vec<Item>) {
        if byte == START {
            if !self.candidate.is_empty() {
                self.abandon_candidate();
            }
            self.candidate.push(byte);
        } else if self.candidate.is_empty() {
            if self.stretch.is_none() && !matches!(byte, b'\r' | b'\n') {
                self.stretch = Some((self.position, Reason::OutsidePacket));
            }
        } else {
            self.candidate.push(byte);
            if self.candidate.len() == PACKET_BYTES {
                self.judge_candidate(items);
            }
        }
    }

    /// All 156 bytes of a candidate are there.
    fn judge_candidate(&mut self, items: &mut Vec<Item>) {
        let offset = self.position + 1 - PACKET_BYTES as u64;
        match self.read_candidate() {
            Ok(reading) => {
                items.extend(self.close_stretch(offset).map(Item::Reject));
                items.push(Item::Packet { offset, reading });
            }
            Err(reason) => {
                self.stretch.get_or_insert((offset, reason));
            }
        }
        self.candidate.clear();
    }

    /// A candidate ended before its 156 bytes were there: at the byte about to be taken.
    fn abandon_candidate(&mut self) {
        let length = self.candidate.len();
        let reason = match packet::decode(&self.candidate) {
            Err(error) if error.at < length => Reason::Malformed(error),
            _ => Reason::CutOff(length),
        };
        self.stretch.get_or_insert((self.position - length as u64, reason));
        self.candidate.clear();
    }

    fn read_candidate(&self) -> Result<Reading, Reason> {
        let reading = packet::decode(&self.candidate).map_err(Reason::Malformed)?;
        match self.bytes_5_to_8 {
            Bytes5To8::Errors => Ok(reading),
            Bytes5To8::Crc => {
                let (found, expected) = (reading.errors.0, crc_of_the_rest(&self.candidate));
                if found == expected {
                    Ok(Reading {
                        errors: unread_sensors(&reading),
                        ..reading
                    })
                } else {
                    Err(Reason::Crc { found, expected })
                }
            }
        }
    }

    fn close_stretch(&mut self, end: u64) -> Option<Reject> {
        let (offset, reason) = self.stretch.take()?;
        Some(Reject {
            offset,
            length: end - offset,
            reason,
        })
    }
}

/// Check sum over a packet without its bytes 5 to 8.
fn crc_of_the_rest(packet: &[u8]) -> u16 {
    let mut digest = CRC.digest();
    digest.update(packet.get(..ERROR_IDENTIFIER.start).unwrap_or_default());
    digest.update(packet.get(ERROR_IDENTIFIER.end..).unwrap_or_default());
    digest.finalize()
}

/// The error identifier that the values of a reading imply.
fn unread_sensors(reading: &Reading) -> Errors {
    let mut errors = Errors::default();
    for (channel, value) in CHANNELS.iter().zip(channel::counts(reading)) {
        if value.is_none() {
            errors.insert(channel.slot());
        }
    }
    errors
}

#[cfg(test)]
mod tests;
