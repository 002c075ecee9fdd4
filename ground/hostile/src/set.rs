//! A calibration set on its way into the unit: whatever words come, it is refused, or is what was sent, with numbers that
//! the estimation can use.
//!
//! The bytes are words as the umbilical carries them: two bytes of place, four of content, over a sound set. A first byte
//! of `~` puts the checksum right before the set is asked for, so that what lies behind it is reached too.

use emems::{
    calibration::{self, ENCODED_BYTES, Ranges, load::Arriving},
    unit::Settings,
};

const CRC: crc::Crc<u32> = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC);
const WORD: usize = 6;

/// The target.
pub fn set(bytes: &[u8]) {
    let ranges = Ranges::of(&Settings::NOMINAL);
    let mut image = calibration::Set::nominal(ranges).encode();
    let mut arriving = Arriving::default();
    let checked = ENCODED_BYTES - 4;
    let (put_right, words) = match bytes.strip_prefix(b"~") {
        Some(words) => (true, words),
        None => (false, bytes),
    };
    for word in words.as_chunks::<WORD>().0 {
        let [high, low, content @ ..] = *word;
        let place = u16::from_be_bytes([high, low]);
        let at = usize::from(place) * 4;
        let inside = image.get_mut(at..at + 4);
        assert_eq!(arriving.take(place, content), inside.is_some(), "place {place:04X}");
        if let Some(inside) = inside {
            inside.copy_from_slice(&content);
        }
    }
    if put_right {
        let crc = CRC.checksum(&image[..checked]).to_le_bytes();
        image[checked..].copy_from_slice(&crc);
    }
    for (place, content) in image.as_chunks::<4>().0.iter().enumerate() {
        assert!(arriving.take(place as u16, *content));
    }
    let taken = arriving.set(ranges, 0);
    assert_eq!(taken.is_ok(), calibration::Set::load(&image, ranges, 0).is_ok());
    let Ok(set) = taken else { return };
    assert!(set.encode() == image, "another set than was sent");
    for (channel, axis) in set.channels() {
        for above_c in [set.lowest_c - set.reference_c, 0.0, set.highest_c - set.reference_c] {
            for counts in [i16::MIN + 1, 0, i16::MAX] {
                assert!(
                    axis.value(counts, above_c).is_finite(),
                    "{channel:?}: {counts} at {above_c} K"
                );
            }
        }
    }
}
