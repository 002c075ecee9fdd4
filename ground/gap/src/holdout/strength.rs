//! Whether an effect is as strong on the held-out windows as it was fitted.
//!
//! In: what an effect of a finished model adds to every row, and what the model predicts. Out: [`Promise`], the factor of
//! that contribution which fits the held-out samples best: one for the true law, whatever its size; anything else for a law
//! that only happened to look like the truth on the fit windows.

use nalgebra::{DMatrix, DVector};
use statrs::function::erf::erfc;

use super::recurrences::Said;
use crate::{
    holdout::{events::Events, fit_error::FitError},
    input::hold::Held,
    thresholds::STRENGTH_TOLERATED,
    unknown::adequacy::odds,
};

/// What is said of a finished effect.
#[derive(Clone, Copy, Debug)]
pub struct Claimed<'a> {
    /// Channels with what it adds to every row, in physical units.
    pub added: &'a [(usize, Vec<f64>)],
    /// For each of them what its fitted calibration still leaves open, a row for a column that is known to one: its standard
    /// deviation at every row of the log, in physical units.
    pub open: &'a [DMatrix<f64>],
    /// What everything that is fitted may be off by.
    pub error: &'a FitError,
    /// Predictions of every row with everything in, channel by channel.
    pub after: &'a [Vec<f64>],
    /// Standard deviation of a sample at every row, channel by channel.
    pub sigmas: &'a [Vec<f64>],
    /// How much more a sample scatters than that, one a channel.
    pub louder: &'a [f64],
    /// What of the model happens again at random.
    pub events: Option<&'a Events>,
    /// Which stretch of time each row is in, where samples of one are averaged before they are compared.
    pub stretches: Option<&'a [usize]>,
}

/// An effect's strength on the held-out windows over that on the fit windows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Promise {
    /// Best factor.
    pub factor: f64,
    /// Its standard deviation: of the held-out noise, of the calibration, and of all that was fitted, which a motion may show
    /// otherwise than the fit windows' did.
    pub sigma: f64,
}

impl Promise {
    /// How far a true effect may be as far from one, 0 to 1: the odds that the probability of that leaves it.
    pub fn confidence(&self) -> f64 {
        let away = ((self.factor - 1.0).abs() - STRENGTH_TOLERATED).max(0.0);
        odds(
            erfc(away / self.sigma / core::f64::consts::SQRT_2)
                .max(f64::MIN_POSITIVE)
                .ln(),
        )
    }
}

impl Held {
    /// How strong an effect is here, apart from what the calibration may still do; nothing where it adds nothing.
    pub fn promise(&self, claimed: Claimed) -> Option<Promise> {
        let course = self.course(Said {
            after: claimed.after,
            sigmas: claimed.sigmas,
            louder: claimed.louder,
            events: claimed.events,
        });
        let (mut energy, mut along) = (0.0, 0.0);
        let mut by_parameter = DVector::zeros(claimed.error.slopes.len());
        for ((channel, added), open) in claimed.added.iter().zip(claimed.open) {
            let series = &self.samples()[*channel];
            let sigma = |row: usize| claimed.sigmas[*channel][row] * claimed.louder[*channel];
            let after = |row: usize| course.mean(*channel, row, |after| after);
            let samples = series.rows.iter().map(|row| *row as usize).zip(&series.values);
            let seen: Vec<(usize, f64)> = samples
                .map(|(row, value)| (row, value - after(row)))
                .filter(|(row, rest)| rest.is_finite() && added[*row].is_finite())
                .collect();
            let rows: Vec<usize> = seen.iter().map(|(row, _)| *row).collect();
            let means = |of: &dyn Fn(usize) -> f64| means(&rows, claimed.stretches, |at| of(at) / sigma(rows[at]));
            let own = means(&|at| added[rows[at]]);
            let rest = means(&|at| seen[at].1);
            let columns: Vec<DVector<f64>> = (0..open.nrows())
                .map(|column| means(&|at| open[(column, rows[at])]))
                .collect();
            let nuisance = match columns.is_empty() {
                true => DMatrix::zeros(own.len(), 0),
                false => DMatrix::from_columns(&columns),
            };
            // Woodbury: (I + N N')^-1 = I - N (I + N'N)^-1 N'.
            let imitated = nuisance.tr_mul(&own);
            let inner = DMatrix::identity(open.nrows(), open.nrows()) + nuisance.tr_mul(&nuisance);
            let Some(inner) = inner.cholesky() else { continue };
            let apart = &own - &nuisance * inner.solve(&imitated);
            let apart = match claimed.stretches {
                Some(_) => &apart / louder_than_noise(&rest, &own, &apart),
                None => apart,
            };
            energy += apart.dot(&own);
            along += apart.dot(&rest);
            for (sum, slope) in by_parameter.iter_mut().zip(&claimed.error.slopes) {
                let Some((_, values)) = slope.entries.iter().find(|(index, _)| index == channel) else {
                    continue;
                };
                *sum += apart.dot(&means(&|at| values[rows[at]]));
            }
        }
        (energy > 0.0).then(|| Promise {
            factor: 1.0 + along / energy,
            sigma: (energy + by_parameter.dot(&(&claimed.error.covariance * &by_parameter)).max(0.0)).sqrt() / energy,
        })
    }
}

