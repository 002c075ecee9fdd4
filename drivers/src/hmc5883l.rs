//! HMC5883L: three-axis magnetometer, 12 bits, gain selectable.
//!
//! In: an I2C bus. Out: x, y, z in counts (-2048 to 2047), each with its overflow mark. Source: Honeywell HMC5883L
//! datasheet (form 900405), register tables 2 to 20. The output registers come in the order X, Z, Y, and are locked from
//! the first byte read until all six are: every path here ends with all six read. Refuses another part, settings that
//! were not kept, codes the part cannot produce, and a lock that does not open; the first set after a change of settings
//! was measured with the old gain and is withheld.
//!
//! A part measures by its own clock, and a set is up to a period old when it is read; or once, when it is asked
//! ([`Mode::Asked`], [`Hmc5883l::measure`]): who asks knows when.
//!
//! ```
//! use embedded_hal_mock::eh1::i2c::{Mock, Transaction};
//! use emems_drivers::hmc5883l::{ADDRESS, Config, Hmc5883l};
//!
//! # embassy_futures::block_on(async {
//! let reads = |first, bytes: &[u8], data: [u8; 6]| {
//!     vec![
//!         Transaction::transaction_start(ADDRESS),
//!         Transaction::write(ADDRESS, vec![first]),
//!         Transaction::read(ADDRESS, bytes.to_vec()),
//!         Transaction::write(ADDRESS, vec![0x03]),
//!         Transaction::read(ADDRESS, data.to_vec()),
//!         Transaction::transaction_end(ADDRESS),
//!     ]
//! };
//! // On a board this is the I2C of its HAL; here it answers to the identity, and then with two sets.
//! let identity = Transaction::write_read(ADDRESS, vec![0x0A], b"H43".to_vec());
//! let set = [0x00, 0x78, 0xFF, 0x2E, 0xFF, 0xDD];
//! let mut bus = Mock::new(&[vec![identity], reads(0x09, &[1], set), reads(0x09, &[1], set)].concat());
//! let mut magnetometer = Hmc5883l::new(bus.clone());
//! magnetometer.probe().await?;
//! // The first set may be of settings before.
//! assert_eq!(magnetometer.read().await?, None);
//! let sample = magnetometer.read().await?.unwrap();
//! let field_ut = sample.counts.map(|counts| 100.0 * f32::from(counts) / f32::from(Config::default().gain.counts_per_gauss()));
//! assert!((field_ut[0] - 11.01).abs() < 0.01);
//! # bus.done();
//! # Ok::<(), emems_drivers::Error<_>>(())
//! # })
//! # .unwrap();
//! ```

use embedded_hal_async::i2c::{I2c, Operation};

use super::{Error, Register};

pub mod self_test;

/// Bus address (datasheet, I2C communication protocol).
pub const ADDRESS: u8 = 0x1E;

/// Code of an axis that overflowed (datasheet, data output registers).
pub const OVERFLOW: i16 = -4096;

const CONFIGURATION_A: Register = register("Configuration A", 0x00);
const CONFIGURATION_B: Register = register("Configuration B", 0x01);
const MODE: Register = register("Mode", 0x02);
const DATA_X: Register = register("Data Output X", 0x03);
const DATA_Z: Register = register("Data Output Z", 0x05);
const DATA_Y: Register = register("Data Output Y", 0x07);
const STATUS: Register = register("Status", 0x09);
const IDENTIFICATION_A: Register = register("Identification A", 0x0A);
const IDENTIFICATION_B: Register = register("Identification B", 0x0B);
const IDENTIFICATION_C: Register = register("Identification C", 0x0C);

/// Status: a set is in the output registers.
const RDY: u8 = 0x01;
/// Status: the output registers were read in part, or the mode register was read, and are locked (table 17).
const LOCK: u8 = 0x02;

/// Mode (table 12): by the part's clock; once, and then idle, which reads as one of two codes.
const CONTINUOUS: u8 = 0;
const SINGLE: u8 = 1;
const IDLE: core::ops::RangeInclusive<u8> = 2..=3;

const fn register(name: &'static str, address: u8) -> Register {
    let part = "HMC5883L";
    Register { part, name, address }
}

/// \[uT\] of one gauss.
pub const GAUSS_UT: f32 = 100.0;

