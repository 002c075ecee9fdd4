//! When an effect is on: in one stretch of time, or in one that comes again and again.

use std::fmt;

use twin::effect::{Cause, onsets};

use crate::input::windows::Span;

/// When an effect that passes is on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    /// The stretch, or one of those.
    pub stretch: Span,
    /// \[s\] after which it comes again; `None` for once.
    pub every_s: Option<f64>,
}

impl Interval {
    /// Whether it is on at an instant \[s\].
    pub fn contains(self, t_s: f64) -> bool {
        match self.every_s {
            Some(every_s) => (t_s - self.stretch.from).rem_euclid(every_s) < self.stretch.to - self.stretch.from,
            None => self.stretch.contains(t_s),
        }
    }
}

/// \[s\] when an effect begins, if its variant is an onset in a log whose cycles begin at these instants.
pub fn begins_s(cause: &Cause, starts_s: &[f64]) -> Option<f64> {
    if cause.effect.has_values_between() {
        return None;
    }
    let values = cause.effect.between(starts_s);
    let onsets: Vec<f64> = onsets(starts_s).collect();
    let others: Vec<f64> = values.iter().copied().filter(|value| !onsets.contains(value)).collect();
    let is_onset = values.len() == others.len() + onsets.len() && !others.contains(&cause.variant);
    is_onset.then_some(cause.variant)
}

/// Part of a cycle, 0 to 1, after so many cycles.
pub fn phase(cycles: f64) -> f64 {
    // A remainder by one, and a tenth of its time.
    cycles - cycles.floor()
}

impl From<Span> for Interval {
    fn from(stretch: Span) -> Self {
        Interval { stretch, every_s: None }
    }
}

impl fmt::Display for Interval {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Span { from, to } = self.stretch;
        match self.every_s {
            Some(every_s) => write!(f, "{:.1} s of every {every_s:.2} s, as from {from:.1} s on", to - from),
            None => write!(f, "from {from:.1} to {to:.1} s"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_comes_again_is_on_before_and_after_the_stretch_that_tells_it() {
        let on = Interval {
            stretch: Span { from: 25.0, to: 28.0 },
            every_s: Some(10.0),
        };
        for (t_s, is_on) in [(4.9, false), (5.0, true), (7.9, true), (8.0, false), (95.5, true)] {
            assert_eq!(on.contains(t_s), is_on, "{t_s}");
        }
        assert_eq!(on.to_string(), "3.0 s of every 10.00 s, as from 25.0 s on");
    }
}