/// By how much the energy of a rest beside what is `apart` of an effect, as strong as is best there, is above that of white noise of one, at
/// least 1: what a reference errs by is alike over some samples, and means of them are louder than their number says.
fn louder_than_noise(rest: &DVector<f64>, effect: &DVector<f64>, apart: &DVector<f64>) -> f64 {
    let energy = apart.dot(effect).max(f64::MIN_POSITIVE);
    let left = rest.norm_squared() - apart.dot(rest).powi(2) / energy;
    (left / rest.len().max(1) as f64).max(1.0)
}

/// Sums of values in units of noise over each stretch that has samples, over the root of their number: what is white stays white noise of one.
fn means(rows: &[usize], stretches: Option<&[usize]>, value: impl Fn(usize) -> f64) -> DVector<f64> {
    let Some(stretches) = stretches else {
        return DVector::from_iterator(rows.len(), (0..rows.len()).map(value));
    };
    let mut sums: Vec<(f64, f64)> = Vec::new();
    let mut last = None;
    for (at, row) in rows.iter().enumerate() {
        if last.replace(stretches[*row]) != Some(stretches[*row]) {
            sums.push((0.0, 0.0));
        }
        if let Some((sum, count)) = sums.last_mut() {
            (*sum, *count) = (*sum + value(at), *count + 1.0);
        }
    }
    DVector::from_iterator(sums.len(), sums.iter().map(|(sum, count)| sum / count.sqrt()))
}

#[cfg(test)]
mod tests {
    use twin::predict::Column;

    use super::*;
    use crate::input::log::Series;

    const SAMPLES: usize = 400;

    fn sine(row: usize, rate: f64) -> f64 {
        (row as f64 * rate).sin()
    }

    /// The promise of an effect `sin 0.1 k` of a channel whose readings are `measured`, its bias open.
    fn promised(measured: impl Fn(usize) -> f64) -> Promise {
        promised_by(measured, 0.01)
    }

    /// The same of an amplitude that was fitted to `fitted_sigma`.
    fn promised_by(measured: impl Fn(usize) -> f64, fitted_sigma: f64) -> Promise {
        promised_of(measured, fitted_sigma, &|row| sine(row, 0.1), None)
    }

    /// The same where the law of the effect is this.
    fn promised_of(
        measured: impl Fn(usize) -> f64,
        fitted_sigma: f64,
        law: &dyn Fn(usize) -> f64,
        stretches: Option<&[usize]>,
    ) -> Promise {
        let held = Held::new(vec![Series {
            rows: (0..SAMPLES as u32).collect(),
            values: (0..SAMPLES).map(measured).collect(),
        }]);
        let added = [(0, (0..SAMPLES).map(law).collect())];
        let open = [DMatrix::from_element(1, SAMPLES, 100.0)];
        let after = [(0..SAMPLES).map(law).collect()];
        let amplitude = Column {
            name: "amplitude".into(),
            sigma: 1.0,
            entries: added.to_vec(),
        };
        let error = FitError {
            slopes: vec![amplitude],
            covariance: DMatrix::from_element(1, 1, fitted_sigma * fitted_sigma),
        };
        let claimed = Claimed {
            added: &added,
            open: &open,
            error: &error,
            after: &after,
            sigmas: &[vec![0.1; SAMPLES]],
            louder: &[1.0],
            events: None,
            stretches,
        };
        held.promise(claimed).expect("it adds something")
    }

