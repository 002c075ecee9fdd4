#![doc = include_str!("../README.md")]
//!
//! # How they are built
//!
//! One part a file: bytes on a bus to counts. Registers are named as in the datasheets.
//!
//! Every driver of a sensor has the same four doors, each bounded in bus transactions: `probe` asks cheaply whether the
//! part is there, `configure` writes its settings and reads them back, `verify` reads them back again later (a part that
//! browned out comes back with its power-on settings), and `read` takes one sample. No driver keeps time; those that must
//! wait take an [`embedded_hal_async::delay::DelayNs`]. All fail with the same [`Error`], which names part, register and
//! value, so that whoever reports it need not know which part it came from.
#![no_std]
#![forbid(unsafe_code)]

use core::fmt;

pub mod adis16265;
pub mod hmc5883l;
pub mod lis331hh;
pub mod tca9548a;
pub mod tmp102;

/// A register of a part, as errors name it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Register {
    /// The part's name.
    pub part: &'static str,
    /// The register's, as in the datasheet.
    pub name: &'static str,
    /// Its address inside the part.
    pub address: u8,
}

impl fmt::Display for Register {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {} (0x{:02X})", self.part, self.name, self.address)
    }
}

/// Why a sensor could not be read or configured. Values are as wide as the part's registers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Error<E> {
    /// The bus failed in the transaction that starts at this register, or nobody answered.
    Bus(Register, E),
    /// Another part, or none, answers in this one's place.
    WrongIdentity {
        /// Where the part keeps its identity.
        register: Register,
        /// What it answers.
        expected: u16,
        /// What was answered.
        read: u16,
    },
    /// A setting is not what was written.
    NotKept {
        /// Which.
        register: Register,
        /// What was written.
        wrote: u16,
        /// What it holds.
        read: u16,
    },
    /// A word the part cannot produce.
    Garbage {
        /// Where.
        register: Register,
        /// The word.
        read: u16,
    },
    /// A status bit that should have changed has not.
    Stuck {
        /// Where.
        register: Register,
        /// What it still holds.
        read: u16,
    },
    /// Self-test moved an output too little or too much.
    SelfTest {
        /// Which output.
        register: Register,
        /// \[counts\] how far it moved.
        change: i16,
        /// \[counts\] how far it must, and may, move.
        limits: (i16, i16),
    },
}

impl<E> Error<E> {
    fn unless_identity(register: Register, expected: u16, read: u16) -> Result<(), Self> {
        let wrong = Error::WrongIdentity {
            register,
            expected,
            read,
        };
        if read == expected { Ok(()) } else { Err(wrong) }
    }

    fn unless_kept(register: Register, wrote: u16, read: u16) -> Result<(), Self> {
        let lost = Error::NotKept { register, wrote, read };
        if read == wrote { Ok(()) } else { Err(lost) }
    }

    fn unless_within(register: Register, change: i16, limits: (i16, i16)) -> Result<(), Self> {
        let off = Error::SelfTest {
            register,
            change,
            limits,
        };
        if (limits.0..=limits.1).contains(&change) {
            Ok(())
        } else {
            Err(off)
        }
    }
}

impl<E: fmt::Debug> fmt::Display for Error<E> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Error::Bus(register, error) => {
                write!(
                    f,
                    "{register}: bus error {error:?}; check the part's supply and the plate's cable"
                )
            }
            Error::WrongIdentity {
                register,
                expected,
                read,
            } => write!(
                f,
                "{register} read 0x{read:02X}, not 0x{expected:02X}: not this part; check its address or select line"
            ),
            Error::NotKept { register, wrote, read } => write!(
                f,
                "{register} holds 0x{read:02X}, written was 0x{wrote:02X}: configure it again, then check its supply"
            ),
            Error::Garbage { register, read } => write!(
                f,
                "{register} read 0x{read:02X}, which the part cannot produce: not used; probe it again"
            ),
            Error::Stuck { register, read } => write!(
                f,
                "{register} stays 0x{read:02X}: configure it again, then cycle its supply"
            ),
            Error::SelfTest {
                register,
                change,
                limits: (least, most),
            } => write!(
                f,
                "{register} moved {change} counts in self-test, not {least} to {most}: keep it still and repeat, or replace it"
            ),
        }
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use std::string::ToString;

    use super::*;

    #[test]
    fn every_error_names_part_register_and_value_and_says_what_to_do() {
        let register = Register {
            part: "LIS331HH",
            name: "CTRL_REG2",
            address: 0x21,
        };
        let check = |error: Error<u8>, value: &str, advice: &str| {
            let text = error.to_string();
            assert!(text.starts_with("LIS331HH CTRL_REG2 (0x21)"), "{text}");
            assert!(text.contains(value) && text.contains(advice), "{text}");
        };
        let (expected, wrote, read) = (0x32, 0x00, 0x10);
        check(Error::Bus(register, 7), "bus error 7;", "check");
        let wrong = Error::WrongIdentity {
            register,
            expected,
            read,
        };
        check(wrong, "read 0x10, not 0x32:", "check");
        let lost = Error::NotKept { register, wrote, read };
        check(lost, "holds 0x10, written was 0x00:", "configure");
        check(Error::Garbage { register, read: 0xFFFF }, "read 0xFFFF,", "probe");
        check(Error::Stuck { register, read }, "stays 0x10:", "cycle");
        let (change, limits) = (455, (220, 370));
        let moved = Error::SelfTest {
            register,
            change,
            limits,
        };
        check(moved, "moved 455 counts in self-test, not 220 to 370:", "replace");
    }
}
