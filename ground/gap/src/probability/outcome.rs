//! The outcome of a diagnosis: decided here, once, and told by whoever tells it.
//!
//! In: how many causes are named, how likely it is that something outside the library is needed, and the judgement of
//! "calibration and noise are enough". Out: an [`Outcome`].

use crate::{
    thresholds::{SAID, UNKNOWN_ALONE},
    unknown::adequacy::Leftover,
};

/// What a diagnosis comes to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// Calibration and noise are enough.
    Clean,
    /// At least one cause is likelier than not.
    Named,
    /// There is a gap, but no cause of it is likelier than not.
    Undecided,
    /// There is a gap, and nothing in the library explains it.
    Unknown,
}

impl Outcome {
    /// Of so many causes, with this probability of something outside the library, where `gate` judges the log without
    /// effects.
    pub fn of(causes: usize, none_of_these: f64, gate: &Leftover) -> Self {
        if causes > 0 {
            Outcome::Named
        } else if is_unexplained(none_of_these) {
            Outcome::Unknown
        } else if gate.unknown(UNKNOWN_ALONE) > SAID {
            Outcome::Undecided
        } else {
            Outcome::Clean
        }
    }
}

/// Whether something outside the library is likelier needed than not, whatever is named.
pub fn is_unexplained(none_of_these: f64) -> bool {
    none_of_these > SAID
}

#[cfg(test)]
mod tests {
    use super::*;

    fn gate(log_tail: f64) -> Leftover {
        Leftover {
            p: 0.005,
            log_tail,
            aspects: Vec::new(),
            again: None,
            scale: [1.0, 1.0],
        }
    }

    #[test]
    fn a_name_comes_first_then_the_unknown_then_the_gap() {
        let (large, small) = (gate(-50.0), gate(0.0));
        assert_eq!(Outcome::of(1, 0.99, &large), Outcome::Named);
        assert_eq!(Outcome::of(0, 0.51, &large), Outcome::Unknown);
        assert_eq!(Outcome::of(0, 0.5, &large), Outcome::Undecided);
        let plain = Leftover { p: 0.9, ..small };
        assert_eq!(Outcome::of(0, 0.15, &plain), Outcome::Clean);
    }
}
