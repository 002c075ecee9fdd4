//! Rivals that no screen shows: effects that are the same as a chosen one where both are small, where that one is not small.
//!
//! In: a chosen effect of a refined set. Out: the hypotheses whose columns at zero are most like its own there, and where their fit begins.
//!
//! A screen takes effects for linear. Where gyros were late by 14 ms on a rocket, `gyro-latency` gained 577 nats and 20 by the screen. It has as
//! little of `latency`, which is the same in a unit of gyros alone. So the one that was chosen is fitted exactly, and the other is not among
//! those that lead the screen. How like two effects are where they are small is the square of the cosine between their columns, in units of
//! noise.
//!
//! A fit that begins at zero may end beside the best (of 18 ms on a rocket it found 6). So it begins where the columns say the same as the
//! chosen effect: at `theta c'd / d'd`, for `c` its column and `d` the rival's.

use nalgebra::DVector;

use super::screen::leading;
use crate::{
    library::{
        column::{Column, Entries},
        hypotheses::Library,
    },
    null::problem::Problem,
    search::gauss_newton::{Refined, model_of, promised},
};

/// The columns at zero of the last member of a set, if by them it would gain less than its exact fit by more than `most` nats.
pub(super) fn at_zero(
    problem: &Problem,
    library: &Library,
    set: &[usize],
    exact: &Refined,
    thetas: &[DVector<f64>],
    most: f64,
) -> Option<Vec<Entries>> {
    let last = set.len() - 1;
    if library.hypotheses[set[last]].small().is_empty() {
        return None;
    }
    let mut thetas = thetas.to_vec();
    thetas[last].fill(0.0);
    let slopes = problem.slopes(&model_of(library, set, &thetas), last);
    let promised = promised(problem, library, set, &thetas, &slopes);
    (exact.log_evidence - promised > most).then_some(slopes)
}

/// The `count` hypotheses of those that `is_possible` whose columns are most like these of a member with parameters `theta`, each with the
/// parameters that say the same as these.
pub(super) fn most_alike(
    library: &Library,
    own: Vec<Entries>,
    theta: &DVector<f64>,
    is_possible: impl Fn(usize) -> bool,
    count: usize,
) -> Vec<(usize, DVector<f64>)> {
    let own: Vec<Column> = own.into_iter().map(Column::of).collect();
    let like = |hypothesis: usize| -> Vec<Like> {
        let places = library.hypotheses[hypothesis].small().iter().zip(&own);
        places
            .map(|(place, own)| Like::of(own, library.products.held(*place)))
            .collect()
    };
    let likeness = |hypothesis: usize| {
        let has_as_many = library.hypotheses[hypothesis].small().len() == own.len();
        match has_as_many && is_possible(hypothesis) {
            true => like(hypothesis).iter().map(|like| like.square_of_cosine).product(),
            false => f64::NEG_INFINITY,
        }
    };
    let alike: Vec<f64> = (0..library.hypotheses.len()).map(likeness).collect();
    let said = |hypothesis: usize| {
        let factors = DVector::from_iterator(theta.len(), like(hypothesis).iter().map(|like| like.factor));
        (hypothesis, theta.component_mul(&factors))
    };
    leading(&alike, count).into_iter().map(said).collect()
}

/// How like a column is to another.
struct Like {
    square_of_cosine: f64,
    /// The multiple of the other column that comes nearest to the one.
    factor: f64,
}

impl Like {
    fn of(one: &Column, other: &Column) -> Self {
        let (both, own, others) = (one.dot(other), one.dot(one), other.dot(other));
        let over = |value: f64, square: f64| if square > 0.0 { value / square } else { 0.0 };
        Like {
            square_of_cosine: over(both.powi(2), own * others),
            factor: over(both, others),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn likeness_is_of_all_channels() {
        let column = |entries: &[(usize, [f64; 2])]| {
            let entry = |(channel, values): &(usize, [f64; 2])| (*channel, DVector::from_row_slice(values));
            Column::of(entries.iter().map(entry).collect())
        };
        let own = column(&[(0, [3.0, 0.0]), (1, [0.0, 4.0])]);
        let is = |other: &[(usize, [f64; 2])], square: f64, factor: f64| {
            let like = Like::of(&own, &column(other));
            (like.square_of_cosine - square).abs() < 1e-12 && (like.factor - factor).abs() < 1e-12
        };
        assert!(is(&[(0, [-6.0, 0.0]), (1, [0.0, -8.0])], 1.0, -0.5));
        assert!(is(&[(1, [0.0, 1.0])], 0.64, 4.0));
        assert!(is(&[(2, [1.0, 1.0])], 0.0, 0.0));
        assert!(is(&[(0, [0.0, 0.0])], 0.0, 0.0));
    }
}
