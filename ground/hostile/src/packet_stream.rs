//! The decoder of packets, derived frames and lines of text: what it gives covers the stream without gap or overlap, whatever pieces
//! the stream came in, and what it calls intact encodes to the bytes it was read from.
use emems::{derived, packet};
use packets::stream::{Bytes5To8, Decoder, Item, Reject};

fn decoded(bytes_5_to_8: Bytes5To8, stream: &[u8], piece: usize) -> Vec<Item> {
    let mut decoder = Decoder::new(bytes_5_to_8);
    let mut items: Vec<Item> = stream.chunks(piece).flat_map(|piece| decoder.push(piece)).collect();
    items.extend(decoder.finish().map(Item::Reject));
    items
}

/// The target.
pub fn packets(stream: &[u8]) {
    for bytes_5_to_8 in [Bytes5To8::Errors, Bytes5To8::Crc] {
        let items = decoded(bytes_5_to_8, stream, usize::MAX);
        assert_eq!(items, decoded(bytes_5_to_8, stream, 1));
        let mut end = 0;
        for item in items {
            let (offset, bytes) = match item {
                Item::Packet { offset, reading } if bytes_5_to_8 == Bytes5To8::Errors => {
                    (offset, packet::encode(&reading).to_vec())
                }
                Item::Packet { offset, .. } => (offset, stream[offset as usize..][..packet::PACKET_BYTES].to_vec()),
                Item::Derived { offset, derived } => (offset, derived::encode(&derived).to_vec()),
                Item::Line { offset, text } => (offset, format!(">{text}").into_bytes()),
                Item::Reject(Reject { offset, length, .. }) => {
                    (offset, stream[offset as usize..][..length as usize].to_vec())
                }
            };
            let between = &stream[end..offset as usize];
            assert!(
                between.iter().all(|byte| b"\r\n".contains(byte)),
                "bytes dropped without a word"
            );
            assert!(stream[offset as usize..].starts_with(&bytes));
            end = offset as usize + bytes.len();
        }
    }
}
