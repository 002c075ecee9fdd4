//! How plain what was injected is, beside what the healthy recording leaves.
//!
//! In: the healthy scene, once, and scenes with something done to them. Out: [`Plain`]: the marginal signal to noise ratio and how much
//! it matters. With `d` what changes in "written less what the record says" ([`super::told`]), `S` the covariance of that in the healthy
//! recording and `N` what the calibration leaves open, times its sigmas (zero, scale and axes of each sensor, the field and its gradient
//! where they are stated),
//!
//! ```text
//! ratio^2 = d' (S + N N')^-1 d = w'w - b' (I + N~'N~)^-1 b,     w = S^(-1/2) d,  N~ = S^(-1/2) N,  b = N~'w
//! ```
//!
//! over the fit windows. `S` has two parts. What is fast is an autoregression ([`ORDER`]; Yule and Walker, by Levinson's recursion) of what
//! is left once calibration is taken out, over its level within some two seconds. It remembers 0.8 s, and what a reference and a room err by
//! stays alike for some ten. So what is slow stands in `N` beside the calibration: cosines with periods from twice the recording down to
//! [`SLOW_S`] along the axes of n, in which both stand still, each as large as those of about its frequency were found ([`wander`]).
//!
//! What is random from row to row has a variance and no shape: of it the ratio is that of the best test of a variance over stretches,
//! `sqrt(sum E^2 / 2n)`, in rows whitened alike.
//!
//! How much it matters is told twice: as attitude \[deg\] (a slow force over gravity, a slow field over its horizontal part, a slow rate
//! over ten seconds of a filter), and as growth of the root mean square of what is left.

use nalgebra::{DMatrix, DVector, Vector3};

use super::{
    recording::Kind,
    scene::Scene,
    told::{self, Blocks},
};
use crate::sensitivity::consequence::FILTER_S;

/// Of the autoregressions: 0.8 s of blocks, and 56 ms of BROAD's rows.
const ORDER: usize = 8;
const ROW_ORDER: usize = 16;

/// \[s\] the shortest period of what is slow: five times the memory of the autoregression.
const SLOW_S: f64 = 4.0;

/// Blocks to either side over which a level is taken, and blocks' worth of the mean level that are added.
const BLOCKS_BESIDE: usize = 10;
const PSEUDO: f64 = 4.0;

/// Blocks that are one slow value: two seconds.
const SLOW: usize = 20;

/// How plain an injection is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Plain {
    /// Marginal signal to noise ratio.
    pub ratio: f64,
    /// \[deg\] what it does to an attitude.
    pub attitude_deg: f64,
    /// By which the gap of the sensor that shows it most grows, of what it was.
    pub growth: f64,
}

/// A series with holes, whitened.
struct Whitening {
    /// 1, a1, ... of the prediction error.
    coefficients: Vec<f64>,
    /// Of its level, a value each.
    level: Vec<f64>,
}

impl Whitening {
    fn of(series: &[f64], order: usize, near: usize) -> Self {
        let coefficients = levinson(series, order);
        let errors = errors(series, &coefficients);
        let finite: Vec<f64> = errors.iter().copied().filter(|error| error.is_finite()).collect();
        let mean = finite.iter().map(|error| error * error).sum::<f64>() / finite.len().max(1) as f64;
        let mean = mean.max(f64::MIN_POSITIVE);
        let mut sums = vec![(0.0, 0.0)];
        for error in &errors {
            let (sum, count) = sums[sums.len() - 1];
            sums.push(match error.is_finite() {
                true => (sum + error * error, count + 1.0),
                false => (sum, count),
            });
        }
        let level = (0..errors.len()).map(|at| {
            let (from, to) = (sums[at.saturating_sub(near)], sums[(at + near + 1).min(errors.len())]);
            ((to.0 - from.0 + PSEUDO * mean) / (to.1 - from.1 + PSEUDO)).sqrt()
        });
        Whitening {
            level: level.collect(),
            coefficients,
        }
    }

    /// NaN where it is not known.
    fn applied(&self, series: &[f64]) -> Vec<f64> {
        let errors = errors(series, &self.coefficients).into_iter();
        errors.zip(&self.level).map(|(error, level)| error / level).collect()
    }
}

