//! A record on the umbilical: what of it is not already in its packet.
//!
//! In: a record and the page it came from. Out: `%`, the page (6 hexadecimal digits), `P` or `H`, the record's bytes in
//! hexadecimal, `*`, CRC-16/CCITT-FALSE (4 digits) of what stands between, line end. A packet record (`P`) follows its
//! own 156-byte packet and leaves it out, so that a dump is a stream of packets to whoever reads packets; a header (`H`)
//! stands whole. Neither holds `@`, `#`, `$` or a command's letters. The ground puts the two together and has the
//! record's CRC-32 to tell.

use heapless::Vec;

use super::record::{RECORD_BYTES, RecordBytes, is_packet};
use crate::packet::{PACKET_BYTES, hex_value};
use crc::{CRC_16_IBM_3740, Crc};

/// First byte of a frame.
pub const DUMP_START: u8 = b'%';

/// Where the packet stands in a packet record.
pub const PACKET_AT: usize = 24;

/// Bytes of the longest frame: a header's.
pub const DUMP_BYTES: usize = 1 + 6 + 1 + 2 * RECORD_BYTES + 1 + 4 + 1;

const CRC: Crc<u16> = Crc::<u16>::new(&CRC_16_IBM_3740);

/// A frame.
pub type Frame = Vec<u8, DUMP_BYTES>;

/// The frame of a record.
pub fn encode(page: u32, record: &RecordBytes) -> Frame {
    let mut frame = Frame::new();
    let packet = is_packet(record);
    put(&mut frame, DUMP_START);
    for byte in &page.to_be_bytes()[1..] {
        put_hex(&mut frame, *byte);
    }
    put(&mut frame, if packet { b'P' } else { b'H' });
    for (at, byte) in record.iter().enumerate() {
        if !(packet && (PACKET_AT..PACKET_AT + PACKET_BYTES).contains(&at)) {
            put_hex(&mut frame, *byte);
        }
    }
    let crc = CRC.checksum(frame.get(1..).unwrap_or_default());
    put(&mut frame, b'*');
    crc.to_be_bytes().iter().for_each(|byte| put_hex(&mut frame, *byte));
    put(&mut frame, b'\n');
    frame
}

/// The page and the record in a frame, with the packet that came before it; `None` if they are not whole.
pub fn decode(frame: &[u8], packet: Option<&[u8; PACKET_BYTES]>) -> Option<(u32, RecordBytes)> {
    let body = frame.strip_prefix(&[DUMP_START])?.strip_suffix(b"\n")?;
    let (body, crc) = body.split_at_checked(body.len().checked_sub(5)?)?;
    let crc = crc.strip_prefix(b"*")?;
    let mut sent = [0; 2];
    from_hex(crc, &mut sent)?;
    if u16::from_be_bytes(sent) != CRC.checksum(body) {
        return None;
    }
    let (page, rest) = body.split_at_checked(6)?;
    let mut number = [0; 4];
    from_hex(page, &mut number[1..])?;
    let (kind, hex) = rest.split_first()?;
    let mut record = [0; RECORD_BYTES];
    match kind {
        b'H' => from_hex(hex, &mut record)?,
        b'P' => {
            let (before, after) = hex.split_at_checked(2 * PACKET_AT)?;
            from_hex(before, &mut record[..PACKET_AT])?;
            record[PACKET_AT..PACKET_AT + PACKET_BYTES].copy_from_slice(packet?);
            from_hex(after, &mut record[PACKET_AT + PACKET_BYTES..])?;
        }
        _ => return None,
    }
    Some((u32::from_be_bytes(number), record))
}

fn put(frame: &mut Frame, byte: u8) {
    // Never full: a frame has room for its longest.
    let _ = frame.push(byte);
}

fn put_hex(frame: &mut Frame, byte: u8) {
    for digit in [byte >> 4, byte & 0xF] {
        put(frame, b"0123456789ABCDEF"[usize::from(digit & 0xF)]);
    }
}

fn from_hex(digits: &[u8], bytes: &mut [u8]) -> Option<()> {
    if digits.len() != 2 * bytes.len() {
        return None;
    }
    for (pair, byte) in digits.chunks(2).zip(bytes) {
        *byte = (hex_value(pair[0])? << 4 | hex_value(pair[1])?) as u8;
    }
    Some(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        flight_log::record::{BootHeader, Entry, Key, encode_entry, encode_header},
        health::Health,
        sample::SENSOR_COUNT,
    };

    const PACKET: [u8; PACKET_BYTES] = [b'7'; PACKET_BYTES];

    fn record() -> RecordBytes {
        let entry = Entry {
            start_us: 1,
            packet: PACKET,
            slots_us: [4; SENSOR_COUNT],
            flight: true,
            health: Health(3),
            estimate: None,
        };
        encode_entry(Key::default(), &entry)
    }

    #[test]
    fn a_packet_record_comes_back_with_its_packet() {
        let frame = encode(0x01_2345, &record());
        assert_eq!(frame.len(), 214);
        assert_eq!(&frame[..8], b"%012345P");
        assert_eq!(decode(&frame, Some(&PACKET)), Some((0x01_2345, record())));
        assert_eq!(decode(&frame, None), None);
    }

    #[test]
    fn a_header_comes_back_by_itself() {
        let header = encode_header(Key::default(), &BootHeader::default());
        let frame = encode(7, &header);
        assert_eq!(frame.len(), DUMP_BYTES);
        assert_eq!(decode(&frame, None), Some((7, header)));
    }

    #[test]
    fn every_changed_bit_and_every_cut_is_noticed() {
        let frame = encode(9, &record());
        for bit in 0..8 * frame.len() {
            let mut changed = frame.clone();
            changed[bit / 8] ^= 1 << (bit % 8);
            assert_eq!(decode(&changed, Some(&PACKET)), None, "bit {bit}");
        }
        for length in 0..frame.len() {
            assert_eq!(decode(&frame[..length], Some(&PACKET)), None, "{length} bytes");
        }
    }
}
