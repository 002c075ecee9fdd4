//! Robust least squares of vectors, with standard deviations that hold for coloured noise.
//!
//! In: [`Point`]s `value = slopes theta + rest`, in the order of time. Out: [`Fitted`]. Weights are those of Cauchy's law with the scale of each
//! axis from the median of what is left (Holland and Welsch 1977), so that a shock or a phase with more vibration counts for less. Vibration is
//! coloured, and the formal sigmas are five to ten times too small then; so the sigmas are those of a jackknife over [`BLOCKS`] blocks of
//! time (Kuensch 1989).

use nalgebra::{DMatrix, DVector, Vector3};
use packets::magnitude::median;

/// Blocks of time: sigmas are known to a fifth.
const BLOCKS: usize = 12;

/// Iterations of the weights: four were enough on a rocket's chips to 1e-4 of a sigma.
const ITERATIONS: usize = 8;

/// Cauchy's constant: 95 % efficient on normal noise.
const CAUCHY: f64 = 2.385;

/// A median of absolute values to a standard deviation.
const MEDIAN_TO_SIGMA: f64 = 1.4826;

/// One vector and what it depends on: three rows of slopes.
#[derive(Clone, Debug)]
pub struct Point {
    /// Derivatives by the parameters.
    pub slopes: DMatrix<f64>,
    /// What was measured.
    pub value: Vector3<f64>,
}

/// Parameters with their standard deviations.
#[derive(Clone, Debug)]
pub struct Fitted {
    /// Each.
    pub theta: DVector<f64>,
    /// Of each.
    pub sigmas: DVector<f64>,
}

impl Fitted {
    /// Of points; none where they do not determine the parameters, as a whole or without one of the blocks.
    pub fn of(points: &[Point]) -> Option<Self> {
        let block = points.len() / BLOCKS;
        if block == 0 {
            return None;
        }
        let theta = solved(&points.iter().collect::<Vec<_>>())?;
        let mut left_out = Vec::with_capacity(BLOCKS);
        for own in 0..BLOCKS {
            let end = if own + 1 == BLOCKS {
                points.len()
            } else {
                (own + 1) * block
            };
            let others: Vec<&Point> = points[..own * block].iter().chain(&points[end..]).collect();
            left_out.push(solved(&others)?);
        }
        let blocks = BLOCKS as f64;
        let mean = left_out.iter().fold(DVector::zeros(theta.len()), |sum, own| sum + own) / blocks;
        let squares = (left_out.iter()).fold(DVector::zeros(theta.len()), |sum, own| {
            sum + (own - &mean).map(|off| off * off)
        });
        let sigmas = (squares * ((blocks - 1.0) / blocks)).map(f64::sqrt);
        Some(Self { theta, sigmas })
    }
}

fn solved(points: &[&Point]) -> Option<DVector<f64>> {
    let mut weights = vec![Vector3::repeat(1.0); points.len()];
    let mut theta = weighed(points, &weights)?;
    for _ in 0..ITERATIONS {
        let rests: Vec<Vector3<f64>> = (points.iter())
            .map(|point| point.value - Vector3::from_iterator((&point.slopes * &theta).iter().copied()))
            .collect();
        let scales = Vector3::from_fn(|axis, _| {
            let middle = median(rests.iter().map(|rest| rest[axis].abs())).unwrap_or(0.0);
            (MEDIAN_TO_SIGMA * middle).max(f64::MIN_POSITIVE)
        });
        for (weight, rest) in weights.iter_mut().zip(&rests) {
            *weight = Vector3::from_fn(|axis, _| {
                let off = rest[axis] / (CAUCHY * scales[axis]);
                1.0 / ((1.0 + off * off) * scales[axis] * scales[axis])
            });
        }
        theta = weighed(points, &weights)?;
    }
    theta.iter().all(|own| own.is_finite()).then_some(theta)
}

/// Weighed least squares; none where a parameter is not determined.
fn weighed(points: &[&Point], weights: &[Vector3<f64>]) -> Option<DVector<f64>> {
    let size = points.first()?.slopes.ncols();
    let (mut normal, mut right) = (DMatrix::zeros(size, size), DVector::zeros(size));
    for (point, weight) in points.iter().zip(weights) {
        let scaled = DMatrix::from_fn(3, size, |axis, at| point.slopes[(axis, at)] * weight[axis]);
        normal.gemm_tr(1.0, &scaled, &point.slopes, 1.0);
        right.gemv_tr(1.0, &scaled, &point.value, 1.0);
    }
    // In units of its own diagonal: slopes of rates and of forces differ by orders.
    let scale = normal.diagonal().map(f64::sqrt);
    if scale.iter().any(|own| *own == 0.0) {
        return None;
    }
    let even = DMatrix::from_fn(size, size, |row, column| {
        normal[(row, column)] / (scale[row] * scale[column])
    });
    let solved = even.cholesky()?.solve(&right.component_div(&scale));
    Some(solved.component_div(&scale))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A line against an axis of its own, with noise that is alike over forty points, and now and then far off.
    fn points(shocks: bool) -> Vec<Point> {
        let mut state = 7_u64;
        let mut random = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) as f64 / f64::from(1_u32 << 31) - 0.5
        };
        let mut alike = Vector3::zeros();
        (0..2400)
            .map(|at| {
                if at % 40 == 0 {
                    alike = Vector3::from_fn(|_, _| random());
                }
                let x = (0.017 * f64::from(at)).sin();
                let mut slopes = DMatrix::zeros(3, 2);
                (0..3).for_each(|axis| (slopes[(axis, 0)], slopes[(axis, 1)]) = (1.0, x));
                let shock = if shocks && at % 97 == 0 { 50.0 } else { 0.0 };
                Point {
                    slopes,
                    value: Vector3::repeat(0.4 - 1.3 * x + shock) + alike,
                }
            })
            .collect()
    }

    #[test]
    fn shocks_count_for_little_and_sigmas_hold_for_coloured_noise() {
        for shocks in [false, true] {
            let fitted = Fitted::of(&points(shocks)).expect("is determined");
            let off = (fitted.theta[1] + 1.3) / fitted.sigmas[1];
            assert!(off.abs() < 3.0, "{fitted:?}");
            // White noise of this size would give 0.0048; with forty points alike it is six times that.
            assert!((0.01..0.1).contains(&fitted.sigmas[1]), "{fitted:?}");
        }
    }

    #[test]
    fn what_nothing_determines_is_none() {
        let mut points = points(false);
        points.iter_mut().for_each(|point| point.slopes.column_mut(1).fill(0.0));
        assert!(Fitted::of(&points).is_none());
        assert!(Fitted::of(&points[..5]).is_none());
    }
}
