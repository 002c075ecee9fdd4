//! Which quantity of the motion the gap follows: shares of its energy that add up though the quantities overlap.
//!
//! In: what the unit does at each row, and the energy of the residual there. Out: for each quantity the LMG share of the
//! energy's variance from row to row, and "none of these" for the rest. A quantity explains the energy by its mean in
//! each of [`BINS`] bins of equal count, so the dependence may have any shape; sets of quantities by an additive model of
//! these bins, fitted by backfitting (Buja, Hastie and Tibshirani 1989).

use twin::predict::Feel;

use crate::unknown::shapley;

/// Bins of a quantity: enough for a threshold, few enough to be filled.
const BINS: usize = 5;

/// Rounds of backfitting: with five quantities changes are then below a thousandth.
const ROUNDS: usize = 6;

/// Rows that are looked at: more do not change a share.
const MOST_ROWS: usize = 4000;

/// Name of what none of the quantities explains.
pub const UNEXPLAINED: &str = "none of these";

/// A quantity: its name and value.
type Quantity = (&'static str, fn(&Feel) -> f64);

const QUANTITIES: [Quantity; 6] = [
    ("rate", |feel| feel.rate_b.norm()),
    ("angular acceleration", |feel| feel.rate_dot_b.norm()),
    ("specific force", |feel| feel.force_b.norm()),
    ("attitude", |feel| octant(feel)),
    ("temperature", |feel| feel.temperature_c),
    ("time", |feel| feel.t_s),
];

/// Which eighth of the sphere the vertical stands in, as a number.
fn octant(feel: &Feel) -> f64 {
    let down_b = feel.q_nb.inverse() * nalgebra::Vector3::z();
    let sides = down_b.iter().enumerate();
    sides.map(|(axis, side)| f64::from(u8::from(*side > 0.0) << axis)).sum()
}

/// Shares, most first.
pub fn shares(feels: &[Feel], rows: &[usize], energy: &[f64]) -> Vec<(String, f64)> {
    let step = rows.len().div_ceil(MOST_ROWS).max(1);
    let rows: Vec<usize> = rows.iter().copied().step_by(step).collect();
    if rows.len() < 2 * BINS {
        return Vec::new();
    }
    // The root tames the few rows that hold most of the energy.
    let roots: Vec<f64> = rows.iter().map(|row| energy[*row].sqrt()).collect();
    let mean = roots.iter().sum::<f64>() / roots.len() as f64;
    let values: Vec<f64> = roots.iter().map(|root| root - mean).collect();
    let total: f64 = values.iter().map(|value| value * value).sum();
    if total <= 0.0 {
        return Vec::new();
    }
    let bins: Vec<Vec<usize>> = QUANTITIES
        .iter()
        .map(|(_, quantity)| binned(&rows.iter().map(|row| quantity(&feels[*row])).collect::<Vec<f64>>()))
        .collect();
    let found = shapley::shares(QUANTITIES.len(), |set| {
        let chosen: Vec<&Vec<usize>> = (0..QUANTITIES.len())
            .filter(|index| set >> index & 1 == 1)
            .map(|index| &bins[index])
            .collect();
        explained(&values, &chosen) / total
    });
    let mut named: Vec<(String, f64)> = QUANTITIES
        .iter()
        .zip(&found)
        .map(|((name, _), share)| ((*name).to_owned(), share.max(0.0)))
        .collect();
    named.sort_by(|one, other| other.1.total_cmp(&one.1));
    let rest = 1.0 - named.iter().map(|(_, share)| share).sum::<f64>();
    named.push((UNEXPLAINED.to_owned(), rest.max(0.0)));
    named
}

/// The bin of each value; values that are alike share one.
fn binned(values: &[f64]) -> Vec<usize> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let mut edges: Vec<f64> = (1..BINS).map(|k| sorted[k * sorted.len() / BINS]).collect();
    edges.dedup();
    let of = |value: &f64| edges.iter().filter(|edge| value >= *edge).count();
    values.iter().map(of).collect()
}

/// Sum of squares that an additive model of these bins explains.
fn explained(values: &[f64], chosen: &[&Vec<usize>]) -> f64 {
    let mut left = values.to_vec();
    let mut levels = vec![[0.0; BINS]; chosen.len()];
    for _ in 0..if chosen.len() > 1 { ROUNDS } else { 1 } {
        for (bins, levels) in chosen.iter().zip(&mut levels) {
            let (mut sums, mut counts) = ([0.0; BINS], [0.0; BINS]);
            for (bin, value) in bins.iter().zip(&left) {
                sums[*bin] += value + levels[*bin];
                counts[*bin] += 1.0;
            }
            for (bin, value) in bins.iter().zip(&mut left) {
                *value += levels[*bin] - sums[*bin] / counts[*bin];
            }
            for bin in 0..BINS {
                levels[bin] = if counts[bin] > 0.0 {
                    sums[bin] / counts[bin]
                } else {
                    0.0
                };
            }
        }
    }
    let whole: f64 = values.iter().map(|value| value * value).sum();
    whole - left.iter().map(|value| value * value).sum::<f64>()
}

#[cfg(test)]
mod tests {
    use twin::{environment::Environment, motion::Tumble, predict::Scene};

    use super::*;

    fn feels() -> Vec<Feel> {
        let scene = Scene::new(&Tumble::new(), &Environment::laboratory(), 0.0, 100.0, 0.02);
        (0..500).map(|row| scene.feel(f64::from(row) * 0.2)).collect()
    }

    fn found(energy: impl Fn(&Feel) -> f64) -> Vec<(String, f64)> {
        let feels = feels();
        let rows: Vec<usize> = (0..feels.len()).collect();
        let energies: Vec<f64> = feels.iter().map(energy).collect();
        shares(&feels, &rows, &energies)
    }

    #[test]
    fn a_gap_that_grows_with_the_rate_is_the_rates() {
        let found = found(|feel| feel.rate_b.norm_squared());
        assert_eq!(found[0].0, "rate", "{found:?}");
    }

    #[test]
    fn shares_add_up_to_one() {
        let sum: f64 = found(|feel| feel.t_s * feel.t_s + feel.rate_b.norm())
            .iter()
            .map(|(_, share)| share)
            .sum();
        assert!((sum - 1.0).abs() < 1e-9, "{sum}");
    }

    #[test]
    fn an_even_gap_follows_nothing() {
        assert!(found(|_| 1.0).is_empty());
    }
}
