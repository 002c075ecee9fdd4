//! The STM32F407VG as both boards use it: which peripheral does what. A board file only adds the pins.
//!
//! | For | Peripheral | DMA (RM0090 table 42) |
//! |---|---|---|
//! | time, 1 us ticks | TIM5 | |
//! | sensor bus, 400 kHz | I2C1 | DMA1 stream 0 receives, stream 7 transmits, both channel 1 |
//! | gyros, mode 3, 1.3125 MHz, 16 bit | SPI1 | none: `gyros.rs` says why |
//! | telemetry, 115200 8N1 | USART2 | DMA1 stream 6 transmits, channel 4 |
//! | umbilical, 115200 8N1 | USART3 | DMA1 stream 3 transmits, channel 4; bytes are received one by one |
//! | NAND, 8 bit | FSMC bank 2 | none |
//! | supply below 2.9 V | PVD, EXTI line 16 | |
//! | watchdog, 1 s | IWDG | |
//!
//! In: the pins. Out: the [`Parts`](emems::board::Parts) of [`Stm32f407`]. All of the firmware's unsafe code is in
//! this folder, each block with its reason.

mod bus;
mod clock;
mod crash;
mod flash;
mod gyros;
mod lines;
#[allow(dead_code, reason = "a board without a NAND only says that it has none")]
mod nand;
mod ram;
mod retained;
mod stack;

use core::future::poll_fn;
use core::marker::PhantomData;
use core::task::Poll;

use embassy_stm32::wdg::IndependentWatchdog;
use embassy_stm32::{Peripherals, bind_interrupts, dma, i2c, peripherals, usart};
use emems::board::{Board, OptionBytes, Oscillator, ResetCause, Watchdog};

pub use self::bus::SensorBus;
pub use self::flash::read_image;
pub use self::gyros::gyros;
pub use self::lines::{VehicleInputs, telemetry, umbilical};
pub use self::nand::{NandPort, VoltageDetector};
pub use self::retained::ResetSafeRam;
pub use self::stack::stack_use;

bind_interrupts!(struct Irqs {
    I2C1_EV => i2c::EventInterruptHandler<peripherals::I2C1>;
    I2C1_ER => i2c::ErrorInterruptHandler<peripherals::I2C1>;
    DMA1_STREAM0 => dma::InterruptHandler<peripherals::DMA1_CH0>;
    DMA1_STREAM7 => dma::InterruptHandler<peripherals::DMA1_CH7>;
    USART2 => usart::InterruptHandler<peripherals::USART2>;
    DMA1_STREAM6 => dma::InterruptHandler<peripherals::DMA1_CH6>;
    USART3 => lines::ReceiverInterrupt, usart::InterruptHandler<peripherals::USART3>;
    DMA1_STREAM3 => dma::InterruptHandler<peripherals::DMA1_CH3>;
    PVD => nand::SupplyInterrupt;
});

/// The outcome of what was waited for in place, where a future is asked for. `core::future::ready` would panic if it were polled again.
fn over<T: Copy>(outcome: T) -> impl Future<Output = T> {
    poll_fn(move |_| Poll::Ready(outcome))
}

/// The types of a board with an STM32F407 whose I2C1 is on `Scl` and `Sda`.
pub struct Stm32f407<Scl, Sda>(PhantomData<(Scl, Sda)>);

impl<Scl: bus::Scl, Sda: bus::Sda> Board for Stm32f407<Scl, Sda> {
    type SensorBus = SensorBus<Scl, Sda>;
    type Gyro = gyros::Gyro;
    type Telemetry = lines::Transmitter;
    type UmbilicalTx = lines::Transmitter;
    type UmbilicalRx = lines::Receiver;
    type Discretes = VehicleInputs;
    type Watchdog = Iwdg;
    type Retained = ResetSafeRam;
    type Nand = NandPort;
    type Supply = VoltageDetector;

    fn ram_sum<T>(value: &T, before: u32) -> u32 {
        ram::sum(value, before)
    }
}

/// The independent watchdog. Nothing but a reset stops it.
pub struct Iwdg(IndependentWatchdog<'static, peripherals::IWDG>);

impl Watchdog for Iwdg {
    fn feed(&mut self) {
        self.0.pet();
    }
}

/// \[us\] between the last feeding and the reset if the LSI runs at its nominal 32 kHz. It runs anywhere between 17 and
/// 47 kHz (STM32F407 datasheet, table "LSI oscillator characteristics"), so a hung unit restarts after 0.68 to 1.88 s,
/// and whoever feeds must do so every 0.6 s.
const WATCHDOG_US: u32 = 1_000_000;

/// A chip that runs.
pub struct Started {
    /// Its pins and peripherals.
    pub peripherals: Peripherals,
    /// Its watchdog.
    pub watchdog: Iwdg,
    /// Why it started.
    pub reset: ResetCause,
    /// What its clocks come from.
    pub oscillator: Oscillator,
    /// What its option bytes say.
    pub options: OptionBytes,
}

/// Starts the watchdog, then the clocks and the time driver.
///
/// In this order, so that an oscillator that never gets ready ends in a reset and not in a loop of the HAL.
pub fn start() -> Started {
    stack::part();
    let reset = retained::reset_cause();
    embassy_stm32::pac::DBGMCU.apb1fzr().modify(|w| w.set_iwdg(true));
    // SAFETY: `embassy_stm32::init` has not handed out the peripherals yet, and no board file takes this one from them.
    let mut watchdog = IndependentWatchdog::new(unsafe { peripherals::IWDG::steal() }, WATCHDOG_US);
    watchdog.unleash();
    let (peripherals, oscillator) = clock::start();
    Started {
        peripherals,
        watchdog: Iwdg(watchdog),
        reset,
        oscillator,
        options: clock::option_bytes(),
    }
}
