//! The stand: an STM32F427 in place of the F407, wired as the board file wires it, with two model defects covered.
//!
//! In: a plant. Out: a rigless board whose firmware sees sensors, lines and discretes. See `wires` and `chips` for
//! what hangs where.
//!
//! Both covers act in [`Mcu::split`], which rigless asks for every access and event of a peripheral, so they see the
//! registers just before the model does. A test switches each off and shows what goes wrong.

use std::num::{NonZeroU32, NonZeroU64};

use rigless::{
    device::{ErasedDevice, Level, RegisterFile, ResetCause},
    machine::{Board, Target, armv7m},
    mcu::{Mcu, Operate},
    snapshot::Store,
    soc::{
        Bus, Error,
        stm32f427::{
            Stm32f427,
            generated::{self, dma2, i2c3, tim5},
            peripherals::{
                gpio::{Gpio, Pin},
                i2c::I2c,
                rcc,
                spi::Select,
            },
        },
    },
    time::VirtualNanos,
};

use crate::{
    chips::{Gyro, Line, SensorBus, SharedPlant},
    wires::{BusPins, DiscretePins, SensorPort},
};

/// Virtual instructions a second: one a cycle at 168 MHz.
pub const INSTRUCTIONS_PER_SECOND: u64 = 168_000_000;
/// The crystal of the reference design.
const HSE_HZ: u64 = 8_000_000;
const NAME: &str = "emems";
/// Index of USART2 in the part's serial ports: telemetry.
const TELEMETRY: usize = 1;
/// Index of USART3: the umbilical.
const UMBILICAL: usize = 2;
/// `DR` of I2C1 (RM0090 table 1 and 27.6.5), by which a DMA stream is known to serve it.
const I2C1_DR: u64 = 0x4000_5410;

/// Which of the emulator's two defects are covered. Both are by default; a run without one is wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Covers {
    /// rigless stores `I2C_CR2.LAST` and does not act on it (its i2c.rs says so): the controller clocks one byte too
    /// many, and every later DMA read is shifted by one byte.
    pub i2c_last: bool,
    /// rigless raises `CC1IF` to `CC4IF` when `EGR.UG` reinitialises a stopped timer whose compare registers are 0;
    /// embassy's time driver then counts half a period (32768 ticks) that did not happen.
    pub timer_update: bool,
}

impl Default for Covers {
    fn default() -> Self {
        Covers {
            i2c_last: true,
            timer_update: true,
        }
    }
}

/// The slots of the peripherals the stand answers for or watches.
#[derive(Clone, Copy, Debug)]
struct Slots {
    i2c1: usize,
    gpio_b: usize,
    gpio_c: usize,
    dma1: usize,
    tim5: usize,
    rcc: usize,
}

/// The microcontroller with the stand's own models in three of its slots.
#[derive(Debug)]
pub struct Wired {
    part: Stm32f427,
    sensor_port: SensorPort,
    bus_pins: BusPins,
    discrete_pins: DiscretePins,
    slots: Slots,
    covers: Covers,
    crystal: bool,
}

impl Wired {
    fn new(plant: SharedPlant, covers: Covers) -> Result<Self, Error> {
        let mut part = Stm32f427::new()?;
        part.rcc.attach_crystals(HSE_HZ, 0);
        part.set_supply(3300);
        for plate in 0..4_u8 {
            let gyro = Gyro {
                plant: plant.clone(),
                plate: usize::from(plate),
            };
            if let Some(pin) = Pin::new(plate) {
                let select = Select {
                    port: "GPIOC",
                    pin,
                    active: Level::Low,
                };
                part.spi[0].attach_selected(gyro, select);
            }
        }
        part.usart[TELEMETRY].attach(Line::default());
        part.usart[UMBILICAL].attach(Line::default());
        let mut i2c = I2c::with_clock(rcc::HSI_HZ);
        i2c.attach(SensorBus(plant.clone()));
        let bus = part.bus();
        let slots = Slots {
            i2c1: bus.slot("I2C1")?,
            gpio_b: bus.slot("GPIOB")?,
            gpio_c: bus.slot("GPIOC")?,
            dma1: bus.slot("DMA1")?,
            tim5: bus.slot("TIM5")?,
            rcc: bus.slot("RCC")?,
        };
        Ok(Wired {
            part,
            sensor_port: SensorPort::new(i2c, plant.clone()),
            bus_pins: BusPins::new(plant.clone()),
            discrete_pins: DiscretePins {
                gpio: Gpio::default(),
                plant,
            },
            slots,
            covers,
            crystal: true,
        })
    }

