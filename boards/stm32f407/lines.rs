//! The lines to the vehicle and the ground: telemetry on USART2, umbilical on USART3, two discrete inputs.
//!
//! In: bytes, pin levels. Out: bytes, `true` for an asserted line. Lines out go by DMA. The umbilical's way in is an
//! interrupt a byte and a queue: it carries commands, ten bytes a second and not ten thousand, and the HAL's DMA ring
//! does not come back from an error: the stream restarts at the ring's beginning while its reader goes on where it was
//! (RM0090 section 10.5.6, reload of NDTR; embassy issues 1441 and 3356), so up to a ring of old bytes is read as new
//! and a ring of new ones is not seen. Here a byte with a framing, noise or overrun error is one error in its place
//! among the bytes, and the next byte is the next byte.

use core::sync::atomic::{AtomicBool, Ordering};

use embassy_stm32::Peri;
use embassy_stm32::gpio::{AfType, Flex, Input, Pin, Pull};
use embassy_stm32::interrupt::typelevel::{self, Handler, Interrupt};
use embassy_stm32::mode::Async;
use embassy_stm32::pac;
use embassy_stm32::peripherals::{DMA1_CH3, DMA1_CH6, USART2, USART3};
use embassy_stm32::usart::{Config, RxPin, TxPin, UartTx};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::channel::Channel;
use embedded_io_async::{Error, ErrorKind, ErrorType, Read};
use emems::board::Discretes;

use super::Irqs;

/// A line out.
pub type Transmitter = UartTx<'static, Async>;

/// USART2, sending only.
pub fn telemetry(
    usart: Peri<'static, USART2>,
    tx: Peri<'static, impl TxPin<USART2>>,
    dma: Peri<'static, DMA1_CH6>,
) -> Transmitter {
    let line = UartTx::new(usart, tx, dma, Irqs, Config::default()).expect("115200 Bd divides APB1's 42 MHz");
    // SAFETY: `Irqs` binds the handler. The HAL leaves a line that only sends without its interrupt, and then a flush
    // is never woken.
    unsafe { typelevel::USART2::enable() };
    line
}

/// USART3, both ways.
pub fn umbilical(
    usart: Peri<'static, USART3>,
    tx: Peri<'static, impl TxPin<USART3>>,
    rx: Peri<'static, impl RxPin<USART3>>,
    dma: Peri<'static, DMA1_CH3>,
) -> (Transmitter, Receiver) {
    let line = UartTx::new(usart, tx, dma, Irqs, Config::default()).expect("115200 Bd divides APB1's 42 MHz");
    let function = rx.af_num();
    let mut pin = Flex::new(rx);
    // An unplugged umbilical idles instead of receiving noise.
    pin.set_as_af_unchecked(function, AfType::input(Pull::Up));
    pac::USART3.cr1().modify(|w| {
        w.set_re(true);
        w.set_rxneie(true);
    });
    // SAFETY: `Irqs` binds the handlers, and what they need is static.
    unsafe { typelevel::USART3::enable() };
    let receiver = Receiver { lost: false, _pin: pin };
    (line, receiver)
}

/// Bytes on their way to the reader: 22 ms at full rate. Nothing keeps the reader waiting that long.
static RECEIVED: Channel<CriticalSectionRawMutex, Result<u8, BytesLost>, 256> = Channel::new();

/// The queue was full when a byte came.
static OVERFLOWED: AtomicBool = AtomicBool::new(false);

/// USART3's receiver, beside the HAL's handler for its transmitter.
pub struct ReceiverInterrupt;

impl Handler<typelevel::USART3> for ReceiverInterrupt {
    unsafe fn on_interrupt() {
        // Reading SR, then DR clears the byte's flags, the error flags with it (RM0090 section 26.6.1). An overrun
        // raises the same interrupt.
        let flags = pac::USART3.sr().read();
        if !flags.rxne() && !flags.ore() {
            return;
        }
        let byte = pac::USART3.dr().read().dr() as u8;
        let damaged = flags.fe() || flags.ne() || flags.ore();
        let item = if damaged { Err(BytesLost) } else { Ok(byte) };
        if RECEIVED.try_send(item).is_err() {
            OVERFLOWED.store(true, Ordering::Relaxed);
        }
    }
}

/// Bytes were damaged on the line, or came faster than they were read.
#[derive(Clone, Copy, Debug)]
pub struct BytesLost;

impl core::fmt::Display for BytesLost {
    fn fmt(&self, formatter: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        formatter.write_str("bytes were lost on the umbilical")
    }
}

impl core::error::Error for BytesLost {}

impl Error for BytesLost {
    fn kind(&self) -> ErrorKind {
        ErrorKind::InvalidData
    }
}

/// A line in. There is one: its queue is static.
pub struct Receiver {
    /// An error came after bytes that had to be handed over first.
    lost: bool,
    _pin: Flex<'static>,
}

impl ErrorType for Receiver {
    type Error = BytesLost;
}

impl Read for Receiver {
    async fn read(&mut self, buffer: &mut [u8]) -> Result<usize, BytesLost> {
        if core::mem::take(&mut self.lost) || OVERFLOWED.swap(false, Ordering::Relaxed) {
            return Err(BytesLost);
        }
        let Some((first, rest)) = buffer.split_first_mut() else {
            return Ok(0);
        };
        *first = RECEIVED.receive().await?;
        let mut count = 1;
        for place in rest {
            match RECEIVED.try_receive() {
                Ok(Ok(byte)) => *place = byte,
                Ok(Err(BytesLost)) => {
                    self.lost = true;
                    break;
                }
                Err(_) => break,
            }
            count = usize::saturating_add(count, 1);
        }
        Ok(count)
    }
}

/// The two discrete inputs, active low: the vehicle closes a contact to ground, a broken wire reads inactive.
pub struct VehicleInputs {
    lift_off: Input<'static>,
    micro_g: Input<'static>,
}

impl VehicleInputs {
    /// The inputs on these pins.
    pub fn new(lift_off: Peri<'static, impl Pin>, micro_g: Peri<'static, impl Pin>) -> Self {
        VehicleInputs {
            lift_off: Input::new(lift_off, Pull::Up),
            micro_g: Input::new(micro_g, Pull::Up),
        }
    }
}

impl Discretes for VehicleInputs {
    fn lift_off(&mut self) -> bool {
        self.lift_off.is_low()
    }

    fn micro_g(&mut self) -> bool {
        self.micro_g.is_low()
    }
}
