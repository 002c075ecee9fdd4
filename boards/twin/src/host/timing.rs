//! How long the host board's lines take: the wire, plus what the firmware image spends around it.
//!
//! The wire times follow from the rates. The overheads are read off the image on the emulated board (its slot times in
//! derived frames against those of the host run), so that both sample the world at the same instants; a test holds the
//! two runs together.
//!
//! [`BOOT`] is read off the instants at which the gyros are asked, never off a packet's bytes: those also hold what the firmware
//! does before a UART's first bit, and an error of one hides in the other.

use crate::part::Nanos;

/// \[ns\] a bit on the sensor bus at 400 kHz.
pub const I2C_BIT: Nanos = 2_500;
/// \[ns\] from an alarm to the firmware's next step.
pub const WAKE: Nanos = 8_050;
/// \[ns\] the firmware's work around one I2C transaction, besides the wake at its end.
pub const I2C_OVERHEAD: Nanos = 1_650;
/// \[ns\] what a transaction that reads takes more of it.
pub const I2C_READ: Nanos = 7_600;
/// \[ns\] its work at each change of direction inside one.
pub const I2C_TURN: Nanos = 11_750;
/// \[ns\] a 16-bit word on the gyro bus at 84 MHz / 64.
pub const SPI_WORD: Nanos = 12_190;
/// \[ns\] the firmware's work around one word.
pub const SPI_OVERHEAD: Nanos = 5_750;
/// \[ns\] the firmware's work before the first bit of a write to a UART.
pub const UART_START: Nanos = 108_300;
/// \[ns\] a byte on a UART, 8N1 at 42 MHz / 365, the divisor nearest to 115200.
pub const UART_BYTE: Nanos = 86_905;
/// \[ns\] from reset to the start of the unit's clock.
pub const BOOT: Nanos = 670_000;
