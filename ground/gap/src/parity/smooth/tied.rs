//! A track as rows of the smoother: each fix depends on the motion of the whole log before it, so no band holds it.
//!
//! In: fixes along a trajectory ([`Aligned`]), the knots, the banded factor `N = L L'` of everything else. Out: [`Tie`].
//!
//! With a turn `th` and a force `s` in b a position changes by `dp(t) = int_0^t (t - u) C_nb (s + th x f) du`. Of the rows `T` in their
//! sigmas, begin, velocity and offset of the clock are taken off, for they are free. With `W = L^-1 T'` and `W'W = V D V'` the
//! normal matrix of everything is
//!
//! ```text
//! N + T'T = L (I + W W') L',   (I + W W')^-1 = M M,   M = I - Z (1 - (1 + D)^-1/2) Z',   Z = W V D^-1/2
//! ```
//!
//! and a part `L^-1 A'u` becomes `M L^-1 A'u`: the same inner products, the track in. The rank is that of three a fix at most.

use nalgebra::{DMatrix, DMatrixViewMut, DVector, SymmetricEigen, Vector3};

use crate::parity::{
    known::track::{Aligned, Fix},
    smooth::{
        banded::{Factor, LANES},
        basis::{Knots, SUPPORT},
        rows::UNKNOWNS,
        trajectory::Trajectory,
    },
};

/// Share of the information of everything else below which a direction of the track is left out: it would change nothing that is
/// printed.
const LEAST_SHARE: f64 = 1e-9;

/// A track that the motion is tied to.
pub struct Tie {
    /// `W`.
    moved: DMatrix<f64>,
    /// `Z`, orthonormal.
    along: DMatrix<f64>,
    /// `1 - (1 + D)^-1/2`.
    shrunk: DVector<f64>,
    /// `L^-T Z (D / (1 + D))^1/2`: by the products of its rows the covariance is smaller.
    known: DMatrix<f64>,
    /// \[s\] one sigma of the clock's offset, the calibration known; none where this log does not tell it.
    pub offset_sigma_s: Option<f64>,
}

impl Tie {
    /// Of fixes along a trajectory.
    pub fn of(fixes: &[Fix], aligned: &Aligned, trajectory: &Trajectory, knots: &Knots, factor: &Factor) -> Self {
        let rows = rows(fixes, aligned, trajectory, knots, factor.size());
        let begun = &aligned.begun;
        // T' without what begin and velocity make.
        let apart = &rows - (&rows * begun) * begun.transpose();
        let moved = forward(factor, apart);
        let direction = aligned.direction(trajectory);
        let offset_sigma_s = direction.as_ref().and_then(|_| {
            let inner = DMatrix::identity(moved.ncols(), moved.ncols()) + moved.tr_mul(&moved);
            let solved = inner.cholesky()?.solve(&aligned.by_offset);
            Some(aligned.by_offset.dot(&solved).sqrt().recip())
        });
        let moved = match &direction {
            Some(direction) => &moved - (&moved * direction) * direction.transpose(),
            None => moved,
        };
        let SymmetricEigen {
            eigenvectors,
            eigenvalues,
        } = SymmetricEigen::new(moved.tr_mul(&moved));
        let kept: Vec<usize> = (0..eigenvalues.len())
            .filter(|at| eigenvalues[*at] > LEAST_SHARE)
            .collect();
        let sizes = DVector::from_iterator(kept.len(), kept.iter().map(|at| eigenvalues[*at]));
        let vectors = eigenvectors.select_columns(&kept);
        let mut along = &moved * vectors;
        for (at, size) in sizes.iter().enumerate() {
            along.column_mut(at).scale_mut(size.sqrt().recip());
        }
        let mut known = backward(factor, along.clone());
        for (at, size) in sizes.iter().enumerate() {
            known.column_mut(at).scale_mut((size / (1.0 + size)).sqrt());
        }
        Self {
            moved,
            shrunk: sizes.map(|size| 1.0 - (1.0 + size).sqrt().recip()),
            along,
            known,
            offset_sigma_s,
        }
    }

