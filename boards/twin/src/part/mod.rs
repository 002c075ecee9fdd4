//! The parts at register level: physical truth in, register bytes out.
//!
//! Both boards drive them byte by byte: the emulated one as the STM32's peripherals clock them, the host one as it
//! plays an `embedded-hal` transaction. Time is always an argument, in nanoseconds since power-on.

use std::sync::Arc;

/// [ns] since power-on.
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
