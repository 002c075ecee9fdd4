//! When the gap is there: its onset and its end, each with an interval.
//!
//! In: residuals of the channels that hold the excess. Out: a [`Passage`], if the energy between two instants is plainly
//! larger than before and after them; `None` for a gap that is always there, or never.
//!
//! Energies of stretches are sums of squares: of mean `m` and variance `2 f m`, with `f` above one where the residual is
//! not white. A generalised likelihood ratio compares every pair of instants with "always" (Willsky and Jones 1976); an
//! instant's 95 % interval holds what the best partner leaves within 1.92 nats of the best (profile likelihood). What
//! excites an effect also comes and goes, so this says when the gap is there, not when its cause is.

use nalgebra::DVector;

use crate::{
    input::windows::Span,
    null::problem::Problem,
    thresholds::{DOUBTED, MOST_OF_A_GAP, PASSAGE_QUIET},
};

/// Stretches that the fit windows are cut into.
const STRETCHES: usize = 60;

/// \[nats\] half the 95 % quantile of chi-square with one degree.
const PROFILE: f64 = 1.92;

/// When the gap is there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Passage {
    /// \[s\] when it begins; `None` where it is there from the start.
    pub onset: Option<Instant>,
    /// \[s\] when it ends; `None` where it is there to the end.
    pub end: Option<Instant>,
}

impl Passage {
    /// Of a named cause: each edge lies between the last fitted sample on its one side and the first on its other.
    pub fn of(problem: &Problem, span: Span) -> Self {
        let starts_s = problem.twin.starts_s();
        let rows = problem.fitted_rows();
        let edge = |t_s: f64| {
            let next = rows.partition_point(|row| starts_s[*row] < t_s);
            let at = |index: usize| rows.get(index).map_or(t_s, |row| starts_s[*row]);
            t_s.is_finite().then(|| Instant {
                t_s,
                interval_s: [at(next.saturating_sub(1)), at(next)],
            })
        };
        Passage {
            onset: edge(span.from),
            end: edge(span.to),
        }
    }
}

/// An instant with its 95 % interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Instant {
    /// \[s\]
    pub t_s: f64,
    /// \[s\]
    pub interval_s: [f64; 2],
}

/// Looks for it in the channels that hold most of the excess.
pub fn find(problem: &Problem, rests: &[DVector<f64>], excess: &[f64]) -> Option<Passage> {
    let mut order: Vec<usize> = (0..excess.len()).filter(|channel| excess[*channel] > 0.0).collect();
    order.sort_by(|one, other| excess[*other].total_cmp(&excess[*one]));
    let whole: f64 = order.iter().map(|channel| excess[*channel]).sum();
    let mut held = 0.0;
    order.retain(|channel| {
        let is_needed = held < MOST_OF_A_GAP * whole;
        held += excess[*channel];
        is_needed
    });
    let rows = problem.fitted_rows();
    let starts_s = problem.twin.starts_s();
    let place: Vec<usize> = (0..rows.len()).map(|at| at * STRETCHES / rows.len().max(1)).collect();
    let (mut energies, mut counts) = (vec![0.0; STRETCHES], vec![0.0; STRETCHES]);
    for channel in order {
        for (row, value) in problem.frames[channel].series.rows.iter().zip(rests[channel].iter()) {
            if let Ok(at) = rows.binary_search(&(*row as usize)) {
                energies[place[at]] += value * value;
                counts[place[at]] += 1.0;
            }
        }
    }
    let edges_s: Vec<f64> = (0..=STRETCHES)
        .map(|edge| {
            let at = (edge * rows.len())
                .div_ceil(STRETCHES)
                .min(rows.len().saturating_sub(1));
            rows.get(at).map_or(0.0, |row| starts_s[*row])
        })
        .collect();
    let (from, to) = passage(&energies, &counts)?;
    let instant = |(best, low, high): Edge| Instant {
        t_s: edges_s[best],
        interval_s: [edges_s[low.saturating_sub(1)], edges_s[(high + 1).min(STRETCHES)]],
    };
    Some(Passage {
        onset: (from.0 > 0).then(|| instant(from)),
        end: (to.0 < energies.len()).then(|| instant(to)),
    })
}

/// Where an edge is best, at the lowest and at the highest.
type Edge = (usize, usize, usize);