/// Gain, by its counts a gauss (datasheet table 9, GN2 to GN0). The field that fits is the inverse: 0.88 to 8.1 gauss.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum Gain {
    PerGauss1370 = 0,
    #[default]
    PerGauss1090 = 1,
    PerGauss820 = 2,
    PerGauss660 = 3,
    PerGauss440 = 4,
    PerGauss390 = 5,
    PerGauss330 = 6,
    PerGauss230 = 7,
}

impl Gain {
    /// Every setting, in the order of its bits.
    pub const ALL: [Gain; 8] = [
        Gain::PerGauss1370,
        Gain::PerGauss1090,
        Gain::PerGauss820,
        Gain::PerGauss660,
        Gain::PerGauss440,
        Gain::PerGauss390,
        Gain::PerGauss330,
        Gain::PerGauss230,
    ];

    /// [counts/gauss]; one gauss is [`GAUSS_UT`].
    pub const fn counts_per_gauss(self) -> u16 {
        [1370, 1090, 820, 660, 440, 390, 330, 230][self as usize]
    }
}

/// Measurements a second in continuous mode (datasheet table 5, DO2 to DO0).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum Rate {
    Hz0_75 = 0,
    Hz1_5 = 1,
    Hz3 = 2,
    Hz7_5 = 3,
    Hz15 = 4,
    Hz30 = 5,
    #[default]
    Hz75 = 6,
}

impl Rate {
    /// \[Hz\]
    pub const fn hz(self) -> f32 {
        [0.75, 1.5, 3.0, 7.5, 15.0, 30.0, 75.0][self as usize]
    }
}

/// Measurements averaged into one set (datasheet table 4, MA1 MA0).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum Average {
    #[default]
    Of1 = 0,
    Of2 = 1,
    Of4 = 2,
    Of8 = 3,
}

/// When it measures (datasheet table 12).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Mode {
    /// By its own clock, at the output rate.
    #[default]
    Continuous,
    /// Once when it is configured, and whenever it is asked.
    Asked,
}

/// Settings.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Config {
    /// Gain of all axes.
    pub gain: Gain,
    /// Output rate.
    pub rate: Rate,
    /// Averaging.
    pub average: Average,
    /// When it measures.
    pub mode: Mode,
}

impl Config {
    /// Configuration A, Configuration B, Mode.
    const fn registers(self) -> [u8; 3] {
        let a = (self.average as u8) << 5 | (self.rate as u8) << 2;
        let mode = match self.mode {
            Mode::Continuous => CONTINUOUS,
            Mode::Asked => SINGLE,
        };
        [a, (self.gain as u8) << 5, mode]
    }
}

/// One set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sample {
    /// [counts, 1 / [`Gain::counts_per_gauss`] each] x, y, z in the part's axes; [`OVERFLOW`] where it overflowed.
    pub counts: [i16; 3],
    /// Which of x, y, z overflowed.
    pub overflow: [bool; 3],
    /// The part had finished writing the set (RDY), and one that measures when it is asked had been since the set before.
    pub ready: bool,
}

/// A magnetometer on its bus.
pub struct Hmc5883l<I2C> {
    bus: I2C,
    /// The next set was measured with earlier settings.
    withhold: bool,
    /// Of one that measures when it is asked, whether it was since it was read.
    asked: Option<bool>,
}

impl<I2C: I2c> Hmc5883l<I2C> {
    /// Nothing is sent.
    pub fn new(bus: I2C) -> Self {
        Hmc5883l {
            bus,
            withhold: true,
            asked: None,
        }
    }

    /// Asks for the identity, "H43".
    pub async fn probe(&mut self) -> Result<(), Error<I2C::Error>> {
        let mut read = [0; 3];
        self.bus
            .write_read(ADDRESS, &[IDENTIFICATION_A.address], &mut read)
            .await
            .map_err(|e| Error::Bus(IDENTIFICATION_A, e))?;
        let identity = [
            (IDENTIFICATION_A, b'H'),
            (IDENTIFICATION_B, b'4'),
            (IDENTIFICATION_C, b'3'),
        ];
        for ((register, expected), read) in identity.into_iter().zip(read) {
            Error::unless_identity(register, expected.into(), read.into())?;
        }
        Ok(())
    }

    /// Writes the settings and reads them back; the next set read is withheld.
    pub async fn configure(&mut self, config: Config) -> Result<(), Error<I2C::Error>> {
        self.probe().await?;
        self.write(config.registers()).await?;
        self.verify(config).await
    }