    #[test]
    fn an_effect_that_keeps_its_promise_is_believed_and_one_that_does_not_is_not() {
        let kept = promised(|row| sine(row, 0.1) + 0.1 * sine(row, 1.7));
        assert!((kept.factor - 1.0).abs() < 2.0 * kept.sigma, "{kept:?}");
        assert!(kept.confidence() > 0.99);
        let gone = promised(|row| 0.1 * sine(row, 1.7));
        assert!(gone.factor.abs() < 2.0 * gone.sigma, "{gone:?}");
        assert!(gone.confidence() < 1e-6);
    }

    #[test]
    fn what_the_calibration_leaves_open_breaks_no_promise() {
        let biased = promised(|row| sine(row, 0.1) + 3.0);
        assert!(biased.confidence() > 0.99, "{biased:?}");
    }

    #[test]
    fn an_amplitude_that_is_hardly_known_may_be_another_here() {
        let half = |row: usize| 0.5 * sine(row, 0.1) + 0.1 * sine(row, 1.7);
        let (known, hardly_known) = (promised_by(half, 0.01), promised_by(half, 0.25));
        assert!(known.confidence() < 1e-6, "{known:?}");
        assert!(hardly_known.confidence() > 0.3, "{hardly_known:?}");
        assert!((known.factor - hardly_known.factor).abs() < 1e-12);
    }

    /// The law has three times its own energy of an error of the reference, which the unit has not.
    #[test]
    fn an_error_in_the_law_makes_no_true_effect_weaker_in_means() {
        let law = |row: usize| sine(row, 0.1) + 1.7 * sine(row, 2.1);
        let noisy = |row: usize| sine(row, 0.1) + 0.1 * sine(row, 1.7);
        let stretches: Vec<usize> = (0..SAMPLES).map(|row| row / 12).collect();
        let by_sample = promised_of(noisy, 0.01, &law, None);
        let in_means = promised_of(noisy, 0.01, &law, Some(&stretches));
        assert!(by_sample.confidence() < 1e-6, "{by_sample:?}");
        assert!(
            (in_means.factor - 1.0).abs() < 0.1 && in_means.confidence() > 0.99,
            "{in_means:?}"
        );
        let gone = promised_of(|row| 0.1 * sine(row, 1.7), 0.01, &law, Some(&stretches));
        assert!(gone.confidence() < 1e-6, "{gone:?}");
    }

    /// What is alike over a stretch makes means louder, and a factor that far from one is no refutation.
    #[test]
    fn means_are_as_uncertain_as_they_scatter() {
        let stretches: Vec<usize> = (0..SAMPLES).map(|row| row / 12).collect();
        let slow = |row: usize| 0.7 * sine(row / 12, 2.3);
        let promise = promised_of(
            |row| sine(row, 0.1) + slow(row),
            0.0,
            &|row| sine(row, 0.1),
            Some(&stretches),
        );
        let white = promised_of(|row| sine(row, 0.1), 0.0, &|row| sine(row, 0.1), Some(&stretches));
        assert!(promise.sigma > 5.0 * white.sigma, "{promise:?} {white:?}");
    }

    #[test]
    fn windows_that_hardly_show_an_effect_refute_it_only_far_off() {
        let near = Promise {
            factor: 0.2,
            sigma: 0.8,
        };
        assert!(near.confidence() > 0.4, "{}", near.confidence());
        let far = Promise {
            factor: -47.0,
            sigma: 0.74,
        };
        assert!(far.confidence() < 1e-6, "{}", far.confidence());
    }
}