    /// The far end of the telemetry line.
    pub fn telemetry(&mut self) -> Option<&mut Line> {
        self.part.usart[TELEMETRY].chip_mut()
    }

    /// The far end of the umbilical.
    pub fn umbilical(&mut self) -> Option<&mut Line> {
        self.part.usart[UMBILICAL].chip_mut()
    }

    /// How many in a million of the bytes towards the unit arrive with a framing error. Which ones is drawn by rigless
    /// from the byte's number, so it is the same in every run.
    pub fn garble_umbilical(&mut self, per_million: u32) {
        let errors = self.part.usart[UMBILICAL].errors_mut();
        errors.framing.name = "umbilical framing";
        errors.framing.per_million = per_million;
    }

    /// Takes the high-speed crystal off the board.
    pub fn remove_crystal(&mut self) {
        self.part.rcc.attach_crystals(0, 0);
        self.crystal = false;
    }

    /// The model lets HSERDY rise whether or not there is a crystal, so it is kept down.
    fn keep_hse_from_starting(&mut self) {
        let registers = self.part.bus_mut().slot_mut(self.slots.rcc).registers_mut();
        let control = registers.get(generated::rcc::Register::Cr);
        registers.set(generated::rcc::Register::Cr, generated::rcc::cr::HSERDY.set(control, 0));
    }

    fn one_byte_is_left(&self) -> bool {
        let slots = self.part.bus().slots();
        let control = slots[self.slots.i2c1].registers().get(i2c3::Register::Cr2);
        i2c3::cr2::LAST.is_set(control)
            && i2c3::cr2::DMAEN.is_set(control)
            && STREAMS
                .iter()
                .any(|stream| stream.serves_last_byte(slots[self.slots.dma1].registers()))
    }

    fn forget_spurious_matches(&mut self) {
        let registers = self.part.bus_mut().slot_mut(self.slots.tim5).registers_mut();
        if !tim5::cr1::CEN.is_set(registers.get(tim5::Register::Cr1)) {
            // CC1IF to CC4IF, RM0090 18.4.5.
            let status = registers.get(tim5::Register::Sr) & !0b1_1110;
            registers.set(tim5::Register::Sr, status);
        }
    }
}

/// The registers of one stream of a DMA controller.
struct Stream {
    control: dma2::Register,
    count: dma2::Register,
    peripheral: dma2::Register,
}

impl Stream {
    fn serves_last_byte(&self, registers: &RegisterFile) -> bool {
        // S0CR.EN is bit 0 of every stream's control register, RM0090 10.5.5.
        registers.get(self.control) & 1 == 1
            && registers.get(self.peripheral) == I2C1_DR
            && registers.get(self.count) == 1
    }
}

/// The two streams a request of I2C1_RX can reach, RM0090 table 42: 0 and 5 of DMA1, channel 1.
const STREAMS: [Stream; 2] = [
    Stream {
        control: dma2::Register::S0cr,
        count: dma2::Register::S0ndtr,
        peripheral: dma2::Register::S0par,
    },
    Stream {
        control: dma2::Register::S5cr,
        count: dma2::Register::S5ndtr,
        peripheral: dma2::Register::S5par,
    },
];

impl Mcu for Wired {
    fn bus(&self) -> &Bus {
        self.part.bus()
    }

    fn bus_mut(&mut self) -> &mut Bus {
        self.part.bus_mut()
    }

    fn reset(&mut self, at: VirtualNanos, cause: ResetCause) {
        self.part.reset(at, cause);
        let mut i2c = I2c::with_clock(rcc::HSI_HZ);
        i2c.inherit(&mut self.sensor_port.i2c);
        self.sensor_port.i2c = i2c;
        self.bus_pins = BusPins::new(self.bus_pins.plant.clone());
        self.discrete_pins.gpio = Gpio::default();
    }

    fn poll(&mut self, now: VirtualNanos) {
        self.part.poll(now);
    }

