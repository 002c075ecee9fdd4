//! The three peripherals whose pins the board reaches: I2C1, and GPIO ports B and C.
//!
//! Each is rigless' own model with what it leaves out (its i2c.rs: "A peer holding SDA or SCL low", and `LAST`) or
//! with what the board has on the pins: pull-ups and the multiplexer's reset on port B, the vehicle's two discrete
//! lines, active low, and the NAND's WP# on port C. In: the firmware's accesses. Out: levels and register values at the access' instant.

use rigless::{
    device::{Device, DeviceContext, Level, RegisterFile},
    soc::stm32f427::{
        generated::{
            gpioa,
            i2c3::{Register, cr1, sr2},
        },
        peripherals::{
            gpio::{Gpio, Pin},
            i2c::I2c,
        },
    },
    time::{EventId, VirtualNanos},
};

use crate::chips::SharedPlant;

const fn pin(index: u8) -> Pin {
    match Pin::new(index) {
        Some(pin) => pin,
        None => panic!("a port has sixteen pins"),
    }
}

/// TCA9548A RESET#, PB5.
const MUX_RESET: Pin = pin(5);
/// I2C1 SCL, PB6.
const SCL: Pin = pin(6);
/// I2C1 SDA, PB7.
const SDA: Pin = pin(7);
/// Lift-off#, PC6.
const LIFT_OFF: Pin = pin(6);
/// Micro-g#, PC7.
const MICRO_G: Pin = pin(7);

/// NAND WP#, PC8.
const WRITE_PROTECT: Pin = pin(8);

/// I2C1 with lines that can be held low, and with the NACK that `CR2.LAST` asks for.
#[derive(Debug)]
pub struct SensorPort {
    pub i2c: I2c,
    pub plant: SharedPlant,
    /// The DMA stream takes one more byte and `LAST` is set: RM0090 27.3.8 has the controller NACK it. Only the
    /// board sees the stream's count, so it sets this before each event.
    pub nack_next: bool,
    held: bool,
    /// The end of a byte that waits until SCL is let go: the event then, and the model's own.
    stretched: Option<(EventId, EventId)>,
}

impl SensorPort {
    pub fn new(i2c: I2c, plant: SharedPlant) -> Self {
        SensorPort {
            i2c,
            plant,
            nack_next: false,
            held: false,
            stretched: None,
        }
    }

    /// The model's event that `event` stands for, unless SCL is held low: then it is put off until SCL is let go, since no
    /// byte ends without its clocks (UM10204 section 3.1.9). START and STOP, which the model carries out at once, are not
    /// held up; the byte that follows is.
    fn clocked(&mut self, event: EventId, context: &mut DeviceContext<'_>) -> Option<EventId> {
        let own = match self.stretched.take_if(|(then, _)| *then == event) {
            Some((_, own)) => own,
            None => event,
        };
        let until = VirtualNanos(self.plant.lock().scl_held_until());
        if until <= context.now() {
            return Some(own);
        }
        self.stretched = Some((context.schedule(until), own));
        None
    }

    /// Brings the registers to what the lines say, before anything else sees them; whether SDA is held.
    ///
    /// A held line is a busy bus of somebody else's, and the model keeps a START pending (RM0090 27.3.3), but not while
    /// SWRST holds the registers at reset. SDA let go with SCL high is a STOP: the bus is free (27.6.7, BUSY), and a
    /// pending START is carried out.
    fn feel(&mut self, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) -> bool {
        let was_held = std::mem::replace(&mut self.held, self.plant.lock().sda_held());
        let control = registers.get(Register::Cr1);
        let status = registers.get(Register::Sr2);
        if self.held && !cr1::SWRST.is_set(control) {
            registers.set(Register::Sr2, sr2::MSL.set(sr2::BUSY.set(status, 1), 0));
        } else if was_held && !self.held && !sr2::MSL.is_set(status) {
            registers.set(Register::Sr2, sr2::BUSY.set(status, 0));
            if cr1::START.is_set(control) {
                // The model acts on START's rising edge.
                for value in [cr1::START.set(control, 0), control] {
                    registers.set(Register::Cr1, value);
                    self.i2c.write(Register::Cr1, value, registers, context);
                }
            }
        }
        self.held
    }
}

impl Device for SensorPort {
    type Register = Register;

    fn read(
        &mut self,
        register: Register,
        registers: &mut RegisterFile,
        context: &mut DeviceContext<'_>,
    ) -> Option<u64> {
        self.feel(registers, context);
        self.i2c.read(register, registers, context)
    }

    fn write(&mut self, register: Register, value: u64, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        self.feel(registers, context);
        if register == Register::Cr1 {
            if cr1::SWRST.is_set(value) {
                self.plant.lock().controller_reset();
            } else if cr1::START.is_set(value) {
                let mut plant = self.plant.lock();
                // A line that is held keeps it pending, as `feel` has it; the plant counts that its fault was met.
                plant.sda_in_the_way();
                if plant.start_is_refused() {
                    // It stays asked for, and nothing comes of it.
                    return registers.set(Register::Cr1, value);
                }
            }
        }
        self.i2c.write(register, value, registers, context);
    }

