//! HMC5883L: three-axis magnetometer, I2C.
//!
//! Magnetic field in its own frame in, 12-bit codes out in the order X, Z, Y (datasheet, register list). Modelled:
//! continuous, single and idle mode, rates, gains (the first measurement after a change is made with the previous
//! one), overflow code, RDY, LOCK, self-test, address pointer. Not modelled: averaging (CRA bits MA) changes nothing,
//! as the nominal noise is that of the unit's setting.

use nalgebra::Vector3;

use super::{
    I2cPart, Input, Nanos,
    signal::{ConversionClock, Specimen, quantise, seconds},
};

/// 7-bit address.
pub const ADDRESS: u8 = 0x1E;

/// [counts/G] by GN of CRB (gain settings).
const GAIN: [f64; 8] = [1370.0, 1090.0, 820.0, 660.0, 440.0, 390.0, 330.0, 230.0];
/// [ns] between measurements by DO of CRA: 0.75, 1.5, 3, 7.5, 15, 30, 75 Hz; the last code is reserved.
const PERIOD_NS: [u64; 8] = [
    1_333_333_333,
    666_666_667,
    333_333_333,
    133_333_333,
    66_666_667,
    33_333_333,
    13_333_333,
    13_333_333,
];
/// [uT] of one gauss.
const GAUSS_UT: f64 = 100.0;
/// [uT] field of the self-test strap (self-test operation). The field measured just before is subtracted.
const SELF_TEST_UT: Vector3<f64> = Vector3::new(1.16 * GAUSS_UT, 1.16 * GAUSS_UT, 1.08 * GAUSS_UT);
/// Sent for an axis beyond the converter (data output registers).
const OVERFLOW: i16 = -4096;

/// [ns] one measurement.
const MEASUREMENT_NS: Nanos = 6_000_000;
/// [ns] power-on to the first measurement (operational examples).
const TURN_ON_NS: Nanos = 56_000_000;
/// [ns] RDY is clear before new data are placed.
const WRITING_NS: Nanos = 250_000;

const CRA: u8 = 0;
const CRB: u8 = 1;
const MODE: u8 = 2;
const DATA_X_MSB: u8 = 3;
const DATA_Y_LSB: u8 = 8;
const STATUS: u8 = 9;
const IDENTIFICATION_A: u8 = 10;
const IDENTIFICATION_C: u8 = 12;
const ALL_SIX: u8 = 0x3F;

/// What the part is doing.
enum Activity {
    /// Measures by its clock, having made measurement `latest`.
    Continuous { clock: ConversionClock, latest: i64 },
    /// Makes one measurement, complete at this instant [ns].
    Single { due: Nanos },
    /// Nothing.
    Idle,
}

/// One HMC5883L.
pub struct Hmc5883l {
    field_p_ut: Input<Vector3<f64>>,
    specimen: Specimen<3>,
    cra: u8,
    crb: u8,
    mode: u8,
    pointer: u8,
    expects_pointer: bool,
    activity: Activity,
    /// [counts/G] the converter is set to: CRB's, from the second measurement after it was written.
    gain: f64,
    /// Measurement in the output registers: when it was complete, and its gain; not worked out until read.
    pending: Option<(i64, f64)>,
    /// Data output registers, in their order.
    output: [u8; 6],
    ready: bool,
    locked: bool,
    /// Which of the six have been read.
    seen: u8,
}

impl Hmc5883l {
    /// A part in the field `field_p_ut` [uT], powered at time 0.
    pub fn new(field_p_ut: Input<Vector3<f64>>, specimen: Specimen<3>) -> Self {
        let mut part = Hmc5883l {
            field_p_ut,
            specimen,
            cra: 0,
            crb: 0,
            mode: 0,
            pointer: 0,
            expects_pointer: false,
            activity: Activity::Idle,
            gain: 0.0,
            pending: None,
            output: [0; 6],
            ready: false,
            locked: false,
            seen: 0,
        };
        part.power_on(0);
        part
    }

    /// Takes notice of the measurements completed up to `now`.
    fn advance(&mut self, now: Nanos) {
        let (made, instant_ns) = match &mut self.activity {
            Activity::Continuous { clock, latest } => {
                let made = clock.latest(now) - *latest;
                *latest += made.max(0);
                (made, clock.instant_ns(*latest))
            }
            Activity::Single { due } if *due <= now => (1, *due as i64),
            _ => (0, 0),
        };
        if made <= 0 {
            return;
        }
        if matches!(self.activity, Activity::Single { .. }) {
            self.activity = Activity::Idle;
            self.mode |= 3;
        }
        let set = GAIN[usize::from(self.crb >> 5)];
        let gain = if made == 1 { self.gain } else { set };
        self.gain = set;
        if !self.locked {
            self.pending = Some((instant_ns, gain));
            self.ready = true;
        }
    }

