//! How uncertain Allan variances of one record are, and how they depend on each other.
//!
//! In: the averaging factors and windows of overlapping Allan variances `V_i`, and [`Term`]s with squared coefficients
//! `c`. Out: the covariances of the `V_i`. With `z` the second differences of the angle, jointly Gaussian about the mean
//! that ramps and sinusoids give them,
//!
//! ```text
//! cov(V_i, V_j) = 2 / (M_i M_j 2 tau_i^2 2 tau_j^2) sum_k sum_l R(l - k)^2 + 2 R(l - k) D(l - k)
//! ```
//!
//! `R` is the covariance of the random part of `z_i`, `z_j`, a sum of nine values of the angle's autocovariance; `D` the
//! product of their means. Both are linear in `c`, so that each covariance is a quadratic form in `c`, which depends on
//! the record only through its length: it is built once, and a fit may then ask for any coefficients.
//!
//! Neighbouring octaves share most of their windows; leaving this out would make the intervals of fitted coefficients
//! too narrow. Factors must be powers of two: lags then fall on a grid that both share.

use nalgebra::{DMatrix, DVector};

use super::terms::Term;

/// Averaging factors farther apart than this are taken as independent: only quantisation, of which every variance is the
/// same sum of squares, still correlates, and there the shortest factors alone say all.
const INDEPENDENT: usize = 32;
/// Steps the shorter averaging time is divided into.
const STEPS: i64 = 16;
/// Flicker noise stays correlated beyond the windows' own length, for this many of the longer averaging time.
const REACH: i64 = 4;

/// An overlapping Allan variance's averaging factor (a power of two) and how many windows it is the mean of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Windows {
    /// Averaging factor.
    pub factor: usize,
    /// Number of windows.
    pub count: usize,
}

/// The covariances of the Allan variances of one record, as quadratic forms in the squared coefficients of `terms`.
pub struct Covariance {
    windows: Vec<Windows>,
    /// For each pair of variances the first of which is not the later one, row by row.
    forms: Vec<Option<DMatrix<f64>>>,
}

impl Covariance {
    /// Of variances at `windows` of a record sampled every `step_s`.
    pub fn new(step_s: f64, windows: &[Windows], terms: &[Term]) -> Self {
        let pairs = windows
            .iter()
            .flat_map(|one| windows.iter().map(move |other| (one, other)));
        let forms = pairs.map(|(one, other)| {
            let ordered = one.factor <= other.factor && other.factor <= INDEPENDENT * one.factor;
            (ordered && one.count > 0 && other.count > 0).then(|| form(step_s, *one, *other, terms))
        });
        Self {
            windows: windows.to_vec(),
            forms: forms.collect(),
        }
    }

    /// Covariance of two of the variances under squared coefficients in the order of the terms.
    pub fn of(&self, one: usize, other: usize, squared: &DVector<f64>) -> f64 {
        let (short, long) = if self.windows[one].factor <= self.windows[other].factor {
            (one, other)
        } else {
            (other, one)
        };
        self.forms[short * self.windows.len() + long]
            .as_ref()
            .map_or(0.0, |form| squared.dot(&(form * squared)))
    }
}

fn form(step_s: f64, short: Windows, long: Windows, terms: &[Term]) -> DMatrix<f64> {
    let (m1, m2) = (short.factor as i64, long.factor as i64);
    let (tau1, tau2) = (m1 as f64 * step_s, m2 as f64 * step_s);
    let step = (m1 / STEPS).max(1);
    let mut form = DMatrix::zeros(terms.len(), terms.len());
    let reach = REACH * m2 / step;
    for lag in (-reach..=reach).map(|cell| cell * step) {
        let pairs = pairs_until(short, long, lag + (step - 1) / 2) - pairs_until(short, long, lag - step / 2 - 1);
        if pairs <= 0.0 {
            continue;
        }
        let smooth: Vec<f64> = terms
            .iter()
            .map(|term| match term {
                Term::Ramp => (tau1 * tau2).powi(2),
                term => second_differences(lag, m1, m2, |lag| term.autocovariance(lag as f64 * step_s)),
            })
            .collect();
        // Quantisation is a spike of one lag where the windows share samples, not of a whole cell.
        let spike = second_differences(lag, m1, m2, |lag| if lag == 0 { 1.0 } else { 0.0 });
        let here = pairs_until(short, long, lag) - pairs_until(short, long, lag - 1);
        for (a, one) in terms.iter().enumerate() {
            for (b, other) in terms.iter().enumerate() {
                form[(a, b)] += match (*one, *other) {
                    (Term::Quantisation, Term::Quantisation) => here * spike * spike,
                    (Term::Quantisation, _) => here * spike * smooth[b],
                    (_, Term::Quantisation) => here * spike * smooth[a],
                    (one, other) if one.is_deterministic() && other.is_deterministic() => 0.0,
                    _ => pairs * smooth[a] * smooth[b],
                };
            }
        }
    }
    form * (2.0 / (4.0 * (tau1 * tau2).powi(2) * short.count as f64 * long.count as f64))
}