    fn on_event(&mut self, event: EventId, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        if self.feel(registers, context) {
            // The byte on the wire never ends: nobody can clock it. Only a reset of the peripheral forgets it.
            return;
        }
        let Some(event) = self.clocked(event, context) else {
            return;
        };
        if !self.nack_next {
            return self.i2c.on_event(event, registers, context);
        }
        let before = registers.get(Register::Cr1);
        registers.set(Register::Cr1, cr1::ACK.set(before, 0));
        self.i2c.on_event(event, registers, context);
        let after = registers.get(Register::Cr1);
        registers.set(Register::Cr1, cr1::ACK.set(after, cr1::ACK.get(before)));
    }

    fn on_clock(&mut self, hz: u64, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        self.i2c.on_clock(hz, registers, context);
    }

    fn reset(&mut self) {
        self.i2c.reset();
        self.stretched = None;
    }

    fn reset_line(&mut self, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        self.i2c.reset_line(registers, context);
    }
}

/// Port B: the I2C lines with their pull-ups, and the multiplexer's reset.
#[derive(Debug)]
pub struct BusPins {
    pub gpio: Gpio,
    pub plant: SharedPlant,
    scl: Level,
}

impl BusPins {
    pub fn new(plant: SharedPlant) -> Self {
        BusPins {
            gpio: Gpio::default(),
            plant,
            scl: Level::High,
        }
    }

    fn pull(&mut self, registers: &RegisterFile, context: &mut DeviceContext<'_>) {
        let plant = self.plant.lock();
        let sda = Level::from(!plant.sda_held());
        let scl = Level::from(plant.scl_held_until() <= context.now().0);
        drop(plant);
        self.gpio.drive(SCL, Some(scl), registers, context);
        self.gpio.drive(SDA, Some(sda), registers, context);
        self.gpio.drive(MUX_RESET, Some(Level::High), registers, context);
    }
}

impl Device for BusPins {
    type Register = gpioa::Register;

    fn read(
        &mut self,
        register: gpioa::Register,
        registers: &mut RegisterFile,
        context: &mut DeviceContext<'_>,
    ) -> Option<u64> {
        self.pull(registers, context);
        self.gpio.read(register, registers, context)
    }

    fn write(
        &mut self,
        register: gpioa::Register,
        value: u64,
        registers: &mut RegisterFile,
        context: &mut DeviceContext<'_>,
    ) {
        self.pull(registers, context);
        self.gpio.write(register, value, registers, context);
        let scl = self.gpio.level(SCL, registers);
        if self.scl == Level::Low && scl == Level::High {
            self.plant.lock().clock_pulse();
        }
        self.scl = scl;
        if self.gpio.level(MUX_RESET, registers) == Level::Low {
            self.plant.lock().i2c.reset_pin();
        }
    }

    fn reset(&mut self) {
        self.gpio.reset();
        self.scl = Level::High;
    }

    fn reset_line(&mut self, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        self.gpio.reset_line(registers, context);
    }
}

/// Port C: the vehicle's lift-off# and micro-g# lines, and WP# of the NAND with its pull-down; the gyros' chip selects
/// hear its pins through rigless.
#[derive(Debug)]
pub struct PortC {
    pub gpio: Gpio,
    pub plant: SharedPlant,
    write_protect: Level,
}

impl PortC {
    pub fn new(plant: SharedPlant) -> Self {
        PortC {
            gpio: Gpio::default(),
            plant,
            write_protect: Level::Low,
        }
    }

    fn put_write_protect(&mut self, level: Level, context: &mut DeviceContext<'_>) {
        if std::mem::replace(&mut self.write_protect, level) != level {
            let protected = level == Level::Low;
            self.plant.lock().nand.protect(protected, context.now().0);
        }
    }
}

impl Device for PortC {
    type Register = gpioa::Register;

    fn read(
        &mut self,
        register: gpioa::Register,
        registers: &mut RegisterFile,
        context: &mut DeviceContext<'_>,
    ) -> Option<u64> {
        if register == gpioa::Register::Idr {
            let (lift_off, micro_g) = self.plant.lock().discretes(context.now().0);
            self.gpio
                .drive(LIFT_OFF, Some(Level::from(!lift_off)), registers, context);
            self.gpio
                .drive(MICRO_G, Some(Level::from(!micro_g)), registers, context);
        }
        self.gpio.read(register, registers, context)
    }

    fn write(
        &mut self,
        register: gpioa::Register,
        value: u64,
        registers: &mut RegisterFile,
        context: &mut DeviceContext<'_>,
    ) {
        self.gpio.drive(WRITE_PROTECT, Some(Level::Low), registers, context);
        self.gpio.write(register, value, registers, context);
        let level = self.gpio.level(WRITE_PROTECT, registers);
        self.put_write_protect(level, context);
    }

    fn reset(&mut self) {
        self.gpio.reset();
    }

    fn reset_line(&mut self, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        self.gpio.reset_line(registers, context);
        self.put_write_protect(Level::Low, context);
    }
}

#[cfg(test)]
mod tests;
