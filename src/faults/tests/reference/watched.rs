//! One axis: its disagreements since the last restart, and what is held of it.

extern crate std;

use std::vec::Vec;

use super::super::super::Verdict;

/// Values since the last restart, to a 64th, at most 127.
#[derive(Clone, Default)]
pub(crate) struct History(pub(crate) Vec<f64>);

impl History {
    pub(crate) fn push(&mut self, value: f64) {
        self.0.push(((value * 64.0).round() / 64.0).clamp(-127.0, 127.0));
    }

    pub(super) fn last(&self, cycles: usize) -> &[f64] {
        &self.0[self.0.len().saturating_sub(cycles)..]
    }

    pub(super) fn sum(&self, cycles: usize) -> f64 {
        self.last(cycles).iter().sum()
    }

    pub(super) fn squares(&self) -> f64 {
        self.last(26).iter().map(|value| value * value).sum()
    }

    pub(crate) fn full(&self) -> bool {
        self.0.len() >= 26
    }
}

/// Means over one and five seconds in standard deviations, and the sum of squares.
pub(crate) type Limits = [f64; 3];
const SOUND: Limits = [3.0, 3.0, 52.0];
pub(super) const QUIET: f64 = 0.5625;

/// One axis.
#[derive(Clone)]
pub(crate) struct Watched {
    pub(crate) history: History,
    pub(crate) noise: f64,
    relative: f64,
    pub(crate) offset: f64,
    pub(crate) offset_variance: f64,
    allowed: f64,
    pub(crate) strikes: u32,
    sound_for: u32,
    relapses: u32,
    pub(crate) verdict: Verdict,
    /// Whether it learned was a matter of rounding.
    pub(crate) open: bool,
}

impl Watched {
    pub(crate) fn new(noise: f64, allowed: f64, counted_in: f64) -> Self {
        Watched {
            history: History::default(),
            noise,
            relative: counted_in / noise,
            offset: 0.0,
            offset_variance: allowed,
            allowed,
            strikes: 0,
            sound_for: 0,
            relapses: 0,
            verdict: Verdict::Sound,
            open: false,
        }
    }

    pub(crate) fn excluded(&self) -> bool {
        self.verdict != Verdict::Sound
    }

    pub(super) fn unnamed(&self) -> bool {
        [Verdict::Disagreeing, Verdict::Biased, Verdict::Noisy].contains(&self.verdict)
    }

    pub(crate) fn note(&mut self, disagreement: f64, share: f64, systematic: f64) {
        let sigmas = disagreement / (self.noise * share).sqrt();
        let most = 4.5 * (1.0 + self.relative * systematic).sqrt();
        // What is wild without anything systematic is clipped with it.
        let clipped = if sigmas.abs() > 4.5 {
            sigmas.clamp(-most, most)
        } else {
            sigmas
        };
        self.history.push(clipped);
    }

    /// The largest figure in parts of its limit, squared.
    pub(crate) fn over(&self, [short, long, squares]: Limits, systematic: &History) -> f64 {
        let history = &self.history;
        let of_squares = history.squares() / (squares + 4.5 * 4.5 * self.relative * systematic.squares());
        if history.0.len() < 6 {
            return of_squares;
        }
        let mean = |cycles: usize, limit: f64, seen: usize| {
            let variance = cycles as f64 + self.relative * systematic.sum(seen).powi(2);
            history.sum(seen).powi(2) / (limit * limit * variance)
        };
        of_squares
            .max(mean(6, short, 6))
            .max(mean(history.0.len().min(26), long, 26))
    }

    pub(super) fn crept(&self) -> f64 {
        (self.offset / 6.0).powi(2) / self.allowed
    }

    pub(super) fn loudness(&self, over: f64) -> f64 {
        if self.strikes >= 3 {
            return (f64::from(self.strikes) / 3.0 + over.sqrt()).powi(2);
        }
        self.crept().max(over)
    }

    pub(crate) fn alarm(&self, limits: Limits, systematic: &History) -> f64 {
        self.loudness(self.over(limits, systematic))
    }

    pub(crate) fn learn(&mut self, disagreement: f64, variance: f64, limits: Limits, systematic: &History) -> f64 {
        let over = self.over(limits, systematic);
        let near = self.crept().max(over);
        // Within what single precision and steps of a 64th leave open.
        self.open |= self.history.full() && (near / QUIET - 1.0).abs() < 2e-3;
        if near <= QUIET || !self.history.full() {
            let gain = self.offset_variance / variance;
            self.offset += gain * disagreement;
            let learnt = (1.0 - gain) * self.offset_variance + self.noise / 1e6;
            self.offset_variance = learnt.min(self.allowed);
        }
        self.loudness(over)
    }

    pub(crate) fn strike(&mut self, gated: bool) {
        self.strikes = if gated { self.strikes + 1 } else { 0 };
    }

    pub(crate) fn restart(&mut self) {
        self.history = History::default();
        (self.sound_for, self.strikes) = (0, 0);
    }

    pub(crate) fn exclude(&mut self, verdict: Verdict) {
        if !self.excluded() {
            self.relapses = (self.relapses + 1).min(6);
            if self.offset.abs() >= 6.0 * self.allowed.sqrt() {
                self.offset = 0.0;
            }
        }
        self.verdict = verdict;
        self.restart();
    }

    pub(crate) fn reconsider(&mut self, systematic: &History) {
        let agrees = self.over(SOUND, systematic) < 1.0;
        self.sound_for = if agrees { self.sound_for + 1 } else { 0 };
        if self.sound_for >= 26 << (self.relapses - 1) {
            (self.verdict, self.strikes) = (Verdict::Sound, 0);
        } else if self.history.full() && self.unnamed() && !agrees {
            let mean = self.history.sum(26) / 26.0;
            let variance = self.history.squares() / 26.0 - mean * mean;
            let expected = 1.0 + self.relative * systematic.squares() / 26.0;
            self.verdict = if variance > 4.0 * expected {
                Verdict::Noisy
            } else {
                Verdict::Biased
            };
        }
    }
}
