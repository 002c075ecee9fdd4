//! Umbilical bytes to packets, reply lines and derived frames, one byte at a time.
//!
//! In: bytes as they come, in pieces of any size. Out: [`Found`], with the offset in the stream. `@` begins a packet
//! wherever it stands, because nothing else contains it; so after any damage the next packet is read. A packet is
//! what [`emems::packet::decode`] accepts, rejected at its first wrong byte; `>` and `$` begin a line that ends with LF.
//! Bytes that are none of the three are handed out too, once a damaged place, with the reason: nothing is dropped
//! silently.

use emems::{
    derived::{self, DERIVED_START, Derived, DerivedError},
    packet::{self, PacketError},
    sample::Reading,
};

/// First byte of a reply line.
const REPLY_START: u8 = b'>';

/// Longest reply line or derived frame: the frame is the longest thing that the unit says.
const LONGEST_LINE: usize = emems::derived::DERIVED_BYTES + 64;

/// Unreadable bytes handed out at most at once, so that endless noise is shown while it lasts.
const LONGEST_UNREAD: usize = 256;

/// Something complete in the stream.
#[derive(Clone, Debug, PartialEq)]
pub struct Found {
    /// Offset of its first byte since the stream began.
    pub at: u64,
    /// What it is.
    pub item: Item,
}

/// What a stream consists of.
#[derive(Clone, Debug, PartialEq)]
pub enum Item {
    /// A whole packet.
    Packet(Box<Reading>),
    /// A reply without its `>` and line end; bytes that are not printable ASCII are shown as U+FFFD.
    Reply(String),
    /// A whole derived frame.
    Derived(Box<Derived>),
    /// Bytes that are none of these.
    Unread {
        /// The bytes.
        bytes: Vec<u8>,
        /// What is wrong with them.
        why: Why,
    },
}

/// Why bytes are unread.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Why {
    /// They follow no start character.
    #[error("begins with none of '@', '>', '$'")]
    NoStart,
    /// They begin like a packet.
    #[error("damaged packet: {0}")]
    Packet(PacketError),
    /// They stand between `$` and a line end.
    #[error("damaged derived frame: {0}")]
    Derived(DerivedError),
    /// A line or frame cut off by a packet.
    #[error("line cut off by a packet")]
    CutLine,
    /// A line or frame without end.
    #[error("line longer than {LONGEST_LINE} bytes")]
    LongLine,
    /// The line to the unit was interrupted here.
    #[error("cut off by unplugging")]
    Unplugged,
}

/// What the held bytes are.
#[derive(Clone, Copy, Debug, Default)]
enum Holding {
    /// Nothing.
    #[default]
    Nothing,
    /// The beginning of a packet.
    Packet,
    /// The beginning of a reply line.
    Reply,
    /// The beginning of a derived frame.
    Derived,
    /// Unreadable bytes.
    Unread(Why),
}

/// A reader of the stream.
#[derive(Clone, Debug, Default)]
pub struct Stream {
    /// Offset of the byte being taken.
    offset: u64,
    /// Offset of the first held byte.
    start: u64,
    holding: Holding,
    held: Vec<u8>,
}

impl Stream {
    /// Takes the next bytes and returns what they complete.
    pub fn read(&mut self, bytes: &[u8]) -> Vec<Found> {
        let mut found = Vec::new();
        for byte in bytes {
            found.extend(self.take(*byte));
            self.offset += 1;
        }
        found
    }

    /// Gives up what is held: bytes after this do not continue those before, however well they would fit.
    pub fn cut(&mut self) -> Option<Found> {
        match self.holding {
            Holding::Nothing => None,
            Holding::Unread(why) => self.unread(why),
            _ => self.unread(Why::Unplugged),
        }
    }

    fn take(&mut self, byte: u8) -> Option<Found> {
        match self.holding {
            Holding::Nothing => {
                self.begin(byte);
                None
            }
            Holding::Packet => self.packet(byte),
            Holding::Reply | Holding::Derived => self.line(byte),
            Holding::Unread(why) => self.skip(byte, why),
        }
    }

    fn begin(&mut self, byte: u8) {
        self.holding = match byte {
            packet::START => Holding::Packet,
            REPLY_START => Holding::Reply,
            DERIVED_START => Holding::Derived,
            b'\r' | b'\n' => return,
            _ => Holding::Unread(Why::NoStart),
        };
        self.start = self.offset;
        self.held.push(byte);
    }

    fn packet(&mut self, byte: u8) -> Option<Found> {
        self.held.push(byte);
        match packet::decode(&self.held) {
            Ok(reading) => self.found(Item::Packet(Box::new(reading))),
            // Right so far, and not yet whole.
            Err(PacketError { found: None, .. }) => None,
            Err(error) => {
                self.held.pop();
                self.skip(byte, Why::Packet(error))
            }
        }
    }

    fn line(&mut self, byte: u8) -> Option<Found> {
        match (byte, self.holding) {
            (packet::START, _) => self.skip(byte, Why::CutLine),
            (b'\n', Holding::Derived) => {
                self.held.push(byte);
                match derived::decode(&self.held) {
                    Ok(derived) => self.found(Item::Derived(Box::new(derived))),
                    Err(error) => self.unread(Why::Derived(error)),
                }
            }
            (b'\n', _) => {
                let line = self.held.trim_ascii_end();
                let reply = line.iter().skip(1).map(|byte| printable(*byte)).collect();
                self.found(Item::Reply(reply))
            }
            _ if self.held.len() == LONGEST_LINE => self.skip(byte, Why::LongLine),
            _ => {
                self.held.push(byte);
                None
            }
        }
    }

    /// Takes a byte after unreadable ones. Those end where something else may begin, so that they are told of in time.
    fn skip(&mut self, byte: u8, why: Why) -> Option<Found> {
        match byte {
            packet::START | REPLY_START | DERIVED_START | b'\r' | b'\n' => {
                let unread = self.unread(why);
                self.begin(byte);
                unread
            }
            _ => {
                self.holding = Holding::Unread(why);
                self.held.push(byte);
                let ends = byte == packet::END || self.held.len() >= LONGEST_UNREAD;
                if ends { self.unread(why) } else { None }
            }
        }
    }

    fn unread(&mut self, why: Why) -> Option<Found> {
        let bytes = self.held.clone();
        self.found(Item::Unread { bytes, why })
    }

    fn found(&mut self, item: Item) -> Option<Found> {
        self.held.clear();
        self.holding = Holding::Nothing;
        Some(Found { at: self.start, item })
    }
}

/// A garbled line must not reach the terminal as an escape sequence.
fn printable(byte: u8) -> char {
    match byte {
        b' '..=b'~' => char::from(byte),
        b'\t' => ' ',
        _ => char::REPLACEMENT_CHARACTER,
    }
}

// By its path, so that it is found from `ground/hostile` too.
#[cfg(test)]
#[path = "stream/tests.rs"]
mod tests;
