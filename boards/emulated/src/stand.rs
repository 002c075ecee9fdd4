//! The stand: an STM32F427 in place of the F407, wired as the board file wires it, with the emulator's defects covered.
//!
//! In: a plant. Out: a rigless board whose firmware sees sensors, lines and discretes. See `wires` and `chips` for
//! what hangs where.
//!
//! The covers act in [`Mcu::split`], which rigless asks for every access and event of a peripheral, so they see the
//! registers just before the model does.

use std::num::{NonZeroU32, NonZeroU64};

use emems::board::OptionBytes;
use rigless::{
    chip::uart::Rate,
    device::{ErasedDevice, Level, ResetCause},
    machine::{Board, Target, armv7m},
    mcu::{self, Mcu, Operate},
    snapshot::Store,
    soc::{
        Bus, Error, Gate, Window,
        stm32f427::{
            Stm32f427,
            generated::{
                dma2, exti, flash,
                rcc::{Register, cr, csr},
            },
            peripherals::{gpio::Pin, i2c::I2c, rcc, spi::Select},
        },
    },
    time::VirtualNanos,
};

use crate::{
    chips::{Gyro, Line, Nand, SensorBus, SharedPlant},
    covers::{self, Covers},
    wires::{BusPins, PortC, SensorPort},
};

/// Virtual instructions a second: one a cycle at 168 MHz.
pub const INSTRUCTIONS_PER_SECOND: u64 = 168_000_000;
/// The crystal of the reference design.
const HSE_HZ: u64 = 8_000_000;
/// \[mV\] the supply, and where it sags to: below the voltage detector's 2.9 V, above the reset's 1.8 V.
const SUPPLY_MV: u32 = 3300;
const SAGGING_MV: u32 = 2800;
/// EXTI line of the voltage detector (RM0090 section 12.2.5).
const VOLTAGE_DETECTOR: u32 = 16;
const NAME: &str = "emems";
/// Index of USART2 in the part's serial ports: telemetry.
const TELEMETRY: usize = 1;
/// Index of USART3: the umbilical.
const UMBILICAL: usize = 2;

/// Where the FSMC's bank 2 answers once PCR2.PBKEN is set (RM0090 section 36.4.2).
const NAND_WINDOW: Window = Window::new("NAND2", 0x7000_0000, NonZeroU64::new(1 << 28).expect("not zero"))
    .gated(Gate::by("FMC", "PCR2", "PBKEN"));

/// The slots of the peripherals the stand answers for or watches.
#[derive(Clone, Copy, Debug)]
struct Slots {
    i2c1: usize,
    gpio_b: usize,
    gpio_c: usize,
    dma1: usize,
    tim5: usize,
    rcc: usize,
    exti: usize,
    flash: usize,
}

/// The microcontroller with the stand's own models in three of its slots.
#[derive(Debug)]
pub struct Wired {
    /// The part, with the recorder's memory in a window of its FSMC.
    part: mcu::Wired<Stm32f427, Nand>,
    sensor_port: SensorPort,
    bus_pins: BusPins,
    port_c: PortC,
    slots: Slots,
    covers: Covers,
    crystal: bool,
    dma_hung: bool,
    /// The reset to come is one of switching on.
    power_cut: bool,
    /// What the option bytes say; the model's register forgets it in a reset.
    options: OptionBytes,
}

