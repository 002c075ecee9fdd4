//! The sensor bus: I2C1 by DMA at 400 kHz, and the way back when a transfer was abandoned.
//!
//! In: transactions. Out: their results, unchanged. Three things the HAL leaves to its user are done here:
//!
//! - it sets STOP and returns; a START requested before that STOP is out may be lost (RM0090 section 27.6.1, note on
//!   bits STOP, START and PEC), so a transaction first waits, briefly, until it is;
//! - after a data byte was not acknowledged it sends no STOP, and the bus would stay claimed;
//! - a transfer dropped by a timeout leaves a pending START that only a reset of the peripheral removes:
//!   [`RecoverBus::recover`].
//!
//! A transaction on a bus whose recovery was cut short does not exist: recovery has no await in it.

use cortex_m::asm;
use embassy_stm32::gpio::{Flex, Level, Output, Pin, Pull, Speed};
use embassy_stm32::i2c::{self, I2c, Master, SclPin, SdaPin};
use embassy_stm32::mode::Async;
use embassy_stm32::pac;
use embassy_stm32::peripherals::{DMA1_CH0, DMA1_CH7, I2C1};
use embassy_stm32::time::Hertz;
use embassy_stm32::{Peri, PeripheralType};
use embedded_hal_async::i2c::{ErrorType, Operation};
use emems::board::RecoverBus;

use super::Irqs;

/// A pin that can be I2C1's clock.
pub trait Scl: SclPin<I2C1> + PeripheralType + 'static {}
impl<P: SclPin<I2C1> + PeripheralType + 'static> Scl for P {}

/// A pin that can be I2C1's data line.
pub trait Sda: SdaPin<I2C1> + PeripheralType + 'static {}
impl<P: SdaPin<I2C1> + PeripheralType + 'static> Sda for P {}

/// CPU cycles in a microsecond at 168 MHz.
const US: u32 = 168;

/// Half a clock period by hand: 100 kHz, which every part of the bus follows.
const HALF_PERIOD: u32 = 5 * US;

/// \[us\] a part may hold SCL low at each edge during recovery.
const STRETCH_US: u32 = 20;

/// Clock pulses after which a part that held SDA has let go: eight bits and the acknowledge (UM10204 section 3.1.16).
const PULSES: usize = 9;

/// Reads of I2C_CR1 until a STOP is given up: some 60 us, where STOP takes 3 us on a free bus. After that the
/// transaction starts regardless, and its timeout decides.
const STOP_READS: u32 = 1_000;

/// I2C1 and the reset line of the multiplexer on it.
pub struct SensorBus<Scl: self::Scl, Sda: self::Sda> {
    wires: Wires<Scl, Sda>,
    /// `None` only inside `recover`.
    driver: Option<I2c<'static, Async, Master>>,
    mux_reset: Output<'static>,
}

/// What the driver is made of, again after each recovery.
struct Wires<Scl: self::Scl, Sda: self::Sda> {
    i2c: Peri<'static, I2C1>,
    scl: Peri<'static, Scl>,
    sda: Peri<'static, Sda>,
    transmit: Peri<'static, DMA1_CH7>,
    receive: Peri<'static, DMA1_CH0>,
}

impl<Scl: self::Scl, Sda: self::Sda> Wires<Scl, Sda> {
    fn driver(&mut self) -> I2c<'static, Async, Master> {
        let mut config = i2c::Config::default();
        config.frequency = Hertz::khz(400);
        // SAFETY: these five are used by one driver at a time. `SensorBus::new` makes the first, `recover` drops the
        // old one before it calls this.
        unsafe {
            I2c::new(
                self.i2c.clone_unchecked(),
                self.scl.clone_unchecked(),
                self.sda.clone_unchecked(),
                self.transmit.clone_unchecked(),
                self.receive.clone_unchecked(),
                Irqs,
                config,
            )
        }
    }
}