    fn split(&mut self, slot: usize) -> (&mut Bus, Option<&mut dyn ErasedDevice>) {
        if slot == self.slots.i2c1 {
            self.sensor_port.nack_next = self.covers.i2c_last && self.one_byte_is_left();
        } else if slot == self.slots.tim5 && self.covers.timer_update {
            self.forget_spurious_matches();
        } else if slot == self.slots.rcc && !self.crystal {
            self.keep_hse_from_starting();
        }
        let (bus, model) = self.part.split(slot);
        let model = if slot == self.slots.i2c1 {
            Some(&mut self.sensor_port as &mut dyn ErasedDevice)
        } else if slot == self.slots.gpio_b {
            Some(&mut self.bus_pins as &mut dyn ErasedDevice)
        } else if slot == self.slots.gpio_c {
            Some(&mut self.discrete_pins as &mut dyn ErasedDevice)
        } else {
            model
        };
        (bus, model)
    }
}

/// The board as rigless runs it.
#[derive(Debug)]
pub struct Stand {
    /// The microcontroller and what hangs on it.
    pub mcu: Wired,
}

impl Stand {
    /// A stand around `plant`, fresh out of power-on.
    ///
    /// # Errors
    ///
    /// Only if rigless' own description of the part is inconsistent.
    pub fn new(plant: SharedPlant, covers: Covers) -> Result<Self, Error> {
        let mut mcu = Wired::new(plant, covers)?;
        // Every slot answers with a model of the slot's own register layout.
        mcu.check()?;
        Ok(Stand { mcu })
    }
}

// Nothing of a stand can be kept in a rigless snapshot: every run starts from power-on.
impl Store for Stand {}

impl Board for Stand {
    fn name(&self) -> &'static str {
        NAME
    }

    fn target_names(&self) -> Vec<&'static str> {
        vec![NAME]
    }

    fn mcu(&mut self, target: usize) -> Option<&mut dyn Mcu> {
        (target == 0).then_some(&mut self.mcu)
    }

    fn targets(&mut self) -> Vec<Target<'_>> {
        const HZ: NonZeroU64 = NonZeroU64::new(INSTRUCTIONS_PER_SECOND).expect("not zero");
        const REFCLK_DIVIDER: NonZeroU32 = NonZeroU32::new(8).expect("not zero");
        let lines = NonZeroU32::new(u32::from(self.mcu.cpu().interrupt_lines)).unwrap_or(NonZeroU32::MIN);
        let core = armv7m::Core {
            variant: armv7m::Variant::M4,
            clock_hz: HZ,
            interrupt_lines: lines,
            priority_bits: 4,
            refclk_divider: REFCLK_DIVIDER,
            instructions_per_second: HZ,
            boot: "flash",
        }
        .spec_with_parts(
            &rigless::cpu::armv7m::windows(self.mcu.bus()),
            armv7m::Fpu::FpV4Sp,
            armv7m::MpuRegions::Eight,
        );
        vec![Target::new(NAME, &mut self.mcu, core)]
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use rigless::soc::Width;
    use twin::{motion, plant::Plant};

    use super::*;

    const NOW: VirtualNanos = VirtualNanos(1_000);
    const RCC_APB1ENR: u64 = 0x4002_3840;
    const TIM5_EGR: u64 = 0x4000_0C14;
    const TIM5_SR: u64 = 0x4000_0C10;
    /// CC1IF to CC4IF.
    const MATCHES: u64 = 0x1E;

    fn matches_after_update(covers: Covers) -> u64 {
        let still = motion::by_name("still").expect("the twin has it");
        let plant = SharedPlant::new(Plant::ideal(Arc::from(still)));
        let mut mcu = Stand::new(plant, covers).expect("rigless' own description").mcu;
        for (address, value) in [(RCC_APB1ENR, 1 << 3), (TIM5_EGR, 1)] {
            mcu.write(NOW, address, Width::W32, value)
                .expect("a register of the part");
        }
        mcu.read(NOW, TIM5_SR, Width::W32).expect("a register of the part") & MATCHES
    }

    #[test]
    fn a_stopped_timer_that_is_updated_has_matched_nothing() {
        assert_eq!(matches_after_update(Covers::default()), 0);
    }

    #[test]
    fn without_the_cover_it_has_matched_all_four() {
        let bare = Covers {
            timer_update: false,
            ..Covers::default()
        };
        assert_eq!(matches_after_update(bare), MATCHES);
    }
}
