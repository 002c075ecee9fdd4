//! The 156-byte packet of Table A.3.
//!
//! In: a [`Reading`]; out: the bytes `@...#`, and back. Every value is four upper-case hexadecimal digits of a 16-bit
//! two's complement code; [`NOT_READ`](crate::sample::NOT_READ) stands for a value that was not read. Bytes 5 to 8
//! are the error identifier of Table A.3 (Table A.2 says CRC; A.3 has one bit for each of the sixteen sensors and wins).
//!
//! Two levels: the field table over the bytes, private to this file, and [`Reading`], which can only hold what a packet
//! can say. [`decode`] accepts exactly what [`encode`] produces and names the first byte that is anything else.
//!
//! ```
//! use emems::{packet, sample::Reading};
//!
//! let mut reading = Reading::unread(7);
//! reading.gyro[2] = -5;
//! let bytes = packet::encode(&reading);
//! assert_eq!(&bytes[..9], b"@0007FFFF");
//! assert_eq!(packet::decode(&bytes), Ok(reading));
//! ```

use core::{fmt, ops::Range};

use crate::sample::{Errors, Reading};

/// Bytes of a packet.
pub const PACKET_BYTES: usize = 156;

/// First byte of a packet.
pub const START: u8 = b'@';

/// Last byte of a packet.
pub const END: u8 = b'#';

/// The field table, Tab. A.3: offsets in bytes. Every value has [`VALUE_BYTES`](field::VALUE_BYTES), and those of a group follow each other.
pub mod field {
    use super::Range;

    /// Digits of a value.
    pub const VALUE_BYTES: usize = 4;
    /// The counter of cycles.
    pub const COUNTER: usize = 1;
    /// The error identifier; a CRC in streams after Tab. A.2.
    pub const ERRORS: Range<usize> = 5..9;
    /// Twelve values, a plate's x, y, z.
    pub const ACCELEROMETERS: usize = 9;
    /// Twelve values, a plate's x, y, z.
    pub const MAGNETOMETERS: usize = 57;
    /// Four rates.
    pub const GYROS: usize = 105;
    /// Four temperatures inside the gyros.
    pub const GYRO_TEMPERATURES: usize = 121;
    /// Four temperatures of the plates.
    pub const TEMPERATURES: usize = 137;
    /// `1` after lift-off.
    pub const LIFT_OFF: usize = 153;
    /// `1` in micro-gravity.
    pub const MICRO_G: usize = 154;
    /// [`END`](super::END).
    pub const END: usize = 155;
}

/// Where the error identifier stands, for readers of streams that carry a CRC there (Tab. A.2).
pub const ERROR_IDENTIFIER: Range<usize> = field::ERRORS;

/// Why bytes are not a packet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
pub struct PacketError {
    /// Offset of the first byte that no packet has there.
    pub at: usize,
    /// That byte; `None` if the bytes ended before it.
    pub found: Option<u8>,
    /// What belongs there.
    pub expected: Expected,
}

/// What a packet has at some offset.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
pub enum Expected {
    /// `@`.
    Start,
    /// `0`-`9` or `A`-`F`.
    HexDigit,
    /// `0` or `1`.
    Flag,
    /// `#`.
    End,
    /// Nothing: a packet has 156 bytes.
    Nothing,
}

impl fmt::Display for PacketError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let expected = match self.expected {
            Expected::Start => "'@'",
            Expected::HexDigit => "an upper-case hexadecimal digit",
            Expected::Flag => "'0' or '1'",
            Expected::End => "'#'",
            Expected::Nothing => "the end: a packet has 156 bytes",
        };
        match self.found {
            Some(byte) => write!(f, "byte {}: 0x{byte:02X} where a packet has {expected}", self.at),
            None => write!(f, "byte {}: the packet ends where it has {expected}", self.at),
        }
    }
}

impl core::error::Error for PacketError {}

