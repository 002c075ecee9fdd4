//! From truth to the code of one conversion: the clock, the low-pass, the specimen's bias and noise, the rounding.
//!
//! In goes a physical quantity as a function of time, out comes the code of conversion `k`. Everything here is a pure
//! function of (k, input, seed): when and how often a part is read changes nothing, so a unit that reads at another
//! instant, on the host or in emulation, finds the same conversions. What is kept between calls are copies only.

use core::ops::RangeInclusive;

use nalgebra::SVector;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::{
    SplitMix64,
    rand_core::{Rng, SeedableRng},
};

use super::Nanos;

/// Times in the past of power-on exist (the low-pass looks back), so instants are signed inside a part.
fn signed(now: Nanos) -> i64 {
    i64::try_from(now).unwrap_or(i64::MAX)
}

/// \[s\] of an instant \[ns\].
pub fn seconds(instant_ns: i64) -> f64 {
    instant_ns as f64 * 1e-9
}

/// How a specimen's clock runs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pace {
    /// \[periods\] phase at the unit's power-on.
    pub phase: f64,
    /// \[1\] its periods over the nominal ones.
    pub stretch: f64,
}

/// A part's own free-running clock: conversion `k` is complete at `k` periods and a phase after the unit's power-on.
#[derive(Clone, Copy, Debug)]
pub struct ConversionClock {
    period_ns: i64,
    phase_ns: i64,
}

impl ConversionClock {
    /// A part's clock of nominally `period_ns`.
    pub fn paced(period_ns: u64, pace: Pace) -> Self {
        ConversionClock::new((period_ns as f64 * pace.stretch).round() as u64, pace.phase)
    }

    /// `period_ns` at least 1; `phase` in periods.
    pub fn new(period_ns: u64, phase: f64) -> Self {
        let period_ns = signed(period_ns).max(1);
        ConversionClock {
            period_ns,
            phase_ns: (phase * period_ns as f64) as i64,
        }
    }

    /// The last conversion complete at `now`; negative before the first.
    pub fn latest(&self, now: Nanos) -> i64 {
        signed(now).saturating_sub(self.phase_ns).div_euclid(self.period_ns)
    }

    /// \[ns\] instant at which conversion `k` is complete.
    pub fn instant_ns(&self, k: i64) -> i64 {
        k.saturating_mul(self.period_ns).saturating_add(self.phase_ns)
    }
}

/// Weight below which the past of a low-pass is cut off, in steps of its input.
const TAIL: f64 = 1e-4;

/// First-order low-pass seen at the instants of a conversion clock.
///
/// The input is sampled on a grid of nodes that contains every conversion and is no coarser than the time constant.
/// Between nodes it is taken as linear, for which the weights are exact (first-order hold): with r = step/tau and
/// a = exp(-r), y_n = a y_(n-1) + b0 u_n + b1 u_(n-1), b0 = 1 - (1-a)/r, b1 = (1-a)/r - a, unrolled until a^N < `TAIL`.
#[derive(Debug)]
pub struct LowPass<const N: usize> {
    clock: ConversionClock,
    nodes_per_conversion: i64,
    weights: Vec<f64>,
    /// Input at the nodes last looked at, by node modulo its length: neighbouring conversions share most of them.
    nodes: Vec<(i64, SVector<f64, N>)>,
}

impl<const N: usize> LowPass<N> {
    /// `tau_s` \[s\] time constant, above zero.
    pub fn new(clock: ConversionClock, tau_s: f64) -> Self {
        let period_s = seconds(clock.period_ns);
        let nodes_per_conversion = (period_s / tau_s).ceil().max(1.0);
        let r = period_s / nodes_per_conversion / tau_s;
        let a = (-r).exp();
        let (b0, b1) = (1.0 - (1.0 - a) / r, (1.0 - a) / r - a);
        let last = (-TAIL.ln() / r).ceil() as i32;
        let mut weights = vec![b0];
        weights.extend((1..last).map(|j| a.powi(j - 1) * (b1 + a * b0)));
        weights.push(a.powi(last - 1) * (b1 + a));
        LowPass {
            clock,
            nodes_per_conversion: nodes_per_conversion as i64,
            nodes: vec![(i64::MIN, SVector::zeros()); weights.len().next_power_of_two()],
            weights,
        }
    }