impl Wired {
    fn new(plant: SharedPlant, covers: Covers) -> Result<Self, Error> {
        let mut part = Stm32f427::new()?;
        part.rcc.attach_crystals(HSE_HZ, 0);
        part.set_supply(SUPPLY_MV);
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
        let part = mcu::Wired::new(part, NAND_WINDOW, Nand(plant.clone()))?;
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
            exti: bus.slot("EXTI")?,
            flash: bus.slot("FLASH")?,
        };
        Ok(Wired {
            part,
            sensor_port: SensorPort::new(i2c, plant.clone()),
            bus_pins: BusPins::new(plant.clone()),
            port_c: PortC::new(plant),
            slots,
            covers,
            crystal: true,
            dma_hung: false,
            power_cut: false,
            options: OptionBytes::default(),
        })
    }

    /// The far end of the telemetry line.
    pub fn telemetry(&mut self) -> Option<&mut Line> {
        self.part.part.usart[TELEMETRY].chip_mut()
    }

    /// The far end of the umbilical.
    pub fn umbilical(&mut self) -> Option<&mut Line> {
        self.part.part.usart[UMBILICAL].chip_mut()
    }

    /// How many in a million of the bytes towards the unit arrive with a framing error. Which ones is drawn by rigless
    /// from the byte's number, so it is the same in every run.
    pub fn garble_umbilical(&mut self, per_million: u32) {
        let errors = self.part.part.usart[UMBILICAL].errors_mut();
        errors.framing.name = "umbilical framing";
        errors.framing.per_million = per_million;
    }

    /// Every byte towards the unit arrives with noise on it, or no longer.
    pub fn disturb_umbilical(&mut self, disturbed: bool) {
        let errors = self.part.part.usart[UMBILICAL].errors_mut();
        errors.noise.name = "umbilical noise";
        errors.noise.per_million = if disturbed { Rate::EVERY_WORD } else { 0 };
    }

    /// Takes the high-speed crystal off the board. Whether a running firmware has it is seen at its next start: the model's clock does
    /// not follow, and the NMI of the clock security system (RM0090 section 7.2.7) cannot be raised in it.
    pub fn remove_crystal(&mut self) {
        self.part.part.rcc.attach_crystals(0, 0);
        self.crystal = false;
    }

    /// DMA1 stands still in mid-transfer until the next reset.
    pub fn hang_dma(&mut self) {
        self.dma_hung = true;
    }

    /// The next reset is one of switching on, by its flags, with the supply as it should be.
    pub fn cut_power(&mut self) {
        let _ = self.sag(false);
        self.power_cut = true;
    }

    /// The supply sags below what the voltage detector watches for, or is back; whether that is an interrupt. The model has no
    /// EXTI: its registers only keep what the firmware wrote.
    pub fn sag(&mut self, sagging: bool) -> bool {
        self.part.part.set_supply(if sagging { SAGGING_MV } else { SUPPLY_MV });
        let registers = self.part.bus_mut().slot_mut(self.slots.exti).registers_mut();
        let unmasked = registers.get(exti::Register::Imr) & registers.get(exti::Register::Rtsr);
        sagging && unmasked >> VOLTAGE_DETECTOR & 1 == 1
    }

    /// Sets the option bytes: BOR_LEV and RDP (RM0090 section 3.9.10).
    pub fn set_option_bytes(&mut self, options: OptionBytes) {
        self.options = options;
        let level = match options.brown_out.set_mv {
            2700.. => 0b00,
            2400.. => 0b01,
            2100.. => 0b10,
            _ => 0b11,
        };
        let protection = match options.read_out {
            0 => 0xAA,
            2 => 0xCC,
            _ => 0xBB,
        };
        let registers = self.part.bus_mut().slot_mut(self.slots.flash).registers_mut();
        let value = flash::optcr::BOR_LEV.set(registers.get(flash::Register::Optcr), level);
        registers.set(flash::Register::Optcr, flash::optcr::RDP.set(value, protection));
    }

    /// EN of a stream stays set until the item under way is through (RM0090 section 10.3.17), and here it never is.
    fn keep_dma_from_stopping(&mut self) {
        let registers = self.part.bus_mut().slot_mut(self.slots.dma1).registers_mut();
        for control in [dma2::Register::S0cr, dma2::Register::S7cr] {
            let value = registers.get(control);
            registers.set(control, dma2::s0cr::EN.set(value, 1));
        }
    }

    /// The model lets HSERDY rise whether or not there is a crystal, so it is kept down.
    fn keep_hse_from_starting(&mut self) {
        let registers = self.part.bus_mut().slot_mut(self.slots.rcc).registers_mut();
        let control = registers.get(Register::Cr);
        registers.set(Register::Cr, cr::HSERDY.set(control, 0));
    }
}

impl Mcu for Wired {
    fn bus(&self) -> &Bus {
        self.part.bus()
    }

    fn bus_mut(&mut self) -> &mut Bus {
        self.part.bus_mut()
    }

    fn reset(&mut self, at: VirtualNanos, cause: ResetCause) {
        self.part.reset(at, cause);
        self.set_option_bytes(self.options);
        self.dma_hung = false;
        self.sensor_port.plant.lock().controller_reset();
        let mut i2c = I2c::with_clock(rcc::HSI_HZ);
        i2c.inherit(&mut self.sensor_port.i2c);
        self.sensor_port = SensorPort::new(i2c, self.sensor_port.plant.clone());
        self.bus_pins = BusPins::new(self.bus_pins.plant.clone());
        self.port_c = PortC::new(self.port_c.plant.clone());
        // Its pull-down has the pin that the processor has let go.
        self.port_c.plant.lock().nand.protect(true, at.0);
        if std::mem::take(&mut self.power_cut) {
            // RM0090 section 7.3.21: the flags that switching on leaves. The model knows no such reset.
            let registers = self.part.bus_mut().slot_mut(self.slots.rcc).registers_mut();
            let flags = [csr::BORRSTF, csr::PADRSTF, csr::PORRSTF];
            let value = (flags.into_iter()).fold(registers.get(Register::Csr), |value, flag| flag.set(value, 1));
            registers.set(Register::Csr, value);
        }
    }

    fn poll(&mut self, now: VirtualNanos) {
        self.part.poll(now);
    }

    fn split(&mut self, slot: usize) -> (&mut Bus, Option<&mut dyn ErasedDevice>) {
        if slot == self.slots.i2c1 {
            self.sensor_port.nack_next = self.covers.i2c_last && {
                let slots = self.part.bus().slots();
                covers::one_byte_is_left(slots[slot].registers(), slots[self.slots.dma1].registers())
            };
        } else if slot == self.slots.tim5 && self.covers.timer_update {
            covers::forget_spurious_matches(self.part.bus_mut().slot_mut(slot).registers_mut());
        } else if slot == self.slots.rcc && !self.crystal {
            self.keep_hse_from_starting();
        } else if slot == self.slots.dma1 && self.dma_hung {
            self.keep_dma_from_stopping();
            return (self.part.bus_mut(), None);
        }
        let (bus, model) = self.part.split(slot);
        let model = if slot == self.slots.i2c1 {
            Some(&mut self.sensor_port as &mut dyn ErasedDevice)
        } else if slot == self.slots.gpio_b {
            Some(&mut self.bus_pins as &mut dyn ErasedDevice)
        } else if slot == self.slots.gpio_c {
            Some(&mut self.port_c as &mut dyn ErasedDevice)
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
