//! Vectors against time from readings along known directions at instants of their own: a cubic B-spline by least squares.
//!
//! In: [`Sample`]s `value = direction . s(t) + noise`. Out: [`Spline`], twice continuously differentiable. The coefficients `c`
//! minimise `sum ((value - direction . s(t)) / sigma)^2 + sum |c[k-1] - 2 c[k] + c[k+1]|^2 / bend^2`: the second sum bridges
//! what is missing. The normal matrix is banded; its Cholesky factor costs a constant a knot (Golub and Van Loan, 4.3.5).

use nalgebra::SVector;

use crate::parity::smooth::banded::Banded;

/// A reading.
#[derive(Clone, Copy, Debug)]
pub struct Sample<const N: usize> {
    /// \[s\] when.
    pub t_s: f64,
    /// Along what.
    pub direction: SVector<f64, N>,
    /// What was read.
    pub value: f64,
    /// Its standard deviation.
    pub sigma: f64,
}

/// A vector against time.
#[derive(Clone, Debug)]
pub struct Spline<const N: usize> {
    from_s: f64,
    step_s: f64,
    coefficients: Vec<SVector<f64, N>>,
}

impl<const N: usize> Spline<N> {
    /// Through samples between two instants, with knots every `step_s`. `bend` is how far neighbouring coefficients may be off a
    /// straight line.
    pub fn fit(span_s: (f64, f64), step_s: f64, bend: f64, samples: impl IntoIterator<Item = Sample<N>>) -> Self {
        let intervals = ((span_s.1 - span_s.0) / step_s).ceil().max(1.0) as usize;
        let mut spline = Self {
            from_s: span_s.0,
            step_s,
            coefficients: vec![SVector::zeros(); intervals + 3],
        };
        let size = N * spline.coefficients.len();
        let (mut normal, mut solution) = (Banded::zeros(size, 4 * N), vec![0.0; size]);
        let mut add = |first: usize, row: &[f64], value: f64| {
            normal.add(first, row);
            let own = solution[first..].iter_mut();
            own.zip(row).for_each(|(sum, one)| *sum += one * value);
        };
        for sample in samples {
            let (first, weights) = spline.weights(sample.t_s, 0);
            let row: Vec<f64> = (weights.iter())
                .flat_map(|weight| sample.direction.iter().map(move |along| weight * along / sample.sigma))
                .collect();
            add(N * first, &row, sample.value / sample.sigma);
        }
        for knot in 1..spline.coefficients.len() - 1 {
            for axis in 0..N {
                let mut row = vec![0.0; 2 * N + 1];
                (row[0], row[N], row[2 * N]) = (1.0 / bend, -2.0 / bend, 1.0 / bend);
                add(N * (knot - 1) + axis, &row, 0.0);
            }
        }
        normal.factor().solve(solution.as_chunks_mut::<1>().0);
        for (knot, coefficient) in spline.coefficients.iter_mut().enumerate() {
            *coefficient = SVector::from_fn(|axis, _| solution[N * knot + axis]);
        }
        spline
    }

    /// Its value.
    pub fn at(&self, t_s: f64) -> SVector<f64, N> {
        self.derivative(t_s, 0)
    }

    /// Its derivative of this order, 0 to 2.
    pub fn derivative(&self, t_s: f64, order: i32) -> SVector<f64, N> {
        let (first, weights) = self.weights(t_s, order);
        let terms = weights.iter().zip(&self.coefficients[first..]);
        terms
            .map(|(weight, coefficient)| coefficient * *weight)
            .sum::<SVector<f64, N>>()
            / self.step_s.powi(order)
    }

    /// The first of four coefficients that count at an instant, and their weights.
    fn weights(&self, t_s: f64, order: i32) -> (usize, [f64; 4]) {
        let last = self.coefficients.len() - 4;
        let at = ((t_s - self.from_s) / self.step_s).clamp(0.0, (last + 1) as f64);
        let first = (at.floor() as usize).min(last);
        let x = at - first as f64;
        let y = 1.0 - x;
        let weights = match order {
            0 => [
                y.powi(3) / 6.0,
                (3.0 * x.powi(3) - 6.0 * x * x + 4.0) / 6.0,
                (3.0 * y.powi(3) - 6.0 * y * y + 4.0) / 6.0,
                x.powi(3) / 6.0,
            ],
            1 => [
                -y * y / 2.0,
                (3.0 * x * x - 4.0 * x) / 2.0,
                -(3.0 * y * y - 4.0 * y) / 2.0,
                x * x / 2.0,
            ],
            _ => [y, 3.0 * x - 2.0, 3.0 * y - 2.0, x],
        };
        (first, weights)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector2;

    /// Two components seen along three directions in turn.
    fn fitted() -> Spline<2> {
        let directions = [Vector2::new(1.0, 0.0), Vector2::new(0.6, 0.8), Vector2::new(0.0, -1.0)];
        let sample = |k: usize| {
            let t_s = 0.02 * k as f64;
            Sample {
                t_s,
                direction: directions[k % 3],
                value: directions[k % 3].dot(&truth(t_s)),
                sigma: 1e-3,
            }
        };
        // Two seconds are missing.
        Spline::fit(
            (0.0, 20.0),
            0.2,
            1.0,
            (0..=1000).filter(|k| !(400..500).contains(k)).map(sample),
        )
    }

    fn truth(t_s: f64) -> Vector2<f64> {
        Vector2::new((0.9 * t_s).sin(), 0.3 * t_s)
    }

    #[test]
    fn it_goes_through_what_was_read_and_its_derivatives_are_those_of_the_course() {
        let spline = fitted();
        for t_s in [1.03, 5.5, 13.71, 18.2] {
            assert!((spline.at(t_s) - truth(t_s)).norm() < 1e-3, "{t_s}");
            let slope = Vector2::new(0.9 * (0.9 * t_s).cos(), 0.3);
            assert!((spline.derivative(t_s, 1) - slope).norm() < 1e-2, "{t_s}");
            let bend = Vector2::new(-0.81 * (0.9 * t_s).sin(), 0.0);
            assert!((spline.derivative(t_s, 2) - bend).norm() < 0.1, "{t_s}");
        }
    }

    #[test]
    fn what_is_missing_is_bridged() {
        let spline = fitted();
        assert!((spline.at(9.0) - truth(9.0)).norm() < 0.3);
    }
}