    /// Works out the measurement in the output registers.
    fn convert(&mut self) {
        let Some((instant_ns, gain)) = self.pending.take() else {
            return;
        };
        // MS of CRA: positive or negative self-test, else (and for the reserved code) the field.
        let field_ut = match self.cra & 3 {
            1 => SELF_TEST_UT,
            2 => -SELF_TEST_UT,
            _ => (self.field_p_ut)(seconds(instant_ns)) + self.specimen.bias,
        } + self.specimen.noise(instant_ns);
        let codes = [field_ut.x, field_ut.z, field_ut.y].map(|axis_ut| {
            let code = quantise(axis_ut, GAUSS_UT / gain, -2049..=2048) as i16;
            let code = if (-2048..=2047).contains(&code) { code } else { OVERFLOW };
            code.to_be_bytes()
        });
        self.output.copy_from_slice(codes.as_flattened());
    }

    fn set(&mut self, value: u8, now: Nanos) {
        self.advance(now);
        match self.pointer {
            CRA => {
                self.convert();
                self.cra = value & 0x7F;
                self.begin(now);
            }
            CRB => self.crb = value & 0xE0,
            MODE => {
                self.mode = value;
                self.begin(now);
            }
            _ => {}
        }
    }

    /// Writing CRA or MODE begins anew and releases the lock (status register).
    fn begin(&mut self, now: Nanos) {
        self.locked = false;
        self.seen = 0;
        self.ready = false;
        self.activity = match self.mode & 3 {
            0 => {
                let clock = ConversionClock::new(PERIOD_NS[usize::from(self.cra >> 2 & 7)], self.specimen.phase);
                let latest = clock.latest(now.saturating_add(MEASUREMENT_NS));
                Activity::Continuous { clock, latest }
            }
            1 => Activity::Single {
                due: now.saturating_add(MEASUREMENT_NS),
            },
            _ => Activity::Idle,
        };
    }

    fn data(&mut self, index: u8) -> u8 {
        self.convert();
        self.seen |= 1 << index;
        self.locked = self.seen != ALL_SIX;
        if !self.locked {
            self.seen = 0;
        }
        self.output[usize::from(index)]
    }

    fn status(&self, now: Nanos) -> u8 {
        let writing = match &self.activity {
            Activity::Continuous { clock, latest } => {
                !self.locked && clock.latest(now.saturating_add(WRITING_NS)) > *latest
            }
            _ => false,
        };
        u8::from(self.locked) << 1 | u8::from(self.ready && !writing)
    }

    /// The pointer moves on after every byte, round the six data registers and round the end (register access).
    fn step(&mut self) {
        self.pointer = match self.pointer {
            DATA_Y_LSB => DATA_X_MSB,
            IDENTIFICATION_C.. => CRA,
            pointer => pointer + 1,
        };
    }
}

impl I2cPart for Hmc5883l {
    fn address(&self) -> u8 {
        ADDRESS
    }

    fn start(&mut self, read: bool, _now: Nanos) -> bool {
        self.expects_pointer = !read;
        true
    }

    fn write(&mut self, byte: u8, now: Nanos) -> bool {
        if core::mem::take(&mut self.expects_pointer) {
            self.pointer = byte;
        } else {
            self.set(byte, now);
            self.step();
        }
        true
    }

    fn read(&mut self, now: Nanos) -> u8 {
        self.advance(now);
        let pointer = self.pointer;
        self.step();
        match pointer {
            CRA => self.cra,
            CRB => self.crb,
            MODE => {
                self.locked = true;
                self.mode
            }
            DATA_X_MSB..=DATA_Y_LSB => self.data(pointer - DATA_X_MSB),
            STATUS => self.status(now),
            IDENTIFICATION_A..=IDENTIFICATION_C => b"H43"[usize::from(pointer - IDENTIFICATION_A)],
            _ => 0,
        }
    }

    fn stop(&mut self, _now: Nanos) {}

