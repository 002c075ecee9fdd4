//! Symmetric positive matrices whose rows reach a constant width: normal matrices of splines.
//!
//! In: rows of a design, added one by one. Out: [`Factor`] `L` of `N = L L'` (Golub and Van Loan, Matrix Computations, 4.3.5), which solves
//! either triangle, and the entries of `N^-1` within the band (Takahashi, Fagan and Chen 1973). Time and memory are linear in
//! the size. Right-hand sides are solved [`LANES`] at a time, side by side in a [`Panel`]: then a row of the factor is read once for
//! all of them, and no sum waits for the one before.

/// Share of the largest diagonal that is added to all: a direction that no row sees stays at nothing.
const RIDGE: f64 = 1e-12;

/// Right-hand sides that are solved together: their sums fill half of the vector registers of a processor that has no longer ones than
/// 128 bits.
pub const LANES: usize = 16;

/// Right-hand sides side by side, row by row.
pub type Panel<const N: usize = LANES> = [[f64; N]];

/// A matrix that is filled.
#[derive(Clone, Debug)]
pub struct Banded {
    width: usize,
    /// Row by row, the diagonal last.
    rows: Vec<f64>,
}

/// Its lower Cholesky factor.
#[derive(Clone, Debug)]
pub struct Factor {
    width: usize,
    rows: Vec<f64>,
}

impl Banded {
    /// Nothing yet. `width` counts the diagonal.
    pub fn zeros(size: usize, width: usize) -> Self {
        Self {
            width,
            rows: vec![0.0; size * width],
        }
    }

    /// Adds `row' row`, the row beginning at a column; it is no longer than the band is wide.
    pub fn add(&mut self, first: usize, row: &[f64]) {
        for (at, one) in row.iter().enumerate().filter(|(_, one)| **one != 0.0) {
            let end = (first + at + 1) * self.width;
            let own = &mut self.rows[end - 1 - at..end];
            own.iter_mut().zip(row).for_each(|(sum, other)| *sum += one * other);
        }
    }

    /// By Cholesky.
    pub fn factor(self) -> Factor {
        let Self { width, mut rows } = self;
        let size = rows.len() / width;
        let largest = (0..size).map(|row| rows[row * width + width - 1]).fold(0.0, f64::max);
        for row in 0..size {
            rows[row * width + width - 1] += RIDGE * largest;
            let from = (row + 1).saturating_sub(width);
            let (before, own) = rows.split_at_mut(row * width);
            for column in from..=row {
                // The columns that both rows reach: those of this row up to `column`.
                let (start, reach) = (width - 1 + from - row, column - from);
                let at = start + reach;
                let sum = if column == row {
                    own[start..at].iter().map(|value| value * value).sum()
                } else {
                    let other = (column + 1) * width - 1;
                    dot(&before[other - reach..other], &own[start..at])
                };
                let rest = own[at] - sum;
                own[at] = if column == row {
                    rest.max(f64::MIN_POSITIVE).sqrt()
                } else {
                    rest / before[(column + 1) * width - 1]
                };
            }
        }
        Factor { width, rows }
    }
}

/// In four sums, of which none waits for the one before.
fn dot(one: &[f64], other: &[f64]) -> f64 {
    let (ones, rest) = one.as_chunks::<4>();
    let (others, other_rest) = other.as_chunks::<4>();
    let mut sums = [0.0; 4];
    for (one, other) in ones.iter().zip(others) {
        (0..4).for_each(|at| sums[at] += one[at] * other[at]);
    }
    let last: f64 = rest.iter().zip(other_rest).map(|(one, other)| one * other).sum();
    sums.iter().sum::<f64>() + last
}

impl Factor {
    /// Rows there are.
    pub fn size(&self) -> usize {
        self.rows.len() / self.width
    }

    /// Of each row the entries left of the diagonal, and the diagonal.
    fn rows(&self) -> impl DoubleEndedIterator<Item = (usize, &[f64], f64)> + ExactSizeIterator {
        let last = self.width - 1;
        let rows = self.rows.chunks_exact(self.width).enumerate();
        rows.map(move |(row, own)| (row, &own[last - row.min(last)..last], own[last]))
    }

    /// `L^-1 right`, in place.
    pub fn forward<const N: usize>(&self, right: &mut Panel<N>) {
        self.forward_from(0, right);
    }

    /// The same of right-hand sides that are nothing before a row.
    pub fn forward_from<const N: usize>(&self, first: usize, right: &mut Panel<N>) {
        for (row, left, diagonal) in self.rows().skip(first) {
            let (before, own) = right.split_at_mut(row);
            let mut rest = own[0];
            for (factor, known) in left.iter().zip(&before[row - left.len()..]) {
                rest.iter_mut()
                    .zip(known)
                    .for_each(|(rest, known)| *rest -= factor * known);
            }
            own[0] = rest.map(|rest| rest / diagonal);
        }
    }

    /// `L^-T right`, in place.
    pub fn backward<const N: usize>(&self, right: &mut Panel<N>) {
        for (row, left, diagonal) in self.rows().rev() {
            let (before, own) = right.split_at_mut(row);
            let value = own[0].map(|rest| rest / diagonal);
            own[0] = value;
            for (factor, above) in left.iter().zip(&mut before[row - left.len()..]) {
                above
                    .iter_mut()
                    .zip(&value)
                    .for_each(|(above, value)| *above -= factor * value);
            }
        }
    }

    /// `N^-1 right`, in place.
    pub fn solve<const N: usize>(&self, right: &mut Panel<N>) {
        self.forward(right);
        self.backward(right);
    }

