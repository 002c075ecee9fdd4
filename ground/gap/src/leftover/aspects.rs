//! Everything that is looked at in a residual: a list of sums of squares.
//!
//! In: the [`View`]s of all channels and a fit. Out: one sum of squares an aspect, with its name. A test that looks at many
//! shapes at once sees none of them well, so each suspicion has a sum of its own: of a channel its energy; slow shapes in
//! time; shapes in time and motion together (24 cosines, 24 random features, Rahimi and Recht 2007); steps between levels of
//! one quantity, which a wrong law leaves; neighbouring samples alike (Ljung and Box 1978); heavy tails; the size of the
//! fitted calibration, without which an unknown effect hides in the calibration. Of all channels together: the energy of
//! a stretch of time; the same vector in all sensors of a kind; the same small rotation in all sensors, which a loose
//! mount or a reference that slips leaves and no single channel shows.

use nalgebra::{Cholesky, Const, DMatrix, DVector, Matrix3, Vector3};
use rand_distr::{Distribution, StandardNormal, Uniform};
use rand_xoshiro::{Xoshiro256PlusPlus, rand_core::SeedableRng};

use super::{Fitted, LEVELLED, LEVELS, SEED, STRETCHES, View};

/// Shapes in time, and as many in the motion.
const SHAPES: usize = 24;

/// Of them, the first in time that count as slow: a period of a third of the log or more.
const SLOW: usize = 6;

/// Bins for shapes, which are slow: two a shape's shortest period would do, twenty leave no loss.
const BINS: usize = 500;

/// Lags of the whiteness test.
const LAGS: usize = 10;

/// Stretches in which vectors and rotations common to sensors are sought: of seconds, and of a minute.
const COMMON: [usize; 2] = [60, 12];

const KIND_NAMES: [&str; 4] = ["accelerometers", "gyros", "magnetometers", "thermometers"];

/// What is looked at in each channel, before the levels.
const OF_CHANNEL: [&str; 6] = [
    "more energy than noise",
    "a slow shape in time",
    "a shape in time or motion",
    "neighbouring samples alike",
    "outliers",
    "a calibration beyond its sigmas",
];

/// The views made ready for sums.
pub struct Sights<'a> {
    views: &'a [View],
    explained: &'a [usize],
    shapes: Vec<Shapes>,
    vectors: Vec<Vec<Common>>,
    turns: Vec<Common>,
}

impl<'a> Sights<'a> {
    /// Of some channels; those `explained` are passed over.
    pub fn new(views: &'a [View], explained: &'a [usize]) -> Self {
        let is_seen = |index: usize| !explained.contains(&index);
        let vector = |kind: usize, stretches: usize| {
            let design = |view: &View, _: usize| view.axis_b;
            Common::new(views, stretches, design, |index| {
                is_seen(index) && views[index].kind == kind
            })
        };
        let turn = |view: &View, row: usize| view.turned.fixed_view::<1, 3>(row, 0).transpose();
        Sights {
            views,
            explained,
            shapes: views.iter().map(Shapes::new).collect(),
            vectors: (0..kinds(views))
                .map(|kind| COMMON.map(|stretches| vector(kind, stretches)).into())
                .collect(),
            turns: COMMON
                .map(|stretches| Common::new(views, stretches, turn, is_seen))
                .into(),
        }
    }

    /// What each entry of [`Sights::sums`] is.
    pub fn labels(&self) -> Vec<(String, Option<usize>)> {
        let mut labels = Vec::new();
        for (index, view) in self.views.iter().enumerate() {
            let name = &view.name;
            for what in OF_CHANNEL {
                labels.push((format!("{name}: {what}"), Some(index)));
            }
            for what in LEVELLED {
                labels.push((format!("{name}: steps with {what}"), Some(index)));
            }
        }
        for kind in 0..kinds(self.views) {
            let name = KIND_NAMES.get(kind).copied().unwrap_or("sensors");
            labels.push((format!("{name}: calibrations beyond their sigmas together"), None));
            for axis in ["x", "y", "z"] {
                labels.push((format!("{name}: a common vector along {axis}"), None));
            }
            for stretches in COMMON {
                labels.push((format!("{name}: a common vector in stretches of 1/{stretches}"), None));
            }
            for stretch in 0..STRETCHES {
                labels.push((format!("{name}: stretch {} of {STRETCHES}", stretch + 1), None));
            }
        }
        for stretches in COMMON {
            labels.push((
                format!("all sensors: a common rotation in stretches of 1/{stretches}"),
                None,
            ));
        }
        labels
    }

