//! The console's reader: what it finds does not depend on the pieces the line gives, lies in order, and drops nothing
//! but line ends; no reply carries anything a terminal might obey.

// By its path: the package it is in takes the emulator with it.
#[allow(missing_docs, dead_code, reason = "it is documented and used where it belongs")]
#[path = "../../src/console/stream.rs"]
mod stream;

use stream::{Found, Item, Stream};

fn read(bytes: &[u8], piece: usize) -> Vec<Found> {
    let mut stream = Stream::default();
    let mut found: Vec<Found> = bytes.chunks(piece).flat_map(|piece| stream.read(piece)).collect();
    found.extend(stream.cut());
    found
}

/// The target.
pub fn console(bytes: &[u8]) {
    let found = read(bytes, usize::MAX);
    assert_eq!(found, read(bytes, 1));
    let mut end = 0;
    for Found { at, item } in found {
        let start = at as usize;
        assert!(
            bytes[end..start].iter().all(|byte| b"\r\n".contains(byte)),
            "bytes dropped without a word"
        );
        end = start
            + match item {
                Item::Packet(_) => emems::packet::PACKET_BYTES,
                Item::Derived(_) => emems::derived::DERIVED_BYTES,
                Item::Unread { bytes: unread, .. } => {
                    assert!(bytes[start..].starts_with(&unread));
                    unread.len()
                }
                Item::Reply(reply) => {
                    assert!(reply.chars().all(|letter| !letter.is_control()));
                    bytes[start..]
                        .iter()
                        .position(|byte| *byte == b'\n')
                        .expect("a reply ends")
                        + 1
                }
            };
    }
}
