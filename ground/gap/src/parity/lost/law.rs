//! The law of vectors whose scatter a log tells itself: Student's, of as many dimensions, wider where its neighbours are.
//!
//! In: vectors. Out: [`Law`], fitted by maximum likelihood.
//!
//! With `S` the scatter, `f` the degrees of freedom and `n` the dimensions, a vector `d` has the density (Kotz and Nadarajah, Multivariate
//! t distributions and their applications, 2004, 1.1)
//!
//! ```text
//! G((f+n)/2) / G(f/2) / (f pi)^(n/2) / |w S|^(1/2) (1 + d' S^-1 d / (f w))^(-(f+n)/2)
//! ```
//!
//! A motion is quick in some minutes and slow in others: the width `w = 1 - a + a v` follows the mean `v` of `d' S^-1 d / n` of the
//! [`BESIDE`] vectors to either side, not the own one. `S` comes by expectation and maximisation (the same book, 10.1); `a` and `f`
//! are the likeliest of a few.

use nalgebra::{DMatrix, DVector, RowDVector};
use statrs::function::gamma::ln_gamma;

/// Vectors to either side that tell a width: fewer are chance, and a motion changes within more.
const BESIDE: usize = 3;

/// How far a width follows its neighbours, from not at all to wholly. Not 1: beside rows without any scatter there is a width still.
const FOLLOWS: [f64; 5] = [0.0, 0.3, 0.6, 0.9, 0.99];

/// Degrees of freedom, each some 1.7 times the one before: from tails without a variance to those of noise.
const FREE: [f64; 6] = [1.5, 2.5, 4.0, 7.0, 15.0, 60.0];

/// Steps of expectation and maximisation. With 60 the losses found and the shares shown were the same in four logs at 21 cuts each.
const STEPS: usize = 8;

/// Vectors from which there is a law: some five for each of the 21 numbers of a scatter of six.
const LEAST: usize = 100;

/// Vectors that a law is fitted to at most: sizes are then known to 2 %, which moves the evidence by some tenths of a nat.
pub const MOST: usize = 1500;

/// Of vectors.
#[derive(Clone, Debug)]
pub struct Law {
    /// Of the lower triangle `L` of `S = L L'`.
    inverse: DMatrix<f64>,
    ln_det: f64,
    free: f64,
    follows: f64,
    dimensions: f64,
}

/// Vectors, a column each, and how much wider their neighbours are.
struct Known {
    vectors: DMatrix<f64>,
    beside: Vec<f64>,
}

impl Known {
    /// Not more than are needed; none of fewer than [`LEAST`].
    fn of(all: &[(DVector<f64>, f64)]) -> Option<Self> {
        if all.len() < LEAST {
            return None;
        }
        let (vectors, beside): (Vec<DVector<f64>>, Vec<f64>) =
            all.iter().step_by(all.len().div_ceil(MOST)).cloned().unzip();
        Some(Self {
            vectors: DMatrix::from_columns(&vectors),
            beside,
        })
    }

    /// The squared median size of each component, on a diagonal: where the fit begins.
    fn middle(&self) -> DMatrix<f64> {
        let median = |row: RowDVector<f64>| {
            let mut sizes: Vec<f64> = row.iter().map(|own| own.abs()).collect();
            sizes.sort_by(f64::total_cmp);
            sizes[sizes.len() / 2].max(f64::MIN_POSITIVE.sqrt()).powi(2)
        };
        let squares = self.vectors.row_iter().map(|row| median(row.into_owned()));
        DMatrix::from_diagonal(&DVector::from_iterator(self.vectors.nrows(), squares))
    }
}