/// What an autoregression does not predict; NaN where it lacks a value.
fn errors(series: &[f64], coefficients: &[f64]) -> Vec<f64> {
    (0..series.len())
        .map(|at| match at + 1 >= coefficients.len() {
            true => coefficients
                .iter()
                .enumerate()
                .map(|(back, own)| own * series[at - back])
                .sum(),
            false => f64::NAN,
        })
        .collect()
}

/// The prediction error filter of a series with holes. Durbin 1960.
fn levinson(series: &[f64], order: usize) -> Vec<f64> {
    let covariance: Vec<f64> = (0..=order)
        .map(|lag| {
            let products = series.iter().skip(lag).zip(series).map(|(now, before)| now * before);
            let known: Vec<f64> = products.filter(|product| product.is_finite()).collect();
            known.iter().sum::<f64>() / known.len().max(1) as f64
        })
        .collect();
    let mut coefficients = vec![1.0];
    let mut error = covariance[0] * (1.0 + 1e-9) + f64::MIN_POSITIVE;
    for size in 1..=order {
        let sum: f64 = coefficients
            .iter()
            .enumerate()
            .map(|(back, own)| own * covariance[size - back])
            .sum();
        // Of pairs with holes the covariance may be none: stay inside.
        let reflection = (-sum / error).clamp(-0.999, 0.999);
        coefficients.push(0.0);
        let reversed: Vec<f64> = coefficients.iter().rev().copied().collect();
        coefficients
            .iter_mut()
            .zip(reversed)
            .for_each(|(own, other)| *own += reflection * other);
        error *= 1.0 - reflection * reflection;
    }
    coefficients
}

/// A sensor of the healthy recording.
struct Healthy {
    blocks: Blocks,
    /// Root mean square of what is left once calibration is taken out.
    left: f64,
    /// Of each axis.
    whitening: [Whitening; 3],
    /// What calibration leaves open, a block's axis a row, times its sigmas; not whitened.
    open: DMatrix<f64>,
    /// The same beside what is slow, whitened.
    white_open: DMatrix<f64>,
    /// Of the rows as written.
    rows: [Whitening; 3],
    written: Vec<Vector3<f64>>,
}

/// The healthy recording, against which injections are measured.
pub struct Yardstick {
    sensors: Vec<Healthy>,
    is_fit: Vec<bool>,
    row_is_fit: Vec<bool>,
    row_stretch: usize,
    gravity: f64,
    level_field: f64,
}

fn axis(series: &[Vector3<f64>], axis: usize) -> Vec<f64> {
    series.iter().map(|value| value[axis]).collect()
}

impl Yardstick {
    /// Of a healthy scene; `fit` are windows \[s\], `field_sigma_ut` and `gradient_sigma` what is stated of the field.
    pub fn new(scene: &Scene, fit: &[[f64; 2]], field_sigma_ut: f64, gradient_sigma: f64) -> Self {
        let within = |t_s: f64| fit.iter().any(|[from_s, to_s]| (*from_s..*to_s).contains(&t_s));
        let sensors: Vec<Healthy> = (scene.sensors.iter())
            .map(|sensor| {
                let blocks = told::blocks(scene, sensor);
                let open = open(&blocks, sensor.kind, sensor.sigmas, field_sigma_ut, gradient_sigma);
                let left = calibrated(&blocks.misfit, &open);
                let cosines = cosines(&blocks);
                let fast = calibrated(&left, &cosines);
                let whitening = [0, 1, 2].map(|own| Whitening::of(&axis(&fast, own), ORDER, BLOCKS_BESIDE));
                let slow = wander(&left, &fast, &cosines, &whitening);
                let both = DMatrix::from_columns(&open.column_iter().chain(slow.column_iter()).collect::<Vec<_>>());
                let energy: Vec<f64> = left
                    .iter()
                    .map(|left| left.norm_squared())
                    .filter(|one| one.is_finite())
                    .collect();
                Healthy {
                    left: (energy.iter().sum::<f64>() / (3 * energy.len().max(1)) as f64).sqrt(),
                    white_open: whitened_open(&both, &whitening),
                    whitening,
                    rows: [0, 1, 2].map(|own| {
                        let near = BLOCKS_BESIDE * (told::BLOCK_S / scene.step_s).round().max(1.0) as usize;
                        Whitening::of(&axis(&sensor.values, own), ROW_ORDER, near)
                    }),
                    written: sensor.values.clone(),
                    blocks,
                    open,
                }
            })
            .collect();
        Yardstick {
            is_fit: sensors.first().map_or(Vec::new(), |one| {
                one.blocks.times_s.iter().map(|t_s| within(*t_s)).collect()
            }),
            row_is_fit: scene.times_s.iter().map(|t_s| within(*t_s)).collect(),
            row_stretch: (1.0 / scene.step_s).round() as usize,
            gravity: scene.gravity,
            level_field: scene.field_n_ut.map_or(1.0, |field| field.xy().norm().max(1.0)),
            sensors,
        }
    }

