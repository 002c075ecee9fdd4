//! The coefficients behind an Allan plot, with intervals, and what the record is too short to show.
//!
//! In: overlapping Allan variances at octave factors of one record. Out: for each [`Term`] a [`Finding`]: its
//! coefficient with an interval, or that it was not seen and below what it must lie.
//!
//! The variance of the sum is the sum of the variances (IEEE 952, annex C), linear in the squared coefficients. They
//! are fitted by least squares, each point weighted by the uncertainty the fit itself predicts for it: weights from the
//! measured values would favour those that came out low by chance. The uncertainty of the squared coefficients follows from the
//! covariance of the points, which share most of their windows; as sums of squares they are nearly chi-squared, with
//! the degrees of freedom their uncertainty implies (Satterthwaite), which is where the intervals come from.
//!
//! All terms asked for stay in the fit, seen or not, and may come out negative: only then is every coefficient unbiased and
//! its interval that of what was done. Leaving out what looks like nothing makes the others' intervals too narrow (pure
//! bias instability was held by 81 of 100), for the choice is made on the same record. It costs twice the interval of a
//! coefficient that is alone in truth, and half as much again of one among others. Only the mixture whose covariance is
//! taken is kept from going below zero.
//!
//! A term is refused, and bounded from above instead, if its squared coefficient is less than [`SEEN`] standard
//! deviations from zero or if it does not make up [`VISIBLE`] of the variance at [`OCTAVES`] averaging times: a slope
//! that short is a guess. A sinusoid needs no slope: its frequency comes from the spectrum.

use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::{
    bounds,
    covariance::{Covariance, Windows},
    deviation::{Deviation, Point},
    terms::Term,
};

/// Standard deviations a squared coefficient must be from zero.
const SEEN: f64 = 2.5;
/// Share of the variance that counts as visible.
const VISIBLE: f64 = 0.2;
/// At how many octaves a term must be visible.
const OCTAVES: usize = 2;
/// Rounds of weighting; the weights change by less than a part in a thousand after half as many.
const ROUNDS: usize = 5;
/// Steps of a bisection to the last digit of a double.
const HALVINGS: usize = 64;
/// One-sided 95 % quantile of the normal distribution, for bounds from above.
const ONE_SIDED: f64 = 1.645;

/// What a record says about a term. Coefficients are in the record's rate unit and seconds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Finding {
    /// It is there.
    Seen {
        /// Coefficient.
        value: f64,
        /// Low bound.
        low: f64,
        /// High bound.
        high: f64,
    },
    /// The record is too short, or other noise too strong, to show it.
    NotSeen {
        /// With 95 % confidence the coefficient is below this.
        below: f64,
    },
}

/// Findings for all terms asked for.
#[derive(Clone, Debug, PartialEq)]
pub struct Fit {
    /// In the order of the terms asked for.
    pub findings: Vec<(Term, Finding)>,
    /// The squared coefficients that fit best with none below zero, whether seen or not.
    mixture: Vec<f64>,
    /// Weighted sum of squared residuals, for comparing fits of one record.
    pub misfit: f64,
}

impl Fit {
    /// The Allan deviation that fits best, with what is there of refused terms.
    pub fn deviation(&self, tau_s: f64) -> f64 {
        let terms = self.findings.iter().zip(&self.mixture);
        let variance: f64 = terms.map(|((term, _), squared)| squared * term.variance(tau_s)).sum();
        variance.sqrt()
    }
}

impl Finding {
    /// The coefficient; zero if it was not seen.
    pub const fn value(self) -> f64 {
        match self {
            Self::Seen { value, .. } => value,
            Self::NotSeen { .. } => 0.0,
        }
    }
}

/// The points of one record that can be fitted, and the terms to fit.
struct Problem<'a> {
    terms: &'a [Term],
    tau_s: Vec<f64>,
    variance: DVector<f64>,
    covariance: &'a Covariance,
}

/// A solution for all terms.
struct Solution {
    /// Unbiased squared coefficients, of either sign.
    squared: DVector<f64>,
    /// Their standard deviations.
    sigma: DVector<f64>,
    /// The linear combinations of the variances they are: a row for each.
    gain: DMatrix<f64>,
    /// The best squared coefficients without negative ones: what the covariance is that of.
    mixture: DVector<f64>,
    misfit: f64,
}

/// Fits `terms` to the octave points of a record; `confidence` (0 to 1) is that of the intervals. None if there are
/// fewer points than terms that could be told apart.
pub fn fit(points: &[Point], step_s: f64, terms: &[Term], confidence: f64) -> Option<Fit> {
    fit_with(points, terms, &covariance_of(points, step_s, terms), confidence)
}

