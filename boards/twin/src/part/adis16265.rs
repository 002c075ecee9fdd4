//! ADIS16265: one-axis gyro with thermometer and supply monitor, SPI.
//!
//! Rate and temperature in, 16-bit frames out, each answering the frame before it (datasheet, basic operation).
//! Modelled: start-up, output registers with new-data and error bits, ranges, sample rate, software reset, stall time,
//! DIAG_STAT. Not modelled: GYRO_OFF, GYRO_SCALE, filter taps, alarms and sleep are stored and change nothing; the
//! bandwidth is the unit's nominal one whatever SENS_AVG says; flash, DAC and auxiliary ADC are absent.

mod converter;

use super::{Nanos, SpiPart};
use converter::Converter;
pub use converter::Measurand;

/// [counts of 1.8315 mV] the supply, 5.00 V.
const SUPPLY: u16 = 2730;

/// \[ns\] after power or reset during which nothing is answered.
const START_UP_NS: Nanos = 220_000_000;
/// \[ns\] chip select must be high between frames (timing specifications, fast mode).
const STALL_NS: Nanos = 9_000;

const SUPPLY_OUT: u8 = 0x02;
const GYRO_OUT: u8 = 0x04;
const TEMP_OUT: u8 = 0x0C;
const GYRO_SCALE: u8 = 0x16;
const MSC_CTRL: u8 = 0x34;
const SMPL_PRD: u8 = 0x36;
const SENS_AVG: u8 = 0x38;
const DIAG_STAT: u8 = 0x3C;
const GLOB_CMD: u8 = 0x3E;
const PROD_ID: u8 = 0x56;
/// First address after the register map.
const END: u8 = 0x5A;

/// User registers (GYRO_OFF to SLP_CNT); the gaps between them do not exist.
const WRITABLE: [u8; 13] = [
    0x14, 0x16, 0x20, 0x22, 0x24, 0x26, 0x28, 0x30, 0x32, 0x34, 0x36, 0x38, 0x3A,
];
/// DIAG_STAT bit 3: a frame was lost.
const SPI_FAILURE: u16 = 1 << 3;
const NEW_DATA: u16 = 1 << 15;
const ERROR: u16 = 1 << 14;

/// Output registers, in the order of their new-data flags.
const OUTPUTS: [u8; 3] = [SUPPLY_OUT, GYRO_OUT, TEMP_OUT];

/// One ADIS16265.
pub struct Adis16265 {
    measurand: Measurand,
    registers: [u16; END as usize / 2],
    converter: Converter,
    /// [`OUTPUTS`] not read since the last sample.
    new_data: [bool; 3],
    /// End of the start-up.
    answers_from: Nanos,
    deselected_at: Nanos,
    frame: Frame,
    answer: u16,
}

/// What was clocked in since chip select fell.
enum Frame {
    /// Nothing yet.
    Empty,
    /// One word.
    Word(u16),
    /// Not a frame: too early after the one before, or not 16 clocks.
    Lost,
}

impl Adis16265 {
    /// A part powered at time 0.
    pub fn new(measurand: Measurand) -> Self {
        let mut part = Adis16265 {
            converter: Converter::start(0, measurand.rate_specimen.pace, 0, None),
            measurand,
            registers: [0; END as usize / 2],
            new_data: [false; 3],
            answers_from: 0,
            deselected_at: 0,
            frame: Frame::Empty,
            answer: 0,
        };
        part.power_on(0);
        part
    }

    /// \[ns\] when its latest frame ended, 0 before the first.
    pub fn latest_frame(&self) -> Nanos {
        self.deselected_at
    }

    fn register(&mut self, address: u8) -> &mut u16 {
        // Callers stay within the map; the bound only keeps a mistake from being a panic.
        let word = usize::from(address / 2).min(self.registers.len() - 1);
        &mut self.registers[word]
    }

    /// Takes notice of the samples completed up to `now`.
    fn advance(&mut self, now: Nanos) {
        if self.converter.advance(now) {
            self.new_data = [true; 3];
        }
    }

