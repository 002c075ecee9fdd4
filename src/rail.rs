//! The launch rail as its crew measured it: where the nose points, and how well that is known.
//!
//! In: the twelve digits of a G_RA, or the bytes kept in retained memory. Out: a [`Rail`] whose numbers are possible, and the
//! [`Nose`] that the filter takes.
//!
//! | digits | unit | from, to |
//! |---|---|---|
//! | 4 | 0.01 deg, azimuth east of true north | 0, 359.99 |
//! | 4 | 0.01 deg, elevation above the horizontal | 0, 90 |
//! | 2 | 0.1 deg, standard deviation of the azimuth | 0.1, 25.5 |
//! | 2 | 0.1 deg, standard deviation of the elevation | 0.1, 25.5 |
//!
//! All digits zero: no rail. Refuses other numbers.

use core::fmt;

use crate::{
    kalman::Nose,
    numbers::{self, Number},
};

/// Bytes of a rail that is kept.
pub const RAIL_BYTES: usize = 6;

/// In the order of the digits.
const NUMBERS: [Number; 4] = [
    Number {
        before: "azimuth ",
        decimals: 2,
        is_byte: false,
        least: 0,
        most: 35_999,
        why: "azimuth is not below 360 deg",
    },
    Number {
        before: " elevation ",
        decimals: 2,
        is_byte: false,
        least: 0,
        most: 9_000,
        why: "elevation is above 90 deg",
    },
    sigma(" sigma "),
    sigma(" "),
];

const fn sigma(before: &'static str) -> Number {
    Number {
        before,
        decimals: 1,
        is_byte: true,
        least: 1,
        most: 255,
        why: "a sigma is zero",
    }
}

/// What a crew measured.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
pub struct Rail {
    /// [0.01 deg] of the nose, east of north.
    pub azimuth: u16,
    /// [0.01 deg] of the nose, above the horizontal.
    pub elevation: u16,
    /// [0.1 deg] standard deviation of the azimuth.
    pub azimuth_sd: u8,
    /// [0.1 deg] standard deviation of the elevation.
    pub elevation_sd: u8,
}

impl Rail {
    /// Of its digits' number, six bytes.
    pub fn of_bytes([a, b, c, d, azimuth_sd, elevation_sd]: [u8; RAIL_BYTES]) -> Rail {
        Rail {
            azimuth: u16::from_be_bytes([a, b]),
            elevation: u16::from_be_bytes([c, d]),
            azimuth_sd,
            elevation_sd,
        }
    }

    /// The bytes that it is kept as.
    pub fn bytes(&self) -> [u8; RAIL_BYTES] {
        let ([a, b], [c, d]) = (self.azimuth.to_be_bytes(), self.elevation.to_be_bytes());
        [a, b, c, d, self.azimuth_sd, self.elevation_sd]
    }

    /// Whether it says that there is none.
    pub fn is_none(&self) -> bool {
        *self == Rail::default()
    }

    /// What is wrong with it.
    pub fn fault(&self) -> Option<&'static str> {
        numbers::fault(&NUMBERS, &self.bytes())
    }

    /// What the filter takes.
    pub fn nose(&self) -> Nose {
        let deg = |number: f32| number.to_radians();
        Nose {
            azimuth: deg(f32::from(self.azimuth) / 100.0),
            elevation: deg(f32::from(self.elevation) / 100.0),
            azimuth_sd: deg(f32::from(self.azimuth_sd) / 10.0),
            elevation_sd: deg(f32::from(self.elevation_sd) / 10.0),
        }
    }
}

impl fmt::Display for Rail {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.is_none() {
            return f.write_str("no rail");
        }
        numbers::say(&NUMBERS, &self.bytes(), f)?;
        f.write_str(" deg")
    }
}

#[cfg(test)]
mod tests {
    extern crate std;

    use std::string::ToString as _;

    use super::*;

    #[test]
    fn its_bytes_are_its_digits_and_its_words_its_numbers() {
        let rail = Rail::of_bytes([0x1B, 0x58, 0x21, 0x34, 0x05, 0x1F]);
        assert_eq!(rail.to_string(), "azimuth 70.00 elevation 85.00 sigma 0.5 3.1 deg");
        assert_eq!(Rail::of_bytes(rail.bytes()), rail);
        assert!((rail.nose().azimuth - 70.0_f32.to_radians()).abs() < 1e-6);
        assert!((rail.nose().elevation_sd - 3.1_f32.to_radians()).abs() < 1e-6);
    }

    #[test]
    fn impossible_numbers_are_faults_and_no_rail_is_none() {
        let rail = Rail {
            azimuth: 35_999,
            elevation: 9_000,
            azimuth_sd: 1,
            elevation_sd: 255,
        };
        assert_eq!(rail.fault(), None);
        let faults = [
            Rail {
                azimuth: 36_000,
                ..rail
            },
            Rail {
                elevation: 9_001,
                ..rail
            },
            Rail { azimuth_sd: 0, ..rail },
            Rail {
                elevation_sd: 0,
                ..rail
            },
        ];
        for faulty in faults {
            assert!(faulty.fault().is_some(), "{faulty}");
        }
        assert!(Rail::default().is_none() && Rail::default().fault().is_none());
    }
}
