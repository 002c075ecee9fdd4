//! Evidence of a set of effects against none, and the probabilities that follow.
//!
//! In: normal equations with the calibration marginalised ([`crate::null::normal::Normal`], added up over channels) and the
//! prior sigmas of the parameters. Out: the best parameters with their covariance, and
//! `ln Z = 1/2 s'(I + D^-2)^-1 s - 1/2 ln det(1 + D I D)` over the model without them: exact for linear effects, the
//! Laplace approximation otherwise (MacKay 1992). The determinant is the Occam term that prefers one value of gravity to
//! twelve scale factors.
//!
//! How large an effect of a kind is, is known to an order of magnitude at best: its prior is a mixture of [`SIZES`], one for all
//! of its parameters together, so that twelve small scale factors are not paid for as twelve large ones, and a lag that is five
//! times the usual is unlikely and not out of the question (a scale mixture of normals, Andrews and Mallows 1974).
//!
//! Probabilities are `P(e) ~ prior_e Z_e^(1/tau)`. `tau` is above 1 because the truth may lie outside the list, where a
//! posterior would otherwise be certain of the least wrong (Yao, Vehtari, Simpson and Gelman 2018).

use std::ops::Range;

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use crate::null::normal::log_determinant;

/// The most times its usual size that an effect may have.
pub const LARGEST_SIZE: f64 = 5.0;

/// How many times its usual size an effect may have, and the probability of each.
const SIZES: [(f64, f64); 3] = [(1.0 / LARGEST_SIZE, 0.25), (1.0, 0.5), (LARGEST_SIZE, 0.25)];

/// Normal equations over every column of every hypothesis.
#[derive(Clone, Debug)]
pub struct Screen {
    /// `E'PE` summed over channels.
    pub information: DMatrix<f64>,
    /// `E'Pr` summed over channels.
    pub score: DVector<f64>,
    /// Prior sigma of each column's parameter.
    pub prior_sigmas: Vec<f64>,
}

/// A set of parameters fitted under its prior.
#[derive(Clone, Debug, PartialEq)]
pub struct Estimate {
    /// Most probable values.
    pub parameters: DVector<f64>,
    /// Their covariance.
    pub covariance: DMatrix<f64>,
    /// \[nats\] over the model with all of them zero.
    pub log_evidence: f64,
    /// `s'I^-1 s` with the prior included: how far the misfit falls.
    pub energy_explained: f64,
}

impl Screen {
    /// An empty one for so many columns.
    pub fn zeros(prior_sigmas: Vec<f64>) -> Self {
        let width = prior_sigmas.len();
        Screen {
            information: DMatrix::zeros(width, width),
            score: DVector::zeros(width),
            prior_sigmas,
        }
    }

    /// Adds one channel's normal equations, whose columns stand at `places` here.
    pub fn add(&mut self, places: &[usize], normal: &crate::null::normal::Normal) {
        for (row, to_row) in places.iter().enumerate() {
            self.score[*to_row] += normal.score[row];
            for (column, to_column) in places.iter().enumerate() {
                self.information[(*to_row, *to_column)] += normal.information[(row, column)];
            }
        }
    }

    /// Fits some columns and none of the others; `None` when the numbers are not finite.
    pub fn estimate(&self, columns: &[usize]) -> Option<Estimate> {
        let width = columns.len();
        let sigma = |index: usize| self.prior_sigmas[columns[index]];
        let (factor, score) = self.factored(columns)?;
        let solved = factor.solve(&score);
        let fall = score.dot(&solved);
        let log_evidence = 0.5 * fall - 0.5 * log_determinant(&factor);
        let covariance = factor.inverse();
        let estimate = Estimate {
            parameters: DVector::from_fn(width, |row, _| sigma(row) * solved[row]),
            covariance: DMatrix::from_fn(width, width, |row, column| {
                sigma(row) * covariance[(row, column)] * sigma(column)
            }),
            log_evidence,
            energy_explained: fall,
        };
        estimate.log_evidence.is_finite().then_some(estimate)
    }