impl Law {
    /// The law of the vectors of rows, and `d' S^-1 d / n` of each; none of fewer than [`LEAST`].
    pub fn with_widths(rows: &[Option<DVector<f64>>], shared: usize) -> Option<(Self, Vec<Option<f64>>)> {
        let all: Vec<(DVector<f64>, f64)> = rows.iter().flatten().map(|own| (own.clone(), 1.0)).collect();
        let mut law = Self::likeliest(&Known::of(&all)?, &[0.0])?;
        let mut squares = Vec::new();
        for _ in 0..2 {
            let square = |own: &DVector<f64>| law.square(own) / law.dimensions;
            squares = rows.iter().map(|own| own.as_ref().map(square)).collect();
            let all: Vec<(DVector<f64>, f64)> = (rows.iter().enumerate())
                .filter_map(|(row, own)| Some((own.clone()?, about(&squares, (row, row), shared)?)))
                .collect();
            law = Self::likeliest(&Known::of(&all)?, &FOLLOWS)?;
        }
        Some((law, squares))
    }

    /// The law of other vectors, each with its width, which follows as this one's does.
    pub fn of_others(&self, all: &[(DVector<f64>, f64)]) -> Option<Self> {
        Self::likeliest(&Known::of(all)?, &[self.follows])
    }

    fn likeliest(known: &Known, follows: &[f64]) -> Option<Self> {
        let all = follows.iter().flat_map(|follows| FREE.map(|free| (*follows, free)));
        let laws = all.filter_map(|(follows, free)| Self::fitted(known, follows, free));
        laws.max_by(|one, other| one.1.total_cmp(&other.1)).map(|(law, _)| law)
    }

    fn fitted(known: &Known, follows: f64, free: f64) -> Option<(Self, f64)> {
        let mut law = Self::new(known.middle(), free, follows)?;
        for _ in 0..STEPS {
            let mut weighed = known.vectors.clone();
            let squares = law.squares(&known.vectors);
            for ((mut own, square), beside) in weighed.column_iter_mut().zip(&squares).zip(&known.beside) {
                let width = law.width(*beside);
                own *= (free + law.dimensions) / (free * width + square);
            }
            let scatter = &known.vectors * weighed.transpose() / known.beside.len() as f64;
            law = Self::new(0.5 * (&scatter + scatter.transpose()), free, follows)?;
        }
        let squares = law.squares(&known.vectors);
        let likelihood = squares
            .iter()
            .zip(&known.beside)
            .map(|(square, beside)| law.ln_of(*square, *beside))
            .sum();
        Some((law, likelihood))
    }

    /// `d' S^-1 d` of each column.
    fn squares(&self, vectors: &DMatrix<f64>) -> Vec<f64> {
        let solved = &self.inverse * vectors;
        solved.column_iter().map(|own| own.norm_squared()).collect()
    }

    fn new(scatter: DMatrix<f64>, free: f64, follows: f64) -> Option<Self> {
        let dimensions = scatter.nrows() as f64;
        let lower = scatter.cholesky()?.l();
        let ln_det = 2.0 * lower.diagonal().iter().map(|own| own.ln()).sum::<f64>();
        Some(Self {
            inverse: lower.try_inverse()?,
            ln_det,
            free,
            follows,
            dimensions,
        })
    }

    /// `d' S^-1 d`
    fn square(&self, own: &DVector<f64>) -> f64 {
        (&self.inverse * own).norm_squared()
    }

    fn width(&self, beside: f64) -> f64 {
        1.0 - self.follows + self.follows * beside
    }

    fn ln_of(&self, square: f64, beside: f64) -> f64 {
        let (free, dimensions, width) = (self.free, self.dimensions, self.width(beside));
        ln_gamma(0.5 * (free + dimensions))
            - ln_gamma(0.5 * free)
            - 0.5 * dimensions * (free * std::f64::consts::PI * width).ln()
            - 0.5 * self.ln_det
            - 0.5 * (free + dimensions) * (square / (free * width)).ln_1p()
    }

    /// Of a vector whose neighbours are so wide.
    pub fn ln_density(&self, own: &DVector<f64>, beside: f64) -> f64 {
        self.ln_of(self.square(own), beside)
    }

    /// The largest density of a vector under a normal law of this shape, as wide as it has to be.
    pub fn ln_jump(&self, own: &DVector<f64>) -> f64 {
        let dimensions = self.dimensions;
        let width = self.square(own) / dimensions;
        -0.5 * (dimensions * (2.0 * std::f64::consts::PI * width).ln() + self.ln_det + dimensions)
    }
}

