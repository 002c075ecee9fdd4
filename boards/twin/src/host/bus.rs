//! The sensor bus and the gyros' bus on the host: `embedded-hal` transactions played byte by byte to the parts.
//!
//! A transfer that is abandoned leaves the bus as the STM32F4 leaves it: every later one waits for ever, until
//! [`RecoverBus::recover`].

use std::{cell::RefCell, future::pending, rc::Rc};

use embassy_time::{Instant, Timer};
use embedded_hal::{
    i2c::{self, ErrorKind, NoAcknowledgeSource},
    spi,
};
use emems::board::RecoverBus;

use super::{
    clock,
    plight::Plight,
    timing::{I2C_BIT, I2C_OVERHEAD, I2C_READ, I2C_TURN, SPI_OVERHEAD, SPI_WORD},
};
use crate::{
    part::{Nanos, SpiPart},
    plant::Plant,
    run::End,
};

/// \[ns\] nine clock pulses and a STOP by hand, the mux's reset, the peripheral set up again.
const RECOVERY: Nanos = 200_000;

/// Waits until `at` since power-on.
async fn wait_until(at: Nanos) {
    let ahead_us = at.saturating_sub(clock::since_power_on()).div_ceil(1000);
    Timer::at(Instant::from_micros(Instant::now().as_micros() + ahead_us)).await;
}

/// A DMA transfer that does not stop when it is told to. The STM32's HAL waits in place until it has.
struct NeverStops;

impl Drop for NeverStops {
    fn drop(&mut self) {
        clock::hang();
    }
}

/// The sensor bus.
pub struct SensorBus {
    plant: Rc<RefCell<Plant>>,
    plight: Rc<Plight>,
    abandoned: bool,
}

impl SensorBus {
    /// The bus of these parts.
    pub fn new(plant: Rc<RefCell<Plant>>, plight: Rc<Plight>) -> Self {
        plant.borrow_mut().controller_reset();
        SensorBus {
            plant,
            plight,
            abandoned: false,
        }
    }

