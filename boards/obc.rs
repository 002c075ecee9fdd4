//! The reference on-board computer: an STM32F407VG (LQFP100) with an 8 MHz crystal. The theses name no wiring; this is it.
//!
//! | Signal | Pin | Remark |
//! |---|---|---|
//! | sensor bus SCL, SDA | PB6, PB7 | I2C1, 2.2 kOhm to 3.3 V |
//! | TCA9548A RESET# | PB5 | 10 kOhm to 3.3 V |
//! | gyros SCLK, DOUT, DIN | PA5, PA6, PA7 | SPI1 |
//! | gyro CS# of plates 1 to 4 | PC0, PC1, PC2, PC3 | 10 kOhm to 3.3 V each: deselected while the MCU is in reset |
//! | telemetry out | PA2 | USART2 |
//! | umbilical out, in | PB10, PB11 | USART3 |
//! | Lift_Off# | PC6 | closed to ground by the vehicle, internal pull-up |
//! | Micro_G# | PC7 | closed to ground by the vehicle, internal pull-up |
//! | NAND D0 to D7 | PD14, PD15, PD0, PD1, PE7, PE8, PE9, PE10 | FSMC bank 2 |
//! | NAND RE#, WE#, R/B#, CE# | PD4, PD5, PD6, PD7 | FSMC NOE, NWE, NCE2; R/B# is left to the status register |
//! | NAND CLE, ALE | PD11, PD12 | FSMC A16, A17 |
//! | NAND WP# | PC8 | 10 kOhm to ground: protected while the MCU is in reset |
//! | crystal | PH0, PH1 | 8 MHz |
//! | debug | PA13, PA14 | SWD; defmt over RTT |

mod stm32f407;

use embassy_stm32::peripherals::{PB6, PB7};
use emems::board::Parts;

use self::stm32f407::{
    NandPort, ResetSafeRam, SensorBus, Started, Stm32f407, VehicleInputs, VoltageDetector, gyros, read_image,
    stack_use, start, telemetry, umbilical,
};

/// The types of this board.
pub type Obc = Stm32f407<PB6, PB7>;

/// Starts the chip and hands out its parts.
pub fn init() -> Parts<Obc> {
    let Started {
        peripherals: p,
        watchdog,
        reset,
        oscillator,
        options,
    } = start();
    let (umbilical_tx, umbilical_rx) = umbilical(p.USART3, p.PB10, p.PB11, p.DMA1_CH3);
    Parts {
        sensor_bus: SensorBus::new(p.I2C1, p.PB6, p.PB7, p.DMA1_CH7, p.DMA1_CH0, p.PB5),
        gyros: gyros(
            p.SPI1,
            p.PA5,
            p.PA6,
            p.PA7,
            [p.PC0.into(), p.PC1.into(), p.PC2.into(), p.PC3.into()],
        ),
        telemetry: telemetry(p.USART2, p.PA2, p.DMA1_CH6),
        umbilical_tx,
        umbilical_rx,
        discretes: VehicleInputs::new(p.PC6, p.PC7),
        watchdog,
        retained: ResetSafeRam::new(),
        nand: NandPort::new(
            [
                p.PD14.into(),
                p.PD15.into(),
                p.PD0.into(),
                p.PD1.into(),
                p.PE7.into(),
                p.PE8.into(),
                p.PE9.into(),
                p.PE10.into(),
                p.PD4.into(),
                p.PD5.into(),
                p.PD7.into(),
                p.PD11.into(),
                p.PD12.into(),
            ],
            p.PC8.into(),
        ),
        reset,
        oscillator,
        options,
        supply: VoltageDetector::new(),
        stack_use,
        read_image,
    }
}