    /// Of a scene with something done to it, which is random from row to row or has a shape.
    pub fn measured(&self, struck: &Scene, is_random: bool) -> Plain {
        let mut plain = Plain::default();
        let mut energy = 0.0;
        for (healthy, sensor) in self.sensors.iter().zip(&struck.sensors) {
            let blocks = told::blocks(struck, sensor);
            let changed: Vec<Vector3<f64>> = (blocks.misfit.iter().zip(&healthy.blocks.misfit))
                .zip(&self.is_fit)
                .map(|((now, before), is_fit)| {
                    if *is_fit {
                        now - before
                    } else {
                        Vector3::repeat(f64::NAN)
                    }
                })
                .collect();
            energy += match is_random {
                true => self.in_variance(healthy, &sensor.values),
                false => in_shape(healthy, &changed),
            };
            let slow = rms(&slow(&changed));
            let attitude = match sensor.kind {
                Kind::Gyro => slow * FILTER_S,
                Kind::Accelerometer => slow / self.gravity,
                Kind::Magnetometer => slow / self.level_field,
            };
            plain.attitude_deg = plain.attitude_deg.max(attitude.to_degrees());
            let left = rms(&calibrated(&changed, &healthy.open)) / healthy.left.max(f64::MIN_POSITIVE);
            plain.growth = plain.growth.max((1.0 + left * left).sqrt() - 1.0);
        }
        plain.ratio = energy.max(0.0).sqrt();
        plain
    }

    fn in_variance(&self, healthy: &Healthy, values: &[Vector3<f64>]) -> f64 {
        (0..3)
            .map(|own| {
                let changed: Vec<f64> = (values.iter().zip(&healthy.written).zip(&self.row_is_fit))
                    .map(|((now, before), is_fit)| if *is_fit { now[own] - before[own] } else { f64::NAN })
                    .collect();
                let squares = healthy.rows[own].applied(&changed);
                let squares: Vec<f64> = squares
                    .iter()
                    .map(|one| one * one)
                    .filter(|one| one.is_finite())
                    .collect();
                let of_stretch = |squares: &[f64]| squares.iter().sum::<f64>().powi(2) / (2.0 * squares.len() as f64);
                squares.chunks(self.row_stretch).map(of_stretch).sum::<f64>()
            })
            .sum()
    }
}

/// Root mean square of an axis over what is known.
fn rms(series: &[Vector3<f64>]) -> f64 {
    let known: Vec<f64> = series
        .iter()
        .map(|one| one.norm_squared() / 3.0)
        .filter(|one| one.is_finite())
        .collect();
    (known.iter().sum::<f64>() / known.len().max(1) as f64).sqrt()
}

/// Means of what is known over [`SLOW`] blocks.
fn slow(series: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
    let mean = |chunk: &[Vector3<f64>]| {
        let known: Vec<&Vector3<f64>> = chunk.iter().filter(|one| one.x.is_finite()).collect();
        known.iter().copied().sum::<Vector3<f64>>() / known.len() as f64
    };
    series.chunks(SLOW).map(mean).collect()
}

/// `w'w - b' (I + N~'N~)^-1 b` of a sensor.
fn in_shape(healthy: &Healthy, changed: &[Vector3<f64>]) -> f64 {
    let whitened = [0, 1, 2].map(|own| healthy.whitening[own].applied(&axis(changed, own)));
    let whitened = whitened.concat();
    let open = &healthy.white_open;
    let known: Vec<usize> = (0..whitened.len())
        .filter(|row| whitened[*row].is_finite() && open.row(*row).iter().all(|value| value.is_finite()))
        .collect();
    let w = DVector::from_iterator(known.len(), known.iter().map(|row| whitened[*row]));
    let open = open.select_rows(&known);
    let b = open.tr_mul(&w);
    let inner = (open.tr_mul(&open) + DMatrix::identity(open.ncols(), open.ncols())).cholesky();
    w.norm_squared() - inner.map_or(0.0, |inner| b.dot(&inner.solve(&b)))
}

