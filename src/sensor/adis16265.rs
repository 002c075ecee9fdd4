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
//! [`Adis16265::request`] and [`Adis16265::exchange`] are single frames, for gyros on one bus read interleaved; the caller
//! leaves [`STALL_US`] between frames to the same part. Everything else leaves that time itself.

use embedded_hal_async::{delay::DelayNs, spi::SpiDevice};

use super::{Error, Register};

pub mod diagnosis;

/// [us] least time between two frames to one part. The data sheet asks for less; this is what Linux leaves
/// (`read_delay`, `write_delay`), known to work at every sample rate.
pub const STALL_US: u32 = 30;

/// [ms] from power-on or reset until the part answers (data sheet, specifications, start-up time).
pub const START_UP_MS: u32 = 220;

/// [degC/count]; 0 counts is 25 degC (data sheet, TEMP_OUT).
pub const CELSIUS_PER_COUNT: f32 = 0.1453;

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
    /// [deg/s/count] sensitivity (data sheet, specifications).
    pub const fn deg_s_per_count(self) -> f32 {
        match self {
            Range::DegPerS80 => 0.018315,
            Range::DegPerS160 => 0.03663,
            Range::DegPerS320 => 0.07326,
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
#[cfg_attr(target_os = "none", derive(defmt::Format))]
pub struct Output {
    /// [counts] of the register read: [`Range::deg_s_per_count`], or [`CELSIUS_PER_COUNT`] above 25 degC.
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

    /// Asks for a register, one frame; the answer to an earlier request is lost, but checked if it was PROD_ID.
    pub async fn request(&mut self, register: Register) -> Result<(), Error<SPI::Error>> {
        self.exchange(register).await.map(|_| ())
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

    /// Takes the newest rate: two frames, three when the word could be that of a held line.
    pub async fn read_rate(&mut self) -> Result<Output, Error<SPI::Error>> {
        let word = self.register(GYRO_OUT).await?;
        self.confirm(word).await?;
        Ok(Output::rate(word))
    }

    /// Takes the newest rate and temperature: three frames, four when the rate could be that of a held line.
    pub async fn read_rate_and_temperature(&mut self) -> Result<(Output, Output), Error<SPI::Error>> {
        self.stalled(GYRO_OUT).await?;
        let rate = self.stalled(TEMP_OUT).await?;
        let temperature = self.stalled(PROD_ID).await?;
        self.confirm(rate).await?;
        Ok((Output::rate(rate), Output::temperature(temperature)))
    }

    /// A line held low or high answers all zeros or ones. So does a gyro: 0 counts read twice, or -1 with an alarm. Its
    /// identity, already asked for, tells them apart.
    async fn confirm(&mut self, word: u16) -> Result<(), Error<SPI::Error>> {
        if matches!(word, 0 | u16::MAX) {
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
        let address = (u16::from(register.address) + byte) << 8;
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
        Ok(words[0])
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use std::{vec, vec::Vec};

    use embassy_futures::block_on;
    use embedded_hal_async::spi::{ErrorKind, ErrorType, Operation};
    use embedded_hal_mock::eh1::delay::{CheckedDelay, NoopDelay, Transaction as Wait};
    use embedded_hal_mock::eh1::spi::{Mock, Transaction as T};

    use super::*;

    /// Frames as (sent, answered). Runs `act` on a part of which nothing is known.
    pub(super) fn with<R>(
        frames: &[(u16, u16)],
        act: impl AsyncFnOnce(&mut Adis16265<Mock<u16>, NoopDelay>) -> R,
    ) -> R {
        let frame = |&(sent, answered)| {
            let transfer = T::transfer_in_place(vec![sent], vec![answered]);
            [T::transaction_start(), transfer, T::transaction_end()]
        };
        let mut mock = Mock::new(&frames.iter().flat_map(frame).collect::<Vec<_>>());
        let result = block_on(act(&mut Adis16265::new(mock.clone(), NoopDelay::new())));
        mock.done();
        result
    }

    pub(super) const ID: u16 = 0x3F89;

    fn not_a_gyro<T>(read: u16) -> Result<T, Error<ErrorKind>> {
        Err(Error::WrongIdentity {
            register: PROD_ID,
            expected: ID,
            read,
        })
    }

    #[test]
    fn outputs_are_sign_extended_and_their_flags_told() {
        let check = |output: Output, counts, fresh, alarm| {
            assert_eq!(output, Output { counts, fresh, alarm });
        };
        check(Output::rate(0x9FFF), 8191, true, false);
        check(Output::rate(0xA000), -8192, true, false);
        check(Output::rate(0x7FFF), -1, false, true);
        check(Output::rate(0x889B), 2203, true, false);
        check(Output::temperature(0x87FF), 2047, true, false);
        // Bits 13 and 12 of a 12-bit output are not defined.
        check(Output::temperature(0x3800), -2048, false, false);
        check(Output::temperature(0xCFFC), -4, true, true);
    }

    #[test]
    fn the_answer_comes_one_frame_after_its_request() {
        let frames = [(0x0400, 0x1234), (0x0C00, 0x889B), (0x5600, 0x800C)];
        let read = with(&frames, async |gyro| gyro.read_rate_and_temperature().await);
        assert_eq!(read, Ok((Output::rate(0x889B), Output::temperature(0x800C))));
    }

    #[test]
    fn a_reading_checks_the_identity_that_the_one_before_asked_for() {
        let frames = [
            (0x0400, 0),
            (0x5600, 0x8001),
            (0x0400, ID),
            (0x5600, 0x8002),
            (0x0400, 0x5555),
        ];
        with(&frames, async |gyro| {
            assert_eq!(gyro.read_rate().await.map(|r| r.counts), Ok(1));
            assert_eq!(gyro.read_rate().await.map(|r| r.counts), Ok(2));
            assert_eq!(gyro.read_rate().await, not_a_gyro(0x5555));
        });
    }

    #[test]
    fn a_held_line_is_not_a_gyro_but_a_still_one_is() {
        let read_rate = |word, identity| {
            let frames = [(0x0400, word), (0x5600, word), (0x5600, identity)];
            with(&frames, async |gyro| gyro.read_rate().await)
        };
        assert_eq!(read_rate(0x0000, 0x0000), not_a_gyro(0x0000));
        assert_eq!(read_rate(0xFFFF, 0xFFFF), not_a_gyro(0xFFFF));
        assert_eq!(read_rate(0x0000, ID), Ok(Output::rate(0)));
        assert_eq!(read_rate(0xFFFF, ID), Ok(Output::rate(0xFFFF)));
    }

    #[test]
    fn frames_can_be_pipelined_by_the_caller() {
        with(
            &[(0x0400, 0), (0x0400, 0x8001), (0x5600, 0x8002), (0x0400, ID)],
            async |gyro| {
                gyro.request(GYRO_OUT).await.unwrap();
                assert_eq!(gyro.exchange(GYRO_OUT).await, Ok(0x8001));
                assert_eq!(gyro.exchange(PROD_ID).await, Ok(0x8002));
                gyro.request(GYRO_OUT).await.unwrap();
            },
        );
    }

    #[test]
    fn settings_are_written_bytewise_and_read_back() {
        let config = Config {
            range: Range::DegPerS160,
            sample_rate: SampleRate::Hz2048,
            narrow: true,
            taps_log2: 3,
        };
        let configure = |sens_avg| {
            let probe = [(0x5600, 0), (0x5600, ID)];
            let writes = [(0xB600, ID), (0xB902, 0), (0xB883, 0)];
            let reads = [(0x3600, 0), (0x5600, 0x0000), (0x3800, ID), (0x5600, sens_avg)];
            let frames = [&probe[..], &writes, &reads].concat();
            with(&frames, async |gyro| gyro.configure(config).await)
        };
        assert_eq!(configure(0x0283), Ok(()));
        let (register, wrote, read) = (SENS_AVG, 0x0283, 0x0402);
        assert_eq!(configure(0x0402), Err(Error::NotKept { register, wrote, read }));
        assert_eq!(Config::default().sens_avg(), 0x0400);
    }

    #[test]
    fn a_probe_does_not_hold_an_older_answer_against_the_part() {
        let frames = [(0x5600, 0), (0x5600, ID), (0x5600, 0), (0x5600, ID)];
        with(&frames, async |gyro| {
            assert_eq!(gyro.probe().await, Ok(()));
            assert_eq!(gyro.probe().await, Ok(()));
        });
    }

    struct Dead;

    impl ErrorType for Dead {
        type Error = ErrorKind;
    }

    impl SpiDevice<u16> for Dead {
        async fn transaction(&mut self, _: &mut [Operation<'_, u16>]) -> Result<(), ErrorKind> {
            Err(ErrorKind::Other)
        }
    }

    #[test]
    fn the_stall_time_precedes_every_frame_and_a_bus_error_names_the_register() {
        let mut stall = CheckedDelay::new(&[Wait::async_delay_us(STALL_US)]);
        let read = block_on(Adis16265::new(Dead, stall.clone()).read_rate());
        assert_eq!(read, Err(Error::Bus(GYRO_OUT, ErrorKind::Other)));
        stall.done();
    }
}