/// The packet of a reading.
pub fn encode(reading: &Reading) -> [u8; PACKET_BYTES] {
    let mut packet = [0; PACKET_BYTES];
    packet[0] = START;
    put_word(&mut packet, field::COUNTER, reading.counter);
    put_word(&mut packet, field::ERRORS.start, reading.errors.0);
    put(&mut packet, field::ACCELEROMETERS, reading.acc_p.as_flattened());
    put(&mut packet, field::MAGNETOMETERS, reading.mag_p.as_flattened());
    put(&mut packet, field::GYROS, &reading.gyro);
    put(&mut packet, field::GYRO_TEMPERATURES, &reading.gyro_temperature);
    put(&mut packet, field::TEMPERATURES, &reading.temperature);
    packet[field::LIFT_OFF] = b'0' + u8::from(reading.lift_off);
    packet[field::MICRO_G] = b'0' + u8::from(reading.micro_g);
    packet[field::END] = END;
    packet
}

/// The reading in a packet.
pub fn decode(bytes: &[u8]) -> Result<Reading, PacketError> {
    let fail = |at: usize, expected| PacketError {
        at,
        found: bytes.get(at).copied(),
        expected,
    };
    for at in 0..PACKET_BYTES {
        let expected = expected_at(at);
        let fits = bytes.get(at).is_some_and(|byte| match expected {
            Expected::Start => *byte == START,
            Expected::HexDigit => hex_value(*byte).is_some(),
            Expected::Flag => matches!(byte, b'0' | b'1'),
            Expected::End => *byte == END,
            Expected::Nothing => false,
        });
        if !fits {
            return Err(fail(at, expected));
        }
    }
    if bytes.len() > PACKET_BYTES {
        return Err(fail(PACKET_BYTES, Expected::Nothing));
    }
    Ok(Reading {
        counter: word(bytes, field::COUNTER),
        errors: Errors(word(bytes, field::ERRORS.start)),
        acc_p: triads(bytes, field::ACCELEROMETERS),
        mag_p: triads(bytes, field::MAGNETOMETERS),
        gyro: values(bytes, field::GYROS),
        gyro_temperature: values(bytes, field::GYRO_TEMPERATURES),
        temperature: values(bytes, field::TEMPERATURES),
        lift_off: bytes[field::LIFT_OFF] == b'1',
        micro_g: bytes[field::MICRO_G] == b'1',
    })
}

/// What a packet has at an offset: lets a reader of a stream reject a candidate at its first wrong byte.
pub fn expected_at(at: usize) -> Expected {
    match at {
        0 => Expected::Start,
        1..field::LIFT_OFF => Expected::HexDigit,
        field::LIFT_OFF | field::MICRO_G => Expected::Flag,
        field::END => Expected::End,
        _ => Expected::Nothing,
    }
}

fn put(packet: &mut [u8; PACKET_BYTES], at: usize, codes: &[i16]) {
    for (index, code) in codes.iter().enumerate() {
        put_word(packet, at.wrapping_add(field::VALUE_BYTES * index), *code as u16);
    }
}

fn put_word(packet: &mut [u8; PACKET_BYTES], at: usize, value: u16) {
    if let Some(digits) = packet.get_mut(at..).and_then(<[u8]>::first_chunk_mut) {
        *digits = hex_digits(value);
    }
}

/// The four upper-case digits of a word.
pub(crate) fn hex_digits(value: u16) -> [u8; 4] {
    [value >> 12, value >> 8, value >> 4, value].map(|digit| b"0123456789ABCDEF"[usize::from(digit & 0xF)])
}

/// The value of an upper-case digit.
pub(crate) fn hex_value(digit: u8) -> Option<u16> {
    match digit {
        b'0'..=b'9' => Some(u16::from(digit - b'0')),
        b'A'..=b'F' => Some(u16::from(digit - b'A') + 10),
        _ => None,
    }
}

/// The word at an offset whose four digits have been checked.
fn word(bytes: &[u8], at: usize) -> u16 {
    let digits = bytes.get(at..).and_then(<[u8]>::first_chunk::<4>).unwrap_or(b"0000");
    digits
        .iter()
        .fold(0, |value, digit| value << 4 | hex_value(*digit).unwrap_or(0))
}

fn values<const N: usize>(bytes: &[u8], at: usize) -> [i16; N] {
    core::array::from_fn(|index| word(bytes, at + field::VALUE_BYTES * index) as i16)
}

fn triads(bytes: &[u8], at: usize) -> [[i16; 3]; 4] {
    core::array::from_fn(|plate| values(bytes, at + 12 * plate))
}

