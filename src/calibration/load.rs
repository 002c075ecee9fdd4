//! A parameter set on its way through the umbilical, four bytes a word.
//!
//! In: words of four bytes with their places, in any order, again where one was lost. Out: the [`Set`], once every place
//! was heard and the unit accepts it; until then nothing changes. The set's own checksum covers the whole. What is
//! missing or refused is said, and what arrived stays, so that only the rest need be sent again.

use core::fmt;

use super::{ENCODED_BYTES, Ranges, Refusal, Set};

/// Words of a set.
pub const WORDS: usize = ENCODED_BYTES / 4;

/// A set that is arriving.
#[derive(Clone, Debug)]
pub struct Arriving {
    words: [[u8; 4]; WORDS],
    heard: [bool; WORDS],
}

/// Why there is no set yet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum NotLoaded {
    /// Words not heard yet.
    Missing {
        /// How many.
        count: usize,
        /// Place of the first.
        first: usize,
    },
    /// Not accepted.
    Refused(Refusal),
}

impl fmt::Display for NotLoaded {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            NotLoaded::Missing { count, first } => write!(f, "{count} words missing, the first at {first:04X}"),
            NotLoaded::Refused(why) => why.fmt(f),
        }
    }
}

impl Default for Arriving {
    fn default() -> Self {
        Arriving {
            words: [[0; 4]; WORDS],
            heard: [false; WORDS],
        }
    }
}

impl Arriving {
    /// Takes a word; `false` where a set has no such place.
    pub fn take(&mut self, place: u16, bytes: [u8; 4]) -> bool {
        let place = usize::from(place);
        let (Some(word), Some(heard)) = (self.words.get_mut(place), self.heard.get_mut(place)) else {
            return false;
        };
        (*word, *heard) = (bytes, true);
        true
    }

    /// The set, if it is whole, sound, for these ranges and of this unit.
    pub fn set(&self, ranges: Ranges, unit: u32) -> Result<Set, NotLoaded> {
        if let Some(first) = self.heard.iter().position(|heard| !heard) {
            let missing = self.heard.iter().filter(|heard| !**heard);
            let count = missing.fold(0, |count: usize, _| count.saturating_add(1));
            return Err(NotLoaded::Missing { count, first });
        }
        Set::load(self.words.as_flattened(), ranges, unit).map_err(NotLoaded::Refused)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::unit::Settings;

    #[test]
    fn a_set_is_had_only_when_every_word_was_heard() {
        let ranges = Ranges::of(&Settings::NOMINAL);
        let set = Set::nominal(ranges);
        let bytes = set.encode();
        let words = bytes.as_chunks::<4>().0;
        let mut arriving = Arriving::default();
        for (place, word) in words.iter().enumerate().rev().filter(|(place, _)| *place != 7) {
            assert!(arriving.take(place as u16, *word));
        }
        assert!(!arriving.take(WORDS as u16, [0; 4]));
        let missing = NotLoaded::Missing { count: 1, first: 7 };
        assert_eq!(arriving.set(ranges, 0), Err(missing));
        assert!(arriving.take(7, [1, 2, 3, 4]));
        let refused = arriving.set(ranges, 0);
        assert!(matches!(refused, Err(NotLoaded::Refused(Refusal::Checksum { .. }))));
        assert!(arriving.take(7, words[7]));
        assert_eq!(arriving.set(ranges, 0), Ok(set));
        let other = NotLoaded::Refused(Refusal::OtherUnit { found: 0, expected: 9 });
        assert_eq!(arriving.set(ranges, 9), Err(other));
    }
}
