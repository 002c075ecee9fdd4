//! LIS331HH: three-axis accelerometer, +-6, 12 or 24 g, 12 bits.
//!
//! In: an I2C bus. Out: x, y, z in right-justified counts (-2048 to 2047; the registers are left-justified), with the
//! part's own data-ready and overrun flags. Source: STMicroelectronics LIS331HH datasheet, section 7 (registers), section
//! 5.1.1 (bit 7 of the sub-address steps it on). Refuses another part, settings that were not kept, a high-pass filter
//! left on (gravity would disappear), and words the part cannot produce.
//!
//! ```
//! use embedded_hal_mock::eh1::i2c::{Mock, Transaction};
//! use emems_drivers::lis331hh::{ADDRESS, Config, Lis331hh};
//!
//! # embassy_futures::block_on(async {
//! // On a board this is the I2C of its HAL.
//! let mut bus = Mock::new(&[
//!     Transaction::write_read(ADDRESS, vec![0x8F], vec![0x32]), // WHO_AM_I
//!     Transaction::write(ADDRESS, vec![0xA0, 0x27, 0, 0, 0x80, 0]), // CTRL_REG1 to CTRL_REG5
//!     Transaction::write_read(ADDRESS, vec![0xA0], vec![0x27, 0, 0, 0x80, 0]),
//!     Transaction::write_read(ADDRESS, vec![0xA7], vec![0x0F, 0x50, 0xEC, 0x20, 0x00, 0xE0, 0xF9]),
//! ]);
//! let config = Config::default();
//! let mut accelerometer = Lis331hh::new(bus.clone());
//! accelerometer.configure(config).await?;
//! let sample = accelerometer.read().await?;
//! let force_mg = sample.counts.map(|counts| f32::from(counts) * config.full_scale.mg_per_count());
//! assert_eq!(force_mg, [-945.0, 6.0, -294.0]);
//! # bus.done();
//! # Ok::<(), emems_drivers::Error<_>>(())
//! # })
//! # .unwrap();
//! ```

use embedded_hal_async::{delay::DelayNs, i2c::I2c};

use super::{Error, Register};

/// Bus address with SA0 low (datasheet section 5.1.1).
pub const ADDRESS: u8 = 0x18;

/// Content of WHO_AM_I (datasheet section 7.1).
const IDENTITY: u8 = 0x32;
/// Bit 7 of the sub-address: step on after each byte.
const STEP: u8 = 0x80;
/// CTRL_REG4: output registers change only as a whole between readings.
const BDU: u8 = 0x80;
/// CTRL_REG4: self-test, positive sign.
const ST: u8 = 0x02;
/// STATUS_REG: all axes were overwritten before they were read.
const ZYXOR: u8 = 0x80;
/// STATUS_REG: all axes are new.
const ZYXDA: u8 = 0x08;

/// [counts at 6 g] by how much self-test may move x, y, z (datasheet, mechanical characteristics, Vst at 6 g). Upper limits and
/// all of z are the datasheet's; its lower limit of x and y is taken from the sister part LIS331DLH (120 of at most 550 mg), whose
/// upper limit is this one's too.
const SELF_TEST_COUNTS: [(i16, i16); 3] = [(40, 180), (40, 180), (220, 370)];
/// \[ms\] five samples at the slowest rate: the new state has passed the filter (datasheet, turn-on time: 1/ODR + 1 ms).
const SETTLING_MS: u32 = 100;

const fn register(name: &'static str, address: u8) -> Register {
    let part = "LIS331HH";
    Register { part, name, address }
}