    /// Output at conversion `k`. `input` must be the same function at every call.
    pub fn at(&mut self, k: i64, input: impl Fn(f64) -> SVector<f64, N>) -> SVector<f64, N> {
        let newest = k.saturating_mul(self.nodes_per_conversion);
        let step_ns = self.clock.period_ns as f64 / self.nodes_per_conversion as f64;
        let mask = self.nodes.len() as i64 - 1;
        let mut sum = SVector::zeros();
        for (weight, node) in self.weights.iter().zip((0..).map(|j| newest.saturating_sub(j))) {
            let kept = &mut self.nodes[(node & mask) as usize];
            if kept.0 != node {
                *kept = (node, input((self.clock.phase_ns as f64 + node as f64 * step_ns) * 1e-9));
            }
            sum += kept.1 * *weight;
        }
        sum
    }
}

/// A stream of numbers that are a function of their index alone (a hash of seed and index).
#[derive(Clone, Copy, Debug)]
pub struct Noise {
    key: u64,
}

impl Noise {
    /// The stream of a seed.
    pub fn new(seed: u64) -> Self {
        Noise { key: seed }
    }

    fn generator(self, index: u64) -> SplitMix64 {
        SplitMix64::seed_from_u64(self.key ^ index)
    }

    /// An independent stream.
    pub fn stream(self, index: u64) -> Noise {
        Noise {
            key: self.generator(index).next_u64(),
        }
    }

    /// Sixteen random bits.
    pub fn word(self, index: u64) -> u16 {
        (self.generator(index).next_u64() >> 48) as u16
    }

