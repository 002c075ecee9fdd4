//! The four gyros on SPI1: mode 3, 16-bit words, 84 MHz / 64 = 1.3125 MHz (ADIS16265 datasheet, table 2: at most 2.5).
//!
//! In: frames of 16-bit words. Out: the words that came back.
//!
//! A frame is one word and takes 12.2 us, and 800 of them are exchanged each second. Setting up two DMA streams, an
//! interrupt and a turn of the executor cost more than they free, so the word is waited for in place. The wait is not a
//! loop on the status register but a sleep: with SEVONPEND an interrupt that becomes pending is an event, though the
//! NVIC keeps it from being taken (ARMv7-M ARM, B1.5.18), so WFE sleeps until the word is there. Other interrupts are
//! served meanwhile; what they wake runs at most a frame later.

use cortex_m::asm;
use cortex_m::peripheral::{NVIC, SCB};
use embassy_embedded_hal::shared_bus::asynch::spi::SpiDevice;
use embassy_stm32::Peri;
use embassy_stm32::gpio::{AnyPin, Level, Output, Speed};
use embassy_stm32::interrupt;
use embassy_stm32::mode::Blocking;
use embassy_stm32::pac::{self, spi::vals::Dff};
use embassy_stm32::peripherals::SPI1;
use embassy_stm32::spi::mode::Master;
use embassy_stm32::spi::{self, MODE_3, MisoPin, MosiPin, SckPin, Spi};
use embassy_stm32::time::Hertz;
use embassy_sync::blocking_mutex::raw::NoopRawMutex;
use embassy_sync::mutex::Mutex;
use embedded_hal_async::spi::{ErrorKind, ErrorType, SpiBus};
use static_cell::StaticCell;

use super::over;

/// One gyro: the shared bus and its own chip select.
pub type Gyro = SpiDevice<'static, NoopRawMutex, GyroBus, Output<'static>>;

static BUS: StaticCell<Mutex<NoopRawMutex, GyroBus>> = StaticCell::new();

/// Sleeps until a word is there: the first may be ended by an event left over, the second by another interrupt. After
/// that SPI_SR is read in place. The time driver ends a sleep within 33 ms, so an SPI1 that has stopped costs a cycle
/// 4 x 33 ms of its 190, and the packet closes.
const SLEEPS: u32 = 2;

/// Reads of SPI_SR, 20 us and more: until the rest of a word is there, or until BSY falls half a clock period after it.
const READS: u32 = 1_000;

/// The gyros of plates 1 to 4 with these chip selects.
pub fn gyros(
    spi: Peri<'static, SPI1>,
    sck: Peri<'static, impl SckPin<SPI1>>,
    miso: Peri<'static, impl MisoPin<SPI1>>,
    mosi: Peri<'static, impl MosiPin<SPI1>>,
    selects: [Peri<'static, AnyPin>; 4],
) -> [Gyro; 4] {
    let bus: &'static _ = BUS.init(Mutex::new(GyroBus::new(spi, sck, miso, mosi)));
    selects.map(|select| SpiDevice::new(bus, Output::new(select, Level::High, Speed::Medium)))
}

/// SPI1 in 16-bit words.
pub struct GyroBus {
    /// Owns the pins and the clock; the words go through the registers.
    _spi: Spi<'static, Blocking, Master>,
}

impl GyroBus {
    fn new(
        spi: Peri<'static, SPI1>,
        sck: Peri<'static, impl SckPin<SPI1>>,
        miso: Peri<'static, impl MisoPin<SPI1>>,
        mosi: Peri<'static, impl MosiPin<SPI1>>,
    ) -> Self {
        let mut config = spi::Config::default();
        config.mode = MODE_3;
        // Slow edges: the wires go to four plates.
        config.gpio_speed = Speed::Low;
        config.frequency = Hertz(1_312_500);
        let spi = Spi::new_blocking(spi, sck, mosi, miso, config);
        // DFF may only change while SPE is off (RM0090 section 28.5.1).
        pac::SPI1.cr1().modify(|w| w.set_spe(false));
        pac::SPI1.cr1().modify(|w| w.set_dff(Dff::BITS16));
        pac::SPI1.cr1().modify(|w| w.set_spe(true));
        pac::SPI1.cr2().modify(|w| w.set_rxneie(true));
        // SAFETY: sets a bit that only adds wake-up events. The executor's thread loop polls its tasks after any event,
        // and nobody else touches SCR.
        unsafe { (*SCB::PTR).scr.modify(|scr| scr | SEVONPEND) };
        GyroBus { _spi: spi }
    }

    fn exchange(&mut self, word: u16) -> Result<u16, ErrorKind> {
        // Whatever an abandoned wait left behind. Only an interrupt that was not pending becomes an event, so it is taken
        // back here, after a read of SR, and not right after the word's: RXNE takes a moment to reach the NVIC.
        if pac::SPI1.sr().read().rxne() {
            let _ = pac::SPI1.dr().read();
        }
        NVIC::unpend(interrupt::SPI1);
        pac::SPI1.dr().write(|w| w.set_dr(word));
        let is_there = || pac::SPI1.sr().read().rxne();
        let asleep = |_| {
            let there = is_there();
            if !there {
                asm::wfe();
            }
            there
        };
        let there = (0..SLEEPS).any(asleep) || (0..READS).any(|_| is_there());
        let answer = pac::SPI1.dr().read().dr();
        if there { Ok(answer) } else { Err(ErrorKind::Other) }
    }
}

/// SCR.SEVONPEND (ARMv7-M ARM, B3.2.7).
const SEVONPEND: u32 = 1 << 4;

impl ErrorType for GyroBus {
    type Error = ErrorKind;
}

/// Words are waited for in place: each of these is over when it returns.
impl SpiBus<u16> for GyroBus {
    fn read(&mut self, words: &mut [u16]) -> impl Future<Output = Result<(), ErrorKind>> {
        words.fill(0);
        self.transfer_in_place(words)
    }

    fn write(&mut self, words: &[u16]) -> impl Future<Output = Result<(), ErrorKind>> {
        over(words.iter().try_for_each(|word| self.exchange(*word).map(|_| ())))
    }

    fn transfer(&mut self, read: &mut [u16], write: &[u16]) -> impl Future<Output = Result<(), ErrorKind>> {
        let longer = read.len().max(write.len());
        over((0..longer).try_for_each(|index| {
            let answer = self.exchange(write.get(index).copied().unwrap_or(0))?;
            if let Some(word) = read.get_mut(index) {
                *word = answer;
            }
            Ok(())
        }))
    }

    fn transfer_in_place(&mut self, words: &mut [u16]) -> impl Future<Output = Result<(), ErrorKind>> {
        over(words.iter_mut().try_for_each(|word| {
            *word = self.exchange(*word)?;
            Ok(())
        }))
    }

    fn flush(&mut self) -> impl Future<Output = Result<(), ErrorKind>> {
        // The sleeps above may have taken an event that was the executor's: give it back, or a woken task sleeps on.
        asm::sev();
        let idle = (0..READS).any(|_| !pac::SPI1.sr().read().bsy());
        over(if idle { Ok(()) } else { Err(ErrorKind::Other) })
    }
}
