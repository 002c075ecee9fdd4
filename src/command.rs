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

use crate::{packet::hex_value, rail::Rail};

/// Letters of a word.
pub const WORD_BYTES: usize = 4;

/// \[us\] pause after which a half word is forgotten.
pub const HALF_WORD_TIMEOUT_US: u64 = 2_000_000;

/// Digits after [`Command::DumpRange`]'s word, six for the first record, six for how many; and after
/// [`Command::SetWord`]'s, four for the place, eight for the bytes; after [`Command::Rail`]'s those of a [`Rail`].
const DIGITS: usize = 12;

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
    /// Confirm [`Command::LoadSet`], [`Command::ForgetSet`] or [`Command::Rail`].
    ConfirmSet,
    /// Read the calibration set in use.
    ReadSet,
    /// The unit lies on this launch rail, or on none.
    Rail(Rail),
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
pub const COMMANDS: [Entry; 23] = [
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
        "WAIT: confirm G_CL, G_CX or G_RA, within 10 s",
    ),
    entry(b"G_CR", Command::ReadSet, "WAIT: read the calibration in use"),
    entry(
        b"G_RA",
        RAIL,
        "WAIT: rail, G_RAaaaaeeeesstt (hex 0.01 deg azimuth, elevation, 0.1 deg sigmas; then G_CK)",
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

/// Whether a command's word has twelve digits behind it.
pub fn takes_digits(command: Command) -> bool {
    matches!(
        command,
        Command::DumpRange { .. } | Command::SetWord { .. } | Command::Rail(_)
    )
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
    /// A word whose digits are not twelve upper-case hexadecimal ones: at which digit, and the byte there.
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

    fn whole_word(&mut self) -> Option<Heard> {
        let word = self.word();
        let found = COMMANDS.iter().find(|entry| *entry.word == word);
        if found.is_some_and(|entry| takes_digits(entry.command)) {
            return None;
        }
        self.letters.clear();
        Some(found.map_or(Heard::Unknown(word), |entry| Heard::Command(entry.command)))
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
        if self.letters.len() < WORD_BYTES + DIGITS {
            return None;
        }
        let number = |from: usize, count: usize| {
            let digits = self.letters.iter().skip(WORD_BYTES + from).take(count);
            digits.fold(0, |value, digit| value << 4 | u32::from(hex_value(*digit).unwrap_or(0)))
        };
        let command = if self.word() == *word_of(SET_WORD) {
            Command::SetWord {
                place: number(0, 4) as u16,
                bytes: number(4, 8).to_be_bytes(),
            }
        } else if self.word() == *word_of(RAIL) {
            Command::Rail(Rail {
                azimuth: number(0, 4) as u16,
                elevation: number(4, 4) as u16,
                azimuth_sd: number(8, 2) as u8,
                elevation_sd: number(10, 2) as u8,
            })
        } else {
            Command::DumpRange {
                first: number(0, 6),
                count: number(6, 6),
            }
        };
        self.letters.clear();
        Some(Heard::Command(command))
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
            if !takes_digits(entry.command) {
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
