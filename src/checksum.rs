//! The checksum of whatever outlives a reset or a power cut: records, superblock, calibration set, retained memory, the image.

use crc::{CRC_32_ISO_HDLC, Crc};

/// CRC-32 (ISO-HDLC).
pub(crate) const CRC: Crc<u32> = Crc::<u32>::new(&CRC_32_ISO_HDLC);
