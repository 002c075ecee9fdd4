//! What an ADIS16265 says of itself: status, supply voltage, self-test, restart.
//!
//! In: a gyro. Out: the flags of DIAG_STAT by name, volts. Source: Analog Devices ADIS16260/ADIS16265 data sheet
//! (DIAG_STAT, MSC_CTRL, GLOB_CMD); bits checked against Linux drivers/iio/gyro/adis16260.c.

use core::fmt;

use embedded_hal_async::{delay::DelayNs, spi::SpiDevice};

use super::{Adis16265, Error, Register, START_UP_MS, SUPPLY_OUT, register};

/// [V/count] of [`Adis16265::supply_counts`]; the part works from 4.75 to 5.25 V.
pub const VOLT_PER_COUNT: f32 = 1.8315e-3;

const MSC_CTRL: Register = register("MSC_CTRL", 0x34);
const DIAG_STAT: Register = register("DIAG_STAT", 0x3C);
const GLOB_CMD: Register = register("GLOB_CMD", 0x3E);

/// MSC_CTRL bit 10, in the high byte: internal self-test; the part clears it when done.
const INTERNAL_SELF_TEST: u8 = 1 << 2;
const SELF_TEST_RUNS: u16 = (INTERNAL_SELF_TEST as u16) << 8;
/// GLOB_CMD bit 7.
const SOFTWARE_RESET: u8 = 1 << 7;

/// Content of DIAG_STAT. Reading it clears it; what persists is set again by the next sample.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Diagnosis(pub u16);

/// One bit of [`Diagnosis`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum Flag {
    SupplyLow = 0,
    SupplyHigh = 1,
    FlashUpdate = 2,
    Spi = 3,
    OverRange = 4,
    SelfTest = 5,
    FlashChecksum = 6,
    Alarm1 = 8,
    Alarm2 = 9,
}

impl Diagnosis {
    /// Whether a flag is set.
    pub const fn contains(self, flag: Flag) -> bool {
        self.0 >> flag as u16 & 1 == 1
    }
}

/// The flags that are set, by name, or "no fault".
impl fmt::Display for Diagnosis {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        const NAMES: [(Flag, &str); 9] = [
            (Flag::SupplyLow, "supply below 4.75 V"),
            (Flag::SupplyHigh, "supply above 5.25 V"),
            (Flag::FlashUpdate, "flash update failed"),
            (Flag::Spi, "SPI frame of the wrong length"),
            (Flag::OverRange, "rate beyond its range"),
            (Flag::SelfTest, "self-test failed"),
            (Flag::FlashChecksum, "flash checksum wrong"),
            (Flag::Alarm1, "alarm 1"),
            (Flag::Alarm2, "alarm 2"),
        ];
        let mut separator = "";
        for (flag, name) in NAMES {
            if self.contains(flag) {
                write!(f, "{separator}{name}")?;
                separator = ", ";
            }
        }
        if separator.is_empty() {
            f.write_str("no fault")
        } else {
            Ok(())
        }
    }
}

impl<SPI: SpiDevice<u16>, D: DelayNs> Adis16265<SPI, D> {
    /// Reads and clears the status: what an [`super::Output::alarm`] is about.
    pub async fn diagnose(&mut self) -> Result<Diagnosis, Error<SPI::Error>> {
        self.register(DIAG_STAT).await.map(Diagnosis)
    }

    /// Reads the supply voltage [counts, [`VOLT_PER_COUNT`] each]: 12 bits, unsigned.
    pub async fn supply_counts(&mut self) -> Result<u16, Error<SPI::Error>> {
        self.register(SUPPLY_OUT).await.map(|word| word & 0x0FFF)
    }

    /// Starts the part's own test, in which it must be still; it takes at most 0.25 s.
    pub async fn start_self_test(&mut self) -> Result<(), Error<SPI::Error>> {
        self.write(MSC_CTRL, 1, INTERNAL_SELF_TEST).await
    }

    /// The result of a started self-test, in [`Flag::SelfTest`]; `None` while it runs.
    pub async fn self_test_result(&mut self) -> Result<Option<Diagnosis>, Error<SPI::Error>> {
        let runs = self.register(MSC_CTRL).await? & SELF_TEST_RUNS != 0;
        if runs {
            Ok(None)
        } else {
            self.diagnose().await.map(Some)
        }
    }

    /// Restarts the part and waits until it answers; it has its stored settings then.
    pub async fn restart(&mut self) -> Result<(), Error<SPI::Error>> {
        self.write(GLOB_CMD, 0, SOFTWARE_RESET).await?;
        self.stall.delay_ms(START_UP_MS).await;
        self.probe().await
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use std::string::ToString;

    use super::super::tests::{ID, with};
    use super::*;

    #[test]
    fn each_flag_has_its_own_bit_and_name() {
        assert_eq!(Diagnosis(0).to_string(), "no fault");
        assert_eq!(
            Diagnosis(0x11).to_string(),
            "supply below 4.75 V, rate beyond its range"
        );
        let check = |word, flag| {
            assert!(Diagnosis(word).contains(flag));
            assert!(!Diagnosis(!word).contains(flag));
            let name = Diagnosis(word).to_string();
            assert!(!name.contains(',') && name != "no fault", "{name}");
        };
        check(0x001, Flag::SupplyLow);
        check(0x002, Flag::SupplyHigh);
        check(0x004, Flag::FlashUpdate);
        check(0x008, Flag::Spi);
        check(0x010, Flag::OverRange);
        check(0x020, Flag::SelfTest);
        check(0x040, Flag::FlashChecksum);
        check(0x100, Flag::Alarm1);
        check(0x200, Flag::Alarm2);
    }

    #[test]
    fn the_supply_is_twelve_bits_without_sign() {
        // 5 V / 1.8315 mV = 2730 counts, as a new word with bits 13 and 12 undefined.
        let counts = with(&[(0x0200, 0), (0x5600, 0xBAAA)], async |gyro| {
            gyro.supply_counts().await
        });
        assert_eq!(counts, Ok(2730));
    }

    #[test]
    fn a_self_test_has_no_result_while_it_runs_and_then_the_verdict() {
        let frames = [
            (0xB504, 0),
            (0x3400, 0),
            (0x5600, 0x0400),
            (0x3400, ID),
            (0x5600, 0x0000),
            (0x3C00, ID),
            (0x5600, 0x0020),
        ];
        let (running, verdict) = with(&frames, async |gyro| {
            gyro.start_self_test().await.unwrap();
            (
                gyro.self_test_result().await.unwrap(),
                gyro.self_test_result().await.unwrap(),
            )
        });
        assert_eq!(running, None);
        assert!(verdict.unwrap().contains(Flag::SelfTest));
    }

    #[test]
    fn a_restart_ends_with_the_identity() {
        let frames = [(0xBE80, 0), (0x5600, 0), (0x5600, ID)];
        assert_eq!(with(&frames, async |gyro| gyro.restart().await), Ok(()));
    }
}