    /// \[nats\] over the model without them, of all columns: what [`Screen::estimate`] says, for a third of the work.
    pub fn log_evidence(&self) -> Option<f64> {
        let all: Vec<usize> = (0..self.prior_sigmas.len()).collect();
        let (factor, mut score) = self.factored(&all)?;
        factor.l_dirty().solve_lower_triangular_mut(&mut score);
        let log_evidence = 0.5 * score.norm_squared() - 0.5 * log_determinant(&factor);
        log_evidence.is_finite().then_some(log_evidence)
    }

    /// \[nats\] over the model without them, of all columns, each part, the columns of one effect, being of any size.
    pub fn of_any_size(&self, parts: impl IntoIterator<Item = Range<usize>>) -> Option<f64> {
        let mut settled = self.clone();
        let of_other_sizes = settled.settle(parts);
        Some(settled.log_evidence()? + of_other_sizes)
    }

    /// Gives each part, the columns of one effect, the size that suits it best; returns the nats that its other sizes add to the
    /// evidence with this one, their probabilities included.
    pub fn settle(&mut self, parts: impl IntoIterator<Item = Range<usize>>) -> f64 {
        let parts = parts.into_iter().filter(|part| !part.is_empty());
        parts.map(|part| self.settle_one(&part)).sum()
    }

    fn settle_one(&mut self, part: &Range<usize>) -> f64 {
        let usual = self.prior_sigmas[part.clone()].to_vec();
        let resize = |screen: &mut Self, size: f64| {
            let resized = screen.prior_sigmas[part.clone()].iter_mut().zip(&usual);
            resized.for_each(|(sigma, usual)| *sigma = size * usual);
        };
        let evidence = SIZES.map(|(size, probability)| {
            resize(self, size);
            self.log_evidence()
                .map_or(f64::NEG_INFINITY, |evidence| evidence + probability.ln())
        });
        let (best, most) = (evidence.iter().copied().enumerate())
            .max_by(|one, other| one.1.total_cmp(&other.1))
            .unwrap_or((1, f64::NEG_INFINITY));
        let (size, probability) = SIZES[best];
        resize(self, size);
        if !most.is_finite() {
            return 0.0;
        }
        evidence.iter().map(|one| (one - most).exp()).sum::<f64>().ln() + probability.ln()
    }

    /// Information, factored, and score in units of the prior: I plus something positive, as well conditioned as it gets.
    fn factored(&self, columns: &[usize]) -> Option<(Cholesky<f64, Dyn>, DVector<f64>)> {
        let width = columns.len();
        let sigma = |index: usize| self.prior_sigmas[columns[index]];
        let scaled = DMatrix::from_fn(width, width, |row, column| {
            f64::from(u8::from(row == column))
                + sigma(row) * self.information[(columns[row], columns[column])] * sigma(column)
        });
        let score = DVector::from_fn(width, |row, _| sigma(row) * self.score[columns[row]]);
        Some((Cholesky::new(scaled)?, score))
    }

    /// Of the energy that parameters `theta` of some columns put into the data, the share that other columns can imitate,
    /// and the energy itself (the squared marginal signal-to-noise ratio).
    pub fn imitation(&self, columns: &[usize], theta: &DVector<f64>, others: &[usize]) -> Option<(f64, f64)> {
        let pick = |from: &[usize], to: &[usize]| {
            DMatrix::from_fn(from.len(), to.len(), |r, c| self.information[(from[r], to[c])])
        };
        let energy = theta.dot(&(pick(columns, columns) * theta));
        let score = pick(others, columns) * theta;
        let mut own = pick(others, others);
        for (index, other) in others.iter().enumerate() {
            // A neighbour that needs a hundred prior sigmas to imitate is no imitation.
            own[(index, index)] += 1e-4 / self.prior_sigmas[*other].powi(2);
        }
        let imitated = score.dot(&Cholesky::new(own)?.solve(&score));
        (energy > 0.0).then(|| ((imitated / energy).clamp(0.0, 1.0), energy))
    }
}

/// Probabilities of rivals from their evidence and prior, tempered.
pub fn probabilities(log_evidences: &[f64], log_priors: &[f64], temperature: f64) -> Vec<f64> {
    let scores: Vec<f64> = log_evidences
        .iter()
        .zip(log_priors)
        .map(|(z, prior)| z / temperature + prior)
        .collect();
    let best = scores.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let weights: Vec<f64> = scores.iter().map(|score| (score - best).exp()).collect();
    let sum: f64 = weights.iter().sum();
    weights.iter().map(|weight| weight / sum).collect()
}

