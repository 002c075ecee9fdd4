//! What a model leaves: is it what the twin's own noise and calibration would leave?
//!
//! In: the finished model's columns ([`Joint`]) and the residual. Out: [`Leftover`], a p-value for "this model is enough",
//! and the aspects of the residual that say otherwise, largest first. Aspects: energy of a channel; energy of a stretch of
//! time in a kind of sensor; slow shapes in time and shapes in the motion (24 cosines, 24 random features, Rahimi and Recht
//! 2007); neighbouring samples alike (Ljung and Box 1978); heavy tails; the same vector in all sensors of a kind; and the
//! size of the fitted calibration itself, without which an unknown effect hides in the calibration.
//!
//! Each aspect is a sum of squares; its cube root is near Gaussian (Wilson and Hilferty 1931) and is put in units of its
//! spread over logs simulated from the model: same motion, same holes, calibration drawn from its sigmas, white noise with
//! the tails of a Student law of ten degrees of freedom, for no sensor's noise is quite Gaussian. The p-value counts how many of those have as large a largest aspect, so it is paid for having looked everywhere.

use nalgebra::{DMatrix, DVector, Vector3};
use rand_distr::{ChiSquared, Distribution, StandardNormal, Uniform};
use rand_xoshiro::{Xoshiro256PlusPlus, rand_core::SeedableRng};

use crate::joint::{Fitted, Joint};

/// Shapes in time, and as many in the motion.
const SHAPES: usize = 24;

/// Stretches of time.
pub const STRETCHES: usize = 20;

/// Bins for shapes, which are slow: two a shape's shortest period would do, twenty leave no loss.
const BINS: usize = 500;

/// Lags of the whiteness test.
const LAGS: usize = 10;

/// Simulated logs: fewest (p then has a floor of 1/101) and most.
const SIMULATIONS: [usize; 2] = [100, 200];

/// Normal numbers drawn in all, so that long logs take bounded time.
const DRAWS: usize = 20_000_000;

/// Degrees of freedom of the noise's Student law: an excess kurtosis of one.
const TAILS: f64 = 10.0;

/// Fixed, so that one case gives one verdict.
const SEED: u64 = 0x5eed_0005;

/// What is looked at of one channel.
#[derive(Clone, Debug)]
pub struct View {
    /// Name, for the report.
    pub name: String,
    /// Kind of sensor, an index.
    pub kind: usize,
    /// Its axis in b.
    pub axis_b: Vector3<f64>,
    /// Place of each sample in the fitted time, 0 to 1.
    pub phase: Vec<f64>,
    /// What the unit does at each sample (rates, force, field, temperature), each about zero with unit spread.
    pub motion: DMatrix<f64>,
}

/// One aspect of a residual.
#[derive(Clone, Debug, PartialEq)]
pub struct Aspect {
    /// In words.
    pub what: String,
    /// The channel it belongs to, where there is one.
    pub channel: Option<usize>,
    /// Standard deviations above what the model leaves.
    pub size: f64,
}

/// Judgement of what is left.
#[derive(Clone, Debug, PartialEq)]
pub struct Leftover {
    /// Probability of as large a leftover if the model is enough.
    pub p: f64,
    /// Natural logarithm of that probability continued beyond the last simulated log by a Gumbel law, which is what the
    /// largest of many follows.
    pub log_tail: f64,
    /// Aspects above three, largest first.
    pub aspects: Vec<Aspect>,
    /// Mean and spread of the largest aspect over the simulated logs.
    pub scale: [f64; 2],
}

impl Leftover {
    /// Probability that something else is needed, from its prior: a p-value speaks against "enough" by at most
    /// `-1 / (e p ln p)` (Sellke, Bayarri and Berger 2001).
    pub fn unknown(&self, prior: f64) -> f64 {
        let log_p = self.log_tail.min(self.p.ln());
        let bound = if log_p < -1.0 {
            (1.0 + log_p + (-log_p).ln()).exp()
        } else {
            1.0
        };
        prior / (prior + (1.0 - prior) * bound)
    }
}

/// `ln P(largest >= size)` for a Gumbel law of this mean and spread.
fn log_tail(size: f64, [mean, spread]: [f64; 2]) -> f64 {
    let beta = spread * 6f64.sqrt() / std::f64::consts::PI;
    if beta <= 0.0 {
        return 0.0;
    }
    const EULER: f64 = 0.577_215_664_901_532_9;
    let y = (size - (mean - EULER * beta)) / beta;
    // ln(1 - exp(-exp(-y))): for large y simply -y.
    if y > 30.0 {
        -y
    } else {
        (-(-(-y).exp()).exp_m1()).max(f64::MIN_POSITIVE).ln()
    }
}

