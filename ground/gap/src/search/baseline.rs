//! What simpler methods would say of the same case, for the same table: a method is only as good as what it beats.
//!
//! In: the [`Problem`] and its [`Library`]. Out: [`Named`] effects, strongest first, none where the method sees nothing.
//!
//! - [`largest_residual`]: the channel that is furthest off, and the effect there that fits it best.
//! - [`lasso`]: one global least squares over the columns of the whole library with an l1 penalty (Tibshirani 1996), the
//!   penalty that of the universal threshold `sqrt(2 ln p)` (Donoho and Johnstone 1994), by coordinate descent (Friedman,
//!   Hastie and Tibshirani 2010).
//! - [`best_subset`]: forward selection by BIC (Schwarz 1978), every effect fitted without the calibration being left open.
//!
//! An effect without parameters (a sign, an order, a range) has no column, so none of them sees it.
//!
//! None of them leaves the calibration open, knows "none of these", or has a probability: what they state is a share.
//! The oracle, which knows the effect, is the diagnosis with a library of nothing else ([`oracle_withholds`]).

use nalgebra::{Cholesky, DMatrix, DVector};
use twin::effect::LIBRARY;

use crate::{
    library::{column::Entries, hypotheses::Library},
    null::problem::Problem,
};

/// [sigma over the root of 2n] by which a channel's gap must exceed one to be off.
const OFF: f64 = 5.0;

/// Sweeps of the coordinate descent, and the change in sigma that ends it.
const SWEEPS: usize = 60;
const SETTLED: f64 = 1e-3;

/// Share of what is explained from which the lasso's effects are named.
const NAMED: f64 = 0.2;

/// Effects that forward selection may take.
const MOST: usize = 3;

/// Parameters of an effect that is still tried: more than the axes of a unit's largest kind fit anything.
const WIDEST: usize = 36;

/// An effect a baseline names.
#[derive(Clone, Debug, PartialEq)]
pub struct Named {
    /// Name in the library.
    pub effect: &'static str,
    /// Channels it touches.
    pub channels: Vec<usize>,
    /// Share of what the method explains.
    pub share: f64,
}

/// Residuals of the nominal twin, in units of noise.
fn residuals(problem: &Problem) -> Vec<DVector<f64>> {
    (0..problem.frames.len())
        .map(|channel| problem.residual(channel, &[]))
        .collect()
}

/// The rule of the largest residual.
pub fn largest_residual(problem: &Problem, library: &Library) -> Vec<Named> {
    let residuals = residuals(problem);
    let size = |residual: &DVector<f64>| (residual.norm_squared() / residual.len().max(1) as f64).sqrt();
    let furthest =
        (0..residuals.len()).max_by(|one, other| size(&residuals[*one]).total_cmp(&size(&residuals[*other])));
    let Some(channel) = furthest.filter(|channel| {
        let residual = &residuals[*channel];
        size(residual) > 1.0 + OFF / (2.0 * residual.len() as f64).sqrt()
    }) else {
        return Vec::new();
    };
    let unit = problem.twin.unit();
    let own = library
        .hypotheses
        .iter()
        .filter(|hypothesis| !hypothesis.small().is_empty() && hypothesis.cause.channels(unit) == [channel]);
    let best = own
        .filter_map(|hypothesis| Some((fall(library, hypothesis.small(), &residuals)?.0, hypothesis)))
        .max_by(|one, other| one.0.total_cmp(&other.0));
    let named = |(_, hypothesis): (f64, &crate::library::hypotheses::Hypothesis)| Named {
        effect: hypothesis.effect(),
        channels: vec![channel],
        share: 1.0,
    };
    best.map(named).into_iter().collect()
}

/// One global least squares with an l1 penalty.
pub fn lasso(problem: &Problem, library: &Library) -> Vec<Named> {
    let columns: Vec<(Entries, f64)> = (library.reference..library.products.len())
        .map(|place| {
            let column = library.products.column(place);
            let energy = column.iter().map(|(_, values)| values.norm_squared()).sum();
            (column, energy)
        })
        .collect();
    let penalty = (2.0 * (columns.len().max(2) as f64).ln()).sqrt();
    let mut left = residuals(problem);
    let sizes = descend(&columns, &mut left, penalty);
    let mut energies: Vec<Named> = Vec::new();
    for hypothesis in &library.hypotheses {
        for (index, place) in hypothesis.small().iter().enumerate() {
            let at = place - library.reference;
            let energy = sizes[at].powi(2) * columns[at].1;
            // A column is shared by places of one effect: it counts where it stands alone.
            if energy == 0.0 || hypothesis.small().len() != hypothesis.cause.effect.page().parameters.len() {
                continue;
            }
            let channels = hypothesis.cause.touched_by(index, problem.twin.unit());
            match energies.iter_mut().find(|named| named.effect == hypothesis.effect()) {
                Some(named) => {
                    named.share += energy;
                    named.channels.extend(channels);
                }
                None => energies.push(Named {
                    effect: hypothesis.effect(),
                    channels,
                    share: energy,
                }),
            }
        }
    }
    let total: f64 = energies.iter().map(|named| named.share).sum();
    for named in &mut energies {
        named.share /= total;
        named.channels.sort_unstable();
        named.channels.dedup();
    }
    energies.retain(|named| named.share >= NAMED);
    energies.sort_by(|one, other| other.share.total_cmp(&one.share));
    energies
}

