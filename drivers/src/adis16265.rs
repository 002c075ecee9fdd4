//! ADIS16265: one-axis gyro, +-80, 160 or 320 deg/s, 14 bits, with its own thermometer.
//!
//! In: an SPI device of 16-bit words, mode 3, at most 2.5 MHz. Out: rate and temperature in counts, each with the part's
//! new-data and alarm bits. Source: Analog Devices ADIS16260/ADIS16265 data sheet (SPI, register memory map); addresses
//! and bits checked against Linux drivers/iio/gyro/adis16260.c.
//!
//! A frame carries a request and, at the same time, the answer to the request before it. So a reading ends with a request
//! for the identity, PROD_ID, and the first frame of the next reading checks it: each reading proves at no cost that a
//! gyro, and not a floating or held line, answers. The rate is sampled at its request, not at its answer.
//!
//! [`Adis16265::exchange`] is a single frame, for gyros on one bus read interleaved; the caller
//! leaves [`STALL_US`] between frames to the same part. Everything else leaves that time itself.
//!
//! ```
//! use embedded_hal_mock::eh1::{delay::NoopDelay, spi::{Mock, Transaction}};
//! use emems_drivers::adis16265::{Adis16265, Range};
//!
//! # embassy_futures::block_on(async {
//! let frame = |sent, answered| {
//!     [
//!         Transaction::transaction_start(),
//!         Transaction::transfer_in_place(vec![sent], vec![answered]),
//!         Transaction::transaction_end(),
//!     ]
//! };
//! // On a board this is an SPI device of its HAL, with 16-bit words. The answer comes one frame after its request.
//! let mut spi = Mock::new(&[frame(0x0400, 0), frame(0x5600, 0x889B), frame(0x5600, 16_265)].concat());
//! let rate = Adis16265::new(spi.clone(), NoopDelay::new()).read_rate().await?;
//! assert_eq!((rate.counts, rate.fresh), (2203, true));
//! assert!((f32::from(rate.counts) * Range::default().deg_s_per_count() - 161.39).abs() < 0.01);
//! # spi.done();
//! # Ok::<(), emems_drivers::Error<_>>(())
//! # })
//! # .unwrap();
//! ```

use embedded_hal_async::{delay::DelayNs, spi::SpiDevice};

use super::{Error, Register};

pub mod diagnosis;

/// \[us\] least time between two frames to one part. The data sheet asks for less; this is what Linux leaves
/// (`read_delay`, `write_delay`), known to work at every sample rate.
pub const STALL_US: u32 = 30;

/// \[ms\] from power-on or reset until the part answers (data sheet, specifications, start-up time).
pub const START_UP_MS: u32 = 220;

/// [degC/count] with all its digits, for whoever computes in `f64` (data sheet, TEMP_OUT).
pub const CELSIUS_PER_COUNT_F64: f64 = 0.1453;

/// [degC/count]; 0 counts is [`ZERO_C`].
pub const CELSIUS_PER_COUNT: f32 = CELSIUS_PER_COUNT_F64 as f32;

/// \[degC\] at 0 counts (data sheet, TEMP_OUT).
pub const ZERO_C: f32 = 25.0;

/// \[counts\] at the end of each range: 320 deg/s of 0.07326 (data sheet, specifications). The part gives a little more.
pub const RANGE_COUNTS: i16 = 4368;

/// [deg/s/count] of the ranges, smallest first (data sheet, specifications, sensitivity).
const DEG_S_PER_COUNT: [f64; 3] = [0.018_315, 0.036_63, 0.073_26];

/// Power supply.
pub const SUPPLY_OUT: Register = register("SUPPLY_OUT", 0x02);
/// Rate.
pub const GYRO_OUT: Register = register("GYRO_OUT", 0x04);
/// Temperature.
pub const TEMP_OUT: Register = register("TEMP_OUT", 0x0C);
/// Product identifier: 16265 in decimal.
pub const PROD_ID: Register = register("PROD_ID", 0x56);
const SMPL_PRD: Register = register("SMPL_PRD", 0x36);
const SENS_AVG: Register = register("SENS_AVG", 0x38);

const IDENTITY: u16 = 16_265;
const NEW_DATA: u16 = 1 << 15;
const ERROR_ALARM: u16 = 1 << 14;
const WRITE: u16 = 1 << 15;

