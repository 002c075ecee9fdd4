//! A vector on a uniform grid of time, as a natural cubic spline, and its exact first-order low-pass.
//!
//! In: samples of N components, one a step. Out: value and slope at any instant, and, for a time constant `tau`, the
//! output of `tau y' + y = u` with the spline as input. On a piece `u` is a cubic, for which
//!
//! ```text
//! p = u - tau u' + tau^2 u'' - tau^3 u'''            (a solution)
//! y(t) = p(t) + (y(t_k) - p(t_k)) exp(-(t - t_k)/tau)
//! ```
//!
//! so the filter is exact whatever the step and smooth in `tau`: a low-pass stepped at the simulator's step is neither,
//! and hides a lag from whoever looks for it. Before the first sample all is as at the first, after the last as at the last.

use nalgebra::{SVector, Vector1};

/// The spline.
#[derive(Clone, Debug)]
pub struct Grid<const N: usize> {
    from_s: f64,
    step_s: f64,
    values: Vec<SVector<f64, N>>,
    /// Second derivatives at the samples.
    bends: Vec<SVector<f64, N>>,
}

/// An instant on a grid: its piece, and what the values and the second derivatives at the ends of that count for.
pub(super) struct Spot {
    piece: usize,
    parts: [f64; 2],
    bends: [f64; 2],
}

/// One piece: u(s) = c0 + c1 s + c2 s^2 + c3 s^3.
struct Piece<const N: usize>([SVector<f64, N>; 4]);

impl<const N: usize> Piece<N> {
    /// Through the values at both ends of a step, with the second derivatives there.
    fn between(step_s: f64, values: [SVector<f64, N>; 2], bends: [SVector<f64, N>; 2]) -> Self {
        Self([
            values[0],
            (values[1] - values[0]) / step_s - (bends[0] * 2.0 + bends[1]) * (step_s / 6.0),
            bends[0] * 0.5,
            (bends[1] - bends[0]) / (6.0 * step_s),
        ])
    }

    fn value(&self, s: f64) -> SVector<f64, N> {
        let [c0, c1, c2, c3] = self.0;
        c0 + (c1 + (c2 + c3 * s) * s) * s
    }

    fn slope(&self, s: f64) -> SVector<f64, N> {
        let [_, c1, c2, c3] = self.0;
        c1 + (c2 * 2.0 + c3 * (3.0 * s)) * s
    }

    fn low_passed(&self, s: f64, tau_s: f64) -> SVector<f64, N> {
        let [_, _, c2, c3] = self.0;
        let bend = c2 * 2.0 + c3 * (6.0 * s);
        self.value(s) - (self.slope(s) - (bend - c3 * (6.0 * tau_s)) * tau_s) * tau_s
    }

    /// The same at its beginning, where most terms vanish.
    fn low_passed_first(&self, tau_s: f64) -> SVector<f64, N> {
        let [c0, c1, c2, c3] = self.0;
        c0 - (c1 - (c2 * 2.0 - c3 * (6.0 * tau_s)) * tau_s) * tau_s
    }
}

impl<const N: usize> Grid<N> {
    /// Through samples at `from_s`, `from_s + step_s` and so on; at least two.
    pub fn natural(from_s: f64, step_s: f64, values: Vec<SVector<f64, N>>) -> Self {
        // Second derivatives: a tridiagonal system (1, 4, 1), by elimination.
        let count = values.len();
        let mut bends = vec![SVector::zeros(); count];
        let mut above = vec![0.0; count];
        for i in 1..count.saturating_sub(1) {
            let pivot = 1.0 / (4.0 - above[i - 1]);
            above[i] = pivot;
            let bend = (values[i + 1] - values[i] * 2.0 + values[i - 1]) * (6.0 / step_s.powi(2));
            bends[i] = (bend - bends[i - 1]) * pivot;
        }
        for i in (1..count.saturating_sub(1)).rev() {
            bends[i] = bends[i] - bends[i + 1] * above[i];
        }
        Self {
            from_s,
            step_s,
            values,
            bends,
        }
    }

