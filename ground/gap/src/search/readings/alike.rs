//! Rivals that no screen shows: effects that are the same as a chosen one where both are small, where that one is not small.
//!
//! In: a chosen effect of a refined set. Out: the hypotheses whose columns at zero are most like its own there, and where their fit begins.
//!
//! A screen takes effects for linear. Of gyros that are late by 14 ms on a rocket it has 20 nats of 577 for `gyro-latency`, and as little for
//! `latency`, which is the same in a unit of gyros alone. The one that was chosen is fitted exactly, and what else leads the screen is not the
//! other. How like two effects are where they are small is the square of the cosine between their columns, which are in units of noise.
//!
//! A fit that begins at zero may end beside the best (of 18 ms on a rocket it found 6). So it begins where the columns say the same as the
//! chosen effect: at `theta c'd / d'd`, for `c` its column and `d` the rival's.

use nalgebra::DVector;

use super::screen::leading;
use crate::{
    library::{hypotheses::Library, products::Entries},
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
    own: &[Entries],
    theta: &DVector<f64>,
    is_possible: impl Fn(usize) -> bool,
    count: usize,
) -> Vec<(usize, DVector<f64>)> {
    let like = |hypothesis: usize| -> Vec<Like> {
        let places = library.hypotheses[hypothesis].small().iter().zip(own);
        places
            .map(|(place, own)| Like::of(own, &library.products.column(*place)))
            .collect()
    };
    let likeness = |hypothesis: usize| match library.hypotheses[hypothesis].small().len() == own.len()
        && is_possible(hypothesis)
    {
        true => like(hypothesis).iter().map(|like| like.square_of_cosine).product(),
        false => f64::NEG_INFINITY,
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
    /// Of the other that comes nearest to one.
    factor: f64,
}

impl Like {
    fn of(one: &Entries, other: &Entries) -> Self {
        let square = |column: &Entries| column.iter().map(|(_, values)| values.norm_squared()).sum::<f64>();
        let both = one.iter().filter_map(|(channel, values)| {
            let (_, others) = other.iter().find(|(known, _)| known == channel)?;
            Some(values.dot(others))
        });
        let (both, own, others) = (both.sum::<f64>(), square(one), square(other));
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
        let column = |entries: &[(usize, [f64; 2])]| -> Entries {
            let entry = |(channel, values): &(usize, [f64; 2])| (*channel, DVector::from_row_slice(values));
            entries.iter().map(entry).collect()
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
