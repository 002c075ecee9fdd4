//! Umbilical words, letter by letter, to commands.
//!
//! In: bytes and the time each came. Out: a [`Command`], or what was heard instead. Words are matched exactly and case
//! counts: G_MT and G_Mt differ by one bit, G_Ml looks like G_MI (thesis, App. A.3). Outside a word every byte is
//! passed over until a `G`; inside one a `G` starts anew unless it completes a word. A half word is forgotten after
//! [`HALF_WORD_TIMEOUT_US`]. Each byte costs one bounded step.
//!
//! What a word may do when is [`crate::mode`]'s business.
//!
//! ```
//! use emems::command::{Command, Heard, Parser};
//!
//! let mut parser = Parser::default();
//! let heard: Vec<Heard> = b"??G_ST".iter().filter_map(|byte| parser.hear(*byte, 0)).collect();
//! assert_eq!(heard, [Heard::Command(Command::Status)]);
//! ```

use heapless::Vec;

use crate::{
    packet::hex_value,
    rail::Rail,
    site::{self, told::SITE_BYTES},
};

/// Letters of a word.
pub const WORD_BYTES: usize = 4;

/// \[us\] pause after which a half word is forgotten.
pub const HALF_WORD_TIMEOUT_US: u64 = 2_000_000;

/// Most digits after a word: those of a [`site::Told`].
const DIGITS: usize = 2 * SITE_BYTES;

/// A word as it stands on the line.
pub type Word = [u8; WORD_BYTES];

/// What may be asked of the unit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
pub enum Command {
    /// To FLIGHT.
    Flight,
    /// To WAIT.
    Wait,
    /// Packets to the umbilical.
    SendPackets,
    /// Erase the recorder.
    Erase,
    /// Confirm [`Command::Erase`].
    ConfirmErase,
    /// Read the recorder.
    Dump,
    /// Read a part of the recorder.
    DumpRange {
        /// Number of the first page of the log.
        first: u32,
        /// How many.
        count: u32,
    },
    /// Four bytes of a calibration set.
    SetWord {
        /// Which four of it.
        place: u16,
        /// The bytes.
        bytes: [u8; 4],
    },
    /// Use and keep the calibration set that was sent.
    LoadSet,
    /// Forget the calibration set that is kept, and use the one compiled in.
    ForgetSet,
    /// Confirm [`Command::LoadSet`], [`Command::ForgetSet`], [`Command::Rail`] or [`Command::Site`].
    ConfirmSet,
    /// Read the calibration set in use.
    ReadSet,
    /// The unit lies on this launch rail, or on none.
    Rail(Rail),
    /// The unit is at this launch site, or at the one that is compiled in.
    Site(site::Told),
    /// Stop the running task.
    Stop,
    /// Record packets.
    Record,
    /// Report mode, task, sensors, recorder, resets.
    Status,
    /// Report firmware version and board.
    Version,
    /// Report how the unit lies on its pad.
    Alignment,
    /// Leave safe mode: estimate again, take every command.
    LeaveSafeMode,
    /// List the words.
    Help,
    /// Derived frames on.
    DerivedOn,
    /// Derived frames off.
    DerivedOff,
    /// Test every sensor with its own stimulus.
    SelfTest,
}

/// One row of the help: a word, its command (with an empty range where it takes one) and its meaning.
pub struct Entry {
    /// The word.
    pub word: &'static Word,
    /// The command it stands for.
    pub command: Command,
    /// What it does, for the help.
    pub meaning: &'static str,
}

const fn entry(word: &'static Word, command: Command, meaning: &'static str) -> Entry {
    Entry { word, command, meaning }
}

