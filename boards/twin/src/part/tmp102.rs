//! TMP102: thermometer, I2C.
//!
//! Temperature in, left-justified 12-bit (13-bit with EM) code out (registers after SBOS397). Modelled: pointer, rates,
//! shutdown and one-shot, extended mode. Not modelled: the alert; AL always reads "not in alert".

use nalgebra::SVector;

use super::{
    I2cPart, Input, Nanos,
    signal::{ConversionClock, Specimen, quantise, seconds},
};

/// 7-bit address with ADD0 to ground.
pub const ADDRESS: u8 = 0x48;

/// \[degC\] of one count.
const LSB_C: f64 = 0.0625;
/// \[ns\] one conversion.
const CONVERSION_NS: Nanos = 26_000_000;
/// \[ns\] between conversions by CR1, CR0: 0.25, 1, 4, 8 Hz.
const PERIOD_NS: [u64; 4] = [4_000_000_000, 1_000_000_000, 250_000_000, 125_000_000];

const CONFIGURATION: usize = 1;
/// Bits of the configuration the controller can write: F, POL, TM, SD and CR, EM.
const WRITABLE: u16 = 0x1FD0;
/// Resolution bits (read-only 11) and OS.
const RESOLUTION: u16 = 0x6000;
const ONE_SHOT: u16 = 0x8000;
const SHUTDOWN: u16 = 0x0100;
const POLARITY: u16 = 0x0400;
const ALERT: u16 = 0x0020;
const EXTENDED: u16 = 0x0010;

/// One TMP102.
pub struct Tmp102 {
    temperature_c: Input<f64>,
    specimen: Specimen<1>,
    /// Temperature, configuration, T_LOW, T_HIGH.
    registers: [u16; 4],
    pointer: usize,
    /// Bytes of the present transfer so far, the pointer byte not counted; `None` while that one is due.
    transferred: Option<usize>,
    clock: ConversionClock,
    /// \[ns\] conversions before this instant are not of the present setting.
    since: Nanos,
    /// \[ns\] when the last conversion taken into the temperature register was complete.
    converted: Option<i64>,
    one_shot: Option<Nanos>,
}

impl Tmp102 {
    /// A part at `temperature_c` \[degC\], powered at time 0.
    pub fn new(temperature_c: Input<f64>, specimen: Specimen<1>) -> Self {
        let mut part = Tmp102 {
            temperature_c,
            clock: ConversionClock::paced(PERIOD_NS[2], specimen.pace),
            specimen,
            registers: [0; 4],
            pointer: 0,
            transferred: None,
            since: 0,
            converted: None,
            one_shot: None,
        };
        part.power_on(0);
        part
    }

    /// Takes the last conversion complete at `now` into the temperature register.
    fn advance(&mut self, now: Nanos) {
        let complete = if self.registers[CONFIGURATION] & SHUTDOWN == 0 {
            let instant_ns = self.clock.instant_ns(self.clock.latest(now));
            u64::try_from(instant_ns).ok().filter(|&instant| instant >= self.since)
        } else {
            self.one_shot.filter(|&due| due <= now)
        };
        let Some(instant_ns) = complete.map(|instant| instant as i64) else {
            return;
        };
        if self.converted == Some(instant_ns) {
            return;
        }
        self.converted = Some(instant_ns);
        let temperature = SVector::<f64, 1>::new((self.temperature_c)(seconds(instant_ns)))
            + self.specimen.bias
            + self.specimen.noise(instant_ns);
        let extended = self.registers[CONFIGURATION] & EXTENDED != 0;
        let (limit, shift) = if extended { (4096, 3) } else { (2048, 4) };
        let code = quantise(temperature[0], LSB_C, -limit..=limit - 1);
        // D0 tells the two formats apart.
        self.registers[0] = (code << shift) as u16 | u16::from(extended);
    }

    fn configure(&mut self, value: u16, now: Nanos) {
        self.advance(now);
        let one_shot = (value & ONE_SHOT != 0 && value & SHUTDOWN != 0).then(|| now.saturating_add(CONVERSION_NS));
        self.one_shot = one_shot.or(self.one_shot.filter(|_| value & SHUTDOWN != 0));
        self.registers[CONFIGURATION] = RESOLUTION | value & WRITABLE;
        self.clock = ConversionClock::paced(PERIOD_NS[usize::from(value >> 6 & 3)], self.specimen.pace);
        self.since = now.saturating_add(CONVERSION_NS);
    }

    fn register(&self, now: Nanos) -> u16 {
        let value = self.registers[self.pointer];
        if self.pointer != CONFIGURATION {
            return value;
        }
        // AL is the inverse of POL while there is no alert; OS tells that no one-shot is under way.
        let alert = if value & POLARITY == 0 { ALERT } else { 0 };
        let idle = value & SHUTDOWN != 0 && self.one_shot.is_none_or(|due| due <= now);
        value | alert | if idle { ONE_SHOT } else { 0 }
    }
}

impl I2cPart for Tmp102 {
    fn address(&self) -> u8 {
        ADDRESS
    }

