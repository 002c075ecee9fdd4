//! Numbers that a launch crew tells: where each stands among the bytes of a word's digits, what it may be, and how it is said.
//!
//! In: the bytes, big endian, and a row for each number. Out: the numbers, what is wrong with them, and their text in decimals. Whole
//! numbers all the way, so that what is answered is what was sent. Bytes that are all zero say that nothing is told, and are never
//! wrong.

use core::fmt;

/// A number of a word.
pub struct Number {
    /// Its text begins with this.
    pub before: &'static str,
    /// Decimals of its text.
    pub decimals: u8,
    /// It stands in one byte; otherwise in two, which are signed where it may be negative.
    pub is_byte: bool,
    /// The least that it may be.
    pub least: i32,
    /// The most.
    pub most: i32,
    /// What is wrong with any other.
    pub why: &'static str,
}

impl Number {
    /// Takes it off the front of the bytes; zero where there are none left.
    pub fn take(&self, bytes: &mut &[u8]) -> i32 {
        let mut next = || match bytes.split_first() {
            Some((byte, rest)) => {
                *bytes = rest;
                *byte
            }
            None => 0,
        };
        let first = next();
        if self.is_byte {
            return i32::from(first);
        }
        let word = u16::from_be_bytes([first, next()]);
        if self.least < 0 {
            i32::from(word as i16)
        } else {
            i32::from(word)
        }
    }
}

/// Whether nothing is told.
pub fn is_nothing(bytes: &[u8]) -> bool {
    bytes.iter().all(|byte| *byte == 0)
}

/// What is wrong with the first number that is not what it may be.
#[inline(never)]
pub fn fault(numbers: &[Number], mut bytes: &[u8]) -> Option<&'static str> {
    if is_nothing(bytes) {
        return None;
    }
    let wrong = numbers
        .iter()
        .find(|number| !(number.least..=number.most).contains(&number.take(&mut bytes)));
    wrong.map(|number| number.why)
}

/// The text of all of them.
#[inline(never)]
pub fn say(numbers: &[Number], mut bytes: &[u8], f: &mut fmt::Formatter<'_>) -> fmt::Result {
    for number in numbers {
        let value = number.take(&mut bytes);
        let one = 10_u32.wrapping_pow(number.decimals.into()).max(1);
        let (sign, size) = (if value < 0 { "-" } else { "" }, value.unsigned_abs());
        write!(
            f,
            "{}{sign}{}.{:03$}",
            number.before,
            size / one,
            size % one,
            usize::from(number.decimals)
        )?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    extern crate std;

    use std::{format, string::String};

    use super::*;

    const NUMBERS: [Number; 3] = [
        Number {
            before: "a ",
            decimals: 2,
            is_byte: false,
            least: -9_000,
            most: 9_000,
            why: "a is beyond 90",
        },
        Number {
            before: " b ",
            decimals: 3,
            is_byte: false,
            least: 0,
            most: 40_000,
            why: "b is above 40",
        },
        Number {
            before: " c ",
            decimals: 1,
            is_byte: true,
            least: 1,
            most: 255,
            why: "c is zero",
        },
    ];

    struct Said<'a>(&'a [u8]);

    impl fmt::Display for Said<'_> {
        fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
            say(&NUMBERS, self.0, f)
        }
    }

    fn said(bytes: &[u8]) -> String {
        format!("{}", Said(bytes))
    }

    #[test]
    fn each_number_is_said_with_its_sign_and_its_decimals() {
        assert_eq!(said(&[0xFF, 0xFB, 0x9C, 0x40, 31]), "a -0.05 b 40.000 c 3.1");
        assert_eq!(said(&[0x23, 0x28, 0x00, 0x07, 1]), "a 90.00 b 0.007 c 0.1");
        assert_eq!(said(&[]), "a 0.00 b 0.000 c 0.0");
    }

    #[test]
    fn the_first_wrong_number_is_named_and_nothing_is_never_wrong() {
        for (bytes, why) in [
            ([0x23, 0x28, 0x9C, 0x40, 1], None),
            ([0xDC, 0xD8, 0, 0, 255], None),
            ([0x23, 0x29, 0xFF, 0xFF, 0], Some("a is beyond 90")),
            ([0xDC, 0xD7, 0, 0, 1], Some("a is beyond 90")),
            ([0, 1, 0x9C, 0x41, 1], Some("b is above 40")),
            ([0, 1, 0, 0, 0], Some("c is zero")),
            ([0; 5], None),
        ] {
            assert_eq!(fault(&NUMBERS, &bytes), why, "{bytes:X?}");
        }
    }
}
