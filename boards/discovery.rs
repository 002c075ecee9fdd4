//! The STM32F4DISCOVERY (UM1472; also STM32F407G-DISC1): the same unit on a bench board, proof that a board is one file.
//!
//! | Signal | Pin | Remark |
//! |---|---|---|
//! | sensor bus SCL, SDA | PB8, PB7 | I2C1; 2.2 kOhm to 3 V outside. PB6 and PB9 go to the audio codec |
//! | TCA9548A RESET# | PE11 | |
//! | gyros SCLK, DOUT, DIN | PB3, PB4, PB5 | SPI1. PB3 is also SWO, which RTT has no use for |
//! | gyro CS# of plates 1 to 4 | PE7, PE8, PE9, PE10 | |
//! | telemetry out | PA2 | USART2 |
//! | umbilical out, in | PD8, PD9 | USART3. PB10 goes to the microphone |
//! | Lift_Off# | PE12 | to ground, internal pull-up |
//! | Micro_G# | PE13 | to ground, internal pull-up |
//!
//! Everything else on the board is left alone: LIS302DL (PA5 to PA7, PE0, PE1, PE3), CS43L22 (PA4, PB6, PB9, PC7,
//! PC10, PC12, PD4), MP45DT02 (PB10, PC3), LEDs (PD12 to PD15), button (PA0), USB (PA9 to PA12, PC0, PD5). SPI1's
//! other pins are the LIS302DL's, which takes them for I2C while its own chip select is high: hence PB3 to PB5.
//! There is no NAND: nothing is recorded, and the console says so.

mod stm32f407;

use embassy_stm32::peripherals::{PB7, PB8};
use emems::board::Parts;

use self::stm32f407::{
    NandPort, ResetSafeRam, SensorBus, Started, Stm32f407, VehicleInputs, VoltageDetector, gyros, read_image,
    stack_use, start, telemetry, umbilical,
};

/// The types of this board.
pub type Discovery = Stm32f407<PB8, PB7>;

/// Starts the chip and hands out its parts.
pub fn init() -> Parts<Discovery> {
    let Started {
        peripherals: p,
        watchdog,
        reset,
        oscillator,
        options,
    } = start();
    let (umbilical_tx, umbilical_rx) = umbilical(p.USART3, p.PD8, p.PD9, p.DMA1_CH3);
    Parts {
        sensor_bus: SensorBus::new(p.I2C1, p.PB8, p.PB7, p.DMA1_CH7, p.DMA1_CH0, p.PE11),
        gyros: gyros(
            p.SPI1,
            p.PB3,
            p.PB4,
            p.PB5,
            [p.PE7.into(), p.PE8.into(), p.PE9.into(), p.PE10.into()],
        ),
        telemetry: telemetry(p.USART2, p.PA2, p.DMA1_CH6),
        umbilical_tx,
        umbilical_rx,
        discretes: VehicleInputs::new(p.PE12, p.PE13),
        watchdog,
        retained: ResetSafeRam::new(),
        nand: NandPort::absent(),
        reset,
        oscillator,
        options,
        supply: VoltageDetector::new(),
        stack_use,
        read_image,
    }
}