    /// `M` times parts, in place.
    pub fn apply(&self, parts: &mut DMatrixViewMut<f64>) {
        let mut inner = self.along.tr_mul(&*parts);
        for (mut row, shrunk) in inner.row_iter_mut().zip(self.shrunk.iter()) {
            row *= *shrunk;
        }
        parts.gemm(-1.0, &self.along, &inner, 1.0);
    }

    /// `L^-1 T'r`.
    pub fn prior(&self, off: &DVector<f64>) -> DVector<f64> {
        &self.moved * off
    }

    /// By how much a covariance `one' N^-1 other` of vectors that begin at `first` is smaller.
    pub fn less(&self, first: usize, one: &[f64], other: &[f64]) -> f64 {
        let seen = |own: &[f64]| -> DVector<f64> {
            let rows = self.known.rows(first, own.len());
            rows.tr_mul(&DVector::from_column_slice(own))
        };
        seen(one).dot(&seen(other))
    }
}

/// `T'` in its sigmas: a column a row of a fix, as each unknown moves it.
fn rows(fixes: &[Fix], aligned: &Aligned, trajectory: &Trajectory, knots: &Knots, size: usize) -> DMatrix<f64> {
    let h = trajectory.step_s();
    let mut out = DMatrix::zeros(size, 3 * fixes.len());
    // Of each unknown, the sums of what it adds to the acceleration in n and of that times its instant, up to now.
    let mut sums: Vec<[Vector3<f64>; 2]> = vec![[Vector3::zeros(); 2]; size];
    let mut node = 0;
    let mut reached = 0;
    for (at, fix) in fixes.iter().enumerate() {
        let t_s = fix.t_s + aligned.offset_s;
        while node < trajectory.states.len() && trajectory.at_s(node) <= t_s {
            let (state, at_s) = (&trajectory.states[node], trajectory.at_s(node));
            let to_n = state.q_nb.to_rotation_matrix();
            let by_turn = -(to_n.matrix() * state.force_b.cross_matrix());
            let share = if node == 0 { 0.5 * h } else { h };
            let (first, weights) = knots.weights(at_s, 0);
            for (knot, weight) in weights.iter().enumerate() {
                let own = &mut sums[UNKNOWNS * (first + knot)..];
                for axis in 0..3 {
                    let turn = by_turn.column(axis) * (share * weight);
                    let force = to_n.matrix().column(axis) * (share * weight);
                    own[axis][0] += turn;
                    own[axis][1] += turn * at_s;
                    own[3 + axis][0] += force;
                    own[3 + axis][1] += force * at_s;
                }
            }
            reached = UNKNOWNS * (first + SUPPORT);
            node += 1;
        }
        for (unknown, [sum, times]) in sums[..reached].iter().enumerate() {
            let moved = t_s * sum - times;
            (0..3).for_each(|axis| out[(unknown, 3 * at + axis)] = moved[axis] / fix.sigmas_n[axis]);
        }
    }
    out
}

/// `L^-1` times columns.
fn forward(factor: &Factor, columns: DMatrix<f64>) -> DMatrix<f64> {
    through(columns, |panel| factor.forward(panel))
}

/// `L^-T` times columns.
fn backward(factor: &Factor, columns: DMatrix<f64>) -> DMatrix<f64> {
    through(columns, |panel| factor.backward(panel))
}

fn through(mut columns: DMatrix<f64>, solve: impl Fn(&mut [[f64; LANES]])) -> DMatrix<f64> {
    let size = columns.nrows();
    let mut panel = vec![[0.0; LANES]; size];
    for from in (0..columns.ncols()).step_by(LANES) {
        let lanes = LANES.min(columns.ncols() - from);
        for lane in 0..lanes {
            let own = columns.column(from + lane);
            panel
                .iter_mut()
                .zip(own.iter())
                .for_each(|(row, value)| row[lane] = *value);
        }
        solve(&mut panel);
        for lane in 0..lanes {
            let mut own = columns.column_mut(from + lane);
            own.iter_mut().zip(&panel).for_each(|(value, row)| *value = row[lane]);
        }
    }
    columns
}

