//! What some logs say together, and whether they agree.
//!
//! In: [`Heard`] of one log or several. Out: normal equations of each hypothesis with the unit's unknowns marginalised after the logs were
//! summed, and [`Apart`]: by how much better each log with parameters of its own explains what it saw,
//!
//! ```text
//! X = s'(G + P)^-1 s over the parameters of each log  -  the same over shared ones
//! ```
//!
//! with the unit's unknowns shared in both and a prior `P` that leaves the parameters free. Where the logs agree `X` has a chi-square law of
//! as many degrees of freedom as there are parameters that the logs tell apart, `tr (G + P)^-1 G` of the one less that of the other: a
//! log that does not show an effect contradicts nobody.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use statrs::distribution::{ChiSquared, ContinuousCDF};

use crate::{
    thresholds::{CHANCE, STRENGTH_TOLERATED},
    together::heard::Heard,
};

/// [prior sigmas] how large a parameter may be where logs are compared: the largest size that the evidence offers ([`crate::null::evidence`]), a
/// quarter of what nulls are left free for, so that a log that leaves the effect free says nothing of it.
const FREE: f64 = 5.0;

/// Degrees of freedom below which logs tell nothing apart.
const LEAST_FREE: f64 = 0.5;

/// By how much logs differ.
#[derive(Clone, Copy, Debug)]
pub struct Apart {
    /// Of the difference of their parameters.
    pub chi_square: f64,
    /// Its degrees of freedom.
    pub free: f64,
    /// Probability of as much by chance.
    pub chance: f64,
    /// Root of it over what the shared parameters explain: by what part of itself the effect differs.
    pub part: f64,
}

impl Apart {
    /// Whether the logs contradict each other: beyond chance, one of so many comparisons (Bonferroni), and by more than a true law may be off,
    /// as on held-out windows.
    pub fn is_contradiction(&self, of: usize) -> bool {
        self.chance * (of as f64) < CHANCE && self.part > STRENGTH_TOLERATED
    }
}

/// Some logs.
pub struct Joint<'a> {
    heard: Vec<&'a Heard>,
    /// Of `I + K`.
    factor: Option<Cholesky<f64, Dyn>>,
    pull: DVector<f64>,
}

impl<'a> Joint<'a> {
    /// Of these; those whose unknowns of the unit are not those of the first are left out.
    pub fn of(heard: impl IntoIterator<Item = &'a Heard>) -> Self {
        let mut heard: Vec<&Heard> = heard.into_iter().collect();
        let names = heard.first().map(|first| first.shared.clone()).unwrap_or_default();
        heard.retain(|own| own.shared == names);
        let size = names.len();
        let mut inner = DMatrix::identity(size, size);
        let mut pull = DVector::zeros(size);
        for own in &heard {
            inner += &own.inner;
            pull += &own.pull;
        }
        Self {
            heard,
            factor: Cholesky::new(inner),
            pull,
        }
    }

    /// Information and score of a hypothesis that all of them have.
    pub fn products(&self, key: &str) -> Option<(DMatrix<f64>, DVector<f64>)> {
        self.products_of(key, false)
    }

    /// The same with parameters of each log's own, one after the other, where `are_own`.
    fn products_of(&self, key: &str, are_own: bool) -> Option<(DMatrix<f64>, DVector<f64>)> {
        let own: Vec<_> = self
            .heard
            .iter()
            .map(|heard| heard.own.get(key))
            .collect::<Option<_>>()?;
        let width = own.first()?.score.len();
        let copies = if are_own { own.len() } else { 1 };
        let mut information = DMatrix::zeros(copies * width, copies * width);
        let mut score = DVector::zeros(copies * width);
        let mut open = DMatrix::zeros(self.pull.len(), copies * width);
        for (log, own) in own.iter().enumerate() {
            let at = if are_own { log * width } else { 0 };
            let mut part = information.view_mut((at, at), (width, width));
            part += &own.information;
            let mut part = score.rows_mut(at, width);
            part += &own.score;
            let mut part = open.columns_mut(at, width);
            part += &own.open;
        }
        if let Some(factor) = &self.factor {
            let taken = factor.solve(&open);
            information -= open.tr_mul(&taken);
            score -= taken.tr_mul(&self.pull);
        }
        Some((information, score))
    }

