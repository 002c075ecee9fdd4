//! Which rows of a table contradict the data.
//!
//! In: for every row the excitation it claims, and what all channels put out. Out: the linear calibration most rows agree
//! on (a row agrees if its channels lie within [`AGREE`] of it), the rows that do not, and, where another calibration
//! is agreed on by as many rows, those it would blame instead. For a contradicted row the data say what the excitation
//! was, and whether that is the claimed one with axes exchanged or signs turned.
//!
//! A plain fit spreads a wrong sign over all rows; so candidates are solved exactly from four rows each and the rows are
//! counted (consensus: M. A. Fischler, R. C. Bolles, CACM 24(6), 1981). All fours are tried where they are few,
//! otherwise [`CANDIDATES`] of them, drawn with a fixed seed. What this cannot see: errors that most rows share.
//! Temperature is not modelled: rows that it moves by more than [`AGREE`] are taken for contradictions; calibrate over less.

use nalgebra::{DMatrix, Matrix3, Matrix4, Vector3, Vector4};

/// Most fours of rows tried.
const CANDIDATES: usize = 4000;

/// A row agrees if the root mean square of its channels' errors, each in shares of the channel's own spread, is below
/// this. A turned sign or exchanged axis is worth tens of percent, sensors and tables are good to one.
pub const AGREE: f64 = 0.05;

/// Fours whose excitations are closer to a plane than this (determinant, unit excitation) say too little.
const FLAT: f64 = 0.02;

/// A row of the table.
#[derive(Clone, Debug, PartialEq)]
pub struct Claim {
    /// The excitation it claims.
    pub excitation_b: Vector3<f64>,
    /// Output of every channel.
    pub values: Vec<f64>,
}

/// A row that contradicts the others.
#[derive(Clone, Debug, PartialEq)]
pub struct Contradiction {
    /// Which row.
    pub row: usize,
    /// What the data say the excitation was; `None` with fewer than three independent channels.
    pub found_b: Option<Vector3<f64>>,
    /// The claimed excitation with axes exchanged or signs turned that the data do agree with.
    pub reading: Option<Reading>,
    /// Root mean square error of its channels, in shares of their spread.
    pub error: f64,
}

/// A claimed excitation read another way: component `k` is `sign[k]` times claimed component `from[k]`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Reading {
    /// Claimed component.
    pub from: [usize; 3],
    /// Its sign.
    pub sign: [i8; 3],
}

/// What most rows agree on.
#[derive(Clone, Debug, PartialEq)]
pub struct Consensus {
    /// Rows that contradict it.
    pub contradictions: Vec<Contradiction>,
    /// Sets of rows that another, equally supported calibration would blame instead.
    pub alternatives: Vec<Vec<usize>>,
}

/// Looks for contradictions. Fewer than six rows, or rows that do not span space, give none: there is no majority.
pub fn contradictions(claims: &[Claim]) -> Consensus {
    let Some(table) = Scaled::of(claims) else {
        return Consensus {
            contradictions: Vec::new(),
            alternatives: Vec::new(),
        };
    };
    let mut best: Vec<(Vec<usize>, f64)> = Vec::new();
    for four in fours(claims.len()) {
        let Some(model) = table.solve(&four) else { continue };
        let model = table.refine(model);
        let blamed = table.blamed(&model);
        let cost = table.cost(&model);
        match best.first().map(|(rows, _)| rows.len().cmp(&blamed.len())) {
            Some(std::cmp::Ordering::Less) => {}
            Some(std::cmp::Ordering::Equal) => match best.iter_mut().find(|(rows, _)| *rows == blamed) {
                Some((_, least)) => *least = least.min(cost),
                None => best.push((blamed, cost)),
            },
            _ => best = vec![(blamed, cost)],
        }
    }
    // Of equals, the one with the smaller residuals, then the one that blames later rows.
    best.sort_by(|a, b| a.1.total_cmp(&b.1).then_with(|| b.0.cmp(&a.0)));
    let mut best = best.into_iter().map(|(rows, _)| rows);
    let blamed = best.next().unwrap_or_default();
    let agreed: Vec<usize> = (0..claims.len()).filter(|row| !blamed.contains(row)).collect();
    let Some(model) = table.fit(&agreed) else {
        return Consensus {
            contradictions: Vec::new(),
            alternatives: Vec::new(),
        };
    };
    let describe = |&row: &usize| Contradiction {
        row,
        found_b: table.excitation(&model, row),
        reading: table.reading(&model, row),
        error: table.error(&model, row, &table.excitations[row]),
    };
    Consensus {
        contradictions: blamed.iter().map(describe).collect(),
        alternatives: if blamed.is_empty() { Vec::new() } else { best.collect() },
    }
}

