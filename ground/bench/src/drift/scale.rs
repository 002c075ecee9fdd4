//! A gyro's scale factor, how straight and how steady it is; and how far any figure spreads from one turn-on to the next.
//!
//! In: commanded rates and outputs; a long record at a high rate; one figure a turn-on. Out: [`Scale`], [`Steadiness`],
//! [`Spread`]. (Sections 3.5 and 3.9 of the dry-tuned gyro paper.)
//!
//! The output is `V = K W + b`, by least squares. Nonlinearity is the largest distance from that line, relative to the
//! output at full scale. Refuses too few or equal rates, and outputs that stop growing at either end: a saturated
//! sample would bend the line it is judged by.

use crate::least_squares::student_95;

/// Why there is no scale factor.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ScaleError {
    /// Not enough rates.
    #[error("{given} values; {needed} are needed")]
    TooFew {
        /// How many there are.
        given: usize,
        /// How many it takes.
        needed: usize,
    },
    /// The rate was never changed.
    #[error("all rates are equal: command at least two different rates, best of both signs")]
    NotExcited,
    /// Different rates, same output.
    #[error("the output is the same at the two {0} rates: saturated; leave those rows out")]
    Saturated(&'static str),
}

/// A line through outputs over rates.
#[derive(Clone, Debug, PartialEq)]
pub struct Scale {
    /// Scale factor [output per rate].
    pub factor: f64,
    /// Half-width of its 95 % interval.
    pub factor_95: f64,
    /// Output without rate.
    pub bias: f64,
    /// Half-width of its 95 % interval.
    pub bias_95: f64,
    /// Largest distance from the line over the output at full scale.
    pub nonlinearity: f64,
    /// What the line leaves, in the order of the measurements.
    pub residuals: Vec<f64>,
}

/// Scale factor from `(rate, output)`; `full_scale` in the unit of the rate, or the largest rate given if none.
pub fn scale(points: &[(f64, f64)], full_scale: Option<f64>) -> Result<Scale, ScaleError> {
    if points.len() < 3 {
        return Err(ScaleError::TooFew {
            given: points.len(),
            needed: 3,
        });
    }
    let count = points.len() as f64;
    let (w, v) = points.iter().fold((0.0, 0.0), |sum, point| {
        (sum.0 + point.0 / count, sum.1 + point.1 / count)
    });
    let ww: f64 = points.iter().map(|point| (point.0 - w).powi(2)).sum();
    let largest = points.iter().map(|point| point.0.abs()).fold(0.0, f64::max);
    if ww <= (1e-9 * largest).powi(2) {
        return Err(ScaleError::NotExcited);
    }
    saturated(points)?;
    let factor = points.iter().map(|point| (point.0 - w) * (point.1 - v)).sum::<f64>() / ww;
    let bias = v - factor * w;
    let residuals: Vec<f64> = points.iter().map(|point| point.1 - bias - factor * point.0).collect();
    let sigma = (residuals.iter().map(|left| left * left).sum::<f64>() / (count - 2.0)).sqrt();
    let width = student_95(points.len() - 2) * sigma;
    let most = residuals.iter().map(|left| left.abs()).fold(0.0, f64::max);
    Ok(Scale {
        factor,
        factor_95: width / ww.sqrt(),
        bias,
        bias_95: width * (1.0 / count + w * w / ww).sqrt(),
        nonlinearity: most / (factor * full_scale.unwrap_or(largest)).abs(),
        residuals,
    })
}

/// Exactly the same output at the two most extreme different rates of a side means saturation.
fn saturated(points: &[(f64, f64)]) -> Result<(), ScaleError> {
    let mut sorted = points.to_vec();
    sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
    let flat = |a: (f64, f64), b: (f64, f64)| a.0 != b.0 && a.1 == b.1;
    let last = sorted.len() - 1;
    if flat(sorted[0], sorted[1]) {
        return Err(ScaleError::Saturated("lowest"));
    }
    if flat(sorted[last - 1], sorted[last]) {
        return Err(ScaleError::Saturated("highest"));
    }
    Ok(())
}

/// How a scale factor wanders during one run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Steadiness {
    /// Mean scale factor.
    pub mean: f64,
    /// Standard deviation, relative to the mean.
    pub relative_sigma: f64,
    /// Largest minus smallest, relative to the mean.
    pub relative_spread: f64,
    /// Straight trend, relative to the mean [1/h].
    pub trend_per_h: f64,
}

