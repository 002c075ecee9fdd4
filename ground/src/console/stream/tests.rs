//! What the reader of the umbilical finds: literal streams first, then any bytes.

use emems::{
    derived::DERIVED_BYTES,
    mode::Mode,
    packet::{Expected, PACKET_BYTES, encode},
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
        cycle_us: 8000,
        ..Derived::NONE
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
