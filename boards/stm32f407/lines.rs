//! The lines to the vehicle and the ground: telemetry on USART2, umbilical on USART3, two discrete inputs.
//!
//! In: bytes, pin levels. Out: bytes, `true` for an asserted line. A byte that came with a framing, noise or overrun
//! error ends the HAL's reception (embassy issues 1441 and 3356); here it is reported once and reception is running
//! again before the caller hears of it.

use embassy_stm32::Peri;
use embassy_stm32::gpio::{Input, Pin, Pull};
use embassy_stm32::interrupt::typelevel::Interrupt;
use embassy_stm32::mode::Async;
use embassy_stm32::peripherals::{DMA1_CH1, DMA1_CH3, DMA1_CH6, USART2, USART3};
use embassy_stm32::usart::{self, Config, RingBufferedUartRx, RxPin, TxPin, Uart, UartTx};
use embedded_io_async::{ErrorType, Read};
use emems::board::Discretes;
use static_cell::StaticCell;

use super::Irqs;

/// A line out.
pub type Transmitter = UartTx<'static, Async>;

/// 64 ms of the umbilical at full rate: nothing keeps its reader waiting that long.
const RING_BYTES: usize = 1024;

static RING: StaticCell<[u8; RING_BYTES]> = StaticCell::new();

/// Both ways of the umbilical.
pub struct Umbilical {
    /// To the ground.
    pub tx: Transmitter,
    /// From the ground.
    pub rx: Receiver,
}

/// USART2, sending only.
pub fn telemetry(
    usart: Peri<'static, USART2>,
    tx: Peri<'static, impl TxPin<USART2>>,
    dma: Peri<'static, DMA1_CH6>,
) -> Transmitter {
    let line = UartTx::new(usart, tx, dma, Irqs, Config::default()).expect("115200 Bd divides APB1's 42 MHz");
    // SAFETY: `Irqs` binds the handler. The HAL leaves a line that only sends without its interrupt, and then a flush
    // is never woken.
    unsafe { embassy_stm32::interrupt::typelevel::USART2::enable() };
    line
}

impl Umbilical {
    /// USART3, receiving into a ring from now on.
    pub fn new(
        usart: Peri<'static, USART3>,
        tx: Peri<'static, impl TxPin<USART3>>,
        rx: Peri<'static, impl RxPin<USART3>>,
        tx_dma: Peri<'static, DMA1_CH3>,
        rx_dma: Peri<'static, DMA1_CH1>,
    ) -> Self {
        let mut config = Config::default();
        // An unplugged umbilical idles instead of receiving noise.
        config.rx_pull = Pull::Up;
        let line = Uart::new(usart, rx, tx, tx_dma, rx_dma, Irqs, config).expect("115200 Bd divides APB1's 42 MHz");
        let (tx, rx) = line.split();
        let mut rx = Receiver(rx.into_ring_buffered(RING.init([0; RING_BYTES])));
        rx.0.start_uart();
        Umbilical { tx, rx }
    }
}

/// A line in.
pub struct Receiver(RingBufferedUartRx<'static>);

impl ErrorType for Receiver {
    type Error = usart::Error;
}

impl Read for Receiver {
    async fn read(&mut self, buffer: &mut [u8]) -> Result<usize, usart::Error> {
        let result = self.0.read(buffer).await;
        if result.is_err() {
            self.0.start_uart();
        }
        result
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