/// Judges the residuals of a model. Channels in `explained` are not looked at: another effect says how they scatter.
pub fn judge(views: &[View], joint: &Joint, fitted: &Fitted, explained: &[usize]) -> Leftover {
    let dictionary: Vec<Shapes> = views.iter().map(Shapes::new).collect();
    let observed = sums(views, &dictionary, fitted, explained);
    let samples: usize = views.iter().map(|view| view.phase.len()).sum();
    let count = (DRAWS / samples.max(1)).clamp(SIMULATIONS[0], SIMULATIONS[1]);
    let mut random = Xoshiro256PlusPlus::seed_from_u64(SEED);
    let simulated: Vec<Vec<f64>> = (0..count)
        .map(|_| sums(views, &dictionary, &joint.fit(&simulate(joint, &mut random)), explained))
        .collect();
    let roots = |values: &[f64]| -> Vec<f64> { values.iter().map(|value| value.max(0.0).cbrt()).collect() };
    let simulated: Vec<Vec<f64>> = simulated.iter().map(|values| roots(values)).collect();
    let observed = roots(&observed);
    let spreads: Vec<(f64, f64)> = (0..observed.len())
        .map(|at| moments(simulated.iter().map(|run| run[at])))
        .collect();
    let sizes = |run: &[f64]| -> Vec<f64> {
        run.iter()
            .zip(&spreads)
            .map(|(value, (mean, spread))| if *spread > 0.0 { (value - mean) / spread } else { 0.0 })
            .collect()
    };
    let largest = |run: &[f64]| sizes(run).into_iter().fold(f64::NEG_INFINITY, f64::max);
    let seen = largest(&observed);
    let scale = moments(simulated.iter().map(|run| largest(run)));
    let beyond = simulated.iter().filter(|run| largest(run) >= seen).count();
    let mut aspects: Vec<Aspect> = labels(views)
        .into_iter()
        .zip(sizes(&observed))
        .map(|((what, channel), size)| Aspect { what, channel, size })
        .filter(|aspect| aspect.size > 3.0)
        .collect();
    aspects.sort_by(|one, other| other.size.total_cmp(&one.size));
    Leftover {
        p: (1 + beyond) as f64 / (1 + count) as f64,
        log_tail: log_tail(seen, [scale.0, scale.1]),
        scale: [scale.0, scale.1],
        aspects,
    }
}

fn moments(values: impl Iterator<Item = f64> + Clone) -> (f64, f64) {
    let count = values.clone().count() as f64;
    let mean = values.clone().sum::<f64>() / count;
    let variance = values.map(|value| (value - mean).powi(2)).sum::<f64>() / (count - 1.0);
    (mean, variance.sqrt())
}

fn simulate(joint: &Joint, random: &mut Xoshiro256PlusPlus) -> Vec<DVector<f64>> {
    let spread = ChiSquared::new(TAILS);
    // A Student variable of n degrees has variance n / (n - 2).
    let unit = (TAILS - 2.0).sqrt();
    joint
        .columns()
        .map(|columns| {
            let open = DVector::from_fn(columns.nuisance.ncols(), |_, _| StandardNormal.sample(&mut *random));
            let mut residual = DVector::from_fn(columns.nuisance.nrows(), |_, _| {
                let normal: f64 = StandardNormal.sample(&mut *random);
                spread
                    .as_ref()
                    .map_or(normal, |spread| normal * unit / spread.sample(&mut *random).sqrt())
            });
            residual.gemv(1.0, &columns.nuisance, &open, 1.0);
            residual
        })
        .collect()
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

/// Number of kinds in the views.
fn kinds(views: &[View]) -> usize {
    views.iter().map(|view| view.kind + 1).max().unwrap_or(0)
}

const KIND_NAMES: [&str; 4] = ["accelerometers", "gyros", "magnetometers", "thermometers"];

/// What is looked at in each channel, in the order of [`sums`].
const ASPECTS_OF_CHANNEL: [&str; 5] = [
    "more energy than noise",
    "a shape in time or motion",
    "neighbouring samples alike",
    "outliers",
    "a calibration beyond its sigmas",
];

/// What each entry of [`sums`] is.
fn labels(views: &[View]) -> Vec<(String, Option<usize>)> {
    let mut labels = Vec::new();
    for (index, view) in views.iter().enumerate() {
        let name = &view.name;
        for what in ASPECTS_OF_CHANNEL {
            labels.push((format!("{name}: {what}"), Some(index)));
        }
    }
    for kind in 0..kinds(views) {
        let name = KIND_NAMES.get(kind).copied().unwrap_or("sensors");
        labels.push((format!("{name}: calibrations beyond their sigmas together"), None));
        for axis in ["x", "y", "z"] {
            labels.push((format!("{name}: a common vector along {axis}"), None));
        }
        for stretch in 0..STRETCHES {
            labels.push((format!("{name}: stretch {} of {STRETCHES}", stretch + 1), None));
        }
    }
    labels
}

/// The sums of squares, in the order of [`labels`].
fn sums(views: &[View], shapes: &[Shapes], fitted: &Fitted, explained: &[usize]) -> Vec<f64> {
    let mut sums = Vec::new();
    let mut nuisance = vec![0.0; kinds(views)];
    let mut common = vec![DMatrix::zeros(BINS, 3); kinds(views)];
    let mut stretches = vec![[0.0; STRETCHES]; kinds(views)];
    for (index, (view, shapes)) in views.iter().zip(shapes).enumerate() {
        if explained.contains(&index) {
            sums.extend([0.0; ASPECTS_OF_CHANNEL.len()]);
            continue;
        }
        let (rest, open) = (&fitted.rest[index], &fitted.nuisance[index]);
        let binned = shapes.binned(rest);
        let energy = rest.norm_squared();
        sums.push(energy);
        sums.push(shapes.basis.tr_mul(&binned).norm_squared());
        let values = rest.as_slice();
        let alike = (1..=LAGS).map(|lag| {
            values
                .iter()
                .zip(values.iter().skip(lag))
                .map(|(a, b)| a * b)
                .sum::<f64>()
                .powi(2)
        });
        sums.push(alike.sum::<f64>() / energy.max(1.0));
        sums.push(values.iter().map(|value| value.powi(4)).sum());
        sums.push(open.norm_squared());
        nuisance[view.kind] += open.norm_squared();
        common[view.kind] += &binned * view.axis_b.transpose();
        for (phase, value) in view.phase.iter().zip(values) {
            stretches[view.kind][((phase * STRETCHES as f64) as usize).min(STRETCHES - 1)] += value * value;
        }
    }
    for kind in 0..kinds(views) {
        sums.push(nuisance[kind]);
        sums.extend(common[kind].column_iter().map(|column| column.norm_squared()));
        sums.extend(stretches[kind]);
    }
    sums
}

#[cfg(test)]
mod tests;