    /// \[s\] the instants of the samples.
    pub fn nodes_s(&self) -> impl Iterator<Item = f64> {
        (0..self.values.len()).map(|node| self.from_s + node as f64 * self.step_s)
    }

    fn piece(&self, i: usize) -> Piece<N> {
        let ends = [i, i + 1];
        Piece::between(
            self.step_s,
            ends.map(|end| self.values[end]),
            ends.map(|end| self.bends[end]),
        )
    }

    /// The piece of an instant and how far into it the instant is; `None` beyond the ends, where nothing moves.
    fn place(&self, t_s: f64) -> (usize, f64) {
        let last = self.values.len() - 2;
        let i = (((t_s - self.from_s) / self.step_s).max(0.0) as usize).min(last);
        let s = t_s - self.from_s - i as f64 * self.step_s;
        (i, s.clamp(0.0, self.step_s))
    }

    /// An instant on it, and on every other of the same instants.
    pub(super) fn spot(&self, t_s: f64) -> Spot {
        let (piece, s) = self.place(t_s);
        let after = s / self.step_s;
        let parts = [1.0 - after, after];
        let bend = |part: f64| (part.powi(3) - part) * self.step_s.powi(2) / 6.0;
        Spot {
            piece,
            parts,
            bends: parts.map(bend),
        }
    }

    /// Value there; exactly the samples' where these are all alike.
    pub(super) fn on(&self, spot: &Spot) -> SVector<f64, N> {
        let (before, after) = (spot.piece, spot.piece + 1);
        self.values[before]
            + (self.values[after] - self.values[before]) * spot.parts[1]
            + self.bends[before] * spot.bends[0]
            + self.bends[after] * spot.bends[1]
    }

    /// Its time derivative there.
    pub(super) fn slope_on(&self, spot: &Spot) -> SVector<f64, N> {
        let (before, after, h) = (spot.piece, spot.piece + 1, self.step_s);
        let [of_before, of_after] = spot.parts.map(|part| (3.0 * part * part - 1.0) * h / 6.0);
        (self.values[after] - self.values[before]) / h + self.bends[after] * of_after - self.bends[before] * of_before
    }

    /// Its second time derivative there.
    pub(super) fn bend_on(&self, spot: &Spot) -> SVector<f64, N> {
        self.bends[spot.piece] * spot.parts[0] + self.bends[spot.piece + 1] * spot.parts[1]
    }

    /// Value at `t_s`.
    pub fn at(&self, t_s: f64) -> SVector<f64, N> {
        self.on(&self.spot(t_s))
    }

    /// Its time derivative at `t_s`.
    pub fn slope(&self, t_s: f64) -> SVector<f64, N> {
        self.slope_on(&self.spot(t_s))
    }

    /// Its second time derivative at `t_s`.
    pub fn bend(&self, t_s: f64) -> SVector<f64, N> {
        self.bend_on(&self.spot(t_s))
    }

    /// Its low-pass of time constant `tau_s`, settled at the first sample.
    pub fn low_pass(&self, tau_s: f64) -> LowPass<N> {
        let mut nodes = Vec::new();
        if tau_s > 0.0 {
            nodes.reserve_exact(self.values.len());
            let decay = (-self.step_s / tau_s).exp();
            let mut output = self.values[0];
            nodes.push(output);
            for i in 0..self.values.len() - 1 {
                let piece = self.piece(i);
                output = piece.low_passed(self.step_s, tau_s) + (output - piece.low_passed_first(tau_s)) * decay;
                nodes.push(output);
            }
        }
        LowPass { tau_s, nodes }
    }
}

/// The output of a low-pass at the samples of its grid.
#[derive(Clone, Debug)]
pub struct LowPass<const N: usize> {
    tau_s: f64,
    /// Empty for none.
    nodes: Vec<SVector<f64, N>>,
}