#[cfg(test)]
mod tests {
    use twin::{environment::Environment, motion::Tumble, predict::Scene};

    use super::*;
    use crate::parity::{course::Start, known::track::Displacement, smooth::banded::Banded};

    /// A tumble of ten seconds, and fixes along it.
    fn tumbling() -> (Trajectory, Knots, Vec<Fix>) {
        let environment = Environment::laboratory();
        let scene = Scene::new(&Tumble::new(), &environment, 19.0, 31.0, 0.01);
        let knots = Knots::over((20.0, 30.0), 0.1);
        let start = Start::at_will((20.0, 30.0), 0.2, 50);
        let trajectory = Trajectory::of(&start, &knots, &scene, &environment);
        let course = Displacement::of(&trajectory);
        let fixes: Vec<Fix> = (0..20)
            .map(|at| 0.3 + 0.5 * f64::from(at))
            .map(|t_s| Fix {
                t_s,
                position_n: course.at(t_s + 20.0).0,
                sigmas_n: Vector3::new(1.0, 2.0, 0.5),
            })
            .collect();
        (trajectory, knots, fixes)
    }

    #[test]
    fn rows_say_by_how_much_a_correction_moves_each_fix() {
        let (mut trajectory, knots, fixes) = tumbling();
        let aligned = Aligned::of(&fixes, &trajectory, 20.0);
        let size = UNKNOWNS * knots.coefficients();
        let rows = rows(&fixes, &aligned, &trajectory, &knots, size);
        let correction: Vec<f64> = (0..size).map(|k| 1e-4 * (0.37 * k as f64).sin()).collect();
        let said = rows.tr_mul(&DVector::from_column_slice(&correction));
        let at = |trajectory: &Trajectory| -> Vec<f64> {
            let course = Displacement::of(trajectory);
            let each = fixes.iter().flat_map(|fix| {
                let own = course.at(fix.t_s + aligned.offset_s).0.component_div(&fix.sigmas_n);
                [own.x, own.y, own.z]
            });
            each.collect()
        };
        let before = at(&trajectory);
        trajectory.correct(&knots, &correction, 1.0);
        let moved: DVector<f64> = DVector::from_vec(at(&trajectory)) - DVector::from_vec(before);
        assert!((&moved - &said).norm() < 5e-3 * said.norm(), "{moved} {said}");
    }

    #[test]
    fn the_matrix_that_parts_are_taken_by_is_the_root_of_the_inverse() {
        let (trajectory, knots, fixes) = tumbling();
        let aligned = Aligned::of(&fixes, &trajectory, 20.0);
        let size = UNKNOWNS * knots.coefficients();
        let mut normal = Banded::zeros(size, UNKNOWNS * SUPPORT);
        (0..size).for_each(|at| normal.add(at, &[3.0 + (at as f64).sin()]));
        let tie = Tie::of(&fixes, &aligned, &trajectory, &knots, &normal.factor());
        let part = DMatrix::from_fn(size, 1, |row, _| (0.1 * row as f64).cos());
        let mut twice = part.clone();
        tie.apply(&mut twice.view_mut((0, 0), (size, 1)));
        tie.apply(&mut twice.view_mut((0, 0), (size, 1)));
        // (I + W W') of it is the part again.
        let back = &twice + &tie.moved * tie.moved.tr_mul(&twice);
        assert!(tie.shrunk.len() > 30 && (&back - &part).norm() < 1e-6 * part.norm());
        // The band is a diagonal of d^2, so `N^-1 - (N + T'T)^-1 = D^-1 (I - M M) D^-1`.
        let unit: Vec<f64> = vec![1.0];
        let mut column = DMatrix::zeros(size, 1);
        column[(7, 0)] = 1.0;
        tie.apply(&mut column.view_mut((0, 0), (size, 1)));
        tie.apply(&mut column.view_mut((0, 0), (size, 1)));
        let less = (1.0 - column[(7, 0)]) / (3.0 + 7f64.sin()).powi(2);
        assert!((tie.less(7, &unit, &unit) - less).abs() < 1e-9 + 1e-6 * less);
    }
}