#[cfg(test)]
mod tests {
    use std::iter::once;

    use super::*;

    /// Double precision over a handful of operations on numbers near one.
    const ROUNDING: f64 = 1e-9;

    fn screen(information: [[f64; 2]; 2], score: [f64; 2], sigmas: [f64; 2]) -> Screen {
        Screen {
            information: DMatrix::from_fn(2, 2, |row, column| information[row][column]),
            score: DVector::from_column_slice(&score),
            prior_sigmas: sigmas.to_vec(),
        }
    }

    #[test]
    fn evidence_of_one_parameter_is_the_textbook_integral() {
        // r = x theta + e with x'x = 100, x'r = 30, theta ~ N(0, 0.5^2): ln Z1/Z0 in closed form.
        let estimate = screen([[100.0, 0.0], [0.0, 1.0]], [30.0, 0.0], [0.5, 1.0])
            .estimate(&[0])
            .expect("finite");
        let precision: f64 = 100.0 + 4.0;
        let expected = 0.5 * 900.0 / precision - 0.5 * (precision / 4.0).ln();
        assert!((estimate.log_evidence - expected).abs() < ROUNDING);
        assert!((estimate.parameters[0] - 30.0 / precision).abs() < ROUNDING);
        assert!((estimate.covariance[(0, 0)] - 1.0 / precision).abs() < ROUNDING);
    }

    #[test]
    fn one_parameter_is_preferred_to_two_that_say_the_same() {
        let both = screen([[50.0, 50.0], [50.0, 50.0]], [20.0, 20.0], [1.0, 1.0]);
        let alone = both.estimate(&[0]).expect("finite").log_evidence;
        assert!(alone > both.estimate(&[0, 1]).expect("finite").log_evidence);
    }

    #[test]
    fn an_effect_of_another_size_costs_what_its_rarity_does_and_no_more() {
        // Twenty prior sigmas: 200 nats by one normal, some five by the mixture.
        let mut large = screen([[1e4, 0.0], [0.0, 1.0]], [2e5, 0.0], [1.0, 1.0]);
        let (usual, whole) = (large.log_evidence().expect("finite"), 0.5 * 2e5 * 20.0);
        let sized = large.of_any_size(once(0..1)).expect("finite");
        assert!(whole - usual > 200.0 && whole - sized < 20.0, "{usual} {sized}");
        large.settle(once(0..1));
        assert_eq!(large.prior_sigmas, [5.0, 1.0]);
    }

    #[test]
    fn the_mixture_is_the_sum_over_its_sizes() {
        let fresh = || screen([[100.0, 10.0], [10.0, 80.0]], [30.0, 20.0], [0.5, 0.3]);
        let by_hand: f64 = SIZES
            .iter()
            .map(|(size, probability)| {
                let mut sized = fresh();
                sized.prior_sigmas.iter_mut().for_each(|sigma| *sigma *= size);
                probability * sized.log_evidence().expect("finite").exp()
            })
            .sum();
        let found = fresh().of_any_size(once(0..2)).expect("finite");
        assert!((found - by_hand.ln()).abs() < ROUNDING);
    }

    #[test]
    fn columns_along_each_other_imitate_each_other_fully() {
        let along = screen([[50.0, 25.0], [25.0, 12.5]], [0.0, 0.0], [1.0, 1.0]);
        let (share, energy) = along
            .imitation(&[0], &DVector::from_element(1, 1.0), &[1])
            .expect("finite");
        assert!((share - 1.0).abs() < 1e-4, "{share}");
        assert!((energy - 50.0).abs() < ROUNDING);
    }

    #[test]
    fn temperature_takes_certainty_away() {
        let sharp = probabilities(&[10.0, 0.0], &[0.0, 0.0], 1.0);
        let mild = probabilities(&[10.0, 0.0], &[0.0, 0.0], 4.0);
        assert!(sharp[0] > 0.9999 && mild[0] < 0.93);
        assert!((mild.iter().sum::<f64>() - 1.0).abs() < ROUNDING);
    }
}