/// Covariance of second differences over `m1` and `m2` that start `lag` apart.
fn second_differences(lag: i64, m1: i64, m2: i64, autocovariance: impl Fn(i64) -> f64) -> f64 {
    let weights = [(0, 1.0), (1, -2.0), (2, 1.0)];
    let pairs = weights.iter().flat_map(|a| weights.iter().map(move |b| (a, b)));
    pairs
        .map(|(a, b)| a.1 * b.1 * autocovariance(lag + b.0 * m2 - a.0 * m1))
        .sum()
}

/// How many pairs of windows start at most `lag` apart (the longer's start minus the shorter's).
fn pairs_until(short: Windows, long: Windows, lag: i64) -> f64 {
    let (m1, m2) = (short.count as i64, long.count as i64);
    let triangle = |x: i64| if x > 0 { 0.5 * x as f64 * (x + 1) as f64 } else { 0.0 };
    triangle(lag + m1) - triangle(lag) - triangle(lag + m1 - m2) + triangle(lag - m2)
}

#[cfg(test)]
mod tests {
    use super::{
        super::{bounds, deviation::Deviation, noise::PowerLaw},
        *,
    };

    /// The cells are a sixteenth of an averaging time.
    const CELLS: f64 = 0.03;

    fn windows(factor: usize, angles: usize) -> Windows {
        Windows {
            factor,
            count: angles - 2 * factor,
        }
    }

    #[test]
    fn of_a_pure_power_law_it_is_what_its_degrees_of_freedom_say() {
        let laws = [
            (Term::Quantisation, PowerLaw::WhiteAngle),
            (Term::AngleWalk, PowerLaw::WhiteRate),
            (Term::BiasInstability, PowerLaw::FlickerRate),
            (Term::RateWalk, PowerLaw::RateWalk),
        ];
        for (term, law) in laws {
            // Below some hundred samples Greenhall and Riley's angle, an average, is smoother than a sampled one.
            for factor in [256, 2_048] {
                let at = windows(factor, 5_001);
                let variance = term.variance(factor as f64 * 0.1);
                let covariance = Covariance::new(0.1, &[at], &[term]).of(0, 0, &DVector::from_element(1, 1.0));
                let edf = 2.0 * variance * variance / covariance;
                let expected = bounds::edf(law, Deviation::Oadev, factor, at.count).expect("converges");
                assert!(
                    (edf / expected - 1.0).abs() < CELLS,
                    "{term:?} at {factor}: {edf}, not {expected}"
                );
            }
        }
    }

    #[test]
    fn pairs_are_counted_as_by_hand() {
        let (short, long) = (Windows { factor: 1, count: 7 }, Windows { factor: 2, count: 4 });
        for lag in -9..9_i64 {
            let by_hand = (0..7_i64)
                .flat_map(|i| (0..4_i64).map(move |j| j - i))
                .filter(|apart| *apart <= lag)
                .count();
            assert_eq!(pairs_until(short, long, lag), by_hand as f64, "at {lag}");
        }
    }

    #[test]
    fn it_does_not_depend_on_the_order_of_the_two() {
        let terms = [Term::AngleWalk, Term::Ramp, Term::Quantisation];
        let squared = DVector::from_column_slice(&[1.0, 1e-6, 0.2]);
        let covariance = Covariance::new(1.0, &[windows(16, 3_000), windows(4, 3_000)], &terms);
        let (one, other) = (covariance.of(0, 1, &squared), covariance.of(1, 0, &squared));
        assert!(one > 0.0 && one == other);
    }
}
