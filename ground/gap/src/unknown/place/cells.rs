//! Cells of the log that stand out: a channel, a stretch of time, a regime of the motion.
//!
//! In: residuals in units of noise, of the log and of logs simulated from the model. Out: [`Cell`]s whose energy noise and
//! calibration do not explain, at a false discovery rate of [`CHANCE`] over all cells together (Benjamini and Hochberg
//! 1995; cells that overlap depend on each other positively, for which it holds, Benjamini and Yekutieli 2001).
//!
//! The cube root of a cell's energy is near Gaussian (Wilson and Hilferty 1931); it is put in units of its spread over
//! the simulated logs, which have the case's own motion, holes and calibration.

use nalgebra::DVector;
use statrs::function::erf::erfc;
use twin::predict::{Feel, UnitDescription};

use crate::{null::problem::Problem, thresholds::CHANCE};

/// Stretches of time.
const STRETCHES: usize = 10;

/// Parts of a regime: low, middle and high thirds of its rows.
const PARTS: usize = 3;

/// Samples below which a cell says nothing.
const LEAST: usize = 8;

/// A quantity whose thirds are regimes: name, unit, value.
type Quantity = (&'static str, &'static str, fn(&Feel) -> f64);

const QUANTITIES: [Quantity; 3] = [
    ("rate", "deg/s", |feel| feel.rate_b.norm().to_degrees()),
    ("specific force", "m/s2", |feel| feel.force_b.norm()),
    ("temperature", "degC", |feel| feel.temperature_c),
];

/// A cell that stands out.
#[derive(Clone, Debug, PartialEq)]
pub struct Cell {
    /// Its channel.
    pub channel: String,
    /// \[s\] its stretch of time.
    pub from_s: f64,
    /// \[s\]
    pub to_s: f64,
    /// Its regime, in words.
    pub regime: String,
    /// Standard deviations above what noise and calibration leave.
    pub size: f64,
    /// Probability of as much by chance, for this cell alone.
    pub p: f64,
}

/// Which cells each sample is in.
pub(crate) struct Layout {
    /// By channel and sample: one cell a quantity.
    cells_of: Vec<Vec<[u32; QUANTITIES.len()]>>,
    /// Samples in each cell.
    counts: Vec<usize>,
    /// \[s\] edges of the stretches.
    edges_s: Vec<f64>,
    /// By quantity, where its middle third begins and ends.
    thirds: [[f64; PARTS - 1]; QUANTITIES.len()],
}

impl Layout {
    pub(crate) fn new(problem: &Problem) -> Self {
        let rows = problem.fitted_rows();
        let starts_s = problem.twin.starts_s();
        let feels = problem.twin.feels(0);
        let at = |share: f64, sorted: &[f64]| sorted.get((sorted.len() as f64 * share) as usize).copied();
        let thirds = QUANTITIES.map(|(_, _, quantity)| {
            let mut sorted: Vec<f64> = rows.iter().map(|row| quantity(&feels[*row])).collect();
            sorted.sort_by(f64::total_cmp);
            [1.0, 2.0].map(|third| at(third / PARTS as f64, &sorted).unwrap_or(f64::INFINITY))
        });
        // Stretches of as many rows each: windows may have holes between them.
        let edges_s: Vec<f64> = (0..=STRETCHES)
            .map(|edge| {
                let place = (edge * rows.len() / STRETCHES).min(rows.len().saturating_sub(1));
                rows.get(place).map_or(0.0, |row| starts_s[*row])
            })
            .collect();
        let mut counts = vec![0; problem.frames.len() * QUANTITIES.len() * STRETCHES * PARTS];
        let mut cells_of = Vec::new();
        for (channel, frame) in problem.frames.iter().enumerate() {
            let of_sample = frame.series.rows.iter().map(|row| {
                let row = *row as usize;
                let inner = &edges_s[1..STRETCHES];
                let stretch = inner.partition_point(|edge| *edge <= starts_s[row]);
                core::array::from_fn(|which| {
                    let value = QUANTITIES[which].2(&feels[row]);
                    let part = thirds[which].iter().filter(|edge| value >= **edge).count();
                    let cell = ((channel * QUANTITIES.len() + which) * STRETCHES + stretch) * PARTS + part;
                    counts[cell] += 1;
                    cell as u32
                })
            });
            cells_of.push(of_sample.collect());
        }
        Layout {
            cells_of,
            counts,
            edges_s,
            thirds,
        }
    }