    /// Whether the logs agree about a hypothesis whose parameters have these prior sigmas; none where fewer than two of them show it.
    pub fn apart(&self, key: &str, sigmas: &[f64]) -> Option<Apart> {
        let explained = |are_own: bool| {
            let (information, score) = self.products_of(key, are_own)?;
            let size = |index: usize| FREE * sigmas.get(index % sigmas.len().max(1)).copied().unwrap_or(1.0);
            let width = score.len();
            let scaled = DMatrix::from_fn(width, width, |row, column| {
                size(row) * information[(row, column)] * size(column)
            });
            let score = DVector::from_fn(width, |row, _| size(row) * score[row]);
            let factor = Cholesky::new(DMatrix::identity(width, width) + scaled)?;
            let free = width as f64 - factor.inverse().trace();
            Some((score.dot(&factor.solve(&score)), free))
        };
        let ((own, own_free), (shared, shared_free)) = (explained(true)?, explained(false)?);
        let (chi_square, free) = ((own - shared).max(0.0), own_free - shared_free);
        (free > LEAST_FREE).then(|| Apart {
            chi_square,
            free,
            chance: ChiSquared::new(free).map_or(1.0, |law| law.sf(chi_square)),
            part: (chi_square / shared.max(f64::MIN_POSITIVE)).sqrt(),
        })
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;
    use crate::{null::evidence::Screen, parity::smoothed::Left, together::heard::Own};

    /// A log of one effect of two parameters beside one unknown of the unit, `y = E theta + C c + noise`.
    fn heard(columns: &DMatrix<f64>, open: &DVector<f64>, readings: &DVector<f64>) -> Heard {
        let own = Own {
            information: columns.tr_mul(columns),
            score: columns.tr_mul(readings),
            open: DMatrix::from_rows(&[open.tr_mul(columns).row(0).into_owned()]),
        };
        Heard {
            own: BTreeMap::from([("effect".to_owned(), own)]),
            shared: vec!["scale".to_owned()],
            inner: DMatrix::from_element(1, 1, open.norm_squared()),
            pull: DVector::from_element(1, open.dot(readings)),
            left: Left {
                gap: 1.0,
                calibration: Vec::new(),
            },
        }
    }

    fn wave(rows: usize, pace: f64, phase: f64) -> DVector<f64> {
        DVector::from_fn(rows, |row, _| (pace * row as f64 + phase).sin())
    }

    /// Columns and the unit's unknown of a log, and noise for it.
    fn log(phase: f64) -> (DMatrix<f64>, DVector<f64>, DVector<f64>) {
        let columns = DMatrix::from_columns(&[wave(60, 0.31, phase), wave(60, 0.17, 2.0 * phase)]);
        (columns, wave(60, 0.23, phase + 0.4) * 0.7, wave(60, 2.9, phase) * 1.4)
    }

    #[test]
    fn two_logs_say_what_one_log_of_all_their_rows_says() {
        let [(e1, c1, r1), (e2, c2, r2)] = [log(0.3), log(1.1)];
        let stack = |one: &DVector<f64>, other: &DVector<f64>| {
            DVector::from_iterator(120, one.iter().chain(other.iter()).copied())
        };
        let all = DMatrix::from_fn(120, 2, |row, column| match row < 60 {
            true => e1[(row, column)],
            false => e2[(row - 60, column)],
        });
        let whole = heard(&all, &stack(&c1, &c2), &stack(&r1, &r2));
        let parts = [heard(&e1, &c1, &r1), heard(&e2, &c2, &r2)];
        let (information, score) = Joint::of(&parts).products("effect").expect("known");
        let (expected, expected_score) = Joint::of([&whole]).products("effect").expect("known");
        assert!((information - expected).norm() < 1e-9 && (score - expected_score).norm() < 1e-9);
    }

    #[test]
    fn an_error_of_the_calibration_is_one_however_many_logs_there_are() {
        // The effect is the very unknown, of one prior sigma: a hundred logs do not know it better than the calibration does.
        let same = wave(60, 0.3, 0.2);
        let columns = DMatrix::from_columns(&[same.clone(), wave(60, 0.05, 0.0)]);
        let logs: Vec<Heard> = (0..100).map(|_| heard(&columns, &same, &same)).collect();
        let (information, _) = Joint::of(&logs).products("effect").expect("known");
        assert!((0.9..1.0).contains(&information[(0, 0)]), "{information}");
    }

    #[test]
    fn what_no_log_shows_alone_is_seen_together() {
        // One log knows the sum of both parameters, the other their difference.
        let (one, other, nothing) = (wave(60, 0.31, 0.0), wave(60, 0.17, 0.0), DVector::zeros(60));
        let theta = DVector::from_column_slice(&[3.0, -2.0]);
        let logs = [(one.clone(), one), (other.clone(), -other)].map(|(first, second)| {
            let columns = DMatrix::from_columns(&[first, second]);
            heard(&columns, &nothing, &(&columns * &theta))
        });
        let found = |logs: &[Heard]| {
            let (information, score) = Joint::of(logs).products("effect").expect("known");
            let mut screen = Screen::zeros(vec![10.0, 10.0]);
            (screen.information, screen.score) = (information, score);
            screen.estimate(&[0, 1]).expect("finite")
        };
        let (alone, together) = (found(&logs[..1]), found(&logs));
        assert!(alone.covariance[(0, 0)].sqrt() > 5.0 && together.covariance[(0, 0)].sqrt() < 0.3);
        assert!((together.parameters - theta).amax() < 0.1);
    }

    #[test]
    fn logs_that_differ_contradict_each_other_and_one_that_shows_nothing_does_not() {
        let [(e1, c1, _), (e2, c2, _)] = [log(0.3), log(1.1)];
        let theta = |size: f64| DVector::from_column_slice(&[size, 0.5]);
        let apart = |of_second: f64, shown: f64| {
            let second = &e2 * shown;
            let logs = [
                heard(&e1, &c1, &(&e1 * theta(2.0))),
                heard(&second, &c2, &(&second * theta(of_second))),
            ];
            Joint::of(&logs).apart("effect", &[1.0, 1.0])
        };
        let (same, other) = (
            apart(2.0, 1.0).expect("two show it"),
            apart(-1.0, 1.0).expect("two show it"),
        );
        assert!(same.chi_square < 0.1 && (1.9..2.0).contains(&same.free), "{same:?}");
        assert!(other.is_contradiction(3) && !same.is_contradiction(1), "{other:?}");
        assert!(apart(-1.0, 1e-3).is_none());
    }
}