/// Coordinate descent; `left` becomes what the columns leave. Penalties are in units of each column's norm.
fn descend(columns: &[(Entries, f64)], left: &mut [DVector<f64>], penalty: f64) -> Vec<f64> {
    let mut sizes = vec![0.0; columns.len()];
    for _ in 0..SWEEPS {
        let mut moved: f64 = 0.0;
        for ((column, energy), size) in columns.iter().zip(&mut sizes) {
            if *energy <= 0.0 {
                continue;
            }
            let pull: f64 = column.iter().map(|(channel, values)| values.dot(&left[*channel])).sum();
            let free = pull + *size * energy;
            let threshold = penalty * energy.sqrt();
            let next = free.signum() * (free.abs() - threshold).max(0.0) / energy;
            let change = next - *size;
            if change != 0.0 {
                column
                    .iter()
                    .for_each(|(channel, values)| left[*channel].axpy(-change, values, 1.0));
                moved = moved.max(change.abs() * energy.sqrt());
                *size = next;
            }
        }
        if moved < SETTLED {
            break;
        }
    }
    sizes
}

/// Forward selection by BIC, the calibration taken for exact.
pub fn best_subset(problem: &Problem, library: &Library) -> Vec<Named> {
    let unit = problem.twin.unit();
    let samples: usize = problem.frames.iter().map(|frame| frame.series.rows.len()).sum();
    let price = 0.5 * (samples.max(1) as f64).ln();
    let mut left = residuals(problem);
    let mut found: Vec<Named> = Vec::new();
    while found.len() < MOST {
        let candidates = library.hypotheses.iter().filter(|hypothesis| {
            let is_new = found.iter().all(|named| named.effect != hypothesis.effect());
            is_new && !hypothesis.small().is_empty() && hypothesis.small().len() <= WIDEST
        });
        let best = candidates
            .filter_map(|hypothesis| {
                let (fall, theta) = fall(library, hypothesis.small(), &left)?;
                Some((0.5 * fall - price * theta.len() as f64, hypothesis, theta))
            })
            .max_by(|one, other| one.0.total_cmp(&other.0));
        let Some((gain, hypothesis, theta)) = best.filter(|(gain, ..)| *gain > 0.0) else {
            break;
        };
        for (place, size) in hypothesis.small().iter().zip(theta.iter()) {
            for (channel, values) in library.products.column(*place).iter() {
                left[*channel].axpy(-size, values, 1.0);
            }
        }
        found.push(Named {
            effect: hypothesis.effect(),
            channels: hypothesis.cause.channels(unit),
            share: gain,
        });
    }
    let total: f64 = found.iter().map(|named| named.share).sum();
    found.iter_mut().for_each(|named| named.share /= total);
    found
}

/// By how much least squares on these columns alone makes the energy fall, and their parameters.
fn fall(library: &Library, places: &[usize], residuals: &[DVector<f64>]) -> Option<(f64, DVector<f64>)> {
    let columns: Vec<Entries> = places.iter().map(|place| library.products.column(*place)).collect();
    let inner = |one: &Entries, other: &Entries| -> f64 {
        let on = |channel: usize| other.iter().find(|(index, _)| *index == channel);
        one.iter()
            .filter_map(|(channel, values)| on(*channel).map(|(_, others)| values.dot(others)))
            .sum()
    };
    let width = columns.len();
    let matrix = DMatrix::from_fn(width, width, |row, column| {
        inner(&columns[row], &columns[column]) * if row == column { 1.0 + 1e-9 } else { 1.0 }
    });
    let pull = DVector::from_fn(width, |row, _| {
        columns[row]
            .iter()
            .map(|(channel, values)| values.dot(&residuals[*channel]))
            .sum()
    });
    let theta = Cholesky::new(matrix)?.solve(&pull);
    let fall = theta.dot(&pull);
    fall.is_finite().then_some((fall, theta))
}

/// What to withhold from the library so that it holds these effects only.
pub fn oracle_withholds(effects: &[String]) -> Vec<String> {
    let names = LIBRARY.iter().map(|effect| effect.page().name);
    names
        .filter(|name| effects.iter().all(|effect| effect != name))
        .map(str::to_owned)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_lasso_of_orthogonal_columns_is_the_soft_threshold() {
        let column = |at: usize, size: f64| -> Entries {
            vec![(0, DVector::from_fn(4, |row, _| if row == at { size } else { 0.0 }))]
        };
        let (first, second) = (column(0, 2.0), column(1, 1.0));
        let mut left = vec![DVector::from_column_slice(&[10.0, 0.5, 0.0, 0.0])];
        let sizes = descend(&[(first, 4.0), (second, 1.0)], &mut left, 1.0);
        // 10 along a column of norm 2: (10 * 2 - 1 * 2) / 4; 0.5 is below the penalty.
        assert_eq!(sizes, [4.5, 0.0]);
        assert_eq!(left[0][0], 1.0);
    }

    #[test]
    fn the_oracle_keeps_only_what_it_knows() {
        let withheld = oracle_withholds(&["gyro-scale".to_owned()]);
        assert_eq!(withheld.len(), LIBRARY.len() - 1);
        assert!(!withheld.contains(&"gyro-scale".to_owned()));
    }
}
