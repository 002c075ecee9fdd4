//! LIS331HH: three-axis accelerometer, I2C.
//!
//! Specific force in its own frame in, left-justified 12-bit codes out (registers after the datasheet, chapter 7).
//! Modelled: power modes and rates, full scales, axis enables, BDU, BLE, new-data and overrun flags, sub-address
//! auto-increment, the high-pass on the output (FDS), self-test, clipping at the code. Not modelled: interrupts, sleep
//! to wake-up, the reference mode of the high-pass and its reset by reading HP_FILTER_RESET.

mod converter;

use nalgebra::Vector3;

use super::{I2cPart, Input, Nanos, signal::Specimen};
use converter::Converter;

/// 7-bit address with SA0 low.
pub const ADDRESS: u8 = 0x18;

const WHO_AM_I: u8 = 0x0F;
const CTRL_REG1: u8 = 0x20;
const CTRL_REG2: u8 = 0x21;
const CTRL_REG4: u8 = 0x23;
const STATUS_REG: u8 = 0x27;
const OUT_X_L: u8 = 0x28;
const OUT_Z_H: u8 = 0x2D;

/// CTRL_REG1 to 5, REFERENCE, INT1_CFG, INT1_THS, INT1_DURATION, INT2_CFG, INT2_THS, INT2_DURATION.
const WRITABLE: [u8; 12] = [0x20, 0x21, 0x22, 0x23, 0x24, 0x26, 0x30, 0x32, 0x33, 0x34, 0x36, 0x37];

/// The two bytes of one axis, kept together while only one has been read (BDU).
#[derive(Clone, Copy)]
struct Held {
    output: i16,
    first: u8,
}

/// One LIS331HH.
pub struct Lis331hh {
    force_p: Input<Vector3<f64>>,
    specimen: Specimen<3>,
    registers: [u8; 0x80],
    sub_address: u8,
    expects_sub_address: bool,
    /// `None` in power-down.
    converter: Option<Converter>,
    /// Output registers, left-justified.
    outputs: [i16; 3],
    /// The last conversion is not yet worked out into `outputs`.
    stale: bool,
    /// Conversions of each axis since it was last read, at most 2 (2 = overrun).
    unread: [u8; 3],
    held: [Option<Held>; 3],
}

impl Lis331hh {
    /// A part that feels `force_p` [m/s2], powered at time 0.
    pub fn new(force_p: Input<Vector3<f64>>, specimen: Specimen<3>) -> Self {
        let mut part = Lis331hh {
            force_p,
            specimen,
            registers: [0; 0x80],
            sub_address: 0,
            expects_sub_address: false,
            converter: None,
            outputs: [0; 3],
            stale: false,
            unread: [0; 3],
            held: [None; 3],
        };
        part.power_on(0);
        part
    }

    fn register(&self, address: u8) -> u8 {
        self.registers[usize::from(address & 0x7F)]
    }

    /// CTRL_REG1 bits Xen, Yen, Zen.
    fn is_enabled(&self, axis: usize) -> bool {
        self.register(CTRL_REG1) >> axis & 1 == 1
    }

    /// Takes notice of the conversions completed up to `now`.
    fn advance(&mut self, now: Nanos) {
        let fresh = self.converter.as_mut().map_or(0, |converter| converter.advance(now));
        if fresh == 0 {
            return;
        }
        self.stale = true;
        for axis in 0..3 {
            if self.is_enabled(axis) {
                self.unread[axis] = (self.unread[axis] + fresh).min(2);
            }
        }
    }

    /// Works out the last conversion, with the registers as they were when it was made.
    fn convert(&mut self) {
        let ctrl_reg4 = self.register(CTRL_REG4);
        let Some(converter) = self.converter.as_mut().filter(|_| self.stale) else {
            return;
        };
        self.stale = false;
        let codes = converter.codes(&*self.force_p, &self.specimen, ctrl_reg4);
        for (axis, code) in codes.into_iter().enumerate() {
            if self.is_enabled(axis) {
                self.outputs[axis] = code << 4;
            }
        }
    }

    fn set(&mut self, address: u8, value: u8, now: Nanos) {
        if !WRITABLE.contains(&address) {
            return;
        }
        // The last conversion keeps the settings it was made with.
        self.advance(now);
        self.convert();
        let before = self.register(address);
        // BOOT (CTRL_REG2 bit 7) clears itself; a boot is not otherwise seen from outside.
        let value = if address == CTRL_REG2 { value & 0x7F } else { value };
        self.registers[usize::from(address)] = value;
        match address {
            // PM and DR.
            CTRL_REG1 if (value ^ before) & 0xF8 != 0 => {
                self.converter = Converter::start(value, self.register(CTRL_REG2), self.specimen.pace, now);
            }
            CTRL_REG2 => {
                if let Some(converter) = &mut self.converter {
                    converter.select_filter(value);
                }
            }
            _ => {}
        }
    }

    fn status(&self) -> u8 {
        let bits = |least: u8| {
            let axes = (0..3).fold(0, |bits, axis| bits | u8::from(self.unread[axis] >= least) << axis);
            axes | u8::from(axes == 7) << 3
        };
        bits(2) << 4 | bits(1)
    }

    fn output(&mut self, address: u8) -> u8 {
        let byte = address - OUT_X_L;
        let axis = usize::from(byte / 2);
        let ctrl_reg4 = self.register(CTRL_REG4);
        let block_data_update = ctrl_reg4 & 0x80 != 0;
        let held = match self.held[axis].filter(|_| block_data_update) {
            Some(held) => held,
            None => {
                self.convert();
                self.unread[axis] = 0;
                Held {
                    output: self.outputs[axis],
                    first: byte,
                }
            }
        };
        self.held[axis] = (block_data_update && held.first == byte).then_some(held);
        // BLE (CTRL_REG4 bit 6) puts the high byte at the lower address.
        let [low, high] = held.output.to_le_bytes();
        if (byte & 1 == 1) ^ (ctrl_reg4 & 0x40 != 0) {
            high
        } else {
            low
        }
    }

    /// With bit 7 of the sub-address set, it moves on after every byte (I2C operation).
    fn step(&mut self) {
        if self.sub_address & 0x80 != 0 {
            self.sub_address = self.sub_address.wrapping_add(1) | 0x80;
        }
    }
}

impl I2cPart for Lis331hh {
    fn address(&self) -> u8 {
        ADDRESS
    }

    fn start(&mut self, read: bool, _now: Nanos) -> bool {
        self.expects_sub_address = !read;
        true
    }

    fn write(&mut self, byte: u8, now: Nanos) -> bool {
        if core::mem::take(&mut self.expects_sub_address) {
            self.sub_address = byte;
        } else {
            self.set(self.sub_address & 0x7F, byte, now);
            self.step();
        }
        true
    }

    fn read(&mut self, now: Nanos) -> u8 {
        self.advance(now);
        let address = self.sub_address & 0x7F;
        self.step();
        match address {
            STATUS_REG => self.status(),
            OUT_X_L..=OUT_Z_H => self.output(address),
            _ => self.register(address),
        }
    }

    fn stop(&mut self, _now: Nanos) {}

    fn power_on(&mut self, _now: Nanos) {
        self.registers = [0; 0x80];
        self.registers[usize::from(WHO_AM_I)] = 0x32;
        self.registers[usize::from(CTRL_REG1)] = 0x07;
        self.sub_address = 0;
        self.expects_sub_address = false;
        self.converter = None;
        self.outputs = [0; 3];
        self.stale = false;
        self.unread = [0; 3];
        self.held = [None; 3];
    }
}

#[cfg(test)]
mod tests;
