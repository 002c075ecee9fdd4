//! TMP102: thermometer, 0.0625 degC a count.
//!
//! In: an I2C bus. Out: right-justified counts (-2048 to 2047; the register is left-justified). Source: Texas Instruments
//! SBOS397, sections on the temperature register (tables 3 to 6) and the configuration register (table 7). The part has no
//! identity register; the bits of its configuration that cannot be written stand in for one. Refuses extended (13-bit)
//! mode, in which every count would be worth the same but sit one bit lower.
//!
//! ```
//! use embedded_hal_mock::eh1::i2c::{Mock, Transaction};
//! use emems_drivers::tmp102::{ADDRESS, CELSIUS_PER_COUNT, Tmp102};
//!
//! # embassy_futures::block_on(async {
//! // On a board this is the I2C of its HAL.
//! let mut bus = Mock::new(&[Transaction::write_read(ADDRESS, vec![0x00], vec![0x19, 0x00])]);
//! let counts = Tmp102::new(bus.clone()).read().await?;
//! assert_eq!(f32::from(counts) * CELSIUS_PER_COUNT, 25.0);
//! # bus.done();
//! # Ok::<(), emems_drivers::Error<_>>(())
//! # })
//! # .unwrap();
//! ```

use embedded_hal_async::i2c::I2c;

use super::{Error, Register};

/// Bus address with ADD0 at ground (datasheet, serial bus address).
pub const ADDRESS: u8 = 0x48;

/// [degC/count]; 0 counts is 0 degC.
pub const CELSIUS_PER_COUNT: f32 = 0.0625;

const TEMPERATURE: Register = register("temperature", 0x00);
const CONFIGURATION: Register = register("configuration", 0x01);

/// R1, R0 and the four lowest bits cannot be written; they read 11 and 0000.
const FIXED_MASK: u16 = 0x600F;
const FIXED: u16 = 0x6000;
/// OS and AL are outputs of the part.
const OUTPUTS: u16 = 0x8020;
/// Temperature register: extended mode, and three bits that are always zero.
const NOT_12_BIT: u16 = 0x000F;

const fn register(name: &'static str, address: u8) -> Register {
    let part = "TMP102";
    Register { part, name, address }
}

/// Conversions a second (datasheet table 8, CR1 CR0). One takes 26 ms.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum Rate {
    Hz0_25 = 0b00,
    Hz1 = 0b01,
    Hz4 = 0b10,
    /// New in each cycle of the unit's 5 Hz.
    #[default]
    Hz8 = 0b11,
}

impl Rate {
    /// \[Hz\]
    pub const fn hz(self) -> f32 {
        match self {
            Rate::Hz0_25 => 0.25,
            Rate::Hz1 => 1.0,
            Rate::Hz4 => 4.0,
            Rate::Hz8 => 8.0,
        }
    }

    /// Continuous conversion, 12 bits, alert unused.
    const fn configuration(self) -> u16 {
        FIXED | (self as u16) << 6
    }
}

/// A thermometer on its bus.
pub struct Tmp102<I2C> {
    bus: I2C,
}

impl<I2C: I2c> Tmp102<I2C> {
    /// Nothing is sent.
    pub fn new(bus: I2C) -> Self {
        Tmp102 { bus }
    }

    /// Asks for the bits that only this part has set so.
    pub async fn probe(&mut self) -> Result<(), Error<I2C::Error>> {
        self.configuration().await.map(|_| ())
    }

    /// Writes the configuration and reads it back.
    pub async fn configure(&mut self, rate: Rate) -> Result<(), Error<I2C::Error>> {
        self.probe().await?;
        let [high, low] = rate.configuration().to_be_bytes();
        self.bus
            .write(ADDRESS, &[CONFIGURATION.address, high, low])
            .await
            .map_err(|e| Error::Bus(CONFIGURATION, e))?;
        self.verify(rate).await
    }

    /// Reads the configuration back: finds a part that has restarted by itself.
    pub async fn verify(&mut self, rate: Rate) -> Result<(), Error<I2C::Error>> {
        let read = self.configuration().await?;
        Error::unless_kept(CONFIGURATION, rate.configuration(), read & !OUTPUTS)
    }

    /// Takes the newest temperature [counts, [`CELSIUS_PER_COUNT`] each]; 0 until the first conversion is done.
    pub async fn read(&mut self) -> Result<i16, Error<I2C::Error>> {
        let word = self.word(TEMPERATURE).await?;
        if word & NOT_12_BIT == 0 {
            Ok(word.cast_signed() >> 4)
        } else {
            Err(Error::Garbage {
                register: TEMPERATURE,
                read: word,
            })
        }
    }