/// Columns whose rows are a block's axes, whitened: all blocks of one axis after the other.
fn whitened_open(open: &DMatrix<f64>, whitening: &[Whitening; 3]) -> DMatrix<f64> {
    let count = open.nrows() / 3;
    let columns: Vec<DVector<f64>> = (open.column_iter())
        .map(|column| {
            let own = |axis: usize| -> Vec<f64> { (0..count).map(|block| column[3 * block + axis]).collect() };
            DVector::from_vec([0, 1, 2].map(|axis| whitening[axis].applied(&own(axis))).concat())
        })
        .collect();
    DMatrix::from_columns(&columns)
}

/// `sqrt 2 cos(pi k (i + 1/2) / n)` of block `i` along each axis of n, three columns a `k` from 1 on: their mean square is one.
fn cosines(blocks: &Blocks) -> DMatrix<f64> {
    let count = blocks.poses.len();
    let most = (2.0 * told::BLOCK_S * count as f64 / SLOW_S) as usize;
    let mut cosines = DMatrix::zeros(3 * count, 3 * most);
    for (block, (q_nb, _)) in blocks.poses.iter().enumerate() {
        let to_b = q_nb.inverse().to_rotation_matrix();
        for k in 0..most {
            let phase = std::f64::consts::PI * (k + 1) as f64 * (block as f64 + 0.5) / count as f64;
            let own = to_b.matrix() * (2f64.sqrt() * phase.cos());
            cosines.fixed_view_mut::<3, 3>(3 * block, 3 * k).copy_from(&own);
        }
    }
    cosines
}

/// What reference and room err by slowly: each cosine times its sigma. That is the root mean square of what was found from half its
/// frequency to twice that, less what noise alone makes of it: of `n` values of density `s` a column of mean square one gets `s / n`.
fn wander(
    left: &[Vector3<f64>],
    fast: &[Vector3<f64>],
    cosines: &DMatrix<f64>,
    whitening: &[Whitening; 3],
) -> DMatrix<f64> {
    let most = cosines.ncols() / 3;
    let known: Vec<usize> = (0..left.len()).filter(|block| left[*block].x.is_finite()).collect();
    // By what least squares took out, cosine by cosine: nearly orthogonal where the recording has no large holes.
    let taken = |column: usize| -> f64 {
        let products = known.iter().map(|block| {
            let slow = left[*block] - fast[*block];
            (0..3)
                .map(|axis| cosines[(3 * block + axis, column)] * slow[axis])
                .sum::<f64>()
        });
        products.sum::<f64>() / known.len().max(1) as f64
    };
    let squares: Vec<f64> = (0..most)
        .map(|k| (0..3).map(|axis| taken(3 * k + axis).powi(2)).sum::<f64>() / 3.0)
        .collect();
    let density = |one: &Whitening| {
        let level = one.level.iter().map(|level| level * level).sum::<f64>() / one.level.len().max(1) as f64;
        level / one.coefficients.iter().sum::<f64>().powi(2)
    };
    let of_noise = whitening.iter().map(density).sum::<f64>() / 3.0 / known.len().max(1) as f64;
    let sigma = |k: usize| {
        let near = &squares[k / 2..(2 * k + 2).min(most)];
        (near.iter().sum::<f64>() / near.len().max(1) as f64 - of_noise)
            .max(0.0)
            .sqrt()
    };
    let sigmas: Vec<f64> = (0..most).map(sigma).collect();
    let mut slow = cosines.clone();
    for (mut column, index) in slow.column_iter_mut().zip(0..) {
        column *= sigmas[index / 3];
    }
    slow
}

