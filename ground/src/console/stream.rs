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

/// Longest reply line or derived frame; the unit's own are shorter.
const LONGEST_LINE: usize = 512;

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

#[cfg(test)]
mod tests {
    use emems::{
        derived::DERIVED_BYTES,
        increments::Integrator,
        mode::Mode,
        packet::{Expected, PACKET_BYTES, encode},
        sample::{NO_SLOT, SENSOR_COUNT},
    };
    use proptest::prelude::*;

    use super::*;

    fn packet(counter: u16) -> [u8; PACKET_BYTES] {
        encode(&Reading::unread(counter))
    }

    fn whole(counter: u16) -> Item {
        Item::Packet(Box::new(Reading::unread(counter)))
    }

    fn derived() -> Derived {
        Derived {
            counter: 1,
            start_us: 200_000,
            mode: Mode::Flight,
            health: derived::Health(0),
            cycle_us: 8000,
            slots_us: [NO_SLOT; SENSOR_COUNT],
            increments: Integrator::default().take(),
        }
    }

    fn items(bytes: &[u8]) -> Vec<(u64, Item)> {
        let mut stream = Stream::default();
        let mut found = stream.read(bytes);
        found.extend(stream.cut());
        found.into_iter().map(|found| (found.at, found.item)).collect()
    }

    #[test]
    fn packets_and_lines_are_told_apart() {
        let frame = derived::encode(&derived());
        let bytes = [&packet(1)[..], b">WAIT\r\n", &frame, &packet(2)].concat();
        let expected = [
            (0, whole(1)),
            (156, Item::Reply("WAIT".into())),
            (163, Item::Derived(Box::new(derived()))),
            (163 + DERIVED_BYTES as u64, whole(2)),
        ];
        assert_eq!(items(&bytes), expected);
    }

    #[test]
    fn a_damaged_packet_is_one_report_and_costs_no_other() {
        let mut damaged = packet(2);
        damaged[40] = b'f';
        let bytes = [&packet(1)[..], &damaged, &packet(3)].concat();
        let error = PacketError {
            at: 40,
            found: Some(b'f'),
            expected: Expected::HexDigit,
        };
        let unread = Item::Unread {
            bytes: damaged.to_vec(),
            why: Why::Packet(error),
        };
        assert_eq!(items(&bytes), [(0, whole(1)), (156, unread), (312, whole(3))]);
    }

    #[test]
    fn a_derived_frame_with_one_wrong_bit_is_unread() {
        let mut frame = derived::encode(&derived());
        frame[20] ^= 1;
        let found = items(&frame);
        assert!(
            matches!(
                found[..],
                [(
                    0,
                    Item::Unread {
                        why: Why::Derived(_),
                        ..
                    }
                )]
            ),
            "{found:?}"
        );
    }

    #[test]
    fn a_packet_cut_by_the_next_costs_no_more_than_itself() {
        let bytes = [&packet(1)[..100], &packet(2)].concat();
        let found = items(&bytes);
        assert!(matches!(&found[0], (0, Item::Unread { bytes, .. }) if bytes.len() == 100));
        assert_eq!(found[1..], [(100, whole(2))]);
    }

    #[test]
    fn a_reply_cut_by_a_packet_is_no_reply() {
        let bytes = [b">mode FLI".as_slice(), &packet(2)].concat();
        let unread = Item::Unread {
            bytes: b">mode FLI".to_vec(),
            why: Why::CutLine,
        };
        assert_eq!(items(&bytes), [(0, unread), (9, whole(2))]);
    }

    #[test]
    fn halves_of_two_packets_around_an_unplugging_make_no_packet() {
        let mut stream = Stream::default();
        assert_eq!(stream.read(&packet(1)[..80]), []);
        assert!(matches!(stream.cut(), Some(Found { at: 0, .. })));
        let found = stream.read(&packet(9)[80..]);
        assert!(matches!(
            found[..],
            [Found {
                at: 80,
                item: Item::Unread { why: Why::NoStart, .. }
            }]
        ));
    }

    #[test]
    fn endless_lines_and_noise_are_bounded() {
        let line = items(&[b'>'; 5000]);
        assert!(
            line.iter()
                .all(|(_, item)| matches!(item, Item::Unread { bytes, .. } if bytes.len() <= LONGEST_LINE))
        );
        let noise = items(&[0xFF; 1000]);
        assert_eq!(noise.len(), 4);
    }

    #[test]
    fn a_garbled_reply_cannot_command_the_terminal() {
        assert_eq!(
            items(b">\x1b[2J\xC3\r\n"),
            [(0, Item::Reply("\u{FFFD}[2J\u{FFFD}".into()))]
        );
    }

    proptest! {
        #[test]
        fn any_bytes_in_any_pieces_give_the_same_and_every_byte_is_accounted_for(
            bytes in proptest::collection::vec(prop_oneof![any::<u8>(), Just(b'@'), Just(b'>'), Just(b'\n')], 0..2000),
            piece in 1_usize..64,
        ) {
            let mut stream = Stream::default();
            let mut found: Vec<Found> = bytes.chunks(piece).flat_map(|piece| stream.read(piece)).collect();
            found.extend(stream.cut());
            let lengths = found.iter().map(|found| match &found.item {
                Item::Unread { bytes, .. } => bytes.len(),
                Item::Derived(_) => DERIVED_BYTES,
                Item::Reply(text) => text.chars().count() + 1,
                Item::Packet(_) => PACKET_BYTES,
            });
            let blanks = bytes.iter().filter(|byte| byte.is_ascii_whitespace()).count();
            let total: usize = lengths.sum();
            prop_assert!(total <= bytes.len() && total + blanks >= bytes.len());
            let found: Vec<_> = found.into_iter().map(|found| (found.at, found.item)).collect();
            prop_assert_eq!(found, items(&bytes));
        }

        #[test]
        fn every_intact_packet_is_read_whatever_stands_between(
            between in proptest::collection::vec(proptest::collection::vec(any::<u8>(), 0..300), 1..6),
        ) {
            let mut bytes = Vec::new();
            for (counter, noise) in between.iter().enumerate() {
                bytes.extend_from_slice(noise);
                bytes.extend_from_slice(&packet(counter as u16));
            }
            let read = items(&bytes).into_iter().filter(|(_, item)| matches!(item, Item::Packet(_)));
            let expected: Vec<_> = (0..between.len()).map(|counter| whole(counter as u16)).collect();
            prop_assert_eq!(read.map(|(_, item)| item).collect::<Vec<_>>(), expected);
        }
    }
}
