//! The measuring chains of the ADIS16265 at one sample rate: from rate and temperature to counts.
//!
//! Truth and settings in, the counts of the last sample out. The bandwidth is the unit's nominal one.

use core::f64::consts::{PI, TAU};

use nalgebra::Vector1;

use super::super::{
    Input, Nanos,
    signal::{ConversionClock, LowPass, Pace, Specimen, quantise, seconds},
};

/// \[s\] of the unit's nominal 12.7 Hz bandwidth.
pub const TAU_S: f64 = 1.0 / (TAU * 12.7);
/// [rad/s] of one count at 320 deg/s; half and a quarter of it in the lower ranges (output data table).
pub const LSB_RAD_S: f64 = 0.07326 * PI / 180.0;
/// \[counts\] of full range in every range: 320 deg/s / 0.07326.
const FULL_RANGE: i32 = 4368;
/// \[degC\] of one count; code 0 is 25 degC.
const LSB_C: f64 = 0.1453;
const ZERO_C: f64 = 25.0;
/// \[ns\] time bases of SMPL_PRD: 2048 and 66 samples per second.
const TIME_BASE_NS: [f64; 2] = [1e9 / 2048.0, 1e9 / 66.0];

/// What is measured, and with which specimen.
pub struct Measurand {
    /// [rad/s] about the sense axis.
    pub rate: Input<f64>,
    /// \[degC\] of the part.
    pub temperature_c: Input<f64>,
    /// Of the gyro; its pace is that of the sample clock.
    pub rate_specimen: Specimen<1>,
    /// Of the thermometer.
    pub temperature_specimen: Specimen<1>,
}

/// The running converter.
pub struct Converter {
    clock: ConversionClock,
    low_pass: LowPass<1>,
    latest: i64,
    /// Rate of the last sample \[counts\], once worked out.
    rate_counts: Option<i32>,
}

impl Converter {
    /// SMPL_PRD: bit 7 selects the time base, bits 6 to 0 are one less than the multiplier. Until the first sample the
    /// rate is the one `held`.
    pub fn start(smpl_prd: u16, pace: Pace, now: Nanos, held: Option<i32>) -> Self {
        let base_ns = TIME_BASE_NS[usize::from(smpl_prd >> 7 & 1)];
        let clock = ConversionClock::paced((base_ns * f64::from((smpl_prd & 0x7F) + 1)).round() as u64, pace);
        Converter {
            clock,
            low_pass: LowPass::new(clock, TAU_S),
            latest: clock.latest(now),
            rate_counts: held,
        }
    }

    /// Moves on to the last sample complete at `now`; returns whether it is new.
    pub fn advance(&mut self, now: Nanos) -> bool {
        let latest = self.clock.latest(now);
        let new = latest > self.latest;
        if new {
            self.latest = latest;
            self.rate_counts = None;
        }
        new
    }

    /// Rate of the last sample, at the range of SENS_AVG when it is first asked for.
    pub fn rate_counts(&mut self, measurand: &Measurand, sens_avg: u16) -> i32 {
        if let Some(counts) = self.rate_counts {
            return counts;
        }
        // Bits 10 to 8: 4, 2, 1 for 320, 160, 80 deg/s.
        let range = match sens_avg >> 8 & 7 {
            1 => 0.25,
            2 => 0.5,
            _ => 1.0,
        };
        let rate = self.low_pass.at(self.latest, |t| Vector1::new((measurand.rate)(t)))
            + measurand.rate_specimen.bias
            + measurand.rate_specimen.noise(self.clock.instant_ns(self.latest));
        let counts = quantise(rate[0], LSB_RAD_S * range, -FULL_RANGE..=FULL_RANGE);
        self.rate_counts = Some(counts);
        counts
    }

    /// Temperature at the last sample.
    pub fn temperature_counts(&self, measurand: &Measurand) -> i32 {
        let instant_ns = self.clock.instant_ns(self.latest);
        let specimen = &measurand.temperature_specimen;
        let temperature_c =
            (measurand.temperature_c)(seconds(instant_ns)) + specimen.bias[0] + specimen.noise(instant_ns)[0];
        quantise(temperature_c - ZERO_C, LSB_C, -2048..=2047)
    }
}
