//! A launch site as its crew tells it: gravity, latitude, and the field of a model with how well it is known.
//!
//! In: the 26 digits of a G_SI, or the bytes kept in retained memory or recorder. Out: a [`Told`] whose numbers are possible, and the
//! [`Site`] that the estimation takes.
//!
//! | digits | unit | from, to |
//! |---|---|---|
//! | 4 | mm/s2, gravity | 9760, 9840 |
//! | 4 | 0.01 deg, latitude, north positive, two's complement | -90, 90 |
//! | 4 | 0.01 deg, declination of the field, east positive, two's complement | -180, 180 |
//! | 4 | 0.01 deg, dip of the field, below the horizontal positive, two's complement | -85, 85 |
//! | 2 | 0.1 deg, standard deviation of the field's direction | 0.1, 25.5 |
//! | 4 | 0.01 uT, norm of the field | 20, 70 |
//! | 2 | 0.01 uT, standard deviation of the vehicle's iron on each axis | 0.01, 2.55 |
//! | 2 | 0.01 deg/s, standard deviation of a gyro's bias for each g | 0, 2.55 |
//!
//! Gravity at the ground is 9.764 to 9.834 m/s2 (C. Hirt et al., Geophys. Res. Lett. 40:4279, 2013), the field 22 to 67 uT (IGRF-13).
//! Beyond a dip of 85 deg the field says nothing of the heading that a rocket can use. All digits zero: the site that is compiled
//! in. Refuses other numbers.

use core::fmt;

use super::{Launch, Site};
use crate::numbers::{self, Number};

/// Bytes of a site that is kept.
pub const SITE_BYTES: usize = 13;

const fn word(before: &'static str, decimals: u8, least: i32, most: i32, why: &'static str) -> Number {
    Number {
        before,
        decimals,
        is_byte: false,
        least,
        most,
        why,
    }
}

const fn sigma(before: &'static str, decimals: u8, least: i32, why: &'static str) -> Number {
    Number {
        before,
        decimals,
        is_byte: true,
        least,
        most: 255,
        why,
    }
}

/// In the order of the digits.
const NUMBERS: [Number; 8] = [
    word("gravity ", 3, 9_760, 9_840, "gravity is not 9.76 to 9.84 m/s2"),
    word(" m/s2 latitude ", 2, -9_000, 9_000, "latitude is beyond 90 deg"),
    word(" declination ", 2, -18_000, 18_000, "declination is beyond 180 deg"),
    word(" dip ", 2, -8_500, 8_500, "dip is beyond 85 deg"),
    sigma(" sd ", 1, 1, "sigma of the field's direction is zero"),
    word(" deg field ", 2, 2_000, 7_000, "field is not 20 to 70 uT"),
    sigma(" iron ", 2, 1, "sigma of the iron is zero"),
    sigma(" uT per g ", 2, 0, ""),
];

/// What a crew tells of its site.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
pub struct Told([u8; SITE_BYTES]);

impl Told {
    /// Of its digits' number.
    pub const fn of_bytes(bytes: [u8; SITE_BYTES]) -> Told {
        Told(bytes)
    }

    /// The bytes that it is kept as.
    pub fn bytes(&self) -> &[u8; SITE_BYTES] {
        &self.0
    }

    /// A site in its digits' units, rounded; what does not fit is cut to what fits, and is then refused. `None` for a place of which no
    /// field is known.
    pub fn of(site: &Site) -> Option<Told> {
        let Launch {
            norm_ut,
            dip_deg,
            sd_deg,
            iron_sd_ut,
            bias_per_g_deg_s,
        } = site.launch?;
        let number = |value: f32, parts: f32| value * parts + if value < 0.0 { -0.5 } else { 0.5 };
        // `as` saturates, and makes zero of what is not a number.
        let signed = |value: f32, parts: f32| (number(value, parts) as i16).to_be_bytes();
        let byte = |value: f32, parts: f32| number(value, parts) as u8;
        let [a, b] = signed(site.gravity, 1000.0);
        let [c, d] = signed(site.latitude_deg, 100.0);
        let [e, f] = signed(site.declination_deg, 100.0);
        let [g, h] = signed(dip_deg, 100.0);
        let [i, j] = signed(norm_ut, 100.0);
        let (sd, iron) = (byte(sd_deg, 10.0), byte(iron_sd_ut, 100.0));
        let per_g = byte(bias_per_g_deg_s, 100.0);
        Some(Told([a, b, c, d, e, f, g, h, sd, i, j, iron, per_g]))
    }

    /// Whether it is the site that is compiled in.
    pub fn is_none(&self) -> bool {
        numbers::is_nothing(&self.0)
    }