const fn register(name: &'static str, address: u8) -> Register {
    let part = "ADIS16265";
    Register { part, name, address }
}

/// Dynamic range (data sheet, SENS_AVG bits 10 to 8).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum Range {
    DegPerS80 = 0b001,
    DegPerS160 = 0b010,
    #[default]
    DegPerS320 = 0b100,
}

impl Range {
    /// [deg/s/count] sensitivity.
    pub const fn deg_s_per_count(self) -> f32 {
        match self {
            Range::DegPerS80 => const { DEG_S_PER_COUNT[0] as f32 },
            Range::DegPerS160 => const { DEG_S_PER_COUNT[1] as f32 },
            Range::DegPerS320 => const { DEG_S_PER_COUNT[2] as f32 },
        }
    }

    /// [deg/s/count] with all its digits, for whoever computes in `f64`.
    pub const fn deg_s_per_count_f64(self) -> f64 {
        match self {
            Range::DegPerS80 => DEG_S_PER_COUNT[0],
            Range::DegPerS160 => DEG_S_PER_COUNT[1],
            Range::DegPerS320 => DEG_S_PER_COUNT[2],
        }
    }
}

/// Internal sample rate: 2048 / (SMPL_PRD + 1) a second (as Linux drivers/iio/gyro/adis16260.c computes it).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum SampleRate {
    Hz2048 = 0x00,
    #[default]
    Hz256 = 0x07,
}

impl SampleRate {
    /// \[Hz\]
    pub const fn hz(self) -> u16 {
        2048 / (self as u16 + 1)
    }
}

/// Settings.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Config {
    /// Dynamic range.
    pub range: Range,
    /// Sample rate.
    pub sample_rate: SampleRate,
    /// Analog bandwidth of 50 Hz instead of 330 Hz (SENS_AVG bit 7).
    pub narrow: bool,
    /// Each of the two stages of the Bartlett filter averages 2 to this power samples; 0 to 7, higher ones wrap
    /// (SENS_AVG bits 2 to 0).
    pub taps_log2: u8,
}

impl Config {
    const fn sens_avg(self) -> u16 {
        (self.range as u16) << 8 | (self.narrow as u16) << 7 | (self.taps_log2 & 7) as u16
    }
}

/// One output register, taken apart (data sheet, output data registers).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Output {
    /// \[counts\] of the register read: [`Range::deg_s_per_count`], or [`CELSIUS_PER_COUNT`] above 25 degC.
    pub counts: i16,
    /// The register had not been read since it was written (ND).
    pub fresh: bool,
    /// Some bit of DIAG_STAT is set (EA).
    pub alarm: bool,
}

impl Output {
    /// Takes a word of GYRO_OUT apart: 14 bits, two's complement.
    pub const fn rate(word: u16) -> Self {
        Output::signed(word, 14)
    }

    /// Takes a word of TEMP_OUT apart: 12 bits, two's complement.
    pub const fn temperature(word: u16) -> Self {
        Output::signed(word, 12)
    }

    const fn signed(word: u16, bits: u32) -> Self {
        Output {
            counts: (word << (16 - bits)).cast_signed() >> (16 - bits),
            fresh: word & NEW_DATA != 0,
            alarm: word & ERROR_ALARM != 0,
        }
    }
}

/// A gyro on its bus.
pub struct Adis16265<SPI, D> {
    spi: SPI,
    stall: D,
    /// What the next frame answers; `None` when unknown.
    requested: Option<Register>,
}

impl<SPI: SpiDevice<u16>, D: DelayNs> Adis16265<SPI, D> {
    /// Nothing is sent. `stall` waits between frames.
    pub fn new(spi: SPI, stall: D) -> Self {
        let requested = None;
        Adis16265 { spi, stall, requested }
    }

    /// Takes the answer to the last request and asks for `next`, one frame.
    ///
    /// An answer to PROD_ID that is not this part's is an error; `next` has been asked for all the same.
    pub async fn exchange(&mut self, next: Register) -> Result<u16, Error<SPI::Error>> {
        let answers = self.requested;
        let word = self.frame(next, u16::from(next.address) << 8).await?;
        self.requested = Some(next);
        if answers == Some(PROD_ID) {
            Error::unless_identity(PROD_ID, IDENTITY, word)?;
        }
        Ok(word)
    }