/// Four numbers a channel: three sensitivities and a bias, in scaled units. One row a channel.
type Model = DMatrix<f64>;

struct Scaled {
    excitations: Vec<Vector3<f64>>,
    values: DMatrix<f64>,
    unit: f64,
}

impl Scaled {
    fn of(claims: &[Claim]) -> Option<Self> {
        let channels = claims.first()?.values.len();
        let unit = claims.iter().map(|claim| claim.excitation_b.norm()).fold(0.0, f64::max);
        if claims.len() < 6 || channels == 0 || unit <= 0.0 {
            return None;
        }
        let mut values = DMatrix::from_fn(claims.len(), channels, |row, k| claims[row].values[k]);
        for mut column in values.column_iter_mut() {
            let (mean, spread) = (column.mean(), column.variance().sqrt());
            let spread = if spread > 0.0 { spread } else { 1.0 };
            column.apply(|value| *value = (*value - mean) / spread);
        }
        let excitations = claims.iter().map(|claim| claim.excitation_b / unit).collect();
        Some(Scaled {
            excitations,
            values,
            unit,
        })
    }

    fn solve(&self, four: &[usize; 4]) -> Option<Model> {
        let row = |k: usize| self.excitations[four[k]].push(1.0).transpose();
        let system = Matrix4::from_rows(&[row(0), row(1), row(2), row(3)]);
        if system.determinant().abs() < FLAT {
            return None;
        }
        let inverse = system.try_inverse()?;
        let values = |channel: usize| Vector4::from_fn(|k, _| self.values[(four[k], channel)]);
        let solved: Vec<_> = (0..self.values.ncols())
            .map(|channel| (inverse * values(channel)).transpose())
            .collect();
        Some(DMatrix::from_fn(solved.len(), 4, |channel, k| solved[channel][k]))
    }

    /// Least squares over some rows.
    fn fit(&self, rows: &[usize]) -> Option<Model> {
        let design = DMatrix::from_fn(
            rows.len(),
            4,
            |row, k| if k < 3 { self.excitations[rows[row]][k] } else { 1.0 },
        );
        let inverse = (design.transpose() * &design).try_inverse()?;
        let values = DMatrix::from_fn(rows.len(), self.values.ncols(), |row, channel| {
            self.values[(rows[row], channel)]
        });
        Some((inverse * design.transpose() * values).transpose())
    }

    /// Refits on the rows that agree, where they determine it.
    fn refine(&self, model: Model) -> Model {
        let blamed = self.blamed(&model);
        let agreed: Vec<usize> = (0..self.excitations.len())
            .filter(|row| !blamed.contains(row))
            .collect();
        self.fit(&agreed).unwrap_or(model)
    }

    fn error(&self, model: &Model, row: usize, excitation_b: &Vector3<f64>) -> f64 {
        let x = excitation_b.push(1.0);
        let error = |channel: usize| self.values[(row, channel)] - model.row(channel).transpose().dot(&x);
        let channels = self.values.ncols();
        ((0..channels).map(|channel| error(channel).powi(2)).sum::<f64>() / channels as f64).sqrt()
    }