/// Mean of the neighbours of some vectors, those left out that share rows with them; none where there are none.
pub fn about(squares: &[Option<f64>], (first, last): (usize, usize), shared: usize) -> Option<f64> {
    let before = first.saturating_sub(shared);
    let after = (last + 1 + shared).min(squares.len());
    let before = squares[before.saturating_sub(BESIDE)..before].iter();
    let after = squares[after..(after + BESIDE).min(squares.len())].iter();
    let own: Vec<f64> = before.chain(after).flatten().copied().collect();
    (!own.is_empty()).then(|| own.iter().sum::<f64>() / own.len() as f64)
}

#[cfg(test)]
mod tests {
    use rand_distr::{ChiSquared, Distribution, StandardNormal};
    use rand_xoshiro::{Xoshiro256PlusPlus, rand_core::SeedableRng};

    use super::*;

    /// Vectors of three, of so many degrees of freedom; every second hundred wider by so much.
    fn drawn(free: f64, wider: f64) -> Vec<Option<DVector<f64>>> {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(11);
        let law = ChiSquared::new(free).expect("freedom");
        let mut one = |row: usize| {
            let spread = (free / law.sample(&mut random)).sqrt() * if row / 100 % 2 == 1 { wider } else { 1.0 };
            let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
            let [x, y, z] = [normal(), normal(), normal()];
            Some(DVector::from_vec(vec![
                spread * x,
                spread * (x + 0.1 * y),
                spread * 5.0 * z,
            ]))
        };
        (0..3000).map(&mut one).collect()
    }

    #[test]
    fn a_density_sums_to_one() {
        let all: Vec<_> = drawn(4.0, 1.0)
            .into_iter()
            .flatten()
            .map(|own| (DVector::from_vec(vec![own[0]]), 1.0))
            .collect();
        let law = Law::likeliest(&Known::of(&all).expect("enough"), &[0.0]).expect("a law");
        let sum: f64 = (-400_000..400_000)
            .map(|at| {
                0.001
                    * law
                        .ln_density(&DVector::from_vec(vec![0.001 * f64::from(at)]), 1.0)
                        .exp()
            })
            .sum();
        assert!((sum - 1.0).abs() < 1e-3, "{sum}");
    }

    #[test]
    fn tails_and_shape_are_those_of_the_vectors() {
        for free in [2.5, 60.0] {
            let (law, _) = Law::with_widths(&drawn(free, 1.0), 1).expect("a law");
            assert_eq!(law.free, free);
            assert_eq!(law.follows, 0.0);
            // y is x and a tenth of an own part.
            let square = |x: f64, y: f64, z: f64| law.square(&DVector::from_vec(vec![x, y, z]));
            assert!((square(1.0, 1.0, 0.0) - 1.0).abs() < 0.15, "{}", square(1.0, 1.0, 0.0));
            assert!((square(0.0, 0.1, 0.0) - 1.0).abs() < 0.15);
            assert!((square(0.0, 0.0, 5.0) - 1.0).abs() < 0.15);
        }
    }

    #[test]
    fn a_quick_stretch_is_wider_than_a_slow_one() {
        let rows = drawn(60.0, 10.0);
        let (law, squares) = Law::with_widths(&rows, 1).expect("a law");
        assert!(law.follows >= 0.9, "{}", law.follows);
        let width = |row: usize| law.width(about(&squares, (row, row), 1).expect("neighbours"));
        let of = |at: usize| (100 * at + 20..100 * at + 80).map(width).sum::<f64>() / 60.0;
        assert!(of(3) > 30.0 * of(2), "{} {}", of(3), of(2));
    }

    #[test]
    fn what_jumps_is_explained_by_a_law_as_wide_as_that() {
        let (law, _) = Law::with_widths(&drawn(60.0, 1.0), 1).expect("a law");
        let far = DVector::from_vec(vec![50.0, 50.0, 0.0]);
        assert!(law.ln_jump(&far) > law.ln_density(&far, 1.0) + 20.0);
    }
}
