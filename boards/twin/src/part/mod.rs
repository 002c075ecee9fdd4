//! The parts at register level: physical truth in, register bytes out.
//!
//! Both boards drive them byte by byte: the emulated one as the STM32's peripherals clock them, the host one as it
//! plays an `embedded-hal` transaction. Time is always an argument, in nanoseconds since power-on.
//!
//! Addresses, registers, scales and rates are written here once more, from the data sheets and not from the drivers: a number
//! that a driver has wrong is otherwise wrong on both sides, and no test sees it.

pub mod adis16265;
pub mod hmc5883l;
pub mod lis331hh;
pub mod nand;
pub mod signal;
pub mod tca9548a;
pub mod tmp102;

use std::sync::Arc;

/// \[ns\] since power-on.
pub type Nanos = u64;

/// A physical quantity at a time [s since power-on]; how truth enters a part.
pub type Input<T> = Arc<dyn Fn(f64) -> T + Send + Sync>;

/// A target on an I2C bus, one byte at a time.
pub trait I2cPart: Send {
    /// Its 7-bit address.
    fn address(&self) -> u8;
    /// START (or repeated START) and its address; `read` is the direction bit. Returns whether it acknowledges.
    fn start(&mut self, read: bool, now: Nanos) -> bool;
    /// A byte from the controller; returns whether it is acknowledged.
    fn write(&mut self, byte: u8, now: Nanos) -> bool;
    /// A byte for the controller.
    fn read(&mut self, now: Nanos) -> u8;
    /// STOP.
    fn stop(&mut self, now: Nanos);
    /// Power returns: registers take their defaults.
    fn power_on(&mut self, now: Nanos);
}

/// A target on an SPI bus with its own chip select, one 16-bit word at a time.
pub trait SpiPart: Send {
    /// Chip select falls.
    fn select(&mut self, now: Nanos);
    /// A word in, a word out.
    fn transfer(&mut self, mosi: u16, now: Nanos) -> u16;
    /// Chip select rises.
    fn deselect(&mut self, now: Nanos);
    /// Power returns: registers take their defaults.
    fn power_on(&mut self, now: Nanos);
}

#[cfg(test)]
mod testing {
    //! Register conversations with one part.

    use super::{
        I2cPart, Nanos,
        signal::{Noise, Specimen},
    };

    impl<const N: usize> Specimen<N> {
        /// No bias, no noise, conversions at whole periods.
        pub fn ideal() -> Self {
            let mut specimen = Specimen::draw(Noise::new(0), 0.0, 0.0, 0);
            specimen.pace.phase = 0.0;
            specimen
        }
    }

    /// START, bytes, STOP.
    pub fn write(part: &mut dyn I2cPart, bytes: &[u8], now: Nanos) {
        assert!(part.start(false, now));
        assert!(bytes.iter().all(|&byte| part.write(byte, now)));
        part.stop(now);
    }

    /// Register pointer, repeated START, `N` bytes, STOP.
    pub fn read<const N: usize>(part: &mut dyn I2cPart, register: u8, now: Nanos) -> [u8; N] {
        assert!(part.start(false, now) && part.write(register, now) && part.start(true, now));
        let bytes = core::array::from_fn(|_| part.read(now));
        part.stop(now);
        bytes
    }
}