    fn blamed(&self, model: &Model) -> Vec<usize> {
        let agrees = |row: usize| self.error(model, row, &self.excitations[row]) < AGREE;
        (0..self.excitations.len()).filter(|&row| !agrees(row)).collect()
    }

    fn cost(&self, model: &Model) -> f64 {
        let error = |row: usize| self.error(model, row, &self.excitations[row]).min(AGREE).powi(2);
        // Rounded, so that mirror-image calibrations with equal residuals tie.
        ((0..self.excitations.len()).map(error).sum::<f64>() * 1e9).round()
    }

    fn excitation(&self, model: &Model, row: usize) -> Option<Vector3<f64>> {
        let sensitivity = model.columns(0, 3);
        let normal: Matrix3<f64> = (sensitivity.transpose() * sensitivity)
            .fixed_view::<3, 3>(0, 0)
            .into_owned();
        if self.values.ncols() < 3 {
            return None;
        }
        let values = self.values.row(row).transpose() - model.column(3);
        let x = normal.try_inverse()? * (sensitivity.transpose() * values).fixed_rows::<3>(0);
        Some(x * self.unit)
    }

    /// The reading with the fewest changes that agrees.
    fn reading(&self, model: &Model, row: usize) -> Option<Reading> {
        let readings = Reading::all();
        let agrees = |reading: &&Reading| self.error(model, row, &reading.of(&self.excitations[row])) < AGREE;
        readings
            .iter()
            .filter(agrees)
            .min_by_key(|reading| reading.changes())
            .copied()
    }
}

impl Reading {
    /// All 48 ways to exchange axes and turn signs.
    pub fn all() -> Vec<Reading> {
        const ORDERS: [[usize; 3]; 6] = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];
        let signs = |bits: u8| [0, 1, 2].map(|k| if bits >> k & 1 == 1 { -1 } else { 1 });
        ORDERS
            .iter()
            .flat_map(|&from| {
                (0..8).map(move |bits| Reading {
                    from,
                    sign: signs(bits),
                })
            })
            .collect()
    }

    /// The excitation so read.
    pub fn of(&self, claimed: &Vector3<f64>) -> Vector3<f64> {
        Vector3::from_fn(|k, _| f64::from(self.sign[k]) * claimed[self.from[k]])
    }

    /// How many exchanges and turned signs it takes.
    pub fn changes(&self) -> usize {
        let exchanged = self.from.iter().enumerate().filter(|&(k, &from)| k != from).count();
        2 * exchanged + self.sign.iter().filter(|&&sign| sign < 0).count()
    }

    /// In words: `-x, +y, +z`.
    pub fn words(&self) -> String {
        let part = |k: usize| {
            format!(
                "{}{}",
                if self.sign[k] < 0 { '-' } else { '+' },
                ["x", "y", "z"][self.from[k]]
            )
        };
        format!("({}, {}, {})", part(0), part(1), part(2))
    }
}

/// Fours of different rows: all of them where they are few.
fn fours(rows: usize) -> Vec<[usize; 4]> {
    let all = rows * (rows - 1) * (rows - 2) * (rows - 3) / 24;
    let mut list = Vec::new();
    if all <= CANDIDATES {
        for a in 0..rows {
            for b in a + 1..rows {
                for c in b + 1..rows {
                    list.extend((c + 1..rows).map(|d| [a, b, c, d]));
                }
            }
        }
        return list;
    }
    let mut state = 1_u64;
    let mut draw = || {
        // Knuth's MMIX generator: reproducible, and good enough to pick rows.
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize % rows
    };
    while list.len() < CANDIDATES {
        let four = [draw(), draw(), draw(), draw()];
        if (0..4).all(|k| !four[..k].contains(&four[k])) {
            list.push(four);
        }
    }
    list
}

#[cfg(test)]
mod tests;