    /// Energy of each cell.
    pub(crate) fn sums(&self, rests: &[DVector<f64>]) -> Vec<f64> {
        let mut sums = vec![0.0; self.counts.len()];
        for (cells, rest) in self.cells_of.iter().zip(rests) {
            for (cells, value) in cells.iter().zip(rest.iter()) {
                cells.iter().for_each(|cell| sums[*cell as usize] += value * value);
            }
        }
        sums
    }

    pub(crate) fn standing_out(&self, unit: &UnitDescription, observed: &[f64], simulated: &[&[f64]]) -> Vec<Cell> {
        let looked_at: Vec<usize> = (0..observed.len()).filter(|cell| self.counts[*cell] >= LEAST).collect();
        let sizes: Vec<f64> = looked_at
            .iter()
            .map(|cell| size(observed[*cell], simulated.iter().map(|sums| sums[*cell])))
            .collect();
        let chances: Vec<f64> = sizes.iter().map(|size| upper_tail(*size)).collect();
        let mut found: Vec<Cell> = discoveries(&chances, CHANCE)
            .into_iter()
            .map(|at| self.named(unit, looked_at[at], sizes[at], chances[at]))
            .collect();
        found.sort_by(|one, other| other.size.total_cmp(&one.size));
        found
    }

    fn named(&self, unit: &UnitDescription, cell: usize, size: f64, p: f64) -> Cell {
        let (part, rest) = (cell % PARTS, cell / PARTS);
        let (stretch, rest) = (rest % STRETCHES, rest / STRETCHES);
        let (which, channel) = (rest % QUANTITIES.len(), rest / QUANTITIES.len());
        let (name, measure, _) = QUANTITIES[which];
        let [low, high] = self.thirds[which];
        let regime = match part {
            0 => format!("{name} below {low:.2} {measure}"),
            1 => format!("{name} {low:.2} to {high:.2} {measure}"),
            _ => format!("{name} above {high:.2} {measure}"),
        };
        Cell {
            channel: unit.channels[channel].name.clone(),
            from_s: self.edges_s[stretch],
            to_s: self.edges_s[stretch + 1],
            regime,
            size,
            p,
        }
    }
}

/// Of an energy, in standard deviations over simulated ones.
fn size(observed: f64, simulated: impl Iterator<Item = f64>) -> f64 {
    let roots: Vec<f64> = simulated.map(f64::cbrt).collect();
    let count = roots.len() as f64;
    let mean = roots.iter().sum::<f64>() / count;
    let spread = (roots.iter().map(|root| (root - mean).powi(2)).sum::<f64>() / (count - 1.0)).sqrt();
    if spread > 0.0 {
        (observed.cbrt() - mean) / spread
    } else {
        0.0
    }
}

/// `P(Z >= z)` of a Gaussian.
fn upper_tail(z: f64) -> f64 {
    0.5 * erfc(z / core::f64::consts::SQRT_2)
}

/// Which hypotheses are rejected at this false discovery rate (Benjamini and Hochberg's step-up).
pub(crate) fn discoveries(chances: &[f64], rate: f64) -> Vec<usize> {
    let mut order: Vec<usize> = (0..chances.len()).collect();
    order.sort_by(|one, other| chances[*one].total_cmp(&chances[*other]));
    let count = chances.len() as f64;
    let last = (0..order.len())
        .rev()
        .find(|at| chances[order[*at]] <= rate * (*at + 1) as f64 / count);
    order.truncate(last.map_or(0, |last| last + 1));
    order
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_step_up_is_that_of_the_paper() {
        // Benjamini and Hochberg 1995, section 4: the four smallest of fifteen at a rate of 0.05.
        let chances = [
            0.0001, 0.0004, 0.0019, 0.0095, 0.0201, 0.0278, 0.0298, 0.0344, 0.0459, 0.3240, 0.4262, 0.5719, 0.6528,
            0.7590, 1.0000,
        ];
        assert_eq!(discoveries(&chances, 0.05), [0, 1, 2, 3]);
    }

    #[test]
    fn nothing_is_discovered_among_even_chances() {
        let chances: Vec<f64> = (1..=1000).map(|k| f64::from(k) / 1000.0).collect();
        assert!(discoveries(&chances, CHANCE).is_empty());
    }

    #[test]
    fn the_tail_of_a_gaussian_is_the_tables() {
        for (z, p) in [(0.0, 0.5), (1.644_854, 0.05), (3.090_232, 0.001), (-1.0, 0.841_345)] {
            assert!((upper_tail(z) / p - 1.0).abs() < 1e-5, "{z}");
        }
    }
}