impl<const N: usize> LowPass<N> {
    /// Its scalar product with `weights` at `t_s`; `grid` is the one it was made of. The ends of a piece are multiplied and not the
    /// cubic in between: the rest is then a cubic of one number.
    pub fn along(&self, weights: &SVector<f64, N>, grid: &Grid<N>, t_s: f64) -> f64 {
        let (i, s) = grid.place(t_s);
        let along = |vector: &SVector<f64, N>| Vector1::new(weights.dot(vector));
        let ends = [i, i + 1];
        let piece = Piece::between(
            grid.step_s,
            ends.map(|end| along(&grid.values[end])),
            ends.map(|end| along(&grid.bends[end])),
        );
        let output = match self.nodes.get(i) {
            Some(node) => {
                let decay = (-s / self.tau_s).exp();
                piece.low_passed(s, self.tau_s) + (along(node) - piece.low_passed_first(self.tau_s)) * decay
            }
            None => piece.value(s),
        };
        output.x
    }
}

#[cfg(test)]
mod tests {
    use core::f64::consts::TAU;

    use nalgebra::Vector1;

    use super::*;

    fn sine(step_s: f64, hz: f64) -> Grid<1> {
        let count = (10.0 / step_s) as usize;
        let at = |k: usize| Vector1::new((TAU * hz * k as f64 * step_s).sin());
        Grid::natural(0.0, step_s, (0..=count).map(at).collect())
    }

    #[test]
    fn a_sine_comes_out_of_the_low_pass_with_its_textbook_gain_and_phase() {
        // Spline error h^4/384 u'''' = 2.5e-5 for 2 Hz at 25 ms.
        const SPLINE: f64 = 3e-5;
        for tau_s in [0.0, 1e-4, 0.0125, 0.3] {
            let grid = sine(0.025, 2.0);
            let low_pass = grid.low_pass(tau_s);
            let (gain, phase) = (1.0 / (TAU * 2.0 * tau_s).hypot(1.0), (TAU * 2.0 * tau_s).atan());
            for k in 0..300 {
                let t = 5.0 + 0.011 * f64::from(k);
                let expected = gain * (TAU * 2.0 * t - phase).sin();
                let out = low_pass.along(&Vector1::new(1.0), &grid, t);
                assert!((out - expected).abs() < SPLINE, "tau {tau_s} at {t}: {out} {expected}");
            }
        }
    }

    #[test]
    fn the_low_pass_is_smooth_in_its_time_constant_also_where_that_is_shorter_than_the_step() {
        // A central difference over tau changes by little when tau does: no steps, no noise.
        let grid = sine(0.01, 3.0);
        let slope = |tau_s: f64| {
            let h = 1e-6;
            let at = |tau_s: f64| grid.low_pass(tau_s).along(&Vector1::new(1.0), &grid, 5.003);
            (at(tau_s + h) - at(tau_s - h)) / (2.0 * h)
        };
        for tau_s in [5e-4, 2e-3, 9.9e-3, 0.01, 0.02] {
            let (before, after) = (slope(tau_s * 0.999), slope(tau_s * 1.001));
            assert!(
                (before - after).abs() < 2e-3 * before.abs().max(1.0),
                "{tau_s}: {before} {after}"
            );
        }
    }

    #[test]
    fn the_slope_is_that_of_the_curve_and_all_rests_beyond_the_ends() {
        let grid = sine(0.01, 1.0);
        assert!((grid.slope(5.0).x - TAU).abs() < 1e-4, "{}", grid.slope(5.0).x);
        let line = Grid::natural(1.0, 1.0, [2.0, 4.0, 6.0].map(Vector1::new).to_vec());
        assert_eq!((line.at(-9.0).x, line.at(1.5).x, line.at(99.0).x), (2.0, 3.0, 6.0));
        // A ramp lags by tau once settled.
        let low_pass = line.low_pass(0.01);
        let lagged = low_pass.along(&Vector1::new(1.0), &line, 2.5);
        assert!((lagged - 4.98).abs() < 1e-12);
    }

    #[test]
    fn two_samples_are_a_straight_line() {
        let line = Grid::natural(0.0, 2.0, [1.0, 5.0].map(Vector1::new).to_vec());
        assert_eq!((line.at(0.5).x, line.slope(0.5).x), (2.0, 2.0));
    }
}
