//! What may be fitted and what only judges.
//!
//! In: a log and the case's windows. Out: [`Fit`], which is read freely, and [`Held`], whose samples no fit can reach.
//! A row belongs to a window when its cycle starts in it, first edge in, last edge out.
//!
//! Refuses windows that are empty, run backwards, are not finite or overlap.

use crate::input::{
    hold::Held,
    log::{Log, Series},
};

/// \[s\] from (in) and to (out).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Span {
    /// First instant in it.
    pub from: f64,
    /// First instant after it.
    pub to: f64,
}

impl Span {
    /// Whether an instant lies in it.
    pub fn contains(self, t_s: f64) -> bool {
        t_s >= self.from && t_s < self.to
    }

    fn overlaps(self, other: Span) -> bool {
        self.from < other.to && other.from < self.to
    }
}

/// Why windows are senseless.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum WindowsError {
    /// It has no length.
    #[error("[{0}, {1}] has no length; from must be less than to, both finite")]
    Empty(f64, f64),
    /// Two share an instant.
    #[error("[{0}, {1}] and [{2}, {3}] overlap; what judges must be apart from what is fitted")]
    Overlap(f64, f64, f64, f64),
}

/// The windows of a case.
#[derive(Clone, Debug, PartialEq)]
pub struct Windows {
    fit: Vec<Span>,
    hold: Vec<Span>,
}

impl Windows {
    /// Checks them.
    ///
    /// # Errors
    /// When one is empty or two overlap.
    pub fn new(fit: Vec<Span>, hold: Vec<Span>) -> Result<Self, WindowsError> {
        let all: Vec<Span> = fit.iter().chain(&hold).copied().collect();
        for (index, one) in all.iter().enumerate() {
            if !(one.from.is_finite() && one.to.is_finite() && one.from < one.to) {
                return Err(WindowsError::Empty(one.from, one.to));
            }
            if let Some(other) = all.iter().skip(index + 1).find(|other| one.overlaps(**other)) {
                return Err(WindowsError::Overlap(one.from, one.to, other.from, other.to));
            }
        }
        Ok(Windows { fit, hold })
    }

    /// All is fitted, and nothing judges.
    pub fn all() -> Self {
        let all = Span {
            from: f64::NEG_INFINITY,
            to: f64::INFINITY,
        };
        Windows {
            fit: vec![all],
            hold: Vec::new(),
        }
    }

    /// Those that are fitted.
    pub fn fit(&self) -> &[Span] {
        &self.fit
    }

    /// Those that judge.
    pub fn hold(&self) -> &[Span] {
        &self.hold
    }

    /// Parts a log.
    pub fn part(&self, log: &Log) -> (Fit, Held) {
        let within = |spans: &[Span]| -> Vec<Series> {
            let wanted = |row: usize| {
                let t_s = log.start_s.get(row).copied().unwrap_or(f64::NAN);
                spans.iter().any(|span| span.contains(t_s))
            };
            log.channels.iter().map(|series| series.only(wanted)).collect()
        };
        (
            Fit {
                channels: within(&self.fit),
            },
            Held::new(within(&self.hold)),
        )
    }
}

/// The samples a model may be fitted on.
#[derive(Clone, Debug, PartialEq)]
pub struct Fit {
    /// In the unit's channel order.
    pub channels: Vec<Series>,
}

#[cfg(test)]
mod tests {
    use super::*;

    fn span(from: f64, to: f64) -> Span {
        Span { from, to }
    }

    fn log_of(rows: usize) -> Log {
        Log {
            start_s: (0..rows).map(|row| row as f64).collect(),
            channels: vec![Series {
                rows: (0..rows as u32).collect(),
                values: vec![1.0; rows],
            }],
            ..Log::empty(1)
        }
    }

    #[test]
    fn every_row_is_fitted_or_held_never_both() {
        let windows = Windows::new(vec![span(0.0, 3.0)], vec![span(3.0, 5.0)]).expect("windows");
        let (fit, held) = windows.part(&log_of(6));
        assert_eq!(fit.channels[0].rows, [0, 1, 2]);
        assert_eq!(held.counts(), [2]);
    }

    #[test]
    fn windows_that_share_an_instant_are_refused() {
        let shared = Windows::new(vec![span(0.0, 3.0)], vec![span(2.0, 5.0)]);
        assert_eq!(shared, Err(WindowsError::Overlap(0.0, 3.0, 2.0, 5.0)));
    }

    #[test]
    fn a_window_without_length_is_refused() {
        for (from, to) in [(3.0, 3.0), (4.0, 3.0), (0.0, f64::INFINITY)] {
            assert_eq!(
                Windows::new(vec![span(from, to)], vec![]),
                Err(WindowsError::Empty(from, to))
            );
        }
    }
}
