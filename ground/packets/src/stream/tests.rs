//! What the stream reader finds, literal damage first, then any damage.

use emems::{
    mode::Mode,
    packet::{Expected, encode},
};
use proptest::prelude::*;

use super::*;

const GOLDEN: &[u8; PACKET_BYTES] = b"@00010000FEC50002FF9EFEB5FFFCFF81FEBF000AFF8400020001015D0078FFDDFF2EFF4C003CFFA1008CFFB50021FFF400CDFF8AFFFD089BF71D0008000CFFFC0000000701900191018F019211#";

/// Offsets and counters of the packets, and the rejects as text.
fn read(bytes_5_to_8: Bytes5To8, pieces: &[&[u8]]) -> (Vec<(u64, u16)>, Vec<String>) {
    let (mut packets, mut rejects) = (Vec::new(), Vec::new());
    let mut decoder = Decoder::new(bytes_5_to_8);
    for item in pieces.iter().flat_map(|piece| decoder.push(piece)).collect::<Vec<_>>() {
        match item {
            Item::Packet { offset, reading } => packets.push((offset, reading.counter)),
            Item::Derived { .. } | Item::Line { .. } => {}
            Item::Reject(reject) => rejects.push(reject.to_string()),
        }
    }
    rejects.extend(decoder.finish().map(|reject| reject.to_string()));
    (packets, rejects)
}

fn check(stream: &[u8], packets: &[(u64, u16)], rejects: &[&str]) {
    assert_eq!(
        read(Bytes5To8::Errors, &[stream]),
        (packets.to_vec(), rejects.iter().map(|text| text.to_string()).collect())
    );
}

#[test]
fn packets_back_to_back_or_one_a_line_leave_nothing_to_report() {
    check(&GOLDEN.repeat(2), &[(0, 1), (156, 1)], &[]);
    check(
        &[GOLDEN, b"\r\n".as_slice(), GOLDEN, b"\n"].concat(),
        &[(0, 1), (158, 1)],
        &[],
    );
}

/// Lines of text with their offsets.
fn lines(stream: &[u8]) -> Vec<(u64, String)> {
    let items = Decoder::default().push(stream);
    let line = |item| match item {
        Item::Line { offset, text } => Some((offset, text)),
        _ => None,
    };
    items.into_iter().filter_map(line).collect()
}

#[test]
fn what_the_unit_says_between_packets_is_no_damage() {
    let stream = [GOLDEN, b">mode FLIGHT: lift-off\r\n".as_slice(), GOLDEN, b">\n>ok\r\n"].concat();
    check(&stream, &[(0, 1), (180, 1)], &[]);
    let said = [(156, "mode FLIGHT: lift-off"), (336, ""), (338, "ok")];
    assert_eq!(lines(&stream), said.map(|(offset, text)| (offset, text.to_string())));
}

#[test]
fn a_line_that_does_not_end_is_told_and_costs_no_packet() {
    let unfinished = "offset 0, 5 bytes: begins like a line of text that does not end";
    check(&[b">mode".as_slice(), GOLDEN].concat(), &[(5, 1)], &[unfinished]);
    check(b">mode", &[], &[unfinished]);
    let endless = [b">".as_slice(), &[b'x'; LONGEST_LINE + 1], b"\r\n", GOLDEN].concat();
    let told = "offset 0, 132 bytes: begins like a line of text that does not end";
    check(&endless, &[(132, 1)], &[told]);
    assert_eq!(lines(&endless[1..endless.len() - GOLDEN.len()]), []);
    let longest = [b">".as_slice(), &[b'x'; LONGEST_LINE], b"\r\n"].concat();
    assert_eq!(lines(&longest), [(0, "x".repeat(LONGEST_LINE))]);
    assert_eq!(lines(b">a\xFFb\r\n"), []);
}

#[test]
fn a_truncated_packet_costs_itself_only() {
    check(
        &[&GOLDEN[..40], GOLDEN, &GOLDEN[..7]].concat(),
        &[(40, 1)],
        &[
            "offset 0, 40 bytes: frame cut off after 40 of 156 bytes",
            "offset 196, 7 bytes: frame cut off after 7 of 156 bytes",
        ],
    );
    check(
        &[&GOLDEN[100..], GOLDEN].concat(),
        &[(56, 1)],
        &["offset 0, 56 bytes: not part of a frame"],
    );
}