    /// Rate of the last sample, with the registers as they were when it was made.
    fn rate_counts(&mut self) -> i32 {
        let sens_avg = *self.register(SENS_AVG);
        self.converter.rate_counts(&self.measurand, sens_avg)
    }

    fn read(&mut self, address: u8, now: Nanos) -> u16 {
        self.advance(now);
        if let Some(index) = OUTPUTS.iter().position(|&output| output == address) {
            let data = match address {
                GYRO_OUT => self.rate_counts() as u16 & 0x3FFF,
                TEMP_OUT => self.converter.temperature_counts(&self.measurand) as u16 & 0x0FFF,
                _ => SUPPLY,
            };
            let new = if core::mem::take(&mut self.new_data[index]) {
                NEW_DATA
            } else {
                0
            };
            let error = if *self.register(DIAG_STAT) != 0 { ERROR } else { 0 };
            return new | error | data;
        }
        match address {
            // Reading the flags clears them.
            DIAG_STAT => core::mem::take(self.register(DIAG_STAT)),
            END.. => 0,
            _ => *self.register(address),
        }
    }

    /// Registers are written one byte at a time, the low one at the even address.
    fn write(&mut self, address: u8, value: u8, now: Nanos) {
        let register = address & !1;
        if address == GLOB_CMD && value & 0x80 != 0 {
            self.power_on(now);
            return;
        }
        if !WRITABLE.contains(&register) {
            return;
        }
        // The last sample keeps the settings it was made with.
        self.advance(now);
        let held = self.rate_counts();
        let mut bytes = self.register(register).to_le_bytes();
        bytes[usize::from(address & 1)] = value;
        // MSC_CTRL bit 10, the internal self-test, clears itself; it finds nothing.
        let cleared = if register == MSC_CTRL { 1 << 10 } else { 0 };
        let written = u16::from_le_bytes(bytes) & !cleared;
        *self.register(register) = written;
        if address == SMPL_PRD {
            self.converter = Converter::start(written, self.measurand.rate_specimen.pace, now, Some(held));
        }
    }
}

impl SpiPart for Adis16265 {
    fn select(&mut self, now: Nanos) {
        let ready = self.deselected_at.saturating_add(STALL_NS);
        self.frame = if now < ready { Frame::Lost } else { Frame::Empty };
    }

    fn transfer(&mut self, mosi: u16, _now: Nanos) -> u16 {
        match self.frame {
            Frame::Empty => {
                self.frame = Frame::Word(mosi);
                self.answer
            }
            Frame::Word(_) | Frame::Lost => {
                self.frame = Frame::Lost;
                0
            }
        }
    }

    fn deselect(&mut self, now: Nanos) {
        self.deselected_at = now;
        let frame = core::mem::replace(&mut self.frame, Frame::Empty);
        self.answer = 0;
        if now < self.answers_from {
            return;
        }
        match frame {
            Frame::Empty => {}
            Frame::Lost => *self.register(DIAG_STAT) |= SPI_FAILURE,
            Frame::Word(word) => {
                let [address, value] = word.to_be_bytes();
                if address & 0x80 == 0 {
                    self.answer = self.read(address & !1, now);
                } else {
                    self.write(address & 0x7F, value, now);
                }
            }
        }
    }

    fn power_on(&mut self, now: Nanos) {
        self.registers = [0; END as usize / 2];
        for (address, default) in [
            (GYRO_SCALE, 0x0800),
            (MSC_CTRL, 0x0006),
            (SMPL_PRD, 0x0007),
            (SENS_AVG, 0x0402),
            (PROD_ID, 0x3F89),
        ] {
            *self.register(address) = default;
        }
        self.converter = Converter::start(0x0007, self.measurand.rate_specimen.pace, now, None);
        self.new_data = [false; 3];
        self.answers_from = now.saturating_add(START_UP_NS);
        self.frame = Frame::Empty;
        self.answer = 0;
    }
}

#[cfg(test)]
mod tests;
