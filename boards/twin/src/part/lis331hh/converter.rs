//! The measuring chain of the LIS331HH at one output data rate: from specific force to codes.
//!
//! Specific force and the control registers in, one conversion's codes out. Low-pass (the unit's nominal bandwidth),
//! high-pass on the output if FDS asks for it, self-test, bias, noise, rounding and clipping.

use core::f64::consts::TAU;

use nalgebra::Vector3;

use super::super::{
    Nanos,
    signal::{ConversionClock, LowPass, Pace, Specimen, quantise, seconds},
};

/// [m/s2] of one g, for the datasheet's mg.
pub const STANDARD_GRAVITY: f64 = 9.80665;
/// \[s\] of the unit's nominal 25 Hz bandwidth.
pub const TAU_S: f64 = 1.0 / (TAU * 25.0);
/// [m/s2] deflection by the self-test actuator: the middle of the data sheet's limits (table 3, Vst), 110, 110 and 295
/// counts of 3 mg.
const SELF_TEST: Vector3<f64> = Vector3::new(
    0.330 * STANDARD_GRAVITY,
    0.330 * STANDARD_GRAVITY,
    0.885 * STANDARD_GRAVITY,
);

/// The running converter.
pub struct Converter {
    period_ns: u64,
    clock: ConversionClock,
    latest: i64,
    low_pass: LowPass<3>,
    /// With its time constant \[s\].
    high_pass: Option<(f64, LowPass<3>)>,
}

impl Converter {
    /// Begins to convert at `now`; `None` in power-down.
    pub fn start(ctrl_reg1: u8, ctrl_reg2: u8, pace: Pace, now: Nanos) -> Option<Self> {
        let period_ns = period_ns(ctrl_reg1)?;
        let clock = ConversionClock::paced(period_ns, pace);
        let mut converter = Converter {
            period_ns,
            clock,
            // Turn-on time: 1/ODR + 1 ms (mechanical characteristics).
            latest: clock.latest(now.saturating_add(period_ns + 1_000_000)),
            low_pass: LowPass::new(clock, TAU_S),
            high_pass: None,
        };
        converter.select_filter(ctrl_reg2);
        Some(converter)
    }

    /// FDS puts the high-pass on the output; cut-off ODR / (6 HPc), HPc = 8, 16, 32, 64 (CTRL_REG2 description).
    pub fn select_filter(&mut self, ctrl_reg2: u8) {
        self.high_pass = (ctrl_reg2 & 0x10 != 0).then(|| {
            let periods = 6.0 * f64::from(8_u32 << (ctrl_reg2 & 3)) / TAU;
            let tau_s = periods * seconds(self.period_ns as i64);
            (tau_s, LowPass::new(self.clock, tau_s))
        });
    }

    /// Moves on to the last conversion complete at `now`; returns how many are new, at most 2.
    pub fn advance(&mut self, now: Nanos) -> u8 {
        let made = self.clock.latest(now).saturating_sub(self.latest).max(0);
        self.latest += made;
        made.min(2) as u8
    }

    /// Codes of the last conversion, 12 bit, right-justified.
    pub fn codes(&mut self, force_p: &dyn Fn(f64) -> Vector3<f64>, specimen: &Specimen<3>, ctrl_reg4: u8) -> [i16; 3] {
        let mut force = self.low_pass.at(self.latest, force_p);
        if let Some((tau_s, low_pass)) = &mut self.high_pass {
            // High-pass after low-pass, both of first order, split into partial fractions; the bias goes with the DC.
            force = (force - low_pass.at(self.latest, force_p)) * (*tau_s / (*tau_s - TAU_S));
        } else {
            // CTRL_REG4 bits ST, STsign.
            let self_test = f64::from(ctrl_reg4 >> 1 & 1) * if ctrl_reg4 & 8 == 0 { 1.0 } else { -1.0 };
            force += specimen.bias + SELF_TEST * self_test;
        }
        force += specimen.noise(self.clock.instant_ns(self.latest));
        let digit = sensitivity(ctrl_reg4);
        core::array::from_fn(|axis| quantise(force[axis], digit, -2048..=2047) as i16)
    }
}

/// [m/s2] of one 12-bit digit: 3, 6, 12 mg for FS = 00, 01, 11 (mechanical characteristics).
fn sensitivity(ctrl_reg4: u8) -> f64 {
    let digit_mg = match ctrl_reg4 >> 4 & 3 {
        0 => 3.0,
        1 => 6.0,
        _ => 12.0,
    };
    digit_mg * 1e-3 * STANDARD_GRAVITY
}

/// \[ns\] between conversions by PM and DR of CTRL_REG1; `None` in power-down (and for the reserved PM = 111).
fn period_ns(ctrl_reg1: u8) -> Option<u64> {
    let period_us = match (ctrl_reg1 >> 5, ctrl_reg1 >> 3 & 3) {
        (1, 0) => 20_000,
        (1, 1) => 10_000,
        (1, 2) => 2_500,
        (1, _) => 1_000,
        (2, _) => 2_000_000,
        (3, _) => 1_000_000,
        (4, _) => 500_000,
        (5, _) => 200_000,
        (6, _) => 100_000,
        _ => return None,
    };
    Some(period_us * 1_000)
}