    /// Uniform in [0, 1).
    pub fn uniform(self, index: u64) -> f64 {
        (self.generator(index).next_u64() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Zero mean, unit variance, normal.
    pub fn normal(self, index: u64) -> f64 {
        StandardNormal.sample(&mut self.generator(index))
    }
}

/// What one specimen of a part has of its own: the phase of its clock, a constant bias and white noise on each axis.
#[derive(Clone, Copy, Debug)]
pub struct Specimen<const N: usize> {
    /// Its conversion clock.
    pub pace: Pace,
    /// [unit of the quantity] added to every conversion.
    pub bias: SVector<f64, N>,
    sigma: f64,
    axes: [Noise; N],
}

impl<const N: usize> Specimen<N> {
    /// With a clock whose period is off by a part drawn with this standard deviation.
    pub fn off_pace(mut self, stream: Noise, clock_sigma: f64) -> Self {
        self.pace.stretch += clock_sigma * stream.stream(3).normal(0);
        self
    }

    /// Draws one. `sigma` and `bias_sigma` are standard deviations in the unit of the quantity; the same specimen has another
    /// noise in each `flight`.
    pub fn draw(stream: Noise, sigma: f64, bias_sigma: f64, flight: u64) -> Self {
        let [phases, biases, noises] = [0, 1, 2].map(|index| stream.stream(index));
        Specimen {
            pace: Pace {
                phase: phases.uniform(0),
                stretch: 1.0,
            },
            bias: SVector::from_fn(|axis, _| bias_sigma * biases.normal(axis as u64)),
            sigma,
            axes: core::array::from_fn(|axis| noises.stream(flight * N as u64 + axis as u64)),
        }
    }

    /// Noise of the conversion complete at `instant_ns`.
    pub fn noise(&self, instant_ns: i64) -> SVector<f64, N> {
        if self.sigma == 0.0 {
            return SVector::zeros();
        }
        SVector::from_fn(|axis, _| self.sigma * self.axes[axis].normal(instant_ns as u64))
    }
}

/// The code of a value: rounded half away from zero, then clipped to the codes there are. A NaN is code 0.
pub fn quantise(value: f64, lsb: f64, codes: RangeInclusive<i32>) -> i32 {
    ((value / lsb).round() as i32).clamp(*codes.start(), *codes.end())
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector1;

    use super::*;

    const TAU_S: f64 = 0.0125;
    const PERIOD_NS: u64 = 3_906_250;
    /// A unit ramp taken as constant before the window of length W is off by tau exp(-W/tau) <= tau `TAIL`.
    const RAMP_TAIL: f64 = TAU_S * TAIL;

    fn clock() -> ConversionClock {
        ConversionClock::new(PERIOD_NS, 0.25)
    }

    #[test]
    fn a_conversion_is_complete_at_its_instant_and_not_before() {
        let clock = ConversionClock::new(1_000, 0.5);
        assert_eq!(clock.instant_ns(7), 7_500);
        assert_eq!((clock.latest(7_499), clock.latest(7_500), clock.latest(0)), (6, 7, -1));
    }

    #[test]
    fn a_ramp_comes_out_as_the_analytic_response() {
        // Kink at a node, so the input is linear between nodes and only the tail is cut off.
        let t0 = seconds(clock().instant_ns(100));
        let mut low_pass = LowPass::<1>::new(clock(), TAU_S);
        for k in 90..200 {
            let t = (seconds(clock().instant_ns(k)) - t0).max(0.0);
            let expected = t - TAU_S * (1.0 - (-t / TAU_S).exp());
            let out = low_pass.at(k, |t| Vector1::new((t - t0).max(0.0)))[0];
            assert!((out - expected).abs() < RAMP_TAIL, "{k}: {out} {expected}");
        }
    }

    #[test]
    fn a_step_between_conversions_comes_out_as_the_analytic_response() {
        // In the middle of a node interval the linear input stands for the step to second order.
        let step_over_tau = PERIOD_NS as f64 * 1e-9 / TAU_S;
        let tolerance = step_over_tau.powi(2) / 24.0 + TAIL;
        let t0 = seconds(clock().instant_ns(100)) + PERIOD_NS as f64 * 0.5e-9;
        let mut low_pass = LowPass::<1>::new(clock(), TAU_S);
        for k in 101..160 {
            let expected = 1.0 - (-(seconds(clock().instant_ns(k)) - t0) / TAU_S).exp();
            let out = low_pass.at(k, |t| Vector1::new(f64::from(t > t0)))[0];
            assert!((out - expected).abs() < tolerance, "{k}: {out} {expected}");
        }
    }

    #[test]
    fn a_slow_clock_still_resolves_the_time_constant() {
        let clock = ConversionClock::new(200_000_000, 0.0);
        let mut low_pass = LowPass::<1>::new(clock, TAU_S);
        let out = low_pass.at(5, |t| Vector1::new(3.0 + 10.0 * t))[0];
        // A ramp lags by the time constant.
        assert!((out - (3.0 + 10.0 * (1.0 - TAU_S))).abs() < 10.0 * RAMP_TAIL, "{out}");
    }

    #[test]
    fn the_order_of_reading_does_not_change_a_conversion() {
        let input = |t: f64| Vector1::new((17.0 * t).sin());
        let mut forwards = LowPass::<1>::new(clock(), TAU_S);
        let mut backwards = LowPass::<1>::new(clock(), TAU_S);
        let all: Vec<_> = (0..500).map(|k| forwards.at(k, input)).collect();
        for k in (0..500).rev().step_by(7) {
            assert_eq!(backwards.at(k, input), all[k as usize]);
        }
    }

    #[test]
    fn noise_is_normal_white_and_the_same_on_every_axis() {
        const COUNT: usize = 200_000;
        let specimen = Specimen::<3>::draw(Noise::new(1).stream(4), 2.0, 0.0, 0);
        let samples: Vec<_> = (0..COUNT)
            .map(|k| specimen.noise(k as i64 * PERIOD_NS as i64))
            .collect();
        // Five standard errors of mean, variance, fourth moment (variance 96) and products of unit normals.
        let bound = 5.0 / (COUNT as f64).sqrt();
        let mean = |f: &dyn Fn(usize) -> f64| (1..COUNT).map(f).sum::<f64>() / (COUNT - 1) as f64;
        for axis in 0..3 {
            let u = |k: usize| samples[k][axis] / 2.0;
            assert!(mean(&u).abs() < bound);
            assert!((mean(&|k| u(k).powi(2)) - 1.0).abs() < bound * 2_f64.sqrt());
            assert!((mean(&|k| u(k).powi(4)) - 3.0).abs() < bound * 96_f64.sqrt());
            assert!(mean(&|k| u(k) * u(k - 1)).abs() < bound);
            assert!(mean(&|k| u(k) * samples[k][(axis + 1) % 3] / 2.0).abs() < bound);
        }
    }

    #[test]
    fn rounding_is_half_away_from_zero_and_clips() {
        let code = |value| quantise(value, 0.5, -8..=7);
        assert_eq!([0.25, -0.25, 0.24, 99.0, -99.0].map(code), [1, -1, 0, 7, -8]);
        assert_eq!(code(f64::NAN), 0);
    }
}