#[cfg(test)]
mod tests {
    extern crate std;

    use proptest::prelude::*;
    use std::string::ToString;

    use super::*;
    use crate::sample::NOT_READ;

    /// Table 4.7 row 1, Table 4.2 row 1 and the magnetometer counts of the golden frame.
    const GOLDEN: &[u8; PACKET_BYTES] = b"@00010000FEC50002FF9EFEB5FFFCFF81FEBF000AFF8400020001015D0078FFDDFF2EFF4C003CFFA1008CFFB50021FFF400CDFF8AFFFD089BF71D0008000CFFFC0000000701900191018F019211#";

    fn golden() -> Reading {
        Reading {
            counter: 1,
            errors: Errors(0),
            acc_p: [[-315, 2, -98], [-331, -4, -127], [-321, 10, -124], [2, 1, 349]],
            mag_p: [[120, -35, -210], [-180, 60, -95], [140, -75, 33], [-12, 205, -118]],
            gyro: [-3, 2203, -2275, 8],
            gyro_temperature: [12, -4, 0, 7],
            temperature: [400, 401, 399, 402],
            lift_off: true,
            micro_g: true,
        }
    }

    #[test]
    fn the_golden_frame_is_encoded_and_decoded() {
        assert_eq!(&encode(&golden()), GOLDEN);
        assert_eq!(decode(GOLDEN), Ok(golden()));
    }

    #[test]
    fn counter_errors_and_flags_stand_where_table_a3_has_them() {
        let reading = Reading {
            counter: 0xFFFF,
            errors: Errors(0x8001),
            lift_off: false,
            micro_g: true,
            ..golden()
        };
        let packet = encode(&reading);
        assert_eq!(&packet[..9], b"@FFFF8001");
        assert_eq!(&packet[153..], b"01#");
        assert_eq!(decode(&packet), Ok(reading));
    }

    #[test]
    fn a_cycle_in_which_nothing_was_read_is_all_8000() {
        let packet = encode(&Reading::unread(7));
        assert_eq!(&packet[..9], b"@0007FFFF");
        assert!(packet[9..153].chunks(4).all(|digits| digits == b"8000"));
        assert_eq!(decode(&packet).map(|reading| reading.gyro), Ok([NOT_READ; 4]));
    }

    #[test]
    fn the_first_wrong_byte_is_named() {
        let check = |at: usize, byte: u8, text: &str| {
            let mut packet = *GOLDEN;
            packet[at] = byte;
            assert_eq!(decode(&packet).map_err(|error| error.to_string()), Err(text.into()));
        };
        check(0, b'0', "byte 0: 0x30 where a packet has '@'");
        check(
            9,
            b'f',
            "byte 9: 0x66 where a packet has an upper-case hexadecimal digit",
        );
        check(
            80,
            b'@',
            "byte 80: 0x40 where a packet has an upper-case hexadecimal digit",
        );
        check(154, b'2', "byte 154: 0x32 where a packet has '0' or '1'");
        check(155, b'\n', "byte 155: 0x0A where a packet has '#'");
        assert_eq!(
            decode(&GOLDEN[..40]).unwrap_err().to_string(),
            "byte 40: the packet ends where it has an upper-case hexadecimal digit"
        );
        let long = [GOLDEN.as_slice(), b"#"].concat();
        assert_eq!(decode(&long).unwrap_err().at, PACKET_BYTES);
    }

    proptest! {
        #[test]
        fn every_reading_survives_its_packet(
            counter: u16, errors: u16, acc_p: [[i16; 3]; 4], mag_p: [[i16; 3]; 4], gyro: [i16; 4],
            gyro_temperature: [i16; 4], temperature: [i16; 4], lift_off: bool, micro_g: bool,
        ) {
            let errors = Errors(errors);
            let reading = Reading {
                counter, errors, acc_p, mag_p, gyro, gyro_temperature, temperature, lift_off, micro_g,
            };
            prop_assert_eq!(decode(&encode(&reading)), Ok(reading));
        }

        #[test]
        fn arbitrary_bytes_never_panic(bytes in proptest::collection::vec(any::<u8>(), 0..200)) {
            let _ = decode(&bytes);
        }
    }
}