    /// The sums of squares, in the order of [`Sights::labels`].
    pub fn sums(&self, fitted: &Fitted) -> Vec<f64> {
        let kinds = kinds(self.views);
        let mut sums = Vec::new();
        let mut nuisance = vec![0.0; kinds];
        let mut common = vec![DMatrix::zeros(BINS, 3); kinds];
        let mut stretches = vec![[0.0; STRETCHES]; kinds];
        for (index, (view, shapes)) in self.views.iter().zip(&self.shapes).enumerate() {
            if self.explained.contains(&index) {
                sums.extend([0.0; OF_CHANNEL.len() + LEVELLED.len()]);
                continue;
            }
            let (rest, open) = (&fitted.rest[index], &fitted.nuisance[index]);
            let binned = shapes.binned(rest);
            let along = shapes.basis.tr_mul(&binned);
            let energy = rest.norm_squared();
            let values = rest.as_slice();
            let alike = (1..=LAGS).map(|lag| {
                let pairs = values.iter().zip(values.iter().skip(lag));
                pairs.map(|(a, b)| a * b).sum::<f64>().powi(2)
            });
            sums.push(energy);
            sums.push(along.rows(0, SLOW).norm_squared());
            sums.push(along.norm_squared());
            sums.push(alike.sum::<f64>() / energy.max(1.0));
            sums.push(values.iter().map(|value| value.powi(4)).sum());
            sums.push(open.norm_squared());
            sums.extend(view.levels.iter().map(|levels| between_levels(levels, values)));
            nuisance[view.kind] += open.norm_squared();
            common[view.kind] += &binned * view.axis_b.transpose();
            for (phase, value) in view.phase.iter().zip(values) {
                stretches[view.kind][place(*phase, STRETCHES)] += value * value;
            }
        }
        for kind in 0..kinds {
            sums.push(nuisance[kind]);
            sums.extend(common[kind].column_iter().map(|column| column.norm_squared()));
            sums.extend(self.vectors[kind].iter().map(|vector| vector.sum(fitted)));
            sums.extend(stretches[kind]);
        }
        sums.extend(self.turns.iter().map(|turn| turn.sum(fitted)));
        sums
    }
}

/// Number of kinds in the views.
fn kinds(views: &[View]) -> usize {
    views.iter().map(|view| view.kind + 1).max().unwrap_or(0)
}

fn place(phase: f64, of: usize) -> usize {
    ((phase * of as f64) as usize).min(of - 1)
}

/// Energy of the means of the levels.
fn between_levels(levels: &[u8], values: &[f64]) -> f64 {
    let mut sums = [(0.0, 0.0); LEVELS];
    for (level, value) in levels.iter().zip(values) {
        let (sum, count) = &mut sums[usize::from(*level).min(LEVELS - 1)];
        (*sum, *count) = (*sum + value, *count + 1.0);
    }
    sums.iter().map(|(sum, count)| sum * sum / f64::max(*count, 1.0)).sum()
}

/// A vector that some channels would see together, free in each stretch of time.
struct Common {
    /// Per channel, for each sample its stretch and what the vector adds to it; empty for a channel that is not looked at.
    rows: Vec<Vec<(usize, Vector3<f64>)>>,
    factors: Vec<Option<Cholesky<f64, Const<3>>>>,
}

