//! What the unit needs from whatever it runs on: an STM32F407, its emulation, or a host in virtual time.

use embedded_hal_async::{i2c::I2c, spi::SpiDevice};
use embedded_io_async::{Read, Write};

use crate::nand::k9f1208::NandBus;
pub use crate::sensor::tca9548a::RecoverBus;

/// The set of types a board provides. One implementation per board file; none of them is named in `src/`.
pub trait Board {
    /// The sensor bus, on which a TCA9548A selects one plate at a time.
    type SensorBus: I2c + RecoverBus;
    /// One ADIS16265: SPI mode 3, 16-bit words, its own chip select.
    type Gyro: SpiDevice<u16>;
    /// Telemetry line to the vehicle, 115200 8N1. Never read.
    type Telemetry: Write;
    /// Umbilical line towards the ground.
    type UmbilicalTx: Write;
    /// Umbilical line from the ground. An error means bytes were lost (framing, overrun); the next read goes on.
    type UmbilicalRx: Read;
    /// Lift-off and micro-g inputs.
    type Discretes: Discretes;
    /// Independent watchdog.
    type Watchdog: Watchdog;
    /// What survives a reset but not a power cut.
    type Retained: Retained;
    /// The flight recorder's memory.
    type Nand: NandBus;
    /// What watches the supply.
    type Supply: Supply;

    /// A checksum of the bytes that a value stands in, those between its fields too, on top of the one `before`: it is another if a
    /// bit of the RAM has flipped. The same where the RAM does not flip, as on a host.
    fn ram_sum<T>(value: &T, before: u32) -> u32;
}

/// Everything [`crate::unit::run`] takes, ready to use: clocks run, peripherals are configured, nothing has been sent.
pub struct Parts<B: Board> {
    /// I2C bus of the accelerometers, magnetometers and thermometers.
    pub sensor_bus: B::SensorBus,
    /// Gyros of plates 1 to 4.
    pub gyros: [B::Gyro; 4],
    /// Telemetry line.
    pub telemetry: B::Telemetry,
    /// Umbilical, unit to ground.
    pub umbilical_tx: B::UmbilicalTx,
    /// Umbilical, ground to unit.
    pub umbilical_rx: B::UmbilicalRx,
    /// Lift-off and micro-g inputs.
    pub discretes: B::Discretes,
    /// Watchdog, already running.
    pub watchdog: B::Watchdog,
    /// Retained memory.
    pub retained: B::Retained,
    /// The flight recorder's memory.
    pub nand: B::Nand,
    /// Why the unit started.
    pub reset: ResetCause,
    /// What its time comes from.
    pub oscillator: Oscillator,
    /// What the chip's option bytes say.
    pub options: OptionBytes,
    /// What watches the supply.
    pub supply: B::Supply,
    /// How much of the stack has been used; may take as long as a packet's encoding.
    pub stack_use: fn() -> StackUse,
    /// Reads the firmware's own image.
    pub read_image: ReadImage,
}

/// Reads a piece of the firmware's image from a place on; how many bytes there are, none beyond its end.
pub type ReadImage = fn(at: usize, piece: &mut [u8]) -> usize;

/// The two discrete inputs of the vehicle, `true` = asserted, polarity already undone.
pub trait Discretes {
    /// Lift-off, not debounced.
    fn lift_off(&mut self) -> bool;
    /// Micro-gravity, not debounced.
    fn micro_g(&mut self) -> bool;
}

/// The independent watchdog.
pub trait Watchdog {
    /// Restarts its count.
    fn feed(&mut self);
}

/// What watches the supply.
pub trait Supply {
    /// How often, since this start, it fell below what the recorder's memory needs.
    fn dips(&self) -> u16;
}

/// Memory that survives a reset: [`RETAINED_BYTES`](crate::retained::RETAINED_BYTES) bytes, of which nobody knows what they are
/// after a power cut. What stands where, and how it is checked, is [`crate::retained`]'s business.
pub trait Retained {
    /// Reads as many bytes as there is room for, from `at` on.
    fn read(&self, at: usize, bytes: &mut [u8]);
    /// Writes bytes from `at` on, in this order.
    fn write(&self, at: usize, bytes: &[u8]);
}

/// Why the unit started.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
pub enum ResetCause {
    /// Power was applied, or browned out.
    #[default]
    PowerOn,
    /// The watchdog was not fed.
    Watchdog,
    /// The firmware asked for it, which it does after a panic or fault.
    Software,
    /// The reset pin.
    Pin,
}

impl ResetCause {
    /// Every cause, in the order of their codes.
    const ALL: [ResetCause; 4] = [
        ResetCause::PowerOn,
        ResetCause::Watchdog,
        ResetCause::Software,
        ResetCause::Pin,
    ];

    /// Its number in logs and frames, from 1.
    pub fn code(self) -> u8 {
        self as u8 + 1
    }

    /// The cause with this number.
    pub fn of_code(code: u8) -> Option<Self> {
        ResetCause::ALL.get(usize::from(code).checked_sub(1)?).copied()
    }
}

/// What the unit's clock, and with it every time and baud rate, comes from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
pub enum Oscillator {
    /// The crystal.
    #[default]
    Crystal,
    /// The microcontroller's own oscillator, because the crystal did not start: off by up to 8 % over temperature.
    Internal,
}

impl Oscillator {
    /// Its name on the console.
    pub fn name(self) -> &'static str {
        match self {
            Oscillator::Crystal => "crystal",
            Oscillator::Internal => "internal",
        }
    }
}

/// What a flight depends on in the chip's option bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
pub struct OptionBytes {
    /// The brown-out reset.
    pub brown_out: BrownOut,
    /// Level of the read-out protection: 0 open, 1 for a flight, 2 for good.
    pub read_out: u8,
}

/// The supply voltage below which the processor is held in reset: what its option bytes say, beside what the board asks for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
pub struct BrownOut {
    /// \[mV\] set, at least; 0 is off.
    pub set_mv: u16,
    /// \[mV\] asked for.
    pub asked_mv: u16,
}

impl BrownOut {
    /// Whether the processor may run on at a voltage at which the board cannot answer for it.
    pub fn falls_short(&self) -> bool {
        self.set_mv < self.asked_mv
    }
}

/// How deep the stack has grown since the start. Both are zero where nobody knows, as on a host.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct StackUse {
    /// Bytes used at most.
    pub used: usize,
    /// Bytes there are.
    pub size: usize,
}
