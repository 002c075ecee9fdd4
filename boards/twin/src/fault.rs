//! What may befall the unit, by one name wherever it is made to: on the host board, on the emulated one, in a log.
//!
//! In: words and a seed. Out: [`Scheduled`] strokes, which both boards take, or readings rewritten ([`log`]). A fault is
//! written
//!
//! ```text
//! NAME[:TARGET][=SIZE]@FROM[..TO][xTIMES]      silent:a2@10s..20s   stretch:m1=20@3s   reset@31s..60s x20
//! ```
//!
//! NAME is one of [`WORDS`], which says what the target and the size mean and where the fault can be made. Times are `250ms`,
//! `3s`, `10min`, `2h`, without a unit seconds. A fault that lasts ends at TO, or with the run. With `xTIMES` there are so many,
//! at instants drawn uniformly between FROM and TO; each that lasts ends half-way to the next. What the text leaves
//! open (instants, which way a cut tears, which bit flips) follows from the seed alone, so a text and a seed replay a run.
//!
//! A fault that was scheduled need not have struck: nobody may have called the part that is silent. So the boards count what
//! faults did, under the same names: [`Struck`].
//!
//! Refuses: a name, target, size or time that cannot be meant, with what could be.

pub mod ill;
pub mod log;
mod words;

use std::{
    collections::BTreeMap,
    fmt::{self, Display},
    str::FromStr,
};

use thiserror::Error;

pub use self::words::{SENSOR_NAMES, Target, WORDS, Word};
use crate::part::{Nanos, signal::Noise};
pub use crate::run::{End, Fault, Level, Scheduled};

/// How often each fault did something, by its name.
pub type Struck = BTreeMap<&'static str, u64>;

/// A fault and when it is to strike.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Planned {
    /// Which.
    pub word: &'static Word,
    /// What it befalls: a slot of the reading order, an [`End`] or a [`Level`] by its number; 0 where there is only one.
    pub target: usize,
    /// How large, in the unit of its [`Word::size`].
    pub size: Option<f64>,
    /// \[ns\] from when on.
    pub from: Nanos,
    /// \[ns\] until when.
    pub to: Option<Nanos>,
    /// How many.
    pub times: u32,
}

/// Why a text is no fault.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("{text}: {why}")]
pub struct BadFault {
    text: String,
    why: String,
}

impl FromStr for Planned {
    type Err = BadFault;

    fn from_str(text: &str) -> Result<Self, BadFault> {
        parse(text).map_err(|why| BadFault { text: text.into(), why })
    }
}

fn parse(text: &str) -> Result<Planned, String> {
    let (what, when) = text
        .split_once('@')
        .ok_or("say when, like silent:a2@10s or reset@31s..60s x20")?;
    let (what, size) = match what.split_once('=') {
        Some((what, size)) => (what, Some(number(size)?)),
        None => (what, None),
    };
    let (name, target) = what
        .split_once(':')
        .map_or((what, None), |(name, target)| (name, Some(target)));
    let known = || WORDS.map(|word| word.name).join(" ");
    let word = (WORDS.iter().find(|word| word.name == name))
        .ok_or_else(|| format!("no fault is called {name}; there are {}", known()))?;
    if size.is_some() && word.size.is_empty() {
        return Err(format!("{name} has no size"));
    }
    let (when, times) = match when.split_once('x') {
        Some((when, times)) => (
            when,
            times.parse().map_err(|_| format!("{times} is no number of times"))?,
        ),
        None => (when, 1),
    };
    let (from, to) = match when.trim().split_once("..") {
        Some((from, to)) => (time(from)?, Some(time(to)?)),
        None => (time(when.trim())?, None),
    };
    if to.is_some_and(|to| to <= from) {
        return Err("it would end before it begins".into());
    }
    if times != 1 && (times == 0 || to.is_none()) {
        return Err("several strikes need an end: write it like reset@31s..60s x20".into());
    }
    let target = word.on.number(target)?;
    Ok(Planned {
        word,
        target,
        size,
        from,
        to,
        times,
    })
}

fn number(text: &str) -> Result<f64, String> {
    let number: Option<f64> = text.parse().ok();
    number
        .filter(|number| number.is_finite())
        .ok_or_else(|| format!("\"{text}\" is no number"))
}

/// \[ns\] of a time such as 250ms, 3s, 10min, 2h or 3.
fn time(text: &str) -> Result<Nanos, String> {
    let units = [("ms", 1e6), ("min", 60e9), ("us", 1e3), ("s", 1e9), ("h", 3600e9)];
    let unit = units
        .into_iter()
        .find_map(|(unit, ns)| Some((text.strip_suffix(unit)?, ns)));
    let (digits, ns) = unit.unwrap_or((text, 1e9));
    let ns = number(digits)? * ns;
    if (0.0..1e18).contains(&ns) {
        Ok(ns.round() as Nanos)
    } else {
        Err(format!("{text} is no time; write it like 250ms, 3s or 10min"))
    }
}

impl Planned {
    /// The strokes of a run, in order of time, those that end it among them.
    pub fn strokes(&self, seed: u64) -> Vec<Scheduled> {
        let noise = Noise::new(seed).stream(self.word.number());
        let mut instants: Vec<Nanos> = match self.to {
            Some(to) if self.times > 1 => (0..u64::from(self.times))
                .map(|n| self.from + (noise.uniform(n) * (to - self.from) as f64) as Nanos)
                .collect(),
            _ => vec![self.from],
        };
        instants.sort_unstable();
        let mut strokes = Vec::new();
        for (n, at) in instants.iter().enumerate() {
            let draw = u64::from(noise.stream(1).word(n as u64)) << 16 | u64::from(noise.stream(2).word(n as u64));
            strokes.push(Scheduled {
                at: *at,
                fault: (self.word.begin)(self.target, self.size, draw),
            });
            let ends = match (self.times, instants.get(n + 1)) {
                (1, _) => self.to,
                (_, Some(next)) => Some(at + (next - at) / 2),
                (_, None) => self.to,
            };
            if let (Some(end), Some(at)) = (self.word.end, ends) {
                strokes.push(Scheduled {
                    at,
                    fault: end(self.target),
                });
            }
        }
        strokes
    }
}

/// Everything that is planned, in order of time.
pub fn schedule(planned: &[Planned], seed: u64) -> Vec<Scheduled> {
    let strokes = planned.iter().enumerate();
    let mut strokes: Vec<Scheduled> = strokes
        .flat_map(|(n, planned)| planned.strokes(seed + n as u64))
        .collect();
    strokes.sort_by_key(|stroke| stroke.at);
    strokes
}

impl Display for Planned {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.word.name)?;
        if let Some(target) = self.word.on.name(self.target) {
            write!(f, ":{target}")?;
        }
        if let Some(size) = self.size {
            write!(f, "={size}")?;
        }
        write!(f, "@{}s", self.from as f64 / 1e9)?;
        if let Some(to) = self.to {
            write!(f, "..{}s", to as f64 / 1e9)?;
        }
        if self.times > 1 {
            write!(f, " x{}", self.times)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests;