/// Registers (datasheet section 6). The five settings and the seven bytes from STATUS_REG on are each read in one go.
const WHO_AM_I: Register = register("WHO_AM_I", 0x0F);
const CTRL_REG1: Register = register("CTRL_REG1", 0x20);
const CTRL_REG2: Register = register("CTRL_REG2", 0x21);
const CTRL_REG3: Register = register("CTRL_REG3", 0x22);
const CTRL_REG4: Register = register("CTRL_REG4", 0x23);
const CTRL_REG5: Register = register("CTRL_REG5", 0x24);
const STATUS_REG: Register = register("STATUS_REG", 0x27);
const OUT_X: Register = register("OUT_X", 0x28);
const OUT_Y: Register = register("OUT_Y", 0x2A);
const OUT_Z: Register = register("OUT_Z", 0x2C);

/// \[counts\] what its 12 bits hold: the ends say that it was that much or more.
pub const CODES: core::ops::RangeInclusive<i16> = -2048..=2047;

/// [m/s2] of the data sheet's g, with all its digits, for whoever computes in `f64`.
pub const STANDARD_GRAVITY_F64: f64 = 9.80665;

/// [m/s2] of the data sheet's g.
pub const STANDARD_GRAVITY: f32 = STANDARD_GRAVITY_F64 as f32;

/// Full scale (datasheet, CTRL_REG4 description, FS1 FS0).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum FullScale {
    #[default]
    G6 = 0b00,
    G12 = 0b01,
    G24 = 0b11,
}

impl FullScale {
    /// [mg/count] sensitivity (datasheet, mechanical characteristics, So).
    pub const fn mg_per_count(self) -> f32 {
        match self {
            FullScale::G6 => 3.0,
            FullScale::G12 => 6.0,
            FullScale::G24 => 12.0,
        }
    }
}

/// Output data rate (datasheet, CTRL_REG1 description, DR1 DR0). The low-pass filter follows it: 37, 74, 292, 780 Hz.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum Rate {
    #[default]
    Hz50 = 0b00,
    Hz100 = 0b01,
    Hz400 = 0b10,
    Hz1000 = 0b11,
}

impl Rate {
    /// \[Hz\]
    pub const fn hz(self) -> u16 {
        match self {
            Rate::Hz50 => 50,
            Rate::Hz100 => 100,
            Rate::Hz400 => 400,
            Rate::Hz1000 => 1000,
        }
    }
}

/// Settings.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Config {
    /// Full scale.
    pub full_scale: FullScale,
    /// Output data rate.
    pub rate: Rate,
}

impl Config {
    /// CTRL_REG1 to CTRL_REG5: normal power, all axes on; no filter but the low-pass; no interrupts; block data update.
    const fn registers(self) -> [(Register, u8); 5] {
        const NORMAL_POWER_ALL_AXES: u8 = 0b0010_0111;
        [
            (CTRL_REG1, NORMAL_POWER_ALL_AXES | (self.rate as u8) << 3),
            (CTRL_REG2, 0),
            (CTRL_REG3, 0),
            (CTRL_REG4, BDU | (self.full_scale as u8) << 4),
            (CTRL_REG5, 0),
        ]
    }
}

/// One sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sample {
    /// [counts, [`FullScale::mg_per_count`] each] x, y, z in the part's axes; -2048 to 2047.
    pub counts: [i16; 3],
    /// The part had a set that was not read before (ZYXDA).
    pub fresh: bool,
    /// Older sets were overwritten unread (ZYXOR): usual when the part runs faster than it is read.
    pub overrun: bool,
}

/// An accelerometer on its bus.
pub struct Lis331hh<I2C> {
    bus: I2C,
}

impl<I2C: I2c> Lis331hh<I2C> {
    /// Nothing is sent.
    pub fn new(bus: I2C) -> Self {
        Lis331hh { bus }
    }

    /// Asks for the identity.
    pub async fn probe(&mut self) -> Result<(), Error<I2C::Error>> {
        let mut read = [0];
        self.read_from(WHO_AM_I, &mut read).await?;
        Error::unless_identity(WHO_AM_I, IDENTITY.into(), read[0].into())
    }