/// The usable points: octaves with a value.
fn usable(points: &[Point]) -> impl Iterator<Item = (&Point, f64)> {
    let octaves = points.iter().filter(|point| point.factor.is_power_of_two());
    octaves.filter_map(|point| Some((point, point.value(Deviation::Oadev).filter(|value| *value > 0.0)?)))
}

fn covariance_of(points: &[Point], step_s: f64, terms: &[Term]) -> Covariance {
    let windows: Vec<Windows> = usable(points)
        .map(|(point, _)| Windows {
            factor: point.factor,
            count: point.windows(Deviation::Oadev),
        })
        .collect();
    Covariance::new(step_s, &windows, terms)
}

fn fit_with(points: &[Point], terms: &[Term], covariance: &Covariance, confidence: f64) -> Option<Fit> {
    let problem = Problem {
        terms,
        tau_s: usable(points).map(|(point, _)| point.tau_s).collect(),
        variance: DVector::from_iterator(usable(points).count(), usable(points).map(|(_, value)| value * value)),
        covariance,
    };
    // One point more than terms, or the fit is a solution of equations.
    let kept = terms.len().min(problem.tau_s.len().saturating_sub(1));
    if kept == 0 {
        return None;
    }
    let solution = problem.solve(kept)?;
    let findings = (0..terms.len()).map(|term| {
        let finding = if term >= kept {
            problem.not_asked(term, &solution)?
        } else if problem.is_seen(term, &solution) {
            solution.seen(term, confidence)?
        } else {
            problem.not_seen(term, &solution)?
        };
        Some((terms[term], finding))
    });
    Some(Fit {
        findings: findings.collect::<Option<Vec<_>>>()?,
        mixture: solution.mixture.iter().copied().collect(),
        misfit: solution.misfit,
    })
}

