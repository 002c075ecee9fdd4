//! Shapes in time and in the motion, over bins of one channel: cosines of time, random features of the motion (Rahimi and
//! Recht 2007), and the motion itself.

use nalgebra::{DMatrix, DVector};
use rand_distr::{Distribution, StandardNormal, Uniform};
use rand_xoshiro::{Xoshiro256PlusPlus, rand_core::SeedableRng};

use super::view::{SEED, View};

/// Shapes in time, and as many in the motion.
const SHAPES: usize = 24;

/// Of them, the first in time that count as slow: a period of a third of the log or more.
const SLOW: usize = 6;

/// Bins for shapes, which are slow: two a shape's shortest period would do, twenty leave no loss.
pub const BINS: usize = 500;

/// Bins of one channel and orthonormal shapes over them.
pub struct Shapes {
    bin_of: Vec<usize>,
    weight: Vec<f64>,
    basis: DMatrix<f64>,
    motion: DMatrix<f64>,
}

/// Energy of what a fit leaves along shapes of each sort.
pub struct Along {
    /// Slow ones in time.
    pub slow: f64,
    /// All, in time and in the motion.
    pub any: f64,
    /// The motion's own quantities.
    pub motion: f64,
}

impl Shapes {
    /// Of a channel.
    pub fn new(view: &View) -> Self {
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
            motion: view.motion.clone().qr().q(),
        }
    }

    /// The energy along the shapes of what a fit leaves, whose [`Shapes::binned`] is given too.
    pub fn along(&self, rest: &DVector<f64>, binned: &DVector<f64>) -> Along {
        let along = self.basis.tr_mul(binned);
        Along {
            slow: along.rows(0, SLOW).norm_squared(),
            any: along.norm_squared(),
            motion: self.motion.tr_mul(rest).norm_squared(),
        }
    }

    /// Sums over bins, in units of their noise.
    pub fn binned(&self, rest: &DVector<f64>) -> DVector<f64> {
        let mut sums = DVector::<f64>::zeros(BINS);
        for (bin, value) in self.bin_of.iter().zip(rest.iter()) {
            sums[*bin] += value;
        }
        DVector::from_fn(BINS, |bin, _| sums[bin] * self.weight[bin])
    }
}
