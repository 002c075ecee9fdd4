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

use super::{
    health::Verdict,
    trace::{Added, Bounds, Cursor, LONG, Limits, Trace, WILD, larger},
};
use crate::root::{reciprocal_root, root};

/// Cycles the learned offset goes back: 200 s at 5 Hz. Large: steps are seen sharper. Small: drifts are followed.
pub(super) const MEMORY: f32 = 1000.0;
/// Standard deviations of the calibration's uncertainty that an offset may reach.
const OFFSET_LIMIT: f32 = 6.0;
/// Nothing is learned from a window that is this near to an alarm: three quarters of the way, squared.
pub(super) const QUIET: f32 = 0.75 * 0.75;
/// Cycles in a row beyond the gate that make a fault.
const STRIKES: u8 = 3;
/// An excluded axis comes back below these.
const SOUND: Limits = Limits {
    short: 3.0,
    long: 3.0,
    squares: 52.0,
};
/// Variance about its mean, in those of the noise, beyond which a fault is called noise and not bias.
const NOISY: f32 = 4.0;

/// One axis.
#[derive(Clone, Copy, Debug)]
pub(super) struct Watch {
    trace: Trace,
    /// \[unit2\] variance of its noise.
    pub(super) noise: f32,
    /// Of the noise that is counted in what is systematic, in its own.
    relative: f32,
    /// [unit] learned disagreement.
    pub(super) offset: f32,
    /// \[unit2\] of the offset.
    pub(super) offset_variance: f32,
    /// \[unit2\] what the calibration allows the offset to be.
    allowed: f32,
    strikes: u8,
    sound_for: u16,
    relapses: u8,
    pub(super) verdict: Verdict,
}

impl Watch {
    /// An axis not seen yet, with noise of this variance, whose offset may have the other; what is systematic is counted
    /// in noise of the variance `counted_in`.
    pub(super) fn new(noise: f32, allowed: f32, counted_in: f32) -> Self {
        Watch {
            trace: Trace::EMPTY,
            noise,
            relative: counted_in / noise,
            offset: 0.0,
            offset_variance: allowed,
            allowed,
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

    /// Takes a cycle's disagreement beyond the offset, whose noise has `share` times the variance of the axis's own.
    /// `systematic` is the variance of what is systematic, in the noise that is counted in.
    #[inline]
    pub(super) fn note(&mut self, cursor: Cursor, disagreement: f32, share: f32, systematic: f32) {
        // One wild value, as of an ignition between two plates' conversions, is the gate's business, not the window's.
        let mut sigmas = disagreement * reciprocal_root(self.noise * share);
        // The root is worth its while only beyond what it is at least.
        if sigmas.abs() > WILD {
            let most = WILD * root(1.0 + self.relative * systematic);
            sigmas = if sigmas > most {
                most
            } else if sigmas < -most {
                -most
            } else {
                sigmas
            };
        }
        self.trace.push(cursor, sigmas);
    }

    /// Takes a cycle in which it was not read.
    pub(super) fn miss(&mut self, cursor: Cursor) {
        self.trace.push(cursor, 0.0);
    }

    /// Notes that the axis was beyond the gate in this cycle, or not.
    pub(super) fn strike(&mut self, gated: bool) {
        self.strikes = if gated { self.strikes.saturating_add(1) } else { 0 };
    }

    /// How near it is to an alarm, squared; above 1 there is one.
    pub(super) fn alarm(&self, limits: Limits, added: &Added) -> f32 {
        self.loudness(self.trace.over_squared(limits, added, self.relative))
    }

    fn loudness(&self, over: f32) -> f32 {
        if self.strikes >= STRIKES {
            // At the third strike the alarm is as loud as the disagreement, so that the worst of several goes first.
            let loud = f32::from(self.strikes) / f32::from(STRIKES) + root(over);
            return loud * loud;
        }
        larger(self.crept(), over)
    }

    /// Square of the offset in parts of its limit.
    fn crept(&self) -> f32 {
        self.offset * self.offset / (OFFSET_LIMIT * OFFSET_LIMIT * self.allowed)
    }

    /// As [`Watch::learn`] of an axis whose window is within `bounds`, those of [`QUIET`], which most are; `None` of others.
    #[inline]
    pub(super) fn learn_quietly(&mut self, disagreement: f32, variance: f32, bounds: &Bounds) -> Option<()> {
        let crept = self.offset * self.offset;
        let quiet = self.trace.is_within(bounds) && crept <= QUIET * OFFSET_LIMIT * OFFSET_LIMIT * self.allowed;
        quiet.then(|| self.learn_from(disagreement, variance))
    }

    fn learn_from(&mut self, disagreement: f32, variance: f32) {
        let gain = self.offset_variance / variance;
        self.offset += gain * disagreement;
        let forgotten = self.noise * (1.0 / (MEMORY * MEMORY));
        let learnt = self.offset_variance * (1.0 - gain) + forgotten;
        self.offset_variance = if learnt < self.allowed { learnt } else { self.allowed };
    }

    /// Learns from a disagreement of this variance in all, unless something may be wrong; how near it is to an alarm, as
    /// [`Watch::alarm`] has it.
    pub(super) fn learn(&mut self, disagreement: f32, variance: f32, limits: Limits, added: &Added) -> f32 {
        let over = self.trace.over_squared(limits, added, self.relative);
        if larger(self.crept(), over) <= QUIET || !self.trace.full() {
            self.learn_from(disagreement, variance);
        }
        self.loudness(over)
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
            self.relapses = self.relapses.saturating_add(1).min(6);
            let most = OFFSET_LIMIT * root(self.allowed);
            self.offset = if self.offset.abs() < most { self.offset } else { 0.0 };
        }
        self.verdict = verdict;
        self.restart();
    }

    /// Looks at an excluded axis after a cycle was noted: it comes back after a full window of agreement, and after each
    /// relapse only after twice as many.
    pub(super) fn reconsider(&mut self, added: &Added) {
        let agrees = self.trace.over_squared(SOUND, added, self.relative) < 1.0;
        self.sound_for = if agrees { self.sound_for.saturating_add(1) } else { 0 };
        let wanted = (LONG as u16).checked_shl(self.relapses.saturating_sub(1).into());
        if self.sound_for >= wanted.unwrap_or(u16::MAX) {
            self.verdict = Verdict::Sound;
            self.strikes = 0;
        } else if self.trace.full() && self.verdict.is_unnamed() && !agrees {
            let (variance, expected) = self.trace.variance(added, self.relative);
            self.verdict = if variance > NOISY * expected {
                Verdict::Noisy
            } else {
                Verdict::Biased
            };
        }
    }
}

#[cfg(test)]
mod tests;