/// Edges at which the energy rises and falls.
fn passage(energies: &[f64], counts: &[f64]) -> Option<(Edge, Edge)> {
    let length = energies.len();
    let spread = dispersion(energies, counts);
    // Twice the log-likelihood of a stretch of n samples with mean energy m, up to what all have: -n ln m.
    let fit = |energy: f64, count: f64| {
        if count > 0.0 {
            -0.5 * count * (energy / count).max(1e-9).ln()
        } else {
            0.0
        }
    };
    let (whole_energy, whole_count): (f64, f64) = (energies.iter().sum(), counts.iter().sum());
    let always = fit(whole_energy, whole_count);
    let mut gains: Vec<(usize, usize, f64)> = Vec::new();
    for from in 0..length {
        let (mut energy, mut count) = (0.0, 0.0);
        for to in from + 1..=length {
            energy += energies[to - 1];
            count += counts[to - 1];
            let (outside_energy, outside_count) = (whole_energy - energy, whole_count - count);
            let is_all = from == 0 && to == length;
            if is_all || count <= 0.0 || outside_count <= 0.0 {
                continue;
            }
            let is_quiet_outside = outside_energy / outside_count < PASSAGE_QUIET * energy / count;
            if is_quiet_outside {
                let gain = (fit(energy, count) + fit(outside_energy, outside_count) - always) / spread;
                gains.push((from, to, gain));
            }
        }
    }
    let (from, to, most) = gains.iter().copied().max_by(|one, other| one.2.total_cmp(&other.2))?;
    // The price of having compared so many pairs of edges.
    let pairs = (length * (length + 1) / 2) as f64;
    if most < pairs.ln() + DOUBTED {
        return None;
    }
    let near = || gains.iter().filter(|(_, _, gain)| *gain > most - PROFILE);
    let ends = |of: fn(&(usize, usize, f64)) -> usize, best: usize| {
        let low = near().map(of).min().unwrap_or(best);
        let high = near().map(of).max().unwrap_or(best);
        (best, low, high)
    };
    Some((ends(|pair| pair.0, from), ends(|pair| pair.1, to)))
}

/// How much more the energies of neighbouring stretches differ than white residuals would have them; at least one.
fn dispersion(energies: &[f64], counts: &[f64]) -> f64 {
    let pairs = energies.windows(2).zip(counts.windows(2));
    let mut differences: Vec<f64> = pairs
        .filter(|(_, counts)| counts[0] > 0.0 && counts[1] > 0.0)
        .map(|(energies, counts)| {
            let (one, other) = (energies[0] / counts[0], energies[1] / counts[1]);
            let mean = (one + other) / 2.0;
            (one - other).powi(2) / (2.0 * mean * mean * (1.0 / counts[0] + 1.0 / counts[1])).max(1e-12)
        })
        .collect();
    differences.sort_by(f64::total_cmp);
    // The median of chi-square with one degree is 0.455: onset and end themselves do not count.
    differences
        .get(differences.len() / 2)
        .map_or(1.0, |median| (median / 0.455).max(1.0))
}

#[cfg(test)]
mod tests {
    use rand_distr::{ChiSquared, Distribution};
    use rand_xoshiro::{Xoshiro256PlusPlus, rand_core::SeedableRng};

    use super::*;

    fn energies(level: impl Fn(usize) -> f64) -> (Vec<f64>, Vec<f64>) {
        let counts = vec![50.0; STRETCHES];
        // A spread of a tenth, as 200 squares have.
        let wobble = |k: usize| 1.0 + 0.1 * ((k * 7919) as f64).sin();
        ((0..STRETCHES).map(|k| 50.0 * level(k) * wobble(k)).collect(), counts)
    }

    #[test]
    fn a_gap_that_comes_and_goes_is_placed() {
        let (energies, counts) = energies(|k| if (20..35).contains(&k) { 4.0 } else { 1.0 });
        let (from, to) = passage(&energies, &counts).expect("a passage");
        assert_eq!((from.0, to.0), (20, 35));
        assert!(from.1 >= 19 && from.2 <= 21, "{from:?}");
    }

    #[test]
    fn a_gap_that_stays_has_an_onset_and_no_end() {
        let (energies, counts) = energies(|k| if k >= 42 { 3.0 } else { 1.0 });
        let (from, to) = passage(&energies, &counts).expect("a passage");
        assert_eq!((from.0, to.0), (42, STRETCHES));
    }

    #[test]
    fn an_even_gap_has_neither() {
        let (energies, counts) = energies(|_| 5.0);
        assert_eq!(passage(&energies, &counts), None);
    }

    #[test]
    fn a_gap_that_varies_is_no_passage() {
        let (energies, counts) = energies(|k| if k >= 30 { 5.0 } else { 3.5 });
        assert_eq!(passage(&energies, &counts), None);
    }

    #[test]
    fn of_many_pairs_of_edges_the_best_in_noise_is_no_passage() {
        let found = (0..200).filter(|seed| {
            let mut random = Xoshiro256PlusPlus::seed_from_u64(*seed);
            let energies: Vec<f64> = ChiSquared::new(4.0)
                .expect("a law")
                .sample_iter(&mut random)
                .take(STRETCHES)
                .collect();
            passage(&energies, &[4.0; STRETCHES]).is_some()
        });
        assert_eq!(found.count(), 0);
    }

    #[test]
    fn a_slight_change_is_no_onset() {
        let (energies, counts) = energies(|k| if k >= 30 { 1.2 } else { 1.0 });
        assert_eq!(passage(&energies, &counts), None);
    }
}