/// A misfit without what the open columns take up, by least squares; three rows a block.
fn calibrated(misfit: &[Vector3<f64>], open: &DMatrix<f64>) -> Vec<Vector3<f64>> {
    let known: Vec<usize> = (0..misfit.len())
        .filter(|at| misfit[*at].x.is_finite() && open[(3 * at, 0)].is_finite())
        .collect();
    let columns = open.ncols();
    let rows = DMatrix::from_fn(3 * known.len(), columns, |row, column| {
        open[(3 * known[row / 3] + row % 3, column)]
    });
    let values = DVector::from_fn(3 * known.len(), |row, _| misfit[known[row / 3]][row % 3]);
    // A motion that does not turn leaves some of them open: a little of the diagonal.
    let mut inner = rows.tr_mul(&rows);
    let small = 1e-9 * inner.trace().max(f64::MIN_POSITIVE);
    (0..columns).for_each(|at| inner[(at, at)] += small);
    let Some(found) = inner.cholesky().map(|inner| inner.solve(&rows.tr_mul(&values))) else {
        return misfit.to_vec();
    };
    let explained = open * found;
    (misfit.iter().enumerate())
        .map(|(block, misfit)| {
            misfit - Vector3::new(explained[3 * block], explained[3 * block + 1], explained[3 * block + 2])
        })
        .collect()
}

/// What calibration and field leave open of a sensor, a column each, times its sigma.
fn open(
    blocks: &Blocks,
    kind: Kind,
    [bias, scale, axis_rad]: [f64; 3],
    field_sigma: f64,
    gradient_sigma: f64,
) -> DMatrix<f64> {
    let middle = blocks.poses.iter().map(|pose| pose.1).sum::<Vector3<f64>>() / blocks.poses.len().max(1) as f64;
    let rows: Vec<[Vec<f64>; 3]> = (blocks.told.iter().zip(&blocks.poses))
        .map(|(told, (q_nb, place_n))| {
            let to_b = q_nb.inverse().to_rotation_matrix();
            let away = place_n - middle;
            // Free of sources and curl: symmetric and without trace.
            let gradients = [
                Vector3::new(away.x, 0.0, -away.z),
                Vector3::new(0.0, away.y, -away.z),
                Vector3::new(away.y, away.x, 0.0),
                Vector3::new(away.z, 0.0, away.x),
                Vector3::new(0.0, away.z, away.y),
            ];
            [0, 1, 2].map(|own| {
                let mut row = vec![0.0; 12];
                row[own] = bias;
                for other in 0..3 {
                    row[3 + 3 * own + other] = told[other] * if own == other { scale } else { axis_rad };
                }
                if kind == Kind::Magnetometer {
                    row.extend((0..3).map(|at| field_sigma * to_b.matrix()[(own, at)]));
                    row.extend(
                        gradients
                            .iter()
                            .map(|gradient_n| gradient_sigma * (to_b * gradient_n)[own]),
                    );
                }
                row
            })
        })
        .collect();
    let columns = rows.first().map_or(0, |row| row[0].len());
    DMatrix::from_fn(3 * rows.len(), columns, |row, column| rows[row / 3][row % 3][column])
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::{
        super::recording::{self, Purpose},
        *,
    };

    /// A room whose field wanders hides a disturbance that is as slow, and none that is fast.
    #[test]
    fn what_a_recording_errs_by_slowly_hides_what_is_as_slow_and_nothing_else() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../data");
        let recordings = recording::all(&folder, Purpose::Judge).expect("a minute");
        let recording = &recordings[0];
        let calm = Scene::new(recording);
        let sensor = (calm.sensors.iter())
            .position(|sensor| sensor.kind == Kind::Magnetometer)
            .expect("magnetometers");
        let with = |scene: &Scene, size: f64, period_s: f64, phase: f64| {
            let mut scene = scene.clone();
            for ((row, value), (q_nb, _)) in (0..).zip(&mut scene.sensors[sensor].values).zip(calm.followed()) {
                let turns = f64::from(row) * calm.step_s / period_s;
                let along_n = Vector3::x() * (size * (std::f64::consts::TAU * turns + phase).sin());
                *value += q_nb.inverse() * along_n;
            }
            scene
        };
        let restless = with(&calm, 1.0, 17.0, 1.0);
        let ratio = |healthy: &Scene, period_s: f64| {
            let yardstick = Yardstick::new(healthy, &recording.case.windows.fit, 0.8, 1.5);
            yardstick.measured(&with(healthy, 0.3, period_s, 0.0), false).ratio
        };
        let [slow, fast] = [20.0, 0.7].map(|period_s| [&calm, &restless].map(|healthy| ratio(healthy, period_s)));
        assert!(slow[1] < 0.5 * slow[0], "{slow:?}");
        assert!((fast[1] / fast[0] - 1.0).abs() < 0.2, "{fast:?}");
    }
}
