//! Uniform B-splines of the fifth degree: four times continuously differentiable, so that an angular acceleration has a slope.
//!
//! In: an instant and an order of derivative. Out: the first of six coefficients that count there, and their weights. They are
//! polynomials of the part `x` of the interval that is past, which Cox and de Boor's recursion makes for equal knots (de Boor, A
//! Practical Guide to Splines, 1978, chapter X): `w_p[j] = ((x + p - j) w_(p-1)[j-1] + (1 + j - x) w_(p-1)[j]) / p`.

/// Coefficients that count at an instant.
pub const SUPPORT: usize = 6;

const DEGREE: usize = SUPPORT - 1;

/// Of each power of `x`, what it counts for in the six weights, times [`WHOLE`].
const POWERS: [[f64; SUPPORT]; SUPPORT] = [
    [1.0, 26.0, 66.0, 26.0, 1.0, 0.0],
    [-5.0, -50.0, 0.0, 50.0, 5.0, 0.0],
    [10.0, 20.0, -60.0, 20.0, 10.0, 0.0],
    [-10.0, 20.0, 0.0, -20.0, 10.0, 0.0],
    [5.0, -20.0, 30.0, -20.0, 5.0, 0.0],
    [-1.0, 5.0, -10.0, 10.0, -5.0, 1.0],
];

/// `5!`: the divisions of the recursion together.
const WHOLE: f64 = 120.0;

/// Where the knots are.
#[derive(Clone, Copy, Debug)]
pub struct Knots {
    /// \[s\] of the first.
    pub from_s: f64,
    /// \[s\] between them.
    pub step_s: f64,
    /// Intervals between them.
    pub intervals: usize,
}

impl Knots {
    /// As many as reach from one instant to another.
    pub fn over(span_s: (f64, f64), step_s: f64) -> Self {
        Self {
            from_s: span_s.0,
            step_s,
            intervals: ((span_s.1 - span_s.0) / step_s).ceil().max(1.0) as usize,
        }
    }

    /// \[s\] of the first and of the last, which may lie beyond what was asked for.
    pub fn span_s(&self) -> (f64, f64) {
        (self.from_s, self.from_s + self.intervals as f64 * self.step_s)
    }

    /// Coefficients there are.
    pub fn coefficients(&self) -> usize {
        self.intervals + DEGREE
    }

    /// The interval of an instant, and the part of it that is past. Beyond the ends, the last polynomial goes on.
    fn place(&self, t_s: f64) -> (usize, f64) {
        let at = (t_s - self.from_s) / self.step_s;
        let first = (at.max(0.0) as usize).min(self.intervals - 1);
        (first, at - first as f64)
    }

    /// The first coefficient that counts at an instant, and the weights of it and the next five in a derivative of this order.
    pub fn weights(&self, t_s: f64, order: usize) -> (usize, [f64; SUPPORT]) {
        let (first, x) = self.place(t_s);
        let mut weights = [0.0; SUPPORT];
        for power in (order..=DEGREE).rev() {
            // By deriving that often, a power brings these factors down.
            let factor: f64 = (power - order + 1..=power).map(|factor| factor as f64).product();
            let own = weights.iter_mut().zip(POWERS[power]);
            own.for_each(|(weight, own)| *weight = *weight * x + factor * own);
        }
        let scale = self.step_s.powi(-(order as i32)) / WHOLE;
        (first, weights.map(|weight| weight * scale))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const KNOTS: Knots = Knots {
        from_s: 1.0,
        step_s: 0.1,
        intervals: 20,
    };

    /// A derivative of the spline with these coefficients.
    fn at(coefficients: &[f64], t_s: f64, order: usize) -> f64 {
        let (first, weights) = KNOTS.weights(t_s, order);
        let terms = weights.iter().zip(&coefficients[first..]);
        terms.map(|(weight, own)| weight * own).sum()
    }

    #[test]
    fn weights_are_a_partition_of_one_and_derivatives_are_those_of_what_they_derive() {
        let coefficients: Vec<f64> = (0..KNOTS.coefficients()).map(|k| (0.7 * k as f64).sin()).collect();
        for t_s in [1.0, 1.234, 1.5, 2.9999] {
            let sum: f64 = KNOTS.weights(t_s, 0).1.iter().sum();
            assert!((sum - 1.0).abs() < 1e-12);
            for order in 1..4 {
                let h = 1e-6;
                let quotient =
                    (at(&coefficients, t_s + h, order - 1) - at(&coefficients, t_s - h, order - 1)) / (2.0 * h);
                let own = at(&coefficients, t_s, order);
                assert!(
                    (quotient - own).abs() < 1e-3 * (1.0 + own.abs()),
                    "{t_s} {order}: {quotient} {own}"
                );
            }
        }
    }

    /// Cox and de Boor's recursion.
    fn recursed(x: f64) -> [f64; SUPPORT] {
        let mut weights = [0.0; SUPPORT];
        weights[0] = 1.0;
        for degree in 1..=DEGREE {
            let p = degree as f64;
            for j in (0..=degree).rev() {
                let before = if j > 0 { weights[j - 1] } else { 0.0 };
                weights[j] = ((x + p - j as f64) * before + (1.0 + j as f64 - x) * weights[j]) / p;
            }
        }
        weights
    }

    #[test]
    fn weights_are_those_of_the_recursion() {
        // Within an interval, and beyond both ends.
        for (t_s, interval, x) in [(1.234, 2, 0.34), (0.95, 0, -0.5), (3.05, 19, 1.5)] {
            let (first, weights) = KNOTS.weights(t_s, 0);
            assert_eq!(first, interval);
            for (weight, recursed) in weights.iter().zip(recursed(x)) {
                assert!((weight - recursed).abs() < 1e-9, "{t_s}: {weight} {recursed}");
            }
        }
    }

    #[test]
    fn equal_steps_are_a_straight_line() {
        let coefficients: Vec<f64> = (0..KNOTS.coefficients()).map(|k| 3.0 * k as f64).collect();
        for t_s in [1.1, 2.05] {
            assert!((at(&coefficients, t_s, 1) - 30.0).abs() < 1e-9);
            assert!(at(&coefficients, t_s, 2).abs() < 1e-7);
        }
    }
}