    /// Asks for the identity.
    pub async fn probe(&mut self) -> Result<(), Error<SPI::Error>> {
        // Whatever was asked for before is of no interest, not even the identity: the part may have been away.
        self.requested = None;
        self.register(PROD_ID).await.map(|_| ())
    }

    /// Writes the settings and reads them back. They last until the part restarts.
    pub async fn configure(&mut self, config: Config) -> Result<(), Error<SPI::Error>> {
        self.probe().await?;
        let [range, filter] = config.sens_avg().to_be_bytes();
        self.write(SMPL_PRD, 0, config.sample_rate as u8).await?;
        // The range before the filter, which depends on it (data sheet, SENS_AVG).
        self.write(SENS_AVG, 1, range).await?;
        self.write(SENS_AVG, 0, filter).await?;
        self.verify(config).await
    }

    /// Reads the settings back: finds a part that has restarted by itself.
    pub async fn verify(&mut self, config: Config) -> Result<(), Error<SPI::Error>> {
        for (register, wrote) in [(SMPL_PRD, config.sample_rate as u16), (SENS_AVG, config.sens_avg())] {
            let read = self.register(register).await?;
            Error::unless_kept(register, wrote, read)?;
        }
        Ok(())
    }

    /// Takes the newest rate: two frames, a third when nothing else proves that a gyro answers ([`Self::confirm`]).
    pub async fn read_rate(&mut self) -> Result<Output, Error<SPI::Error>> {
        let is_checked = self.checks_identity();
        let word = self.register(GYRO_OUT).await?;
        self.confirm(is_checked, word).await?;
        Ok(Output::rate(word))
    }

    /// Takes the newest rate and temperature: three frames, a fourth when nothing else proves that a gyro answers.
    pub async fn read_rate_and_temperature(&mut self) -> Result<(Output, Output), Error<SPI::Error>> {
        let is_checked = self.checks_identity();
        self.stalled(GYRO_OUT).await?;
        let rate = self.stalled(TEMP_OUT).await?;
        let temperature = self.stalled(PROD_ID).await?;
        self.confirm(is_checked, rate).await?;
        Ok((Output::rate(rate), Output::temperature(temperature)))
    }

    /// Whether the next frame checks the identity.
    fn checks_identity(&self) -> bool {
        self.requested == Some(PROD_ID)
    }

    /// A line held low or high answers all zeros or ones. So does a gyro: 0 counts read twice, or -1 with an alarm. Its
    /// identity, already asked for, tells them apart. So it does where the reading did not begin with it (`is_checked`), as
    /// after a wrong one: a line that answers at random is right twice in 2^32 readings.
    async fn confirm(&mut self, is_checked: bool, word: u16) -> Result<(), Error<SPI::Error>> {
        if !is_checked || matches!(word, 0 | u16::MAX) {
            self.stalled(PROD_ID).await?;
        }
        Ok(())
    }

    /// Reads a register; leaves a request for the identity behind.
    async fn register(&mut self, register: Register) -> Result<u16, Error<SPI::Error>> {
        self.stalled(register).await?;
        self.stalled(PROD_ID).await
    }

    async fn stalled(&mut self, next: Register) -> Result<u16, Error<SPI::Error>> {
        self.stall.delay_us(STALL_US).await;
        self.exchange(next).await
    }

    /// Writes the low (0) or high (1) byte of a register. What the next frame answers is not defined.
    async fn write(&mut self, register: Register, byte: u16, value: u8) -> Result<(), Error<SPI::Error>> {
        self.stall.delay_us(STALL_US).await;
        let address = u16::from(register.address).wrapping_add(byte) << 8;
        self.frame(register, WRITE | address | u16::from(value))
            .await
            .map(|_| ())
    }

    async fn frame(&mut self, register: Register, word: u16) -> Result<u16, Error<SPI::Error>> {
        // Forgotten until the frame is complete: this future may be dropped in it.
        self.requested = None;
        let mut words = [word];
        self.spi
            .transfer_in_place(&mut words)
            .await
            .map_err(|e| Error::Bus(register, e))?;
        let [word] = words;
        Ok(word)
    }
}

#[cfg(test)]
mod tests;