/// Every word of the unit: the seven of App. A.3, then ours.
pub const COMMANDS: [Entry; 24] = [
    entry(b"G_MV", Command::Flight, "to FLIGHT (send twice)"),
    entry(b"G_ME", Command::Wait, "to WAIT (send twice)"),
    entry(
        b"G_MT",
        Command::SendPackets,
        "WAIT: packets to the umbilical (send twice)",
    ),
    entry(b"G_MA", Command::Erase, "WAIT: erase the recorder (then G_CA)"),
    entry(b"G_CA", Command::ConfirmErase, "WAIT: confirm G_MA, within 10 s"),
    entry(b"G_Ml", Command::Dump, "WAIT: read the recorder"),
    entry(
        b"G_LR",
        Command::DumpRange { first: 0, count: 0 },
        "WAIT: read pages, G_LRffffffcccccc (hex first, count)",
    ),
    entry(
        b"G_CW",
        SET_WORD,
        "WAIT: calibration, G_CWppppbbbbbbbb (hex place, four bytes)",
    ),
    entry(
        b"G_CL",
        Command::LoadSet,
        "WAIT: use and keep the calibration sent (then G_CK)",
    ),
    entry(
        b"G_CX",
        Command::ForgetSet,
        "WAIT: forget the calibration kept (then G_CK)",
    ),
    entry(
        b"G_CK",
        Command::ConfirmSet,
        "WAIT: confirm G_CL, G_CX, G_RA or G_SI, within 10 s",
    ),
    entry(b"G_CR", Command::ReadSet, "WAIT: read the calibration in use"),
    entry(
        b"G_RA",
        RAIL,
        "WAIT: rail, G_RAaaaaeeeesstt (hex 0.01 deg azimuth, elevation, 0.1 deg sigmas; then G_CK)",
    ),
    entry(
        b"G_SI",
        SITE,
        "WAIT: site, G_SIggggllllddddiiiissffffrrbb (hex gravity, latitude, declination, dip, sigma, field, iron, per g; then G_CK)",
    ),
    entry(b"G_Mt", Command::Stop, "WAIT: stop the running task (send twice)"),
    entry(b"G_MG", Command::Record, "FLIGHT: record packets (send twice)"),
    entry(b"G_ST", Command::Status, "status"),
    entry(b"G_VE", Command::Version, "version"),
    entry(
        b"G_PA",
        Command::Alignment,
        "azimuth, elevation, roll and sigmas; sensors in use",
    ),
    entry(b"G_XN", Command::LeaveSafeMode, "leave safe mode"),
    entry(b"G_HE", Command::Help, "this list"),
    entry(b"G_DL", Command::DerivedOn, "derived frames on"),
    entry(b"G_DX", Command::DerivedOff, "derived frames off"),
    entry(b"G_AT", Command::SelfTest, "WAIT: self-test of the sensors"),
];

const SET_WORD: Command = Command::SetWord {
    place: 0,
    bytes: [0; 4],
};

const RAIL: Command = Command::Rail(Rail {
    azimuth: 0,
    elevation: 0,
    azimuth_sd: 0,
    elevation_sd: 0,
});

const SITE: Command = Command::Site(site::Told::of_bytes([0; SITE_BYTES]));

/// How many digits a command's word has behind it. [`Command::DumpRange`]'s are six for the first record and six for how many,
/// [`Command::SetWord`]'s four for the place and eight for the bytes, the others' those of a [`Rail`] and of a [`site::Told`].
pub fn digits_of(command: Command) -> usize {
    match command {
        Command::DumpRange { .. } | Command::SetWord { .. } | Command::Rail(_) => 12,
        Command::Site(_) => DIGITS,
        _ => 0,
    }
}

impl Command {
    /// What is wrong with its numbers.
    pub fn fault(&self) -> Option<&'static str> {
        match self {
            Command::Rail(rail) => rail.fault(),
            Command::Site(site) => site.fault(),
            _ => None,
        }
    }
}

/// The word of a command.
pub fn word_of(command: Command) -> &'static Word {
    let same = |entry: &&Entry| core::mem::discriminant(&entry.command) == core::mem::discriminant(&command);
    COMMANDS.iter().find(same).map_or(b"G_HE", |entry| entry.word)
}

/// What was heard.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
pub enum Heard {
    /// A command.
    Command(Command),
    /// Four letters beginning with `G_` that are no word.
    Unknown(Word),
    /// A word whose digits are not upper-case hexadecimal ones: at which digit, and the byte there.
    BadDigit {
        /// The word.
        word: Word,
        /// Which digit, from 0.
        digit: u8,
        /// What came instead.
        found: u8,
    },
}

/// The listener on the umbilical.
#[derive(Clone, Debug, Default)]
pub struct Parser {
    letters: Vec<u8, { WORD_BYTES + DIGITS }>,
    last_us: u64,
    /// Bytes that belonged to no word, line ends and blanks excepted.
    pub passed_over: u32,
}