    /// Reads the settings back: finds a part that has restarted by itself.
    pub async fn verify(&mut self, config: Config) -> Result<(), Error<I2C::Error>> {
        let (mut kept, mut data) = ([0; 3], [0; 6]);
        // Reading the mode register locks the outputs (table 17); reading all of them opens the lock.
        self.two_reads((CONFIGURATION_A, &mut kept), &mut data).await?;
        let [.., mode] = &mut kept;
        // It is idle after its measurement.
        if config.mode == Mode::Asked && IDLE.contains(mode) {
            *mode = SINGLE;
        }
        let registers = [CONFIGURATION_A, CONFIGURATION_B, MODE];
        for ((register, wrote), read) in registers.into_iter().zip(config.registers()).zip(kept) {
            Error::unless_kept(register, wrote.into(), read.into())?;
        }
        Ok(())
    }

    /// Asks for one measurement, which is there 6 ms later (datasheet, operating modes): of a part that is configured so. What it made
    /// of the settings before, if it has, is not withheld from the set after it.
    pub async fn measure(&mut self) -> Result<(), Error<I2C::Error>> {
        if self.withhold {
            self.withhold = !self.newest().await?.ready;
        }
        self.asked = Some(false);
        let asked = self.bus.write(ADDRESS, &[MODE.address, SINGLE]).await;
        asked.map_err(|e| Error::Bus(MODE, e))?;
        self.asked = Some(true);
        Ok(())
    }

    /// Takes the newest set. `None`: it was withheld, being the first since the settings changed; the next is good if it
    /// is read one measurement later.
    pub async fn read(&mut self) -> Result<Option<Sample>, Error<I2C::Error>> {
        let mut sample = self.newest().await?;
        sample.ready &= self.asked.as_mut().is_none_or(core::mem::take);
        Ok((!core::mem::take(&mut self.withhold)).then_some(sample))
    }

    async fn newest(&mut self) -> Result<Sample, Error<I2C::Error>> {
        let (mut status, mut data) = self.status_and_data().await?;
        if status & LOCK != 0 {
            // The set was held since an earlier, incomplete reading; this reading of all six bytes has released it.
            (status, data) = self.status_and_data().await?;
        }
        if status & LOCK != 0 {
            let (register, read) = (STATUS, status.into());
            return Err(Error::Stuck { register, read });
        }
        let [xh, xl, zh, zl, yh, yl] = data;
        let counts = [
            code(DATA_X, [xh, xl])?,
            code(DATA_Y, [yh, yl])?,
            code(DATA_Z, [zh, zl])?,
        ];
        Ok(Sample {
            counts,
            overflow: counts.map(|c| c == OVERFLOW),
            ready: status & RDY != 0,
        })
    }

    async fn write(&mut self, [a, b, mode]: [u8; 3]) -> Result<(), Error<I2C::Error>> {
        (self.withhold, self.asked) = (true, (mode == SINGLE).then_some(true));
        // In the form of the other transfers, so that the image has one future less.
        self.bus
            .transaction(ADDRESS, &mut [Operation::Write(&[CONFIGURATION_A.address, a, b, mode])])
            .await
            .map_err(|e| Error::Bus(CONFIGURATION_A, e))
    }

    async fn status_and_data(&mut self) -> Result<(u8, [u8; 6]), Error<I2C::Error>> {
        let (mut status, mut data) = ([0], [0; 6]);
        self.two_reads((STATUS, &mut status), &mut data).await?;
        Ok((status[0], data))
    }

    /// Reads some registers and then all six data bytes in one transaction. The data address is sent, since whether the
    /// pointer runs on from register 8 to 9 or back to 3 differs between the part's datasheet revisions.
    async fn two_reads(
        &mut self,
        (first, bytes): (Register, &mut [u8]),
        data: &mut [u8; 6],
    ) -> Result<(), Error<I2C::Error>> {
        let mut operations = [
            Operation::Write(&[first.address]),
            Operation::Read(bytes),
            Operation::Write(&[DATA_X.address]),
            Operation::Read(data),
        ];
        self.bus
            .transaction(ADDRESS, &mut operations)
            .await
            .map_err(|e| Error::Bus(first, e))
    }
}

/// The codes of one axis: 12 bits, sign-extended by the part, or [`OVERFLOW`].
fn code<E>(register: Register, bytes: [u8; 2]) -> Result<i16, Error<E>> {
    match i16::from_be_bytes(bytes) {
        counts @ (-2048..=2047 | OVERFLOW) => Ok(counts),
        other => {
            let read = other.cast_unsigned();
            Err(Error::Garbage { register, read })
        }
    }
}

#[cfg(test)]
mod tests;