    fn power_on(&mut self, now: Nanos) {
        // Defaults of the register descriptions; single measurement is the default mode.
        self.cra = 0x10;
        self.crb = 0x20;
        self.mode = 0x01;
        self.pointer = 0;
        self.gain = GAIN[1];
        self.pending = None;
        self.output = [0; 6];
        self.begin(now);
        self.activity = Activity::Single {
            due: now.saturating_add(TURN_ON_NS),
        };
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::part::testing::{read, write};

    const MS: Nanos = 1_000_000;
    /// 75 Hz, one measurement averaged.
    const CRA_75_HZ: u8 = 0x18;

    fn part(field_ut: impl Fn(f64) -> [f64; 3] + Send + Sync + 'static) -> Hmc5883l {
        Hmc5883l::new(Arc::new(move |t| Vector3::from(field_ut(t))), Specimen::ideal())
    }

    fn continuous(field_ut: impl Fn(f64) -> [f64; 3] + Send + Sync + 'static) -> Hmc5883l {
        let mut part = part(field_ut);
        write(&mut part, &[0x00, CRA_75_HZ, 0x20, 0x00], 0);
        part
    }

    fn xzy(part: &mut Hmc5883l, now: Nanos) -> [i16; 3] {
        let bytes: [u8; 6] = read(part, 0x03, now);
        [0, 2, 4].map(|i| i16::from_be_bytes([bytes[i], bytes[i + 1]]))
    }

    #[test]
    fn at_power_on_it_has_the_datasheet_defaults_and_makes_one_measurement() {
        let mut part = part(|_| [10.0, 20.0, 30.0]);
        assert_eq!(read(&mut part, 0x0A, 0), *b"H43");
        assert_eq!(read(&mut part, 0x00, 0), [0x10, 0x20, 0x01]);
        part.power_on(0);
        assert_eq!(read(&mut part, 0x09, 55 * MS), [0x00]);
        assert_eq!(read(&mut part, 0x09, 57 * MS), [0x01]);
        assert_eq!(read(&mut part, 0x03, 57 * MS), [0x00, 0x6D, 0x01, 0x47, 0x00, 0xDA]);
        assert_eq!(read(&mut part, 0x02, 57 * MS), [0x03]);
    }

    #[test]
    fn the_axes_come_in_the_order_x_z_y() {
        let mut part = continuous(|_| [10.0, -20.0, 30.0]);
        assert_eq!(xzy(&mut part, 100 * MS), [109, 327, -218]);
    }

    #[test]
    fn the_pointer_goes_round_the_data_registers_and_round_the_end() {
        let mut part = continuous(|_| [10.0, -20.0, 30.0]);
        let bytes: [u8; 12] = read(&mut part, 0x03, 100 * MS);
        assert_eq!(bytes[..6], bytes[6..]);
        assert_eq!(read(&mut part, 0x0B, 100 * MS), [b'4', b'3', CRA_75_HZ]);
    }

    #[test]
    fn beyond_the_converter_the_code_says_overflow() {
        let mut part = continuous(|_| [188.0, -187.8, 187.8]);
        assert_eq!(xzy(&mut part, 100 * MS), [-4096, 2047, -2047]);
    }

    #[test]
    fn the_first_measurement_after_a_gain_change_has_the_previous_gain() {
        let mut part = continuous(|_| [100.0; 3]);
        assert_eq!(xzy(&mut part, 100 * MS), [1090; 3]);
        write(&mut part, &[0x01, 0xE0], 100 * MS);
        // Measurements are complete at 106.7 and 120.0 ms.
        let seen = [106, 107, 119, 121].map(|ms| xzy(&mut part, ms * MS)[0]);
        assert_eq!(seen, [1090, 1090, 1090, 230]);
    }

    #[test]
    fn a_partial_read_locks_the_data_until_all_six_bytes_are_read() {
        let mut part = continuous(|t| [if t < 1.0 { 10.0 } else { 20.0 }; 3]);
        assert_eq!(read(&mut part, 0x03, 900 * MS), [0x00, 0x6D, 0x00]);
        assert_eq!(read(&mut part, 0x09, 900 * MS), [0x03]);
        assert_eq!(xzy(&mut part, 2_000 * MS), [109; 3]);
        assert_eq!(read(&mut part, 0x09, 2_000 * MS), [0x01]);
        assert_eq!(xzy(&mut part, 2_020 * MS), [218; 3]);
    }

    #[test]
    fn reading_the_mode_locks_and_writing_it_unlocks() {
        let mut part = continuous(|t| [if t < 1.0 { 10.0 } else { 20.0 }; 3]);
        assert_eq!(read(&mut part, 0x02, 900 * MS), [0x00]);
        assert_eq!(read(&mut part, 0x09, 1_500 * MS), [0x03]);
        write(&mut part, &[0x02, 0x00], 1_500 * MS);
        assert_eq!(read(&mut part, 0x09, 1_501 * MS), [0x00]);
        assert_eq!(xzy(&mut part, 1_530 * MS), [218; 3]);
    }

    #[test]
    fn ready_is_clear_while_new_data_are_placed() {
        let mut part = continuous(|_| [0.0; 3]);
        // The eighth measurement is complete at 106.67 ms.
        let seen = [106_300_000, 106_500_000, 106_700_000].map(|now| read::<1>(&mut part, 0x09, now)[0]);
        assert_eq!(seen, [1, 0, 1]);
    }

    #[test]
    fn single_mode_measures_once_and_goes_idle() {
        let mut part = part(|t| [t * 1000.0; 3]);
        write(&mut part, &[0x02, 0x01], 100 * MS);
        assert_eq!(read(&mut part, 0x09, 105 * MS), [0x00]);
        assert_eq!(read(&mut part, 0x09, 106 * MS), [0x01]);
        assert_eq!(xzy(&mut part, 900 * MS), [1155; 3]);
        assert_eq!(read(&mut part, 0x02, 900 * MS), [0x03]);
    }

    #[test]
    fn the_self_test_shows_the_strap_and_not_the_field() {
        for (measurement, sign) in [(1, 1), (2, -1)] {
            let mut part = continuous(|_| [40.0; 3]);
            write(&mut part, &[0x00, CRA_75_HZ | measurement, 0xA0], 0);
            // 390 counts/G: 1.16 G, 1.08 G, 1.16 G.
            assert_eq!(xzy(&mut part, 200 * MS), [452 * sign, 421 * sign, 452 * sign]);
        }
    }
}