    fn start(&mut self, read: bool, _now: Nanos) -> bool {
        self.transferred = read.then_some(0);
        true
    }

    fn write(&mut self, byte: u8, now: Nanos) -> bool {
        let Some(index) = self.transferred else {
            self.pointer = usize::from(byte & 3);
            self.transferred = Some(0);
            return true;
        };
        self.transferred = Some(index + 1);
        if self.pointer == 0 || index > 1 {
            return true;
        }
        // Registers are updated byte by byte, most significant first.
        let mut bytes = self.registers[self.pointer].to_be_bytes();
        bytes[index] = byte;
        let value = u16::from_be_bytes(bytes);
        match self.pointer {
            CONFIGURATION => self.configure(value, now),
            pointer => self.registers[pointer] = value & 0xFFF8,
        }
        true
    }

    fn read(&mut self, now: Nanos) -> u8 {
        let index = self.transferred.unwrap_or(0);
        // Both bytes are of one conversion: the register does not change under a read.
        if index == 0 {
            self.advance(now);
        }
        self.transferred = Some(index + 1);
        self.register(now).to_be_bytes()[index & 1]
    }

    fn stop(&mut self, _now: Nanos) {}

    fn power_on(&mut self, now: Nanos) {
        self.registers = [0, 0x60A0, 0x4B00, 0x5000];
        self.pointer = 0;
        self.converted = None;
        self.one_shot = None;
        self.configure(0x60A0, now);
        // 0 degC until the first conversion is complete.
        self.registers[0] = 0;
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::part::testing::{read, write};

    const MS: Nanos = 1_000_000;

    fn part(temperature_c: impl Fn(f64) -> f64 + Send + Sync + 'static) -> Tmp102 {
        Tmp102::new(Arc::new(temperature_c), Specimen::ideal())
    }

    #[test]
    fn it_starts_with_the_datasheet_defaults() {
        let mut part = part(|_| 25.0);
        assert_eq!(read(&mut part, 0x01, 0), [0x60, 0xA0]);
        assert_eq!(read(&mut part, 0x02, 0), [0x4B, 0x00]);
        assert_eq!(read(&mut part, 0x03, 0), [0x50, 0x00]);
    }

    #[test]
    fn it_reads_zero_until_the_first_conversion() {
        let mut part = part(|_| 25.0);
        assert_eq!(read(&mut part, 0x00, 20 * MS), [0x00, 0x00]);
        assert_eq!(read(&mut part, 0x00, 260 * MS), [0x19, 0x00]);
    }

    #[test]
    fn a_conversion_under_way_is_begun_anew_by_a_new_setting() {
        let mut part = part(|_| 25.0);
        write(&mut part, &[0x01, 0x60, 0xA0], 240 * MS);
        assert_eq!(read(&mut part, 0x00, 260 * MS), [0x00, 0x00]);
        assert_eq!(read(&mut part, 0x00, 510 * MS), [0x19, 0x00]);
    }

    #[test]
    fn negative_and_extreme_temperatures_are_those_of_the_datasheet_table() {
        let code = |temperature_c| read::<2>(&mut part(move |_| temperature_c), 0x00, 300 * MS);
        assert_eq!(code(-25.0), [0xE7, 0x00]);
        assert_eq!(code(-0.25), [0xFF, 0xC0]);
        assert_eq!(code(150.0), [0x7F, 0xF0]);
    }

    #[test]
    fn it_converts_four_times_a_second_and_no_oftener() {
        let mut part = part(|t| (t * 100.0).round());
        let seen = [499, 501, 749, 751].map(|ms| read::<2>(&mut part, 0x00, ms * MS)[0]);
        assert_eq!(seen, [25, 50, 50, 75]);
        write(&mut part, &[0x01, 0x60, 0xE0], 751 * MS);
        assert_eq!(read::<1>(&mut part, 0x00, 880 * MS), [88]);
    }

    #[test]
    fn the_extended_mode_has_one_bit_more() {
        let mut part = part(|_| 150.0);
        write(&mut part, &[0x01, 0x60, 0xB0], 0);
        assert_eq!(read(&mut part, 0x01, 0), [0x60, 0xB0]);
        assert_eq!(read(&mut part, 0x00, 300 * MS), [0x4B, 0x01]);
    }

    #[test]
    fn in_shutdown_it_converts_once_when_asked() {
        let mut part = part(|t| (t * 10.0).round());
        write(&mut part, &[0x01, 0x61, 0xA0], 10 * MS);
        assert_eq!(read(&mut part, 0x00, 5_000 * MS), [0x00, 0x00]);
        assert_eq!(read(&mut part, 0x01, 5_000 * MS), [0xE1, 0xA0]);
        write(&mut part, &[0x01, 0xE1, 0xA0], 5_000 * MS);
        assert_eq!(read(&mut part, 0x01, 5_020 * MS), [0x61, 0xA0]);
        assert_eq!(read(&mut part, 0x01, 5_030 * MS), [0xE1, 0xA0]);
        assert_eq!(read(&mut part, 0x00, 9_000 * MS), [50, 0x00]);
    }
}
