//! The outcome of a diagnosis: decided here, once, and told by whoever tells it.
//!
//! In: how many causes are named, how likely it is that what is left matters, and that no cause explains it, and how far calibration alone
//! shrinks the gap. Out: an [`Outcome`].

use crate::thresholds::SAID;

/// What a diagnosis comes to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// Calibration and noise are enough.
    Clean,
    /// They are once the calibration is fitted anew.
    Recalibrate,
    /// At least one cause is likelier than not, and nothing that matters is left.
    Named,
    /// At least one cause is, and what is left matters.
    PartlyNamed,
    /// What is there matters, but no cause of it is likelier than not.
    Undecided,
    /// What is there matters, and nothing in the library explains it.
    Unknown,
}

impl Outcome {
    /// Of so many causes, with these probabilities that what is left matters and that no cause explains it; `recalibrated` is whether a new
    /// calibration shrinks the held-out gap by more than what matters.
    pub fn of(causes: usize, matters: f64, none_of_these: f64, recalibrated: bool) -> Self {
        match (causes > 0, matters > SAID) {
            (true, false) => Outcome::Named,
            (true, true) => Outcome::PartlyNamed,
            (false, true) if is_unexplained(none_of_these) => Outcome::Unknown,
            (false, true) => Outcome::Undecided,
            (false, false) if recalibrated => Outcome::Recalibrate,
            (false, false) => Outcome::Clean,
        }
    }

    /// As verdict.json has it.
    pub fn word(self) -> &'static str {
        match self {
            Outcome::Clean => "clean",
            Outcome::Recalibrate => "recalibrate",
            Outcome::Named => "named",
            Outcome::PartlyNamed => "partly-named",
            Outcome::Undecided => "undecided",
            Outcome::Unknown => "unknown",
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

    #[test]
    fn a_name_comes_first_then_what_matters_then_the_calibration() {
        assert_eq!(Outcome::of(1, 0.1, 0.1, true), Outcome::Named);
        assert_eq!(Outcome::of(1, 0.9, 0.9, false), Outcome::PartlyNamed);
        assert_eq!(Outcome::of(0, 0.9, 0.51, true), Outcome::Unknown);
        assert_eq!(Outcome::of(0, 0.9, 0.3, true), Outcome::Undecided);
        assert_eq!(Outcome::of(0, 0.1, 0.1, true), Outcome::Recalibrate);
        assert_eq!(Outcome::of(0, 0.1, 0.1, false), Outcome::Clean);
    }
}