impl Parser {
    /// Takes the byte that came at `now_us`.
    pub fn hear(&mut self, byte: u8, now_us: u64) -> Option<Heard> {
        if now_us.saturating_sub(self.last_us) > HALF_WORD_TIMEOUT_US {
            self.forget();
        }
        self.last_us = now_us;
        match self.letters.len() {
            0 => self.begin(byte),
            1 if byte == b'_' => self.take(byte),
            1 => {
                self.forget();
                self.begin(byte);
            }
            // A `G` here is the start of a word after a cut one: no word has it as its third letter.
            2 if byte == b'G' => {
                self.forget();
                self.begin(byte);
            }
            2 => self.take(byte),
            3 => {
                self.take(byte);
                return self.whole_word();
            }
            _ => return self.digit(byte),
        }
        None
    }

    fn begin(&mut self, byte: u8) {
        match byte {
            b'G' => self.take(byte),
            b'\r' | b'\n' | b' ' => {}
            _ => self.passed_over = self.passed_over.saturating_add(1),
        }
    }

    fn take(&mut self, byte: u8) {
        // Never full: `hear` empties the letters at the last one.
        let _ = self.letters.push(byte);
    }

    /// Forgets the word that has begun: what comes next does not go on it.
    pub fn forget(&mut self) {
        self.passed_over = self.passed_over.saturating_add(self.letters.len() as u32);
        self.letters.clear();
    }

    fn word(&self) -> Word {
        self.letters.first_chunk().copied().unwrap_or_default()
    }

    /// The row of the word that has begun.
    fn entry(&self) -> Option<&'static Entry> {
        let word = self.word();
        COMMANDS.iter().find(|entry| *entry.word == word)
    }

    fn whole_word(&mut self) -> Option<Heard> {
        let found = self.entry().map(|entry| entry.command);
        if found.is_some_and(|command| digits_of(command) > 0) {
            return None;
        }
        let word = self.word();
        self.letters.clear();
        Some(found.map_or(Heard::Unknown(word), Heard::Command))
    }

    fn digit(&mut self, byte: u8) -> Option<Heard> {
        if hex_value(byte).is_none() {
            let heard = Heard::BadDigit {
                word: self.word(),
                digit: (self.letters.len() - WORD_BYTES) as u8,
                found: byte,
            };
            self.letters.clear();
            self.begin(byte);
            return Some(heard);
        }
        self.take(byte);
        let command = self.entry()?.command;
        if self.letters.len() < WORD_BYTES + digits_of(command) {
            return None;
        }
        let mut bytes = [0_u8; SITE_BYTES];
        for (at, digit) in self.letters.iter().skip(WORD_BYTES).enumerate() {
            if let Some(byte) = bytes.get_mut(at / 2) {
                *byte = *byte << 4 | hex_value(*digit).unwrap_or(0) as u8;
            }
        }
        self.letters.clear();
        let [a, b, c, d, e, f, ..] = bytes;
        Some(Heard::Command(match command {
            Command::SetWord { .. } => Command::SetWord {
                place: u16::from_be_bytes([a, b]),
                bytes: [c, d, e, f],
            },
            Command::Rail(_) => Command::Rail(Rail::of_bytes([a, b, c, d, e, f])),
            Command::Site(_) => Command::Site(site::Told::of_bytes(bytes)),
            _ => Command::DumpRange {
                first: u32::from_be_bytes([0, a, b, c]),
                count: u32::from_be_bytes([0, d, e, f]),
            },
        }))
    }
}

#[cfg(test)]
mod tests {
    extern crate std;

    use proptest::prelude::*;
    use std::vec::Vec;

    use super::*;

    /// What a fresh parser hears when the bytes come one a millisecond.
    fn heard(bytes: &[u8]) -> Vec<Heard> {
        let mut parser = Parser::default();
        bytes
            .iter()
            .enumerate()
            .filter_map(|(at, byte)| parser.hear(*byte, 1000 * at as u64))
            .collect()
    }

    #[test]
    fn every_word_is_its_own_command() {
        for entry in &COMMANDS {
            if digits_of(entry.command) == 0 {
                assert_eq!(heard(entry.word), [Heard::Command(entry.command)]);
            }
            assert_eq!(word_of(entry.command), entry.word);
        }
    }

