//! What some channels would see together: a vector, a small rotation, a factor, free in each stretch of time. Stretches overlap
//! by half, or what begins in the middle of one would be half as large there.
//!
//! In: for each sample what each of its components adds to it. Out: the energy along them of what a fit leaves, and of that the
//! part along one axis, the same in all stretches: a mount slips about one, and one current has one field. Of sixty stretches
//! that is a third of the numbers, and so as much sharper.

use nalgebra::{DMatrix, SMatrix, SVector};

use super::view::{View, place};
use crate::null::joint::Fitted;

/// [units of noise] to which a vector's length is cut before fourth powers are summed. Vectors of many sensors have lighter
/// tails than each of these, so the cut lies farther out than that of [`super::sums::tails`].
const FARTHEST: f64 = 8.0;

/// Of the mean of a normal matrix' diagonal: directions that nothing looks along stay closed.
const RIDGE: f64 = 1e-3;

/// Something of `D` components that some channels would see together, free in each stretch of time.
pub struct Common<const D: usize> {
    /// Per channel, for each sample its part of the log and what each component adds to it; empty for a channel that is not
    /// looked at.
    rows: Vec<Vec<(usize, SVector<f64, D>)>>,
    /// Parts of the log that a stretch has, each but the first of which is also in the one after.
    width: usize,
    /// Of each stretch the inverse root of the components' normal matrix, which is symmetric: nearly alike in all, an
    /// axis is one in all.
    roots: Vec<SMatrix<f64, D, D>>,
}

impl<const D: usize> Common<D> {
    /// In so many stretches. `design` gives what the components add to a sample; only channels that are seen count.
    pub fn new(
        views: &[View],
        stretches: usize,
        design: impl Fn(&View, usize) -> SVector<f64, D>,
        is_seen: impl Fn(usize) -> bool,
    ) -> Self {
        Self::of_parts(views, [2 * stretches, 2], design, is_seen)
    }

    /// In every sample by itself.
    pub fn of_samples(
        views: &[View],
        design: impl Fn(&View, usize) -> SVector<f64, D>,
        is_seen: impl Fn(usize) -> bool,
    ) -> Self {
        let samples = views.iter().map(|view| view.phase.len()).max().unwrap_or(0);
        Self::of_parts(views, [samples, 1], design, is_seen)
    }

    fn of_parts(
        views: &[View],
        [parts, width]: [usize; 2],
        design: impl Fn(&View, usize) -> SVector<f64, D>,
        is_seen: impl Fn(usize) -> bool,
    ) -> Self {
        let mut normal = vec![SMatrix::<f64, D, D>::zeros(); parts];
        let mut rows = Vec::new();
        for (index, view) in views.iter().enumerate() {
            let row = |(row, phase): (usize, &f64)| (place(*phase, parts), design(view, row));
            let own: Vec<(usize, SVector<f64, D>)> = match is_seen(index) {
                true => view.phase.iter().enumerate().map(row).collect(),
                false => Vec::new(),
            };
            own.iter()
                .for_each(|(part, add)| normal[*part] += add * add.transpose());
            rows.push(own);
        }
        Common {
            rows,
            width,
            roots: normal
                .windows(width)
                .map(|own| inverse_root(own.iter().sum()))
                .collect(),
        }
    }

    /// The energy along the components, over all stretches.
    pub fn sum(&self, fitted: &Fitted) -> f64 {
        self.standard(fitted).map(|own| own.norm_squared()).sum()
    }

    /// The same, and that of it which is along the one axis that has most.
    pub fn sums(&self, fitted: &Fitted) -> [f64; 2] {
        let all: SMatrix<f64, D, D> = self.standard(fitted).map(|own| own * own.transpose()).sum();
        [all.trace(), dynamic(&all).symmetric_eigenvalues().max()]
    }

    /// How heavy its tails are: of a blow that is small in each sensor, in few of the stretches.
    pub fn tails(&self, fitted: &Fitted) -> f64 {
        self.standard(fitted).map(|own| own.norm().min(FARTHEST).powi(4)).sum()
    }

    /// The components of each stretch in units of their noise.
    fn standard(&self, fitted: &Fitted) -> impl Iterator<Item = SVector<f64, D>> {
        let mut scores = vec![SVector::zeros(); self.roots.len() + self.width - 1];
        for (rows, rest) in self.rows.iter().zip(&fitted.rest) {
            for ((part, add), value) in rows.iter().zip(rest.iter()) {
                scores[*part] += add * *value;
            }
        }
        let sums: Vec<SVector<f64, D>> = scores.windows(self.width).map(|own| own.iter().sum()).collect();
        sums.into_iter().zip(&self.roots).map(|(score, root)| root * score)
    }
}

/// Inverse root of a normal matrix with its ridge; zero of a matrix that is zero.
pub fn inverse_root<const D: usize>(normal: SMatrix<f64, D, D>) -> SMatrix<f64, D, D> {
    let ridge = SMatrix::identity() * (RIDGE * normal.trace() / D as f64);
    let eigen = dynamic(&(normal + ridge)).symmetric_eigen();
    let inverse = eigen
        .eigenvalues
        .map(|value| if value > 0.0 { value.sqrt().recip() } else { 0.0 });
    let root = &eigen.eigenvectors * DMatrix::from_diagonal(&inverse) * eigen.eigenvectors.transpose();
    SMatrix::from_iterator(root.iter().copied())
}

/// The library decomposes matrices of a size that it is told, not of a generic one.
fn dynamic<const D: usize>(matrix: &SMatrix<f64, D, D>) -> DMatrix<f64> {
    DMatrix::from_iterator(D, D, matrix.iter().copied())
}
