//! 168 MHz from the 8 MHz crystal, or from the internal oscillator if the crystal does not start.
//!
//! Out: SYSCLK 168 MHz, AHB 168, APB1 42, APB2 84 MHz either way; flash caches on. From the crystal, time is as good
//! as the crystal. From the HSI it is off by up to 1 % at 25 degC and 8 % over temperature (STM32F407 datasheet, table
//! "HSI oscillator characteristics"): the unit flies on, log, status and derived frames say so, and times and baud rates
//! carry that error.
//!
//! A crystal that stops in flight raises the clock security system's NMI (RM0090 section 7.2.7). It has no handler of
//! its own: it ends in a crash record and a reset, after which the crystal does not start and the HSI takes over.

use embassy_stm32::pac::{FLASH, RCC};
use embassy_stm32::rcc::{
    AHBPrescaler, APBPrescaler, Hse, HseMode, Pll, PllMul, PllPDiv, PllPreDiv, PllQDiv, PllSource, Sysclk,
};
use embassy_stm32::time::Hertz;
use embassy_stm32::{Config, Peripherals};
use emems::board::{BrownOut, OptionBytes, Oscillator};

/// Reads of RCC_CR until the crystal is given up: at least four cycles of the 16 MHz HSI each, so at least 100 ms, as
/// long as ST's own start-up code waits. A healthy crystal needs 2 ms (STM32F407 datasheet, tSU(HSE)).
const HSE_READS: u32 = 400_000;

/// \[mV\] what every board with this chip asks of the brown-out reset: level 3, the highest, because at 168 MHz with five wait
/// states the chip needs 2.7 V (RM0090 table 10). The factory leaves it off; a programmer sets it (BOR_LEV = 00).
const BROWN_OUT_MV: u16 = 2700;

/// What the option bytes say: of the brown-out reset the lower end of its level's range (RM0090 section 3.6.1, BOR_LEV), and of the
/// read-out protection its level (section 3.6.3, RDP).
pub fn option_bytes() -> OptionBytes {
    let options = FLASH.optcr().read();
    OptionBytes {
        brown_out: BrownOut {
            set_mv: match options.bor_lev() {
                0b00 => 2700,
                0b01 => 2400,
                0b10 => 2100,
                _ => 0,
            },
            asked_mv: BROWN_OUT_MV,
        },
        read_out: match options.rdp() {
            0xAA => 0,
            0xCC => 2,
            _ => 1,
        },
    }
}

/// Starts the clocks and says what they come from. The HAL would wait for a dead crystal for ever, so the crystal is tried before
/// it is asked to.
pub fn start() -> (Peripherals, Oscillator) {
    let crystal = hse_starts();
    let mut config = Config::default();
    let (source, prediv) = if crystal {
        (PllSource::HSE, PllPreDiv::DIV4)
    } else {
        (PllSource::HSI, PllPreDiv::DIV8)
    };
    config.rcc.hse = crystal.then_some(Hse {
        freq: Hertz::mhz(8),
        mode: HseMode::Oscillator,
    });
    config.rcc.pll_src = source;
    // 2 MHz * 168 = 336 MHz (RM0090 section 7.3.2: 2 MHz at the input keeps the jitter low); / 2 = 168 MHz, / 7 = 48 MHz.
    config.rcc.pll = Some(Pll {
        prediv,
        mul: PllMul::MUL168,
        divp: Some(PllPDiv::DIV2),
        divq: Some(PllQDiv::DIV7),
        divr: None,
    });
    config.rcc.sys = Sysclk::PLL1_P;
    config.rcc.ahb_pre = AHBPrescaler::DIV1;
    config.rcc.apb1_pre = APBPrescaler::DIV4;
    config.rcc.apb2_pre = APBPrescaler::DIV2;
    let peripherals = embassy_stm32::init(config);

    // The HAL writes the wait states over the cache bits, and flash at 168 MHz without its caches is five waits a fetch
    // (RM0090 section 3.5.2). The prefetch buffer stays off: revision A of the chip has it broken (errata ES0182).
    FLASH.acr().modify(|w| {
        w.set_icen(true);
        w.set_dcen(true);
    });
    if !crystal {
        defmt::warn!("the 8 MHz crystal did not start: running from the HSI, times are off by up to 8 %");
        return (peripherals, Oscillator::Internal);
    }
    RCC.cr().modify(|w| w.set_csson(true));
    (peripherals, Oscillator::Crystal)
}

fn hse_starts() -> bool {
    RCC.cr().modify(|w| w.set_hseon(true));
    let ready = (0..HSE_READS).any(|_| RCC.cr().read().hserdy());
    if !ready {
        RCC.cr().modify(|w| w.set_hseon(false));
    }
    ready
}