    /// Writes the settings and reads them back. The part must answer to its identity first.
    pub async fn configure(&mut self, config: Config) -> Result<(), Error<I2C::Error>> {
        self.probe().await?;
        let [r1, r2, r3, r4, r5] = config.registers().map(|(_, value)| value);
        self.write(CTRL_REG1, &[CTRL_REG1.address | STEP, r1, r2, r3, r4, r5])
            .await?;
        self.verify(config).await
    }

    /// Reads the settings back: finds a part that has restarted by itself.
    pub async fn verify(&mut self, config: Config) -> Result<(), Error<I2C::Error>> {
        let mut kept = [0; 5];
        self.read_from(CTRL_REG1, &mut kept).await?;
        for ((register, wrote), read) in config.registers().into_iter().zip(kept) {
            Error::unless_kept(register, wrote.into(), read.into())?;
        }
        Ok(())
    }

    /// Takes the newest sample; status and all axes in one transaction, so they belong together.
    pub async fn read(&mut self) -> Result<Sample, Error<I2C::Error>> {
        let mut bytes = [0; 7];
        self.read_from(STATUS_REG, &mut bytes).await?;
        let [status, xl, xh, yl, yh, zl, zh] = bytes;
        Ok(Sample {
            counts: [
                right_justified(OUT_X, [xl, xh])?,
                right_justified(OUT_Y, [yl, yh])?,
                right_justified(OUT_Z, [zl, zh])?,
            ],
            fresh: status & ZYXDA != 0,
            overrun: status & ZYXOR != 0,
        })
    }

    /// Moves the proof mass by the part's own force and returns the change of x, y, z [counts at 6 g]. Takes 0.2 s, in
    /// which the part must be still; `config` is in force again afterwards, whatever the result.
    pub async fn self_test(&mut self, config: Config, delay: &mut impl DelayNs) -> Result<[i16; 3], Error<I2C::Error>> {
        let moved = self.self_test_change(delay).await;
        self.configure(config).await?;
        let moved = moved?;
        for ((axis, change), limits) in [OUT_X, OUT_Y, OUT_Z].into_iter().zip(moved).zip(SELF_TEST_COUNTS) {
            Error::unless_within(axis, change, limits)?;
        }
        Ok(moved)
    }

    async fn self_test_change(&mut self, delay: &mut impl DelayNs) -> Result<[i16; 3], Error<I2C::Error>> {
        // The limits hold at 6 g only (mechanical characteristics, Vst).
        let mut samples = [[0; 3]; 2];
        for (sample, ctrl_reg4) in samples.iter_mut().zip([BDU, BDU | ST]) {
            self.write(CTRL_REG4, &[CTRL_REG4.address, ctrl_reg4]).await?;
            delay.delay_ms(SETTLING_MS).await;
            *sample = self.read().await?.counts;
        }
        let [[x0, y0, z0], [x, y, z]] = samples;
        // Twelve bits each: no difference overflows.
        Ok([x.wrapping_sub(x0), y.wrapping_sub(y0), z.wrapping_sub(z0)])
    }

    async fn read_from(&mut self, first: Register, bytes: &mut [u8]) -> Result<(), Error<I2C::Error>> {
        self.bus
            .write_read(ADDRESS, &[first.address | STEP], bytes)
            .await
            .map_err(|e| Error::Bus(first, e))
    }

    async fn write(&mut self, first: Register, bytes: &[u8]) -> Result<(), Error<I2C::Error>> {
        self.bus.write(ADDRESS, bytes).await.map_err(|e| Error::Bus(first, e))
    }
}

/// The four bits below a 12-bit code are zero; a floating or held bus, or another part, seldom keeps that.
fn right_justified<E>(register: Register, bytes: [u8; 2]) -> Result<i16, Error<E>> {
    let word = i16::from_le_bytes(bytes);
    if word & 0xF == 0 {
        Ok(word >> 4)
    } else {
        Err(Error::Garbage {
            register,
            read: u16::from_le_bytes(bytes),
        })
    }
}

#[cfg(test)]
mod tests;