    /// `N^-1` within the band.
    pub fn inverse(&self) -> Inverse {
        let (size, width) = (self.size(), self.width);
        let mut inverse = Inverse {
            width,
            rows: vec![0.0; self.rows.len()],
        };
        // Z = N^-1 fulfils L'Z = L^-1, whose upper triangle is nothing but 1 / l_jj on the diagonal.
        let mut column = vec![0.0; width];
        for j in (0..size).rev() {
            let diagonal = self.rows[(j + 1) * width - 1];
            let last = (j + width).min(size);
            // Below the diagonal of column j of L.
            for k in j + 1..last {
                column[k - j] = self.rows[k * width + width - 1 + j - k];
            }
            for i in (j..last).rev() {
                let sum: f64 = (j + 1..last)
                    .map(|k| column[k - j] * inverse.at(i.max(k), i.min(k)))
                    .sum();
                let own = if i == j { 1.0 / diagonal } else { 0.0 };
                inverse.rows[i * width + width - 1 + j - i] = (own - sum) / diagonal;
            }
        }
        inverse
    }
}

/// Entries of an inverse near its diagonal.
#[derive(Clone, Debug)]
pub struct Inverse {
    width: usize,
    rows: Vec<f64>,
}

impl Inverse {
    /// The entry of a row at a column that is not to the right of it, and in the band.
    fn at(&self, row: usize, column: usize) -> f64 {
        self.rows[row * self.width + self.width - 1 + column - row]
    }

    /// `one' N^-1 other` of two vectors that begin at `first` and are as long as each other, and no longer than the band is wide.
    pub fn between(&self, first: usize, one: &[f64], other: &[f64]) -> f64 {
        let mut sum = 0.0;
        let is_there = |(_, own): &(usize, &f64)| **own != 0.0;
        for (row, own) in one.iter().enumerate().filter(is_there) {
            for (column, others) in other.iter().enumerate().filter(is_there) {
                let (low, high) = (row.min(column), row.max(column));
                sum += own * others * self.at(first + high, first + low);
            }
        }
        sum
    }

    /// `own' N^-1 own`, by half of its products.
    pub fn around(&self, first: usize, own: &[f64]) -> f64 {
        let mut sum = 0.0;
        for (row, value) in own.iter().enumerate().filter(|(_, value)| **value != 0.0) {
            let end = (first + row + 1) * self.width;
            let before = dot(&self.rows[end - 1 - row..end - 1], &own[..row]);
            sum += value * (2.0 * before + value * self.rows[end - 1]);
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};

    use super::*;

    /// A design of overlapping rows, dense and banded.
    fn matrices() -> (DMatrix<f64>, Banded) {
        let (size, width) = (9, 4);
        let mut dense = DMatrix::zeros(size, size);
        let mut banded = Banded::zeros(size, width);
        for k in 0..24 {
            let first = k % (size - width + 1);
            let row: Vec<f64> = (0..width).map(|j| ((k * 7 + j * 3) as f64 * 0.61).sin()).collect();
            banded.add(first, &row);
            for (i, one) in row.iter().enumerate() {
                for (j, other) in row.iter().enumerate() {
                    dense[(first + i, first + j)] += one * other;
                }
            }
        }
        (dense, banded)
    }

    #[test]
    fn it_solves_as_the_dense_matrix_does() {
        let (dense, banded) = matrices();
        let right = DVector::from_fn(9, |row, _| (row as f64).cos());
        let mut solved: Vec<f64> = right.iter().copied().collect();
        banded.factor().solve(solved.as_chunks_mut::<1>().0);
        let truth = dense.cholesky().expect("positive").solve(&right);
        assert!((DVector::from_vec(solved) - truth).norm() < 1e-8);
    }

    #[test]
    fn right_hand_sides_that_are_solved_together_are_as_they_are_alone() {
        let factor = matrices().1.factor();
        let right = |row: usize, lane: usize| (row as f64 + 0.3 * lane as f64).cos();
        let mut together: Vec<[f64; LANES]> = (0..9).map(|row| std::array::from_fn(|lane| right(row, lane))).collect();
        factor.solve(&mut together);
        for lane in 0..LANES {
            let mut alone: Vec<[f64; 1]> = (0..9).map(|row| [right(row, lane)]).collect();
            factor.solve(&mut alone);
            let mut rows = together.iter().zip(&alone);
            assert!(rows.all(|(together, [alone])| together[lane] == *alone), "{lane}");
        }
    }

    #[test]
    fn what_is_nothing_before_a_row_begins_there() {
        let factor = matrices().1.factor();
        let right = |row: usize| if row < 4 { 0.0 } else { (row as f64).cos() };
        let mut whole: Vec<[f64; 1]> = (0..9).map(|row| [right(row)]).collect();
        let mut begun = whole.clone();
        factor.forward(&mut whole);
        factor.forward_from(4, &mut begun);
        assert_eq!(whole, begun);
    }

    #[test]
    fn its_inverse_is_that_of_the_dense_matrix_within_the_band() {
        let (dense, banded) = matrices();
        let inverse = banded.factor().inverse();
        let truth = dense.try_inverse().expect("regular");
        let (one, other) = ([0.3, -1.0, 0.0, 2.0], [1.0, 0.5, -0.2, 0.7]);
        for first in 0..=5 {
            let mut sum = 0.0;
            for i in 0..4 {
                for j in 0..4 {
                    sum += one[i] * other[j] * truth[(first + i, first + j)];
                }
            }
            let own = inverse.between(first, &one, &other);
            assert!((own - sum).abs() < 1e-8 * truth.amax(), "{first}: {own} {sum}");
            let (around, between) = (inverse.around(first, &one), inverse.between(first, &one, &one));
            assert!(
                (around - between).abs() < 1e-8 * truth.amax(),
                "{first}: {around} {between}"
            );
        }
    }
}
