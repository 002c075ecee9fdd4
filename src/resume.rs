//! What the unit was doing, in the sixteen bytes that survive a reset.
//!
//! In: mode, recording, counter and resets. Out: 16 bytes with a CRC-32 (ISO-HDLC) over the first 12, little endian:
//! `0-3` magic, `4` mode, `5` recording, `6-7` counter of the next packet, `8-9` resets, `10-11` zero. What power-on
//! leaves in RAM, or what a reset tore in mid-write, is refused by its checksum.

use crc::{CRC_32_ISO_HDLC, Crc, NoTable};

use crate::mode::Mode;

/// Bytes of an encoded [`Resume`].
pub const RESUME_BYTES: usize = 16;

const MAGIC: [u8; 4] = *b"EMRS";
const CHECKED: usize = RESUME_BYTES - 4;
/// Without a table, which would take a kilobyte of flash.
const CRC: Crc<u32, NoTable> = Crc::<u32, NoTable>::new(&CRC_32_ISO_HDLC);

/// What the unit was doing when a reset struck.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
pub struct Resume {
    /// Mode to return to.
    pub mode: Mode,
    /// Whether packets were being recorded.
    pub recording: bool,
    /// Counter of the next packet.
    pub next_counter: u16,
    /// Resets since power-on.
    pub resets: u16,
}

impl Resume {
    /// The 16 bytes that are kept.
    pub fn encode(&self) -> [u8; RESUME_BYTES] {
        let mut bytes = [0; RESUME_BYTES];
        bytes[0..4].copy_from_slice(&MAGIC);
        bytes[4] = match self.mode {
            Mode::Wait => 1,
            Mode::Flight => 2,
        };
        bytes[5] = self.recording.into();
        bytes[6..8].copy_from_slice(&self.next_counter.to_le_bytes());
        bytes[8..10].copy_from_slice(&self.resets.to_le_bytes());
        let crc = CRC.checksum(&bytes[..CHECKED]);
        bytes[CHECKED..].copy_from_slice(&crc.to_le_bytes());
        bytes
    }

    /// The state, or `None` if the bytes are not one.
    pub fn decode(bytes: &[u8; RESUME_BYTES]) -> Option<Self> {
        let crc = CRC.checksum(&bytes[..CHECKED]).to_le_bytes();
        if bytes[0..4] != MAGIC || bytes[CHECKED..] != crc || bytes[10..12] != [0, 0] {
            return None;
        }
        Some(Resume {
            mode: match bytes[4] {
                1 => Mode::Wait,
                2 => Mode::Flight,
                _ => return None,
            },
            recording: match bytes[5] {
                0 => false,
                1 => true,
                _ => return None,
            },
            next_counter: u16::from_le_bytes([bytes[6], bytes[7]]),
            resets: u16::from_le_bytes([bytes[8], bytes[9]]),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const IN_FLIGHT: Resume = Resume {
        mode: Mode::Flight,
        recording: true,
        next_counter: 0x1234,
        resets: 7,
    };
    const IN_FLIGHT_BYTES: [u8; RESUME_BYTES] = [
        b'E', b'M', b'R', b'S', 2, 1, 0x34, 0x12, 7, 0, 0, 0, 0x88, 0xCC, 0xB9, 0xC4,
    ];

    #[test]
    fn a_flight_is_kept_in_these_sixteen_bytes() {
        assert_eq!(IN_FLIGHT.encode(), IN_FLIGHT_BYTES);
        assert_eq!(Resume::decode(&IN_FLIGHT_BYTES), Some(IN_FLIGHT));
        assert_eq!(Resume::decode(&Resume::default().encode()), Some(Resume::default()));
    }

    #[test]
    fn every_one_and_two_bit_error_is_refused() {
        for first in 0..RESUME_BYTES * 8 {
            for second in first..RESUME_BYTES * 8 {
                let mut bytes = IN_FLIGHT_BYTES;
                bytes[first / 8] ^= 1 << (first % 8);
                if second != first {
                    bytes[second / 8] ^= 1 << (second % 8);
                }
                assert_eq!(Resume::decode(&bytes), None, "bits {first} and {second}");
            }
        }
    }

    #[test]
    fn a_write_torn_by_a_reset_is_refused() {
        let before = Resume::default().encode();
        for written in 5..RESUME_BYTES {
            let mut torn = before;
            torn[..written].copy_from_slice(&IN_FLIGHT_BYTES[..written]);
            assert_eq!(Resume::decode(&torn), None, "{written} bytes written");
        }
    }

    #[test]
    fn a_mode_that_does_not_exist_is_refused_whatever_its_checksum() {
        let mut bytes = IN_FLIGHT_BYTES;
        bytes[4] = 3;
        let crc = CRC.checksum(&bytes[..CHECKED]).to_le_bytes();
        bytes[CHECKED..].copy_from_slice(&crc);
        assert_eq!(Resume::decode(&bytes), None);
    }

    #[test]
    fn memory_after_power_on_resumes_nothing() {
        assert_eq!(Resume::decode(&[0; RESUME_BYTES]), None);
        assert_eq!(Resume::decode(&[0xFF; RESUME_BYTES]), None);
    }
}
