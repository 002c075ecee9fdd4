//! The 156-byte packet of Table A.3.

/// Bytes of a packet.
pub const PACKET_BYTES: usize = 156;