#[test]
fn two_packets_spliced_into_one_are_one_stretch() {
    check(
        &[&GOLDEN[..100], &GOLDEN[120..], GOLDEN].concat(),
        &[(136, 1)],
        &[
            "offset 0, 136 bytes: begins like a packet, then byte 135: 0x23 where a packet has an upper-case hexadecimal digit",
        ],
    );
}

#[test]
fn lower_case_is_rejected_with_its_position() {
    check(
        &[GOLDEN.to_ascii_lowercase().as_slice(), GOLDEN].concat(),
        &[(156, 1)],
        &[
            "offset 0, 156 bytes: begins like a packet, then byte 9: 0x66 where a packet has an upper-case hexadecimal digit",
        ],
    );
}

#[test]
fn an_over_long_packet_is_rejected_and_the_next_one_found() {
    check(
        &[&GOLDEN[..155], b"1#".as_slice(), GOLDEN].concat(),
        &[(157, 1)],
        &["offset 0, 157 bytes: begins like a packet, then byte 155: 0x31 where a packet has '#'"],
    );
}

#[test]
fn starts_and_ends_within_a_packet_do_not_hide_the_next() {
    let mut broken = *GOLDEN;
    (broken[50], broken[90]) = (b'@', b'#');
    check(
        &[broken.as_slice(), GOLDEN].concat(),
        &[(156, 1)],
        &["offset 0, 156 bytes: frame cut off after 50 of 156 bytes"],
    );
}

#[test]
fn console_text_between_packets_is_one_stretch_a_line_or_not() {
    check(
        &[GOLDEN.as_slice(), b"\r\nG_MT ok\r\n@ home\r\n", GOLDEN].concat(),
        &[(0, 1), (175, 1)],
        &["offset 158, 17 bytes: not part of a frame"],
    );
}

fn derived_frame() -> [u8; DERIVED_BYTES] {
    derived::encode(&Derived {
        counter: 1,
        start_us: 200_000,
        mode: Mode::Flight,
        cycle_us: 3_700,
        slots_us: std::array::from_fn(|slot| 225 * slot as u32),
        ..Derived::NONE
    })
}

#[test]
fn derived_frames_between_packets_are_read_too() {
    const AFTER_BOTH: u64 = 156 + DERIVED_BYTES as u64;
    let stream = [GOLDEN.as_slice(), &derived_frame(), GOLDEN].concat();
    let items = Decoder::default().push(&stream);
    let [
        Item::Packet { offset: 0, .. },
        Item::Derived { offset: 156, derived },
        Item::Packet { offset: AFTER_BOTH, .. },
    ] = items.as_slice()
    else {
        panic!("{items:?}")
    };
    assert_eq!((derived.counter, derived.cycle_us), (1, 3_700));
}

#[test]
fn a_damaged_derived_frame_costs_itself_only() {
    let mut flipped = derived_frame();
    flipped[30] = b'7';
    check(
        &[flipped.as_slice(), GOLDEN, &derived_frame()[..100], GOLDEN].concat(),
        &[(902, 1), (1158, 1)],
        &[
            "offset 0, 902 bytes: begins like a derived frame, but checksum 13D7 was sent, the fields give 62B9",
            "offset 1058, 100 bytes: frame cut off after 100 of 902 bytes",
        ],
    );
}

#[test]
fn bytes_5_to_8_may_be_a_checksum() {
    let mut packet = *GOLDEN;
    packet[5..9].copy_from_slice(b"642C");
    assert_eq!(read(Bytes5To8::Crc, &[&packet]), (vec![(0, 1)], vec![]));
    assert_eq!(
        read(Bytes5To8::Crc, &[GOLDEN]),
        (
            vec![],
            vec!["offset 0, 156 bytes: checksum 0000 in bytes 5 to 8, the rest gives 642C".into()]
        )
    );
}

