//! The board's pins as the firmware's accesses find them, without a core.

use std::sync::Arc;

use rigless::{mcu::Operate, soc::Width, time::VirtualNanos};
use twin::{motion, plant::Plant, run::Fault};

use crate::{chips::SharedPlant, covers::Covers, stand::Stand};

const GPIOB: u64 = 0x4002_0400;
const GPIOC: u64 = 0x4002_0800;
const I2C1: u64 = 0x4000_5400;
const MODER: u64 = 0x00;
const OTYPER: u64 = 0x04;
const IDR: u64 = 0x10;
const BSRR: u64 = 0x18;
const CR1: u64 = 0x00;
const SR1: u64 = 0x14;
const SR2: u64 = 0x18;
/// CR1.PE and CR1.START.
const START: u64 = 0x101;
const BUSY: u64 = 0b10;
const SB: u64 = 0b01;

struct Pins {
    stand: Stand,
    plant: SharedPlant,
    now: u64,
}

impl Pins {
    fn new(motion: &str) -> Self {
        let source = motion::by_name(motion).expect("the twin has it");
        let plant = SharedPlant::new(Plant::ideal(Arc::from(source)));
        let stand = Stand::new(plant.clone(), Covers::default()).expect("rigless' own description");
        let mut pins = Pins {
            stand,
            plant,
            now: 1_000,
        };
        // RCC_AHB1ENR: ports B and C; RCC_APB1ENR: I2C1.
        pins.write(0x4002_3830, 0b110);
        pins.write(0x4002_3840, 1 << 21);
        // PB5 to PB7 outputs, PB6 and PB7 open drain, all high.
        pins.write(GPIOB + BSRR, 0xE0);
        pins.write(GPIOB + OTYPER, 0xC0);
        pins.write(GPIOB + MODER, 0b01_01_01 << 10);
        pins
    }

    fn write(&mut self, address: u64, value: u64) {
        let at = VirtualNanos(self.now);
        self.stand
            .mcu
            .write(at, address, Width::W32, value)
            .expect("a register of the part");
    }

    fn read(&mut self, address: u64) -> u64 {
        let at = VirtualNanos(self.now);
        self.stand
            .mcu
            .read(at, address, Width::W32)
            .expect("a register of the part")
    }

    fn strike(&mut self, fault: Fault) {
        self.plant.lock().apply(fault, self.now);
    }

    fn sda(&mut self) -> bool {
        self.read(GPIOB + IDR) >> 7 & 1 == 1
    }

    fn pulse(&mut self, pin: u32) {
        self.write(GPIOB + BSRR, 1 << (16 + pin));
        self.write(GPIOB + BSRR, 1 << pin);
    }
}

#[test]
fn the_ninth_pulse_on_scl_frees_sda() {
    let mut pins = Pins::new("still");
    assert!(pins.sda());
    pins.strike(Fault::SdaHeld(9));
    for _ in 0..8 {
        pins.pulse(6);
        assert!(!pins.sda());
    }
    pins.pulse(6);
    assert!(pins.sda());
}

#[test]
fn no_pulse_frees_a_stuck_bus() {
    let mut pins = Pins::new("still");
    pins.strike(Fault::BusStuck(true));
    for _ in 0..20 {
        pins.pulse(6);
    }
    assert!(!pins.sda());
    pins.strike(Fault::BusStuck(false));
    assert!(pins.sda());
}

#[test]
fn a_low_on_the_reset_line_deselects_every_channel() {
    let mut pins = Pins::new("still");
    let accelerometer = |pins: &mut Pins| {
        let acknowledged = pins.plant.lock().i2c.start(0x18, false, 2_000);
        pins.plant.lock().i2c.stop(2_000);
        acknowledged
    };
    pins.plant.lock().i2c.start(0x70, false, 2_000);
    pins.plant.lock().i2c.write(0b0001, 2_000);
    pins.plant.lock().i2c.stop(2_000);
    assert!(accelerometer(&mut pins));
    pins.pulse(5);
    assert!(!accelerometer(&mut pins));
}

#[test]
fn a_start_waits_while_sda_is_held_and_goes_out_when_it_is_free() {
    let mut pins = Pins::new("still");
    pins.strike(Fault::BusStuck(true));
    pins.write(I2C1 + CR1, START);
    assert_eq!(pins.read(I2C1 + SR2) & BUSY, BUSY);
    assert_eq!(pins.read(I2C1 + SR1) & SB, 0);
    pins.strike(Fault::BusStuck(false));
    assert_eq!(pins.read(I2C1 + SR1) & SB, SB);
}

#[test]
fn the_discrete_lines_are_low_when_the_vehicle_asserts_them() {
    let mut pins = Pins::new("rocket");
    // PC6 lift-off#, PC7 micro-g#: both high on the pad, lift-off after 30 s, micro-gravity minutes later.
    assert_eq!(pins.read(GPIOC + IDR) >> 6 & 0b11, 0b11);
    pins.now = 35_000_000_000;
    assert_eq!(pins.read(GPIOC + IDR) >> 6 & 0b11, 0b10);
    pins.now = 200_000_000_000;
    assert_eq!(pins.read(GPIOC + IDR) >> 6 & 0b11, 0b00);
}
