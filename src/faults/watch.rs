//! One axis under watch: what it disagrees by, how that has been, and whether it is believed.
//!
//! In, each cycle: the disagreement of the axis with what the others say of it, with its standard deviation in two parts,
//! noise (which averages out) and systematic (which does not). Out: how near it is to an alarm, and whether an excluded axis
//! may come back.
//!
//! A constant disagreement within the calibration's uncertainty is no fault. It is learned as an offset by a scalar Kalman
//! filter that starts with the uncertainty of the biases and remembers some [`MEMORY`] cycles; alarms are raised by what
//! departs from it. So a step is seen at the noise's level, not at the calibration's. What creeps in slowly is learned too,
//! until the offset is more than the calibration can be off by: that is an alarm of its own.

use nalgebra::ComplexField;

use super::{
    health::Verdict,
    trace::{LONG, SHORT, Trace},
};

/// Cycles the learned offset goes back: 200 s at 5 Hz. Large: steps are seen sharper. Small: drifts are followed.
pub(super) const MEMORY: f32 = 1000.0;
/// Standard deviations of the calibration's uncertainty that an offset may reach.
const OFFSET_LIMIT: f32 = 6.0;
/// Nothing is learned from a window that is this near to an alarm.
const QUIET: f32 = 0.6;
/// Sum of squares over a full window: chi-square of 26 degrees of freedom, 1e-8.
const SQUARES_LIMIT: f32 = 90.0;
/// Cycles in a row beyond the gate that make a fault.
const STRIKES: u8 = 3;
/// An excluded axis comes back below these: means in standard deviations, and the sum of squares.
const SOUND: (f32, f32) = (3.0, 52.0);
/// How fast a systematic part is forgotten, so that a window does not outlive what widened it: 0.83^26 is 1 %.
const FORGETTING: f32 = 0.83;
/// Variance about its mean, in those of the noise, beyond which a fault is called noise and not bias.
const NOISY: f32 = 4.0;

/// Where the means over one second and over five give an alarm, in standard deviations.
#[derive(Clone, Copy, Debug)]
pub(super) struct Limits {
    pub(super) short: f32,
    pub(super) long: f32,
}

/// One axis.
#[derive(Clone, Copy, Debug)]
pub(super) struct Watch {
    trace: Trace,
    /// [unit] learned disagreement.
    pub(super) offset: f32,
    /// [unit2] of the offset.
    pub(super) offset_variance: f32,
    /// [unit2] what the calibration allows the offset to be.
    allowed: f32,
    /// Systematic variance over noise variance, slowly forgotten.
    doubt: f32,
    strikes: u8,
    sound_for: u16,
    relapses: u8,
    pub(super) verdict: Verdict,
}

impl Watch {
    /// An axis not seen yet, whose offset may have this variance.
    pub(super) fn new(allowed: f32) -> Self {
        Watch {
            trace: Trace::EMPTY,
            offset: 0.0,
            offset_variance: allowed,
            allowed,
            doubt: 0.0,
            strikes: 0,
            sound_for: 0,
            relapses: 0,
            verdict: Verdict::Sound,
        }
    }

    /// Whether the axis is not to be used.
    pub(super) fn excluded(&self) -> bool {
        self.verdict != Verdict::Sound
    }

    /// Whether it has been watched for a full window since it was last restarted.
    pub(super) fn seen_long(&self) -> bool {
        self.trace.full()
    }

    /// Takes a cycle's disagreement beyond the offset, with the standard deviation of its noise and the variance of what is
    /// systematic in it.
    pub(super) fn note(&mut self, disagreement: f32, noise: f32, systematic: f32) {
        let doubt = (systematic + self.offset_variance) / (noise * noise);
        self.doubt = doubt.max(FORGETTING * self.doubt);
        self.trace.push(disagreement / noise);
    }

    /// Notes that the axis was beyond the gate in this cycle, or not.
    pub(super) fn strike(&mut self, gated: bool) {
        self.strikes = if gated { self.strikes.saturating_add(1) } else { 0 };
    }

    /// How near it is to an alarm; above 1 there is one.
    pub(super) fn alarm(&self, limits: Limits) -> f32 {
        let means = (self.trace.short() / widened(limits.short, SHORT, self.doubt))
            .abs()
            .max((self.trace.long() / widened(limits.long, LONG, self.doubt)).abs());
        let spread = ComplexField::sqrt(self.trace.squares() / (SQUARES_LIMIT * (1.0 + self.doubt)));
        let crept = self.offset.abs() / (OFFSET_LIMIT * ComplexField::sqrt(self.allowed));
        let struck = f32::from(self.strikes) / f32::from(STRIKES);
        // At the third strike the alarm is as loud as the disagreement, so that the worst of several goes first.
        let struck = if struck >= 1.0 { struck + spread } else { 0.0 };
        means.max(spread).max(crept).max(struck)
    }

    /// Learns from a disagreement of this variance in all, unless something may be wrong.
    pub(super) fn learn(&mut self, disagreement: f32, variance: f32, noise: f32, limits: Limits) {
        if self.alarm(limits) > QUIET && self.trace.full() {
            return;
        }
        let gain = self.offset_variance / variance;
        self.offset += gain * disagreement;
        let forgotten = noise / MEMORY;
        self.offset_variance = (self.offset_variance * (1.0 - gain) + forgotten * forgotten).min(self.allowed);
    }

    /// Begins its window anew, as after a change of what it is compared with.
    pub(super) fn restart(&mut self) {
        self.trace = Trace::EMPTY;
        self.sound_for = 0;
        self.strikes = 0;
    }

    /// Is no longer believed. A learned offset that has crept beyond what is allowed is given up with it.
    pub(super) fn exclude(&mut self, verdict: Verdict) {
        if !self.excluded() {
            self.relapses = (self.relapses + 1).min(6);
            let most = OFFSET_LIMIT * ComplexField::sqrt(self.allowed);
            self.offset = if self.offset.abs() < most { self.offset } else { 0.0 };
        }
        self.verdict = verdict;
        self.restart();
    }

    /// Looks at an excluded axis after a cycle was noted: it comes back after a full window of agreement, and after each
    /// relapse only after twice as many.
    pub(super) fn reconsider(&mut self) {
        let means = (self.trace.short() / widened(SOUND.0, SHORT, self.doubt))
            .abs()
            .max((self.trace.long() / widened(SOUND.0, LONG, self.doubt)).abs());
        let agrees = means < 1.0 && self.trace.squares() < SOUND.1 * (1.0 + self.doubt);
        self.sound_for = if agrees { self.sound_for.saturating_add(1) } else { 0 };
        if self.sound_for >= (LONG as u16) << self.relapses.saturating_sub(1) {
            self.verdict = Verdict::Sound;
            self.strikes = 0;
        } else if self.trace.full() && self.verdict.is_unnamed() && !agrees {
            let noisy = self.trace.variance() > NOISY * (1.0 + self.doubt);
            self.verdict = if noisy { Verdict::Noisy } else { Verdict::Biased };
        }
    }
}

/// A limit on a mean over `cycles`, with what does not average out added to the noise.
fn widened(limit: f32, cycles: usize, doubt: f32) -> f32 {
    limit * ComplexField::sqrt(1.0 + cycles as f32 * doubt)
}
