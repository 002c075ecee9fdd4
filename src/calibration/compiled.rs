//! The set a unit starts with: the one it was built with, or the nominal one.
//!
//! In: the bytes that `EMEMS_CALIBRATION` named to the build, none if it named nothing. Out: their [`Set`]. It gives the unit its
//! serial number: from then on the unit refuses sets of others. A set for other ranges than the unit's, or that the unit
//! would refuse over its umbilical, is not used; the build has seen that the bytes are whole.

use super::{ENCODED_BYTES, Ranges, Set, bytes};

const BYTES: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/calibration.bin"));

// A damaged file shall not wait for its flight to be found out.
const _: () = assert!(
    BYTES.is_empty() || BYTES.len() == ENCODED_BYTES && bytes::is_intact(BYTES),
    "EMEMS_CALIBRATION is not what `ground calibration apply --out` writes"
);

impl Set {
    /// The set of this build.
    pub fn compiled_in(ranges: Ranges) -> Self {
        Set::load(BYTES, ranges, 0).unwrap_or_else(|_| Set::nominal(ranges))
    }
}