impl<Scl: self::Scl, Sda: self::Sda> SensorBus<Scl, Sda> {
    /// The bus on these pins; external pull-ups are expected on both lines and on the reset line.
    pub fn new(
        i2c: Peri<'static, I2C1>,
        scl: Peri<'static, Scl>,
        sda: Peri<'static, Sda>,
        transmit: Peri<'static, DMA1_CH7>,
        receive: Peri<'static, DMA1_CH0>,
        mux_reset: Peri<'static, impl Pin>,
    ) -> Self {
        let mut wires = Wires {
            i2c,
            scl,
            sda,
            transmit,
            receive,
        };
        let driver = Some(wires.driver());
        SensorBus {
            wires,
            driver,
            mux_reset: Output::new(mux_reset, Level::High, Speed::Low),
        }
    }
}

impl<Scl: self::Scl, Sda: self::Sda> ErrorType for SensorBus<Scl, Sda> {
    type Error = i2c::Error;
}

impl<Scl: self::Scl, Sda: self::Sda> embedded_hal_async::i2c::I2c for SensorBus<Scl, Sda> {
    async fn transaction(&mut self, address: u8, operations: &mut [Operation<'_>]) -> Result<(), i2c::Error> {
        let driver = self.driver.as_mut().ok_or(i2c::Error::Bus)?;
        let _ = (0..STOP_READS).any(|_| !pac::I2C1.cr1().read().stop());
        let result = driver.transaction(address, operations).await;
        if result.is_err() && pac::I2C1.sr2().read().msl() && !pac::I2C1.cr1().read().stop() {
            pac::I2C1.cr1().modify(|w| w.set_stop(true));
        }
        result
    }
}

impl<Scl: self::Scl, Sda: self::Sda> RecoverBus for SensorBus<Scl, Sda> {
    /// At most 0.4 ms: nine STOPs of 20 us, each with its clock edge stretched to the limit. All of it is waited for in
    /// place, since a recovery that is itself abandoned would leave no driver.
    fn recover(&mut self) -> impl Future<Output = bool> {
        // Gates the peripheral's clock and takes the pins off it.
        self.driver = None;
        // SAFETY: no driver has the pins now, and these two are gone before the next one is made.
        let (mut scl, mut sda) = unsafe {
            (
                Flex::new(self.wires.scl.clone_unchecked()),
                Flex::new(self.wires.sda.clone_unchecked()),
            )
        };
        for line in [&mut scl, &mut sda] {
            line.set_high();
            // The weak internal pull-up makes an unplugged bus read idle instead of anything.
            line.set_as_input_output_pull(Speed::Low, Pull::Up);
        }
        asm::delay(HALF_PERIOD);
        // The stuck part may hang behind the multiplexer, so it is clocked free before its channel is switched off.
        for _ in 0..PULSES {
            if sda.is_high() {
                stop(&mut scl, &mut sda);
                if sda.is_high() {
                    break;
                }
            } else {
                pulse(&mut scl);
            }
        }
        // TCA9548A datasheet, section 6.6: 6 ns low are enough.
        self.mux_reset.set_low();
        asm::delay(US);
        self.mux_reset.set_high();
        asm::delay(US);
        let idle = scl.is_high() && sda.is_high();
        drop((scl, sda));
        // Resets the peripheral twice, by RCC and by SWRST, and sets every register.
        self.driver = Some(self.wires.driver());
        super::over(idle)
    }
}

fn pulse(scl: &mut Flex<'_>) {
    scl.set_low();
    asm::delay(HALF_PERIOD);
    release(scl);
}

/// A STOP condition. A part in the middle of sending a zero defeats it by holding SDA; the clock edge then was a pulse.
fn stop(scl: &mut Flex<'_>, sda: &mut Flex<'_>) {
    scl.set_low();
    asm::delay(HALF_PERIOD);
    sda.set_low();
    asm::delay(HALF_PERIOD);
    release(scl);
    sda.set_high();
    asm::delay(HALF_PERIOD);
}

fn release(scl: &mut Flex<'_>) {
    scl.set_high();
    for _ in 0..STRETCH_US {
        if scl.is_high() {
            break;
        }
        asm::delay(US);
    }
    asm::delay(HALF_PERIOD);
}