    #[test]
    fn case_counts() {
        assert_eq!(heard(b"G_MT"), [Heard::Command(Command::SendPackets)]);
        assert_eq!(heard(b"G_Mt"), [Heard::Command(Command::Stop)]);
        assert_eq!(heard(b"G_MI"), [Heard::Unknown(*b"G_MI")]);
        assert_eq!(heard(b"g_MT"), []);
    }

    #[test]
    fn a_word_is_found_after_a_cut_one() {
        for cut in [&b"G"[..], b"G_", b"xyz", b"\r\n", b"GG", b"_M", b"G_G_", b"M"] {
            let bytes = [cut, b"G_ST"].concat();
            assert_eq!(heard(&bytes), [Heard::Command(Command::Status)], "{cut:?}");
        }
    }

    #[test]
    fn a_half_word_is_forgotten_after_two_seconds() {
        let mut parser = Parser::default();
        for (at, byte) in b"G_M".iter().enumerate() {
            assert_eq!(parser.hear(*byte, at as u64), None);
        }
        assert_eq!(parser.hear(b'V', HALF_WORD_TIMEOUT_US + 3), None);
        assert_eq!(parser.passed_over, 4);
    }

    /// A ground that sends a letter every two seconds is heard: forgetting begins after them, not with them.
    #[test]
    fn a_half_word_is_kept_for_two_seconds() {
        let mut parser = Parser::default();
        let words = b"G_ST".iter().zip(0..);
        let heard: Vec<_> = words
            .filter_map(|(byte, at)| parser.hear(*byte, at * HALF_WORD_TIMEOUT_US))
            .collect();
        assert_eq!(heard, [Heard::Command(Command::Status)]);
    }

    /// The status tells what was passed over as a sign of a bad line: a terminal that ends its lines is none.
    #[test]
    fn line_ends_and_blanks_are_not_counted_as_passed_over() {
        let mut parser = Parser::default();
        for byte in b"\r\n G_ST\r\n" {
            parser.hear(*byte, 0);
        }
        assert_eq!(parser.passed_over, 0);
        parser.hear(b'x', 0);
        assert_eq!(parser.passed_over, 1);
    }

    #[test]
    fn a_range_takes_twelve_digits_and_names_a_wrong_one() {
        assert_eq!(
            heard(b"G_LR00001000000A"),
            [Heard::Command(Command::DumpRange { first: 16, count: 10 })]
        );
        let wrong = Heard::BadDigit {
            word: *b"G_LR",
            digit: 3,
            found: b'G',
        };
        assert_eq!(heard(b"G_LR000G_ST"), [wrong, Heard::Command(Command::Status)]);
    }

    #[test]
    fn a_site_takes_twenty_six_digits_and_a_rail_twelve() {
        let site = site::Told::of_bytes([0x26, 0x34, 0xFF, 0x18, 0xF7, 0xDD, 0xFC, 0x84, 2, 0x0A, 0x40, 15, 0]);
        let rail = Rail::of_bytes([0x1B, 0x58, 0x21, 0x34, 5, 3]);
        assert_eq!(
            heard(b"G_SI2634FF18F7DDFC84020A400F00G_RA1B5821340503G_CK"),
            [Command::Site(site), Command::Rail(rail), Command::ConfirmSet].map(Heard::Command)
        );
        let wrong = Heard::BadDigit {
            word: *b"G_SI",
            digit: 25,
            found: b'G',
        };
        assert_eq!(
            heard(b"G_SI2634FF18F7DDFC84020A400F0G_ST"),
            [wrong, Heard::Command(Command::Status)]
        );
    }

    #[test]
    fn four_bytes_of_a_set_keep_their_order() {
        let (place, bytes) = (0x011B, [0x12, 0x34, 0xAB, 0xCD]);
        assert_eq!(
            heard(b"G_CW011B1234ABCDG_CL"),
            [
                Heard::Command(Command::SetWord { place, bytes }),
                Heard::Command(Command::LoadSet)
            ]
        );
    }

    proptest! {
        #[test]
        fn a_word_is_heard_after_any_bytes_and_a_pause(noise in proptest::collection::vec(any::<u8>(), 0..64)) {
            let mut parser = Parser::default();
            for byte in noise {
                parser.hear(byte, 0);
            }
            let later = HALF_WORD_TIMEOUT_US + 1;
            let words: Vec<_> = b"G_HE".iter().filter_map(|byte| parser.hear(*byte, later)).collect();
            prop_assert_eq!(words, [Heard::Command(Command::Help)]);
        }
    }
}