/// Steadiness of the scale factor in a record `(time [s], output)` at one constant `rate`.
pub fn steadiness(record: &[(f64, f64)], rate: f64, bias: f64) -> Result<Steadiness, ScaleError> {
    if record.len() < 3 {
        return Err(ScaleError::TooFew {
            given: record.len(),
            needed: 3,
        });
    }
    if rate == 0.0 || !rate.is_finite() {
        return Err(ScaleError::NotExcited);
    }
    let factors: Vec<(f64, f64)> = record.iter().map(|(t, v)| (*t, (v - bias) / rate)).collect();
    let values: Vec<f64> = factors.iter().map(|(_, factor)| *factor).collect();
    let spread = spread(&values)?;
    let count = factors.len() as f64;
    let t_mean = factors.iter().map(|(t, _)| t / count).sum::<f64>();
    let (tt, tv) = factors.iter().fold((0.0, 0.0), |sum, (t, factor)| {
        (
            sum.0 + (t - t_mean).powi(2),
            sum.1 + (t - t_mean) * (factor - spread.mean),
        )
    });
    if tt == 0.0 {
        return Err(ScaleError::NotExcited);
    }
    Ok(Steadiness {
        mean: spread.mean,
        relative_sigma: spread.sigma / spread.mean.abs(),
        relative_spread: spread.range / spread.mean.abs(),
        trend_per_h: 3_600.0 * tv / tt / spread.mean,
    })
}

/// How far a figure spreads over several turn-ons.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spread {
    /// Mean.
    pub mean: f64,
    /// Standard deviation.
    pub sigma: f64,
    /// Largest minus smallest, the paper's repeatability.
    pub range: f64,
}

/// Repeatability of one figure, a value a turn-on.
pub fn spread(values: &[f64]) -> Result<Spread, ScaleError> {
    if values.len() < 2 {
        return Err(ScaleError::TooFew {
            given: values.len(),
            needed: 2,
        });
    }
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let (least, most) = values
        .iter()
        .fold((f64::MAX, f64::MIN), |range, v| (range.0.min(*v), range.1.max(*v)));
    let sigma = (values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / (count - 1.0)).sqrt();
    Ok(Spread {
        mean,
        sigma,
        range: most - least,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_straight_output_is_linear_and_a_bent_one_is_not() {
        let rates = [-100.0, -50.0, 0.0, 50.0, 100.0];
        let straight = scale(&rates.map(|w| (w, 0.1 * w + 0.02)), None).expect("scale");
        assert!((straight.factor - 0.1).abs() < 1e-12 && (straight.bias - 0.02).abs() < 1e-12);
        assert!(straight.nonlinearity < 1e-12);
        // 0.1 w + 1e-5 w^2 leaves the line through it by 0.05 at the ends and in the middle: half a per cent of 10.
        let bent = scale(&rates.map(|w| (w, 0.1 * w + 1e-5 * w * w)), None).expect("scale");
        assert!((bent.nonlinearity - 0.005).abs() < 1e-12, "{}", bent.nonlinearity);
    }

    #[test]
    fn saturation_and_a_table_that_stood_still_are_refused() {
        let saturated = [(-2.0, -2.0), (0.0, 0.0), (1.0, 1.5), (2.0, 1.5)];
        assert_eq!(scale(&saturated, None), Err(ScaleError::Saturated("highest")));
        assert_eq!(
            scale(&[(5.0, 1.0), (5.0, 1.1), (5.0, 0.9)], None),
            Err(ScaleError::NotExcited)
        );
    }

    #[test]
    fn a_scale_factor_that_grows_by_a_thousandth_an_hour_is_seen_to() {
        let record: Vec<(f64, f64)> = (0..9)
            .map(|k| f64::from(k) * 3_600.0)
            .map(|t| (t, 1.0 + 10.0 * (1.0 + 1e-3 * t / 3_600.0)))
            .collect();
        let found = steadiness(&record, 100.0, 1.0).expect("steadiness");
        assert!((found.trend_per_h - 1e-3 / 1.004).abs() < 1e-9, "{found:?}");
        assert!((found.relative_spread - 8e-3 / 1.004).abs() < 1e-9);
    }

    #[test]
    fn turn_on_repeatability_is_the_largest_difference() {
        assert_eq!(spread(&[2.0, 2.5, 1.75]).expect("spread").range, 0.75);
        assert_eq!(spread(&[2.0]), Err(ScaleError::TooFew { given: 1, needed: 2 }));
    }
}