    /// What is wrong with it.
    pub fn fault(&self) -> Option<&'static str> {
        numbers::fault(&NUMBERS, &self.0)
    }

    /// What the estimation takes.
    #[inline(never)]
    pub fn site(&self, compiled_in: &Site) -> Site {
        if self.is_none() {
            return *compiled_in;
        }
        let mut bytes = &self.0[..];
        let [
            gravity,
            latitude_deg,
            declination_deg,
            dip_deg,
            sd_deg,
            norm_ut,
            iron_sd_ut,
            bias_per_g_deg_s,
        ] = NUMBERS.each_ref().map(|number| {
            let one = [1.0, 10.0, 100.0, 1000.0];
            let one = one.get(usize::from(number.decimals)).copied().unwrap_or(1.0);
            number.take(&mut bytes) as f32 / one
        });
        Site {
            gravity,
            latitude_deg,
            declination_deg,
            launch: Some(Launch {
                norm_ut,
                dip_deg,
                sd_deg,
                iron_sd_ut,
                bias_per_g_deg_s,
            }),
        }
    }
}

impl fmt::Display for Told {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.is_none() {
            return f.write_str("as compiled in");
        }
        numbers::say(&NUMBERS, &self.0, f)?;
        f.write_str(" deg/s")
    }
}

#[cfg(test)]
mod tests {
    extern crate std;

    use std::string::ToString as _;

    use super::*;

    /// Alcantara.
    const TOLD: Told = Told([0x26, 0x34, 0xFF, 0x18, 0xF7, 0xDD, 0xFC, 0x84, 2, 0x0A, 0x40, 15, 0]);

    #[test]
    fn its_words_are_its_numbers_and_a_site_is_told_to_half_a_digit() {
        assert_eq!(
            TOLD.to_string(),
            "gravity 9.780 m/s2 latitude -2.32 declination -20.83 dip -8.92 sd 0.2 deg field 26.24 iron 0.15 uT per g 0.00 deg/s"
        );
        assert_eq!(Told::of(&Site::ALCANTARA), Some(TOLD));
        assert_eq!(Told::of(&Site::LABORATORY), None);
        let site = TOLD.site(&Site::LABORATORY);
        assert_eq!(Told::of(&site), Some(TOLD));
        let (told, known) = (site.launch.expect("told"), Site::ALCANTARA.launch.expect("known"));
        for (told, known, half) in [
            (site.gravity, Site::ALCANTARA.gravity, 0.5e-3),
            (site.latitude_deg, Site::ALCANTARA.latitude_deg, 0.005),
            (site.declination_deg, Site::ALCANTARA.declination_deg, 0.005),
            (told.dip_deg, known.dip_deg, 0.005),
            (told.norm_ut, known.norm_ut, 0.005),
            (told.sd_deg, known.sd_deg, 0.05),
            (told.iron_sd_ut, known.iron_sd_ut, 0.005),
            (told.bias_per_g_deg_s, known.bias_per_g_deg_s, 0.005),
        ] {
            assert!((told - known).abs() < 1.01 * half, "{told} {known}");
        }
    }

    #[test]
    fn impossible_numbers_are_faults_and_zeros_are_the_site_that_is_compiled_in() {
        assert_eq!(TOLD.fault(), None);
        for (at, bytes, why) in [
            (0, [0x26, 0x1F], "gravity"),
            (0, [0x26, 0x71], "gravity"),
            (2, [0x23, 0x29], "latitude"),
            (2, [0xDC, 0xD7], "latitude"),
            (4, [0x46, 0x51], "declination"),
            (4, [0xB9, 0xAF], "declination"),
            (6, [0x21, 0x35], "dip"),
            (6, [0xDE, 0xCB], "dip"),
            (8, [0, 0x0A], "direction"),
            (9, [0x07, 0xCF], "field is not"),
            (9, [0x1B, 0x59], "field is not"),
            (11, [0, 0], "iron"),
        ] {
            let mut told = TOLD;
            told.0[at..at + 2].copy_from_slice(&bytes);
            assert!(told.fault().is_some_and(|fault| fault.contains(why)), "{told}");
        }
        let none = Told::default();
        assert!(none.is_none() && none.fault().is_none());
        assert_eq!(none.site(&Site::ALCANTARA), Site::ALCANTARA);
        assert_eq!(none.to_string(), "as compiled in");
    }

    /// The longest text stands on a line behind "G_SI ok: ".
    #[test]
    fn its_text_fits_a_line() {
        let longest = Told([
            0x26, 0x34, 0xDC, 0xD8, 0xB9, 0xB0, 0xDE, 0xCC, 255, 0x1B, 0x58, 255, 255,
        ]);
        assert_eq!(longest.fault(), None);
        let line = std::format!("G_SI ok: {longest}");
        assert!(line.len() <= crate::unit::LONGEST_LINE, "{} {line}", line.len());
    }
}
