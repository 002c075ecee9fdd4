//! The host board: the unit in virtual time, against the register-level parts.
//!
//! The same future that runs on the STM32F407 is polled here; nothing sleeps. Computing takes no virtual time; what
//! takes time is the lines: I2C at 400 kHz, SPI at 1.3125 MHz, the UARTs at 115200 baud, each with the overhead that the
//! firmware image shows ([`timing`]).

mod board;
mod bus;
mod clock;
mod lines;
mod nand;
mod plight;
mod run;
pub mod timing;

pub use run::{HostReport, fly, fly_around};