    /// Plays a transaction from `now` on; when it is over, and whether it was acknowledged throughout. It waits only
    /// where a part holds SCL low, so that one abandoned there has not reached the bytes that follow.
    async fn play(
        &self,
        address: u8,
        operations: &mut [i2c::Operation<'_>],
        now: Nanos,
    ) -> (Nanos, Result<(), ErrorKind>) {
        let plant = || self.plant.borrow_mut();
        let reads = operations
            .iter()
            .any(|operation| matches!(operation, i2c::Operation::Read(_)));
        let mut at = now + I2C_OVERHEAD + if reads { I2C_READ } else { 0 };
        let byte = 9 * I2C_BIT;
        let mut direction = None;
        for operation in operations {
            let read = matches!(operation, i2c::Operation::Read(_));
            let before = direction.replace(read);
            if before != Some(read) {
                at = self.clocked(at).await + byte + I2C_BIT + before.map_or(0, |_| I2C_TURN);
                let acknowledged = plant().i2c.start(address, read, at);
                if !acknowledged {
                    plant().i2c.stop(at);
                    return (
                        at + I2C_BIT,
                        Err(ErrorKind::NoAcknowledge(NoAcknowledgeSource::Address)),
                    );
                }
            }
            match operation {
                i2c::Operation::Read(bytes) => {
                    for slot in bytes.iter_mut() {
                        at = self.clocked(at).await;
                        *slot = plant().i2c.read(at);
                        at += byte;
                    }
                }
                i2c::Operation::Write(bytes) => {
                    for value in bytes.iter() {
                        at = self.clocked(at).await + byte;
                        let acknowledged = plant().i2c.write(*value, at);
                        if !acknowledged {
                            plant().i2c.stop(at);
                            return (at + I2C_BIT, Err(ErrorKind::NoAcknowledge(NoAcknowledgeSource::Data)));
                        }
                    }
                }
            }
        }
        plant().i2c.stop(at);
        (at + I2C_BIT, Ok(()))
    }

    /// When SCL can rise: at `at`, or when the part that holds it lets go, which is then waited for.
    async fn clocked(&self, at: Nanos) -> Nanos {
        let free = self.plant.borrow().scl_held_until();
        if free > at {
            wait_until(free).await;
        }
        at.max(free)
    }
}

impl i2c::ErrorType for SensorBus {
    type Error = ErrorKind;
}

impl embedded_hal_async::i2c::I2c for SensorBus {
    async fn transaction(&mut self, address: u8, operations: &mut [i2c::Operation<'_>]) -> Result<(), Self::Error> {
        let now = clock::since_power_on();
        self.plight.serve(End::SensorBus);
        if self.plight.dma_hangs() {
            let _waited_for_in_place = NeverStops;
            pending::<()>().await;
        }
        let is_in_the_way = |plant: &mut Plant| plant.sda_in_the_way() || plant.start_is_refused();
        if self.abandoned || is_in_the_way(&mut self.plant.borrow_mut()) {
            self.abandoned = true;
            pending::<()>().await;
        }
        self.abandoned = true;
        let (end, outcome) = self.play(address, operations, now).await;
        wait_until(end).await;
        self.abandoned = false;
        outcome
    }
}

impl RecoverBus for SensorBus {
    async fn recover(&mut self) -> bool {
        {
            let mut plant = self.plant.borrow_mut();
            // With SCL held low there are no edges, until the reset disconnects whoever holds it.
            if plant.scl_held_until() <= clock::since_power_on() {
                (0..9).for_each(|_| plant.clock_pulse());
            }
            plant.i2c.reset_pin();
            plant.controller_reset();
        }
        wait_until(clock::since_power_on() + RECOVERY).await;
        self.abandoned = false;
        !self.plant.borrow().sda_held()
    }
}

/// One gyro.
pub struct Gyro {
    plant: Rc<RefCell<Plant>>,
    plate: usize,
    plight: Rc<Plight>,
}

impl Gyro {
    /// The gyro of a plate.
    pub fn new(plant: Rc<RefCell<Plant>>, plate: usize, plight: Rc<Plight>) -> Self {
        Gyro { plant, plate, plight }
    }
}

impl spi::ErrorType for Gyro {
    type Error = spi::ErrorKind;
}

impl embedded_hal_async::spi::SpiDevice<u16> for Gyro {
    async fn transaction(&mut self, operations: &mut [spi::Operation<'_, u16>]) -> Result<(), Self::Error> {
        self.plight.serve(End::Gyros);
        let mut at = clock::since_power_on() + SPI_OVERHEAD;
        {
            let mut plant = self.plant.borrow_mut();
            let gyro = &mut plant.gyro[self.plate];
            gyro.select(at);
            for operation in operations {
                let mut word = |mosi: u16| {
                    at += SPI_WORD;
                    gyro.transfer(mosi, at)
                };
                match operation {
                    spi::Operation::Read(words) => words.iter_mut().for_each(|slot| *slot = word(0)),
                    spi::Operation::Write(words) => words.iter().for_each(|mosi| {
                        word(*mosi);
                    }),
                    spi::Operation::Transfer(read, write) => {
                        for index in 0..read.len().max(write.len()) {
                            let miso = word(write.get(index).copied().unwrap_or(0));
                            if let Some(slot) = read.get_mut(index) {
                                *slot = miso;
                            }
                        }
                    }
                    spi::Operation::TransferInPlace(words) => words.iter_mut().for_each(|slot| *slot = word(*slot)),
                    spi::Operation::DelayNs(ns) => at += Nanos::from(*ns),
                }
            }
            gyro.deselect(at);
        }
        // The STM32 board waits for the word in place: nothing else is polled meanwhile.
        clock::spend(at - clock::since_power_on());
        Ok(())
    }
}