#[test]
fn behind_a_checksum_failed_sensors_are_told_by_their_values() {
    let mut reading = packet::decode(GOLDEN).expect("golden frame");
    (reading.acc_p[1], reading.temperature[3]) = ([i16::MIN; 3], i16::MIN);
    let rest = crc_of_the_rest(&encode(&reading));
    reading.errors = Errors(rest);
    let items = Decoder::new(Bytes5To8::Crc).push(&encode(&reading));
    let [Item::Packet { reading, .. }] = items.as_slice() else {
        panic!("{items:?}")
    };
    assert_eq!(reading.errors, Errors(0b1000_0000_0000_0010));
}

#[test]
fn a_reason_carries_the_byte() {
    let mut packet = *GOLDEN;
    packet[154] = b'2';
    assert_eq!(Decoder::default().push(&packet), []);
    let mut decoder = Decoder::default();
    decoder.push(&packet);
    assert_eq!(
        decoder.finish().map(|reject| reject.reason),
        Some(Reason::Packet(PacketError {
            at: 154,
            found: Some(b'2'),
            expected: Expected::Flag
        }))
    );
}

/// Anything a line may carry: intact packets, and bytes that tend to look like them.
fn part() -> impl Strategy<Value = (bool, Vec<u8>)> {
    prop_oneof![
        any::<u16>().prop_map(|counter| (true, encode(&Reading::unread(counter)).to_vec())),
        proptest::collection::vec(any::<u8>(), 0..40).prop_map(|bytes| (false, bytes)),
        "[@#$>0-9A-Fa-f\r\n]{0,200}".prop_map(|text| (false, text.into_bytes())),
        (0usize..156).prop_map(|cut| (false, GOLDEN[..cut].to_vec())),
        (0usize..=DERIVED_BYTES).prop_map(|cut| (false, derived_frame()[..cut].to_vec())),
        (0usize..156).prop_map(|cut| (false, GOLDEN[cut + 1..].to_vec())),
    ]
}

proptest! {
    /// By exhaustion: a packet is wherever `decode` accepts 156 bytes.
    #[test]
    fn exactly_the_intact_packets_are_found(parts in proptest::collection::vec(part(), 0..12)) {
        let stream: Vec<u8> = parts.iter().flat_map(|(_, bytes)| bytes.clone()).collect();
        let expected: Vec<(u64, u16)> = stream
            .windows(PACKET_BYTES)
            .enumerate()
            .filter_map(|(offset, window)| Some((offset as u64, packet::decode(window).ok()?.counter)))
            .collect();
        prop_assert!(expected.len() >= parts.iter().filter(|(intact, _)| *intact).count());
        prop_assert_eq!(read(Bytes5To8::Errors, &[&stream]).0, expected);
    }

    #[test]
    fn packets_and_stretches_cover_the_stream_without_overlap(parts in proptest::collection::vec(part(), 0..12)) {
        let stream: Vec<u8> = parts.into_iter().flat_map(|(_, bytes)| bytes).collect();
        let mut decoder = Decoder::default();
        let mut items = decoder.push(&stream);
        items.extend(decoder.finish().map(Item::Reject));
        let mut position = 0;
        for item in items {
            let (offset, length) = match item {
                Item::Packet { offset, .. } => (offset, PACKET_BYTES as u64),
                Item::Derived { offset, .. } => (offset, DERIVED_BYTES as u64),
                Item::Line { offset, text } => (offset, 1 + text.len() as u64),
                Item::Reject(Reject { offset, length, .. }) => (offset, length),
            };
            prop_assert!(length > 0);
            let between = &stream[position as usize..offset as usize];
            prop_assert!(between.iter().all(|byte| matches!(byte, b'\r' | b'\n')), "{:?}", between);
            position = offset + length;
        }
        prop_assert!(stream[position as usize..].iter().all(|byte| matches!(byte, b'\r' | b'\n')));
    }

    #[test]
    fn how_a_stream_is_cut_into_pieces_changes_nothing(
        parts in proptest::collection::vec(part(), 0..6), size in 1usize..400, crc: bool,
    ) {
        let stream: Vec<u8> = parts.into_iter().flat_map(|(_, bytes)| bytes).collect();
        let bytes_5_to_8 = if crc { Bytes5To8::Crc } else { Bytes5To8::Errors };
        let pieces: Vec<&[u8]> = stream.chunks(size).collect();
        prop_assert_eq!(read(bytes_5_to_8, &pieces), read(bytes_5_to_8, &[&stream]));
    }
}
