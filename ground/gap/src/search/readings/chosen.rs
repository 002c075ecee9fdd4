//! What a search gives: an effect that was chosen, and those that could stand in its place.

use nalgebra::{DMatrix, DVector};

use crate::{null::interval::Interval, thresholds::TEMPERATURE};

/// A chosen effect.
#[derive(Clone, Debug)]
pub struct Chosen {
    /// Index of its hypothesis.
    pub hypothesis: usize,
    /// Its parameters.
    pub theta: DVector<f64>,
    /// Their covariance.
    pub covariance: DMatrix<f64>,
    /// \[nats\] over the model without it, prior odds included.
    pub gain: f64,
    /// Hypotheses that could stand in its place, itself among them; best first.
    pub rivals: Vec<Rival>,
}

/// A hypothesis that could stand in the place of a chosen one.
#[derive(Clone, Debug)]
pub struct Rival {
    /// Its index.
    pub hypothesis: usize,
    /// Its parameters; empty where only a screen was asked.
    pub theta: DVector<f64>,
    /// \[nats\] over the model with neither, prior odds included.
    pub gain: f64,
    /// \[nats\] over the model with the chosen one, by the screen and with what is always on, prior odds included; minus infinity where it is
    /// not known.
    pub beside: f64,
    /// When it would be on; `None` for always.
    pub span: Option<Interval>,
    /// Whether it is the hypothesis, and not the same course without what its physics makes of it, which has no name.
    pub is_named: bool,
}

impl Rival {
    /// \[nats\] of it in the place of the chosen one, prior odds included, without what it would explain beside that one too.
    ///
    /// Of two effects i and j each is there or not. With gains `g` (over neither; of j over i alone `g_j|i`) the odds of j without i against
    /// i, with j or without, are `exp(g_j) / (exp(g_i) (1 + exp(g_j|i)))`. So a rival that explains something else, `g_j|i = g_j`, has at
    /// most the odds of nothing.
    pub fn in_its_place(&self) -> f64 {
        let beside = self.beside / TEMPERATURE;
        self.gain - TEMPERATURE * (beside.max(0.0) + (-beside.abs()).exp().ln_1p())
    }
}

/// \[nats\] of all of them.
pub fn total_gain(chosen: &[Chosen]) -> f64 {
    chosen.iter().map(|chosen| chosen.gain).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(gain: f64, beside: f64) -> f64 {
        let rival = Rival {
            hypothesis: 0,
            theta: DVector::zeros(0),
            gain,
            beside,
            span: None,
            is_named: true,
        };
        rival.in_its_place()
    }

    #[test]
    fn what_explains_the_same_is_a_rival_with_all_its_evidence() {
        assert_eq!(of(30.0, f64::NEG_INFINITY), 30.0);
        assert!((of(30.0, -12.0) - 30.0).abs() < 0.01);
    }

    #[test]
    fn what_explains_something_else_as_well_is_no_likelier_than_nothing() {
        assert!(of(9.0, 9.0).abs() < 0.03);
        assert!(of(3000.0, 3000.0).abs() < 1e-9);
        // Half of what it explains is the same: that half is contested.
        assert!((of(200.0, 100.0) - 100.0).abs() < 1e-9);
    }
}
