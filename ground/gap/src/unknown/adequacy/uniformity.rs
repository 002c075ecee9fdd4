//! Whether a named effect is as strong everywhere as its law says.
//!
//! In: what an effect adds to each sample of each channel. Out: sums of squares of what is left along that contribution
//! times a weight that changes: with time, with its own size or sign, with the rate, force, temperature or reading, or from
//! channel to channel. Another effect that happens to look like the named one differs from it in one of these, and there
//! the difference adds up over all channels, where a general test has it spread over many shapes.

use nalgebra::{DMatrix, DVector};

use super::view::{LEVELLED, LEVELS, View};
use crate::null::joint::Fitted;

/// What an effect adds.
#[derive(Clone, Debug)]
pub struct Suspect {
    /// Its name, for the report.
    pub name: String,
    /// Channels it is in with what it adds to each of their samples, in units of noise.
    pub entries: Vec<(usize, DVector<f64>)>,
}

/// Weights in time: Legendre polynomials to this degree.
const DEGREES: usize = 4;

/// Part of its energy that a weighted contribution must have apart from the contribution itself and the weights before it.
const APART: f64 = 1e-6;

/// One way in which an effect may be stronger here than there.
pub struct Strength {
    /// In words.
    pub what: String,
    /// The effect.
    pub effect: String,
    /// The channels that it touches.
    pub channels: Vec<usize>,
    along: Along,
}

/// What is left is looked at along this, over the samples of all channels one after another.
enum Along {
    /// Orthonormal columns.
    Weighted(DMatrix<f64>),
    /// The contribution itself, each channel's part apart from the whole.
    Each(DVector<f64>),
}

impl Strength {
    /// Every way, for an effect.
    pub fn all(views: &[View], suspect: &Suspect) -> Vec<Strength> {
        let entries = &suspect.entries;
        let own: Vec<f64> = entries.iter().flat_map(|(_, values)| values.iter().copied()).collect();
        let samples = own.len();
        let rms = (own.iter().map(|value| value * value).sum::<f64>() / samples.max(1) as f64).sqrt();
        if rms <= 0.0 {
            return Vec::new();
        }
        let contribution = DVector::from_vec(own);
        let weighted = |weight: &dyn Fn(&View, usize, f64) -> f64| {
            let of_channel = |(channel, values): &(usize, DVector<f64>)| -> Vec<f64> {
                let view = &views[*channel];
                let of_row = |(row, value): (usize, &f64)| value * weight(view, row, value / rms);
                values.iter().enumerate().map(of_row).collect()
            };
            DVector::from_vec(entries.iter().flat_map(of_channel).collect())
        };
        let mut ways: Vec<(String, Vec<DVector<f64>>)> = vec![
            (
                "with time".into(),
                (1..=DEGREES)
                    .map(|degree| weighted(&|view, row, _| legendre(degree, 2.0 * view.phase[row] - 1.0)))
                    .collect(),
            ),
            ("with its size".into(), vec![weighted(&|_, _, size| size.abs())]),
            ("with its sign".into(), vec![weighted(&|_, _, size| size.signum())]),
        ];
        for (quantity, name) in LEVELLED.iter().enumerate() {
            let level = |view: &View, row: usize, _: f64| f64::from(view.levels[quantity][row]) / LEVELS as f64;
            ways.push((format!("with {name}"), vec![weighted(&level)]));
        }
        let channels: Vec<usize> = entries.iter().map(|(channel, _)| *channel).collect();
        let strength = |how: String, along: Along| Strength {
            what: format!("{}: its strength changes {how}", suspect.name),
            effect: suspect.name.clone(),
            channels: channels.clone(),
            along,
        };
        let mut all: Vec<Strength> = ways
            .into_iter()
            .filter_map(|(how, columns)| Some(strength(how, Along::Weighted(apart(&contribution, &columns)?))))
            .collect();
        if channels.len() > 1 {
            all.push(strength("from channel to channel".into(), Along::Each(contribution)));
        }
        all
    }

    /// Energy of what is left along the weighted contributions.
    pub fn sum(&self, fitted: &Fitted) -> f64 {
        let mut from = 0;
        let mut parts = self.channels.iter().map(|channel| {
            let rest = &fitted.rest[*channel];
            from += rest.len();
            (from - rest.len(), rest)
        });
        match &self.along {
            Along::Weighted(basis) => {
                let along = parts.fold(DVector::zeros(basis.ncols()), |along: DVector<f64>, (from, rest)| {
                    along + basis.rows(from, rest.len()).tr_mul(rest)
                });
                along.norm_squared()
            }
            Along::Each(contribution) => {
                let (mut each, mut along, mut energy) = (0.0, 0.0, 0.0);
                for (from, rest) in &mut parts {
                    let own = contribution.rows(from, rest.len());
                    let (own_along, own_energy) = (own.dot(rest), own.norm_squared());
                    if own_energy > 0.0 {
                        each += own_along * own_along / own_energy;
                    }
                    along += own_along;
                    energy += own_energy;
                }
                each - along * along / energy
            }
        }
    }
}

/// Orthonormal columns for what `columns` span apart from `from`; nothing if that is nothing.
fn apart(from: &DVector<f64>, columns: &[DVector<f64>]) -> Option<DMatrix<f64>> {
    let mut known = vec![from.normalize()];
    for column in columns {
        let mut rest = column.clone();
        // Twice, for what rounding leaves of the first time.
        for _ in 0..2 {
            known.iter().for_each(|known| rest.axpy(-known.dot(&rest), known, 1.0));
        }
        if rest.norm_squared() > APART * column.norm_squared() {
            known.push(rest.normalize());
        }
    }
    (known.len() > 1).then(|| DMatrix::from_columns(&known[1..]))
}

fn legendre(degree: usize, x: f64) -> f64 {
    let (mut last, mut this) = (1.0, x);
    for n in 1..degree {
        (last, this) = (this, ((2 * n + 1) as f64 * x * this - n as f64 * last) / (n + 1) as f64);
    }
    this
}
