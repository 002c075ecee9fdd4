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
/// \[ns\] between measurements by DO of CRA: 0.75, 1.5, 3, 7.5, 15, 30, 75 Hz; the last code is reserved.
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
/// \[uT\] of one gauss.
const GAUSS_UT: f64 = 100.0;
/// \[uT\] field of the self-test strap (self-test operation). The field measured just before is subtracted.
const SELF_TEST_UT: Vector3<f64> = Vector3::new(1.16 * GAUSS_UT, 1.16 * GAUSS_UT, 1.08 * GAUSS_UT);
/// Sent for an axis beyond the converter (data output registers).
const OVERFLOW: i16 = -4096;

/// \[ns\] one measurement.
const MEASUREMENT_NS: Nanos = 6_000_000;
/// \[ns\] of the clock that times a measurement which it was asked for, from its latest edge on. The data sheet does not tell it.
const EDGE_NS: Nanos = 100_000;
/// \[ns\] power-on to the first measurement (operational examples).
const TURN_ON_NS: Nanos = 56_000_000;
/// \[ns\] RDY is clear before new data are placed.
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
    /// Makes one measurement, complete at this instant \[ns\].
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
    /// A part in the field `field_p_ut` \[uT\], powered at time 0.
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
                let clock = ConversionClock::paced(PERIOD_NS[usize::from(self.cra >> 2 & 7)], self.specimen.pace);
                let latest = clock.latest(now.saturating_add(MEASUREMENT_NS));
                Activity::Continuous { clock, latest }
            }
            1 => {
                let edges = ConversionClock::paced(EDGE_NS, self.specimen.pace);
                let due = edges.instant_ns(edges.latest(now) + (MEASUREMENT_NS / EDGE_NS) as i64);
                Activity::Single {
                    due: due.max(0).cast_unsigned(),
                }
            }
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
mod tests;