impl Problem<'_> {
    /// Weighted least squares over the first `kept` terms, weights from the fit itself.
    fn solve(&self, kept: usize) -> Option<Solution> {
        let count = self.tau_s.len();
        // Columns relative to the measured variances keep the normal equations well conditioned.
        let scale: Vec<f64> = (0..kept).map(|term| self.column_scale(term)).collect::<Option<_>>()?;
        let shapes = DMatrix::from_fn(count, kept, |i, j| self.terms[j].variance(self.tau_s[i]) / scale[j]);
        let mut weights = DVector::from_fn(count, |i, _| {
            1.0 / (self.variance[i] * self.variance[i] * self.tau_s[i])
        });
        let mut mixture = DVector::zeros(self.terms.len());
        for _ in 0..ROUNDS {
            let found = not_negative(&shapes, &weights, &self.variance)?;
            (0..kept).for_each(|term| mixture[term] = found[term] / scale[term]);
            for i in 0..count {
                let uncertainty = self.covariance.of(i, i, &mixture);
                if uncertainty > 0.0 {
                    weights[i] = 1.0 / uncertainty;
                }
            }
        }
        let fitted = &shapes * DVector::from_fn(kept, |term, _| mixture[term] * scale[term]);
        let residuals = &self.variance - fitted;
        let misfit = residuals.iter().zip(weights.iter()).map(|(r, w)| r * r * w).sum();
        let mut gain = DMatrix::zeros(self.terms.len(), count);
        for (term, row) in weighted_inverse(&shapes, &weights)?.row_iter().enumerate() {
            gain.set_row(term, &(row / scale[term]));
        }
        let squared = &gain * &self.variance;
        let sigma2 = (0..self.terms.len()).map(|term| self.uncertainty(&gain, term, &mixture));
        let sigma = DVector::from_iterator(self.terms.len(), sigma2.map(f64::sqrt));
        Some(Solution {
            squared,
            sigma,
            gain,
            mixture,
            misfit,
        })
    }

    /// Variance of a squared coefficient if the record is made of `mixture`.
    fn uncertainty(&self, gain: &DMatrix<f64>, term: usize, mixture: &DVector<f64>) -> f64 {
        let count = self.tau_s.len();
        let pairs = (0..count).flat_map(|i| (0..count).map(move |j| (i, j)));
        let parts = pairs.map(|(i, j)| gain[(term, i)] * gain[(term, j)] * self.covariance.of(i, j, mixture));
        parts.sum::<f64>().max(0.0)
    }

    /// The inverse of the largest squared coefficient the term could have.
    fn column_scale(&self, term: usize) -> Option<f64> {
        let pairs = self.tau_s.iter().zip(self.variance.iter());
        let ratios = pairs.map(|(tau, variance)| self.terms[term].variance(*tau) / variance);
        ratios
            .filter(|ratio| ratio.is_finite())
            .max_by(f64::total_cmp)
            .filter(|most| *most > 0.0)
    }

    fn is_seen(&self, term: usize, solution: &Solution) -> bool {
        let part = |i: usize| solution.squared[term] * self.terms[term].variance(self.tau_s[i]);
        let visible = (0..self.tau_s.len())
            .filter(|&i| part(i) > VISIBLE * self.variance[i])
            .count();
        // A line is told by the spectrum, where it need not be strong to be sharp.
        let told = matches!(self.terms[term], Term::Sinusoid { .. }) || visible >= OCTAVES;
        solution.sigmas(term) >= SEEN && told
    }

    /// The largest squared coefficient that would not come out as low as it did but once in twenty. What a term itself makes
    /// uncertain grows with it and is chi-squared, the rest is nearly normal; the two are joined as in the intervals of
    /// Graybill and Wang for sums of variances (J. Am. Stat. Assoc. 75, 1980).
    fn not_seen(&self, term: usize, solution: &Solution) -> Option<Finding> {
        let alone = DVector::from_fn(self.terms.len(), |other, _| f64::from(u8::from(other == term)));
        let own = self.uncertainty(&solution.gain, term, &alone);
        let own_low = match ChiSquared::new(2.0 / own) {
            Ok(chi) if own > 0.0 => 1.0 - chi.inverse_cdf(0.05) * own / 2.0,
            _ => 0.0,
        };
        let lowest = |squared: f64| {
            let mut mixture = solution.mixture.clone();
            mixture[term] = squared;
            let rest = self.uncertainty(&solution.gain, term, &mixture) - own * squared * squared;
            squared - (ONE_SIDED * rest.max(0.0).sqrt()).hypot(own_low * squared)
        };
        // One that came out below zero is bounded as if at zero: a bound near nothing would only show that terms are missing.
        let found = solution.squared[term].max(0.0);
        let (mut low, mut high) = (0.0, found + solution.sigma[term]);
        for _ in 0..HALVINGS {
            if lowest(high) >= found {
                break;
            }
            (low, high) = (high, 2.0 * high);
        }
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            if lowest(middle) >= found {
                high = middle
            } else {
                low = middle
            }
        }
        high.is_finite().then(|| Finding::NotSeen { below: high.sqrt() })
    }

    /// A bound for a term there are too few points to ask for: no variance is less than the term's part of it.
    fn not_asked(&self, term: usize, solution: &Solution) -> Option<Finding> {
        let highest = (0..self.tau_s.len()).filter_map(|i| {
            let edf = 2.0 * self.variance[i].powi(2) / self.covariance.of(i, i, &solution.mixture);
            let (_, high) = bounds::bounds(self.variance[i].sqrt(), edf, 0.9)?;
            Some(high / self.terms[term].variance(self.tau_s[i]).sqrt())
        });
        let below = highest.min_by(f64::total_cmp)?;
        Some(Finding::NotSeen { below })
    }
}

impl Solution {
    /// How many standard deviations a squared coefficient is from zero.
    fn sigmas(&self, term: usize) -> f64 {
        self.squared[term] / self.sigma[term].max(f64::MIN_POSITIVE)
    }

    fn seen(&self, term: usize, confidence: f64) -> Option<Finding> {
        let value = self.squared[term].sqrt();
        let (low, high) = bounds::bounds(value, 2.0 * self.sigmas(term).powi(2), confidence)?;
        Some(Finding::Seen { value, low, high })
    }
}

/// The matrix that makes weighted least squares coefficients of observations.
fn weighted_inverse(shapes: &DMatrix<f64>, weights: &DVector<f64>) -> Option<DMatrix<f64>> {
    let weighted = DMatrix::from_fn(shapes.ncols(), shapes.nrows(), |j, i| {
        shapes[(i, j)] * weights[i] / weights.max()
    });
    Some((&weighted * shapes).try_inverse()? * weighted)
}

/// Weighted least squares without negative coefficients: the most negative one is put to zero until none is left.
fn not_negative(shapes: &DMatrix<f64>, weights: &DVector<f64>, observed: &DVector<f64>) -> Option<DVector<f64>> {
    let mut kept: Vec<usize> = (0..shapes.ncols()).collect();
    loop {
        let found = weighted_inverse(&shapes.select_columns(&kept), weights)? * observed;
        let (least, value) = found.argmin();
        if value >= 0.0 {
            let mut all = DVector::zeros(shapes.ncols());
            kept.iter()
                .zip(found.iter())
                .for_each(|(term, value)| all[*term] = *value);
            return Some(all);
        }
        kept.remove(least);
    }
}

#[cfg(test)]
#[path = "fit/tests.rs"]
mod tests;
