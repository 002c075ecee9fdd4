//! A byte stream to readings, however damaged.
//!
//! In: bytes, in pieces of any size. Out: every intact packet, derived frame and line of text with its offset, and for each
//! stretch of bytes between them one [`Reject`] with offset, length and reason. Refuses nothing and never panics; line ends
//! between frames are passed over without a word, since one packet a line is how people keep streams.
//!
//! Packets start with `@`, derived frames with `$`, and neither character stands anywhere else in either. So a reader
//! that starts anew at each of them finds every intact frame, two candidates never overlap, and one frame is all it
//! need remember. What the unit says to people, `>mode FLIGHT: lift-off` and CR LF, starts with `>` outside a frame.

pub mod sequence;

use crc::{CRC_16_IBM_3740, Crc};
use emems::{
    derived::{self, DERIVED_BYTES, DERIVED_START, Derived, DerivedError},
    packet::{self, ERROR_IDENTIFIER, PACKET_BYTES, PacketError, START},
    sample::{Errors, Reading},
    unit::LONGEST_LINE,
};

use crate::channel::{self, CHANNELS};

/// CRC-16/CCITT-FALSE, by its catalogued name.
const CRC: Crc<u16> = Crc::<u16>::new(&CRC_16_IBM_3740);

/// First byte of a line that the unit says to people.
const LINE_START: u8 = b'>';

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
    /// An intact derived frame.
    Derived {
        /// Offset of its `$`.
        offset: u64,
        /// What it says.
        derived: Box<Derived>,
    },
    /// A line that the unit says to people: a change of mode, or a reply where the stream is of the umbilical.
    Line {
        /// Offset of its `>`.
        offset: u64,
        /// What it says, without `>` and line end; printable ASCII.
        text: String,
    },
    /// Bytes that are none of these.
    Reject(Reject),
}

/// A stretch of bytes between intact frames and lines.
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
    /// They stand outside any frame.
    #[error("not part of a frame")]
    OutsideFrame,
    /// They begin like a line of text.
    #[error("begins like a line of text that does not end")]
    Line,
    /// They begin like a packet.
    #[error("begins like a packet, then {0}")]
    Packet(PacketError),
    /// They begin like a derived frame.
    #[error("begins like a derived frame, but {0}")]
    Derived(DerivedError),
    /// The next frame or the end of the stream came too early.
    #[error("frame cut off after {found} of {whole} bytes")]
    CutOff {
        /// Bytes that are there.
        found: usize,
        /// Bytes of a whole frame of its kind.
        whole: usize,
    },
    /// The packet has the right form and the wrong checksum.
    #[error("checksum {sent:04X} in bytes 5 to 8, the rest gives {computed:04X}")]
    Checksum {
        /// In the packet.
        sent: u16,
        /// Of its other bytes.
        computed: u16,
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
        self.abandon_candidate();
        self.close_stretch(self.position)
    }

    fn push_byte(&mut self, byte: u8, items: &mut Vec<Item>) {
        match byte {
            START | DERIVED_START => {
                self.abandon_candidate();
                self.candidate.push(byte);
            }
            _ if self.candidate.starts_with(&[LINE_START]) => self.push_text(byte, items),
            _ if !self.candidate.is_empty() => {
                self.candidate.push(byte);
                if self.candidate.len() == self.whole() {
                    self.judge_candidate(items);
                }
            }
            b'\r' | b'\n' => {}
            LINE_START => self.candidate.push(byte),
            _ => {
                self.stretch.get_or_insert((self.position, Reason::OutsideFrame));
            }
        }
    }

    /// The next byte of a line of text.
    fn push_text(&mut self, byte: u8, items: &mut Vec<Item>) {
        match byte {
            b'\r' | b'\n' => {
                let offset = self.position - self.candidate.len() as u64;
                let text = String::from_utf8_lossy(self.candidate.get(1..).unwrap_or_default()).into_owned();
                items.extend(self.close_stretch(offset).map(Item::Reject));
                items.push(Item::Line { offset, text });
                self.candidate.clear();
            }
            b' '..=b'~' if self.candidate.len() <= LONGEST_LINE => self.candidate.push(byte),
            _ => self.abandon_candidate(),
        }
    }

    /// Bytes the candidate must have.
    fn whole(&self) -> usize {
        match self.candidate.first() {
            Some(&DERIVED_START) => DERIVED_BYTES,
            _ => PACKET_BYTES,
        }
    }

    /// All bytes of a candidate are there.
    fn judge_candidate(&mut self, items: &mut Vec<Item>) {
        let offset = self.position + 1 - self.candidate.len() as u64;
        let item = if self.candidate.starts_with(&[DERIVED_START]) {
            derived::decode(&self.candidate)
                .map(|derived| Item::Derived {
                    offset,
                    derived: Box::new(derived),
                })
                .map_err(Reason::Derived)
        } else {
            self.read_packet().map(|reading| Item::Packet { offset, reading })
        };
        match item {
            Ok(item) => {
                items.extend(self.close_stretch(offset).map(Item::Reject));
                items.push(item);
            }
            Err(reason) => {
                self.stretch.get_or_insert((offset, reason));
            }
        }
        self.candidate.clear();
    }

    /// The candidate, if any, ended before all its bytes were there: at the byte about to be taken.
    fn abandon_candidate(&mut self) {
        let (found, whole) = (self.candidate.len(), self.whole());
        if found == 0 {
            return;
        }
        let reason = match packet::decode(&self.candidate) {
            _ if self.candidate.starts_with(&[LINE_START]) => Reason::Line,
            Err(error) if whole == PACKET_BYTES && error.at < found => Reason::Packet(error),
            _ => Reason::CutOff { found, whole },
        };
        self.stretch.get_or_insert((self.position - found as u64, reason));
        self.candidate.clear();
    }

    fn read_packet(&self) -> Result<Reading, Reason> {
        let reading = packet::decode(&self.candidate).map_err(Reason::Packet)?;
        match self.bytes_5_to_8 {
            Bytes5To8::Errors => Ok(reading),
            Bytes5To8::Crc => {
                let (sent, computed) = (reading.errors.0, crc_of_the_rest(&self.candidate));
                if sent == computed {
                    Ok(Reading {
                        errors: unread_sensors(&reading),
                        ..reading
                    })
                } else {
                    Err(Reason::Checksum { sent, computed })
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

/// Checksum over a packet without its bytes 5 to 8.
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