impl Common {
    fn new(
        views: &[View],
        stretches: usize,
        design: impl Fn(&View, usize) -> Vector3<f64>,
        is_seen: impl Fn(usize) -> bool,
    ) -> Self {
        /// Of the mean of the diagonal: directions no sensor looks along stay closed.
        const RIDGE: f64 = 1e-3;
        let mut normal = vec![Matrix3::zeros(); stretches];
        let mut rows = Vec::new();
        for (index, view) in views.iter().enumerate() {
            let row = |(row, phase): (usize, &f64)| (place(*phase, stretches), design(view, row));
            let own: Vec<(usize, Vector3<f64>)> = match is_seen(index) {
                true => view.phase.iter().enumerate().map(row).collect(),
                false => Vec::new(),
            };
            own.iter()
                .for_each(|(stretch, add)| normal[*stretch] += add * add.transpose());
            rows.push(own);
        }
        let factor =
            |normal: &Matrix3<f64>| Cholesky::new(normal + Matrix3::identity() * (RIDGE * normal.trace() / 3.0));
        Common {
            rows,
            factors: normal.iter().map(factor).collect(),
        }
    }

    fn sum(&self, fitted: &Fitted) -> f64 {
        let mut scores = vec![Vector3::zeros(); self.factors.len()];
        for (rows, rest) in self.rows.iter().zip(&fitted.rest) {
            for ((stretch, add), value) in rows.iter().zip(rest.iter()) {
                scores[*stretch] += add * *value;
            }
        }
        let energy = |(factor, score): (&Option<Cholesky<f64, Const<3>>>, &Vector3<f64>)| {
            factor.as_ref().map_or(0.0, |factor| score.dot(&factor.solve(score)))
        };
        self.factors.iter().zip(&scores).map(energy).sum()
    }
}

/// Bins of one channel and orthonormal shapes over them.
struct Shapes {
    bin_of: Vec<usize>,
    weight: Vec<f64>,
    basis: DMatrix<f64>,
}

impl Shapes {
    fn new(view: &View) -> Self {
        let bin_of: Vec<usize> = view
            .phase
            .iter()
            .map(|phase| ((phase * BINS as f64) as usize).min(BINS - 1))
            .collect();
        let mut counts = vec![0.0; BINS];
        let mut motion = DMatrix::zeros(BINS, view.motion.ncols());
        for (row, bin) in bin_of.iter().enumerate() {
            counts[*bin] += 1.0;
            for column in 0..view.motion.ncols() {
                motion[(*bin, column)] += view.motion[(row, column)];
            }
        }
        let mut random = Xoshiro256PlusPlus::seed_from_u64(SEED);
        let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
        let directions = DMatrix::from_fn(view.motion.ncols(), SHAPES, |_, _| 0.7 * normal());
        let angle = Uniform::new(0.0, std::f64::consts::TAU);
        let mut random = Xoshiro256PlusPlus::seed_from_u64(SEED + 1);
        let offsets: Vec<f64> = (0..SHAPES)
            .map(|_| angle.map_or(0.0, |angle| angle.sample(&mut random)))
            .collect();
        let weight: Vec<f64> = counts
            .iter()
            .map(|count: &f64| if *count > 0.0 { 1.0 / count.sqrt() } else { 0.0 })
            .collect();
        let shapes = DMatrix::from_fn(BINS, 2 * SHAPES, |bin, shape| {
            let value = if shape < SHAPES {
                (std::f64::consts::PI * (shape + 1) as f64 * (bin as f64 + 0.5) / BINS as f64).cos()
            } else {
                let mean = motion.row(bin) / counts[bin].max(1.0);
                ((mean * directions.column(shape - SHAPES))[0] + offsets[shape - SHAPES]).cos()
            };
            value * counts[bin].sqrt()
        });
        Shapes {
            bin_of,
            weight,
            basis: shapes.qr().q(),
        }
    }

    /// Sums over bins, in units of their noise.
    fn binned(&self, rest: &DVector<f64>) -> DVector<f64> {
        let mut sums = DVector::<f64>::zeros(BINS);
        for (bin, value) in self.bin_of.iter().zip(rest.iter()) {
            sums[*bin] += value;
        }
        DVector::from_fn(BINS, |bin, _| sums[bin] * self.weight[bin])
    }
}
