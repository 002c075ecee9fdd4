//! From what is felt to what a channel reads: the stages at which a physical effect can act.
//!
//! ```text
//! when it is read -> where and along what -> low-pass -> high-pass -> + added -> passed through
//!   read_late          aim                    lag_s      high_pass_s    add        then
//! ```
//!
//! A chain begins as the nominal channel; effects change it in place, and several may change one chain. All stages are
//! exact and smooth in what the effects put in.

use super::feel::{Aim, Feel};
use super::unit::Channel;

/// \[s\] later as a function of the nominal instant \[s\].
type Delay<'a> = Box<dyn Fn(f64) -> f64 + 'a>;
/// [physical unit] added, from what is felt and the channel's own input.
type Term<'a> = Box<dyn Fn(&Feel, f64) -> f64 + 'a>;
/// [physical unit] added, from what is felt.
type Felt<'a> = Box<dyn Fn(&Feel) -> f64 + 'a>;
/// Changes the series of readings; told the nominal instants \[s\].
type Stage<'a> = Box<dyn Fn(&[f64], &mut [f64]) + 'a>;

/// [time constants of the low-pass] before an instant what is gross of a reading is felt.
pub(crate) const BEFORE: [f64; 2] = [2.0 - core::f64::consts::SQRT_2, 2.0 + core::f64::consts::SQRT_2];

/// How one channel comes to its readings.
pub struct Chain<'a> {
    /// What it looks at.
    pub aim: Aim,
    /// [physical unit] constant.
    pub bias: f64,
    /// \[s\] time constant of a second first-order low-pass. Below zero it is a lead of the same slope: the low-pass of the
    /// channel is then faster than described.
    pub lag_s: f64,
    /// \[s\] time constant of a first-order high-pass.
    pub high_pass_s: Option<f64>,
    delays: Vec<Delay<'a>>,
    terms: Vec<Term<'a>>,
    gross: Vec<Felt<'a>>,
    /// Time constants \[s\], and [physical unit] per degC/s behind them.
    thermal: Vec<(f64, f64)>,
    stages: Vec<Stage<'a>>,
}

impl<'a> Chain<'a> {
    /// The nominal one.
    pub fn of(channel: &Channel) -> Self {
        Self {
            aim: Aim::of(channel),
            bias: channel.bias,
            lag_s: 0.0,
            high_pass_s: None,
            delays: Vec::new(),
            terms: Vec::new(),
            gross: Vec::new(),
            thermal: Vec::new(),
            stages: Vec::new(),
        }
    }

    /// What is logged at `t` was physically read `delay(t)` \[s\] later.
    pub fn read_late(&mut self, delay: impl Fn(f64) -> f64 + 'a) {
        self.delays.push(Box::new(delay));
    }

    /// Adds to every reading. What is felt is that of the instant which the channel's low-pass lets through, so that what acts
    /// on the sensor, and not behind its filter, is filtered to first order.
    pub fn add(&mut self, term: impl Fn(&Feel, f64) -> f64 + 'a) {
        self.terms.push(Box::new(term));
    }

    /// Adds what may be as large as the reading itself: it is taken through the channel's low-pass to third order.
    pub fn add_gross(&mut self, term: impl Fn(&Feel) -> f64 + 'a) {
        self.gross.push(Box::new(term));
    }

    /// Adds `per_rate` of the temperature's rate of change through a low-pass of `tau_s` > 0, of which the channel's own sees what it
    /// lets through to first order.
    pub fn add_thermal(&mut self, tau_s: f64, per_rate: f64) {
        self.thermal.push((tau_s, per_rate));
    }

    /// Changes the finished readings, given the nominal instants.
    pub fn then(&mut self, stage: impl Fn(&[f64], &mut [f64]) + 'a) {
        self.stages.push(Box::new(stage));
    }

    /// \[s\] the physical instant of what is logged at `t_s`.
    pub(crate) fn instant(&self, t_s: f64) -> f64 {
        t_s + self.delays.iter().map(|delay| delay(t_s)).sum::<f64>()
    }

    /// Whether it is read at other instants than the nominal ones.
    pub(crate) fn is_delayed(&self) -> bool {
        !self.delays.is_empty()
    }

    /// Whether it looks at what the nominal channel looks at, when and through what that does.
    pub(crate) fn looks_as(&self, channel: &Channel) -> bool {
        self.aim == Aim::of(channel) && self.lag_s == 0.0 && self.high_pass_s.is_none() && !self.is_delayed()
    }

    pub(crate) fn is_additive(&self) -> bool {
        !self.terms.is_empty()
    }

    pub(crate) fn is_gross(&self) -> bool {
        !self.gross.is_empty()
    }

    /// What is gross of a reading, through a low-pass, given what is felt [`BEFORE`] the instant. The exponential's mean by two of its
    /// instants is exact for cubics (Gauss and Laguerre; Abramowitz and Stegun 25.4.45).
    pub(crate) fn added_gross(&self, felt: [&Feel; 2]) -> f64 {
        let root = core::f64::consts::SQRT_2;
        let mean = |term: &Felt| 0.25 * ((2.0 + root) * term(felt[0]) + (2.0 - root) * term(felt[1]));
        self.gross.iter().map(mean).sum()
    }

    /// Time constants \[s\] and gains [physical unit per degC/s] of what follows the temperature.
    pub(crate) fn thermal(&self) -> &[(f64, f64)] {
        &self.thermal
    }

    pub(crate) fn added(&self, feel: &Feel, input: f64) -> f64 {
        self.terms.iter().map(|term| term(feel, input)).sum()
    }

    pub(crate) fn finish(&self, t_s: &[f64], readings: &mut [f64]) {
        for stage in &self.stages {
            stage(t_s, readings);
        }
    }
}
