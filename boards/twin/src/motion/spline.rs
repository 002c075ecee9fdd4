//! The natural cubic spline through samples of a vector, with its exact derivatives.
//!
//! In: a [`Series`]. Out: value, first and second derivative at any time, all continuous; before the first sample those of
//! the first, after the last those of the last. Natural: no second derivative at both ends, which is right for a record
//! that begins and ends at rest. Lost samples are spanned by the one cubic that joins both sides smoothly.

use nalgebra::SVector;

use super::smooth::smoothed;
use crate::recording::Series;

/// The spline of a vector of N components.
#[derive(Clone, Debug)]
pub struct Spline<const N: usize> {
    samples: Series<N>,
    /// Second derivative at each sample.
    curvatures: Vec<SVector<f64, N>>,
}

/// A vector with its first two derivatives.
#[derive(Clone, Copy, Debug)]
pub struct Sample<const N: usize> {
    /// Its value.
    pub value: SVector<f64, N>,
    /// [1/s] its first derivative.
    pub rate: SVector<f64, N>,
    /// [1/s2] its second derivative.
    pub acc: SVector<f64, N>,
}

impl<const N: usize> Spline<N> {
    /// Through these samples.
    pub fn natural(samples: Series<N>) -> Self {
        let curvatures = curvatures(samples.t_s(), samples.values());
        Self { samples, curvatures }
    }

    /// Through what is left of the same samples when all above `corner_hz` is smoothed away.
    pub fn smoothed(&self, corner_hz: f64, step_s: f64) -> Self {
        let mut values = smoothed(&self.samples, corner_hz, step_s).into_iter();
        Self::natural(self.samples.clone().map(|value| values.next().unwrap_or(value)))
    }

    /// \[s\] first and last sample.
    pub fn span_s(&self) -> (f64, f64) {
        self.samples.span_s()
    }

    /// \[s\] the instants of the samples.
    pub fn t_s(&self) -> &[f64] {
        self.samples.t_s()
    }

    /// Value and derivatives at `t_s`.
    pub fn at(&self, t_s: f64) -> Sample<N> {
        let (i, s) = self.samples.interval(t_s);
        let (t, y, m) = (self.samples.t_s(), self.samples.values(), &self.curvatures);
        let h = t[i + 1] - t[i];
        let r = 1.0 - s;
        let [bend_before, bend_after] = [m[i] * h * h / 6.0, m[i + 1] * h * h / 6.0];
        Sample {
            value: y[i] * r + y[i + 1] * s + bend_before * (r * r * r - r) + bend_after * (s * s * s - s),
            rate: (y[i + 1] - y[i] - bend_before * (3.0 * r * r - 1.0) + bend_after * (3.0 * s * s - 1.0)) / h,
            acc: m[i] * r + m[i + 1] * s,
        }
    }
}

/// Second derivatives that make the first continuous at every inner sample: a tridiagonal system, solved by elimination
/// (Thomas), which its diagonal dominance makes stable.
fn curvatures<const N: usize>(t: &[f64], y: &[SVector<f64, N>]) -> Vec<SVector<f64, N>> {
    let mut curvatures = vec![SVector::zeros(); t.len()];
    let mut above = vec![0.0; t.len()];
    for i in 1..t.len() - 1 {
        let (before, after) = (t[i] - t[i - 1], t[i + 1] - t[i]);
        let bend = ((y[i + 1] - y[i]) / after - (y[i] - y[i - 1]) / before) * 6.0;
        let pivot = 2.0 * (before + after) - before * above[i - 1];
        above[i] = after / pivot;
        curvatures[i] = (bend - curvatures[i - 1] * before) / pivot;
    }
    for i in (1..t.len() - 1).rev() {
        curvatures[i] = curvatures[i] - curvatures[i + 1] * above[i];
    }
    curvatures
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector1;

    use super::*;

    /// Rounding of sums of order one.
    const EXACT: f64 = 1e-12;

    fn spline(t_s: &[f64], y: impl Fn(f64) -> f64) -> Spline<1> {
        let values = t_s.iter().map(|&t| Vector1::new(y(t))).collect();
        Spline::natural(Series::new(t_s.to_vec(), values).unwrap())
    }

    #[test]
    fn it_is_the_textbook_spline() {
        // Samples 0, 1, 0 at 0, 1, 2: curvature -3 in the middle, so the first piece is (3 t - t^3) / 2.
        let hat = spline(&[0.0, 1.0, 2.0], |t| 1.0 - (t - 1.0).abs());
        let at = hat.at(0.5);
        assert!((at.value.x - 0.6875).abs() < EXACT, "{}", at.value.x);
        assert!((at.rate.x - 1.125).abs() < EXACT, "{}", at.rate.x);
        assert!((at.acc.x + 1.5).abs() < EXACT, "{}", at.acc.x);
    }

    #[test]
    fn it_passes_through_uneven_samples_with_both_derivatives_continuous() {
        let times = [0.0, 0.1, 0.5, 0.6, 1.4, 1.5];
        let uneven = spline(&times, |t| (5.0 * t).sin());
        for t in &times[1..5] {
            let (before, at, after) = (uneven.at(t - 1e-9), uneven.at(*t), uneven.at(t + 1e-9));
            assert!((at.value.x - (5.0 * t).sin()).abs() < EXACT);
            assert!((before.rate.x - after.rate.x).abs() < 1e-6);
            assert!((before.acc.x - after.acc.x).abs() < 1e-5);
        }
    }

    #[test]
    fn two_samples_are_a_straight_line() {
        let line = spline(&[1.0, 3.0], |t| 2.0 * t);
        assert_eq!(
            (line.at(2.0).value.x, line.at(2.0).rate.x, line.at(2.0).acc.x),
            (4.0, 2.0, 0.0)
        );
    }

    #[test]
    fn beyond_its_samples_it_is_that_at_its_ends() {
        let line = spline(&[1.0, 3.0], |t| 2.0 * t);
        assert_eq!((line.at(-9.0).value.x, line.at(9.0).value.x), (2.0, 6.0));
    }
}