    async fn configuration(&mut self) -> Result<u16, Error<I2C::Error>> {
        let read = self.word(CONFIGURATION).await?;
        if read & FIXED_MASK == FIXED {
            Ok(read)
        } else {
            Err(Error::WrongIdentity {
                register: CONFIGURATION,
                expected: FIXED,
                read,
            })
        }
    }

    async fn word(&mut self, register: Register) -> Result<u16, Error<I2C::Error>> {
        let mut bytes = [0; 2];
        self.bus
            .write_read(ADDRESS, &[register.address], &mut bytes)
            .await
            .map_err(|e| Error::Bus(register, e))?;
        Ok(u16::from_be_bytes(bytes))
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use std::vec;

    use embassy_futures::block_on;
    use embedded_hal_async::i2c::{ErrorKind, NoAcknowledgeSource};
    use embedded_hal_mock::eh1::i2c::{Mock, Transaction};

    use super::*;

    fn with<T>(expected: &[Transaction], act: impl AsyncFnOnce(&mut Tmp102<Mock>) -> T) -> T {
        let mut mock = Mock::new(expected);
        let result = block_on(act(&mut Tmp102::new(mock.clone())));
        mock.done();
        result
    }

    fn temperature(word: [u8; 2]) -> Transaction {
        Transaction::write_read(0x48, vec![0x00], word.to_vec())
    }

    fn configuration(word: [u8; 2]) -> Transaction {
        Transaction::write_read(0x48, vec![0x01], word.to_vec())
    }

    #[test]
    fn temperatures_follow_the_datasheet_table() {
        let check = |word, counts: i16, celsius: f32| {
            assert_eq!(with(&[temperature(word)], async |part| part.read().await), Ok(counts));
            assert_eq!(f32::from(counts) * CELSIUS_PER_COUNT, celsius);
        };
        // Table 5, shifted left by four as on the bus.
        check([0x7F, 0xF0], 2047, 127.9375);
        check([0x19, 0x00], 0x190, 25.0);
        check([0x00, 0x40], 4, 0.25);
        check([0x00, 0x00], 0, 0.0);
        check([0xFF, 0xC0], -4, -0.25);
        check([0xC9, 0x00], -880, -55.0);
        check([0x80, 0x00], -2048, -128.0);
    }

    #[test]
    fn extended_mode_and_a_held_bus_are_refused() {
        let check = |word, read| {
            let error = with(&[temperature(word)], async |part| part.read().await).unwrap_err();
            let register = TEMPERATURE;
            assert_eq!(error, Error::Garbage { register, read });
        };
        // 25 degC in extended mode, table 6: 0x190 in 13 bits and EM in the lowest bit.
        check([0x0C, 0x81], 0x0C81);
        check([0xFF, 0xFF], 0xFFFF);
    }

    #[test]
    fn the_configuration_is_written_and_read_back_whatever_the_alert_says() {
        let check = |rate, wrote: [u8; 2], kept| {
            let expected = [
                configuration([0x60, 0xA0]),
                Transaction::write(0x48, vec![0x01, wrote[0], wrote[1]]),
                configuration(kept),
            ];
            assert_eq!(with(&expected, async |part| part.configure(rate).await), Ok(()));
        };
        check(Rate::Hz8, [0x60, 0xC0], [0x60, 0xE0]);
        check(Rate::Hz8, [0x60, 0xC0], [0xE0, 0xC0]);
        check(Rate::Hz0_25, [0x60, 0x00], [0x60, 0x20]);
    }

    #[test]
    fn verify_finds_a_part_that_restarted_or_was_extended() {
        let check = |kept, read| {
            let error = with(&[configuration(kept)], async |part| part.verify(Rate::Hz8).await).unwrap_err();
            let (register, wrote) = (CONFIGURATION, 0x60C0);
            assert_eq!(error, Error::NotKept { register, wrote, read });
        };
        check([0x60, 0xA0], 0x6080);
        check([0x60, 0xF0], 0x60D0);
    }

    #[test]
    fn what_lacks_the_fixed_bits_is_another_part() {
        for word in [[0xFF, 0xFF], [0x00, 0x00], [0x40, 0xA0]] {
            let error = with(&[configuration(word)], async |part| part.probe().await).unwrap_err();
            let wrong = Error::WrongIdentity {
                register: CONFIGURATION,
                expected: 0x6000,
                read: u16::from_be_bytes(word),
            };
            assert_eq!(error, wrong);
        }
    }

    #[test]
    fn a_part_that_does_not_acknowledge_is_a_bus_error() {
        let nack = ErrorKind::NoAcknowledge(NoAcknowledgeSource::Address);
        let silent = temperature([0; 2]).with_error(nack);
        let error = with(&[silent], async |part| part.read().await).unwrap_err();
        assert_eq!(error, Error::Bus(TEMPERATURE, nack));
    }
}
