//! An unknown motion eliminated: each packet by itself, and as one course.
//!
//! In: samples by packet, each with its nonzero columns `V`. Out: `(A'V)' N^-1 (A'V)`, what the motion can make of every product of two columns.

use nalgebra::{DMatrix, DVector, Matrix3, SVector, Vector3};
use packets::channel::Quantity;

use super::{COLUMNS, Felt, Sample};
use crate::{flight::CYCLE_S, unit::kind};

/// Unknowns of a packet: rate, its derivative, force, field, derivative of the force.
const PACKET: usize = 15;
/// Unknowns of a knot, and knots that a sample depends on.
const KNOT: usize = 6;
const SUPPORT: usize = 4;

/// [m/s2] and [rad/s2], [m/s3]: the least that accelerations and derivatives may change by.
const LEAST_CHANGE: f64 = 0.02;

/// Packet by packet.
pub fn by_packet(samples: &[Vec<Sample>]) -> DMatrix<f64> {
    let middle = |samples: &Vec<Sample>| samples.first().map(|sample| sample.felt);
    let felt: Vec<Felt> = samples.iter().filter_map(middle).collect();
    let change = |of: fn(&Felt) -> Vector3<f64>| {
        let pairs = felt
            .windows(2)
            .map(|pair| (of(&pair[1]) - of(&pair[0])).norm_squared() / 3.0);
        (pairs.sum::<f64>() / felt.len().max(2) as f64).sqrt().max(LEAST_CHANGE)
    };
    // A derivative is known to what it changes by, and to what the noise of two packets makes of a slope.
    let (gyro, accelerometer) = (kind(Quantity::Rate).noise, kind(Quantity::SpecificForce).noise);
    let by_noise = |noise: f64| noise / 2f64.sqrt() / CYCLE_S;
    let rate_dot = change(|felt| felt.rate_dot).hypot(by_noise(gyro));
    let jerk = (change(|felt| felt.acceleration) / CYCLE_S).hypot(by_noise(accelerometer));
    let mut taken = DMatrix::zeros(COLUMNS, COLUMNS);
    for samples in samples {
        let mut normal = DMatrix::<f64>::identity(PACKET, PACKET) * 1e-9;
        for axis in 0..3 {
            normal[(3 + axis, 3 + axis)] += rate_dot.powi(-2);
            normal[(12 + axis, 12 + axis)] += jerk.powi(-2);
        }
        let mut right = DMatrix::zeros(PACKET, COLUMNS);
        for sample in samples {
            let row = of_packet(sample);
            normal += row * row.transpose();
            for (column, value) in &sample.columns {
                right.column_mut(*column).axpy(*value, &row, 1.0);
            }
        }
        if let Some(factor) = normal.cholesky() {
            let part = factor.l().solve_lower_triangular(&right).unwrap_or(right);
            taken.gemm_tr(1.0, &part, &part, 1.0);
        }
    }
    taken
}

/// How the unknowns of its packet change a sample.
fn of_packet(sample: &Sample) -> SVector<f64, PACKET> {
    let Felt { rate, field, force, .. } = sample.felt;
    let (axis, arm, tau) = (sample.axis, sample.lever, sample.slot_s);
    let mut row = SVector::<f64, PACKET>::zeros();
    let mut put = |from: usize, value: Vector3<f64>| row.fixed_rows_mut::<3>(from).copy_from(&value);
    match sample.quantity {
        Quantity::SpecificForce => {
            let by_rate = cross(&axis, |e| e.cross(&rate.cross(&arm)) + rate.cross(&e.cross(&arm)));
            put(0, by_rate + tau * cross(&axis, |e| force.cross(&e)));
            put(3, tau * by_rate + cross(&axis, |e| e.cross(&arm)));
            put(6, axis - tau * cross(&axis, |e| rate.cross(&e)));
            put(12, tau * axis);
        }
        Quantity::Field => {
            put(0, tau * cross(&axis, |e| field.cross(&e)));
            put(9, axis - tau * cross(&axis, |e| rate.cross(&e)));
        }
        _ => {
            put(0, axis);
            put(3, tau * axis);
        }
    }
    row / sample.sigma
}

/// Of a linear map of unit vectors, what it changes along an axis.
pub fn cross(axis: &Vector3<f64>, map: impl Fn(Vector3<f64>) -> Vector3<f64>) -> Vector3<f64> {
    Vector3::from_fn(|at, _| axis.dot(&map(Vector3::ith(at, 1.0))))
}

/// The same along one course.
pub fn by_course(samples: &[Vec<Sample>]) -> DMatrix<f64> {
    let all = samples.iter().flatten();
    let energy: f64 = all.map(|sample| sample.felt.acceleration.norm_squared() / 3.0).sum();
    let count = samples.iter().map(Vec::len).sum::<usize>().max(1) as f64;
    let acceleration = (energy / count).sqrt().max(LEAST_CHANGE);
    let size = KNOT * (samples.len() + SUPPORT - 1);
    let band = KNOT * SUPPORT;
    // Row `i` holds the columns `i - band + 1` to `i`.
    let mut normal = DMatrix::<f64>::zeros(band, size);
    let mut right = DMatrix::zeros(size, COLUMNS);
    for at in 0..size {
        let prior = if at % KNOT < 3 { 1e-6 } else { acceleration.powi(-2) };
        normal[(band - 1, at)] += prior;
    }
    for (packet, samples) in samples.iter().enumerate() {
        for sample in samples {
            let row = of_knots(sample);
            let first = KNOT * packet;
            for one in 0..band {
                for other in 0..=one {
                    normal[(band - 1 - (one - other), first + one)] += row[one] * row[other];
                }
            }
            for (column, value) in &sample.columns {
                let mut own = right.column_mut(*column);
                own.rows_mut(first, band).axpy(*value, &row, 1.0);
            }
        }
    }
    let entry = |normal: &DMatrix<f64>, row: usize, column: usize| normal[(band - 1 - (row - column), row)];
    // Cholesky within the band, then the part of every column.
    for row in 0..size {
        let from = (row + 1).saturating_sub(band);
        for column in from..=row {
            let start = from.max((column + 1).saturating_sub(band));
            let sum: f64 = (start..column)
                .map(|k| entry(&normal, row, k) * entry(&normal, column, k))
                .sum();
            let value = entry(&normal, row, column) - sum;
            normal[(band - 1 - (row - column), row)] = match row == column {
                true => value.max(f64::MIN_POSITIVE).sqrt(),
                false => value / entry(&normal, column, column),
            };
        }
    }
    let mut right = right.transpose();
    for row in 0..size {
        for k in (row + 1).saturating_sub(band)..row {
            let factor = entry(&normal, row, k);
            let (before, mut own) = right.columns_range_pair_mut(k, row);
            own.axpy(-factor, &before, 1.0);
        }
        let diagonal = entry(&normal, row, row);
        right.column_mut(row).unscale_mut(diagonal);
    }
    &right * right.transpose()
}

/// How the knots about a sample change it: four times a turn and an acceleration.
fn of_knots(sample: &Sample) -> DVector<f64> {
    let Felt {
        rate,
        rate_dot,
        force,
        field,
        ..
    } = sample.felt;
    let (axis, arm) = (sample.axis, sample.lever);
    let weights = weights(sample.slot_s / CYCLE_S);
    let mut row = DVector::zeros(KNOT * SUPPORT);
    let skew = |v: &Vector3<f64>| Matrix3::new(0.0, -v.z, v.y, v.z, 0.0, -v.x, -v.y, v.x, 0.0);
    for (at, [value, first, second]) in weights.into_iter().enumerate() {
        let turn = match sample.quantity {
            Quantity::SpecificForce => {
                let eye = Matrix3::identity();
                // dw = th' + w x th, dw' = th'' + w x th' + w' x th.
                let by_rate = eye * first + skew(&rate) * value;
                let by_dot = eye * second + skew(&rate) * first + skew(&rate_dot) * value;
                let lever =
                    -skew(&arm) * by_dot - skew(&rate.cross(&arm)) * by_rate - skew(&rate) * skew(&arm) * by_rate;
                (skew(&force) * value + lever).transpose() * axis
            }
            Quantity::Field => (skew(&field) * value).transpose() * axis,
            _ => (Matrix3::identity() * first + skew(&rate) * value).transpose() * axis,
        };
        row.rows_mut(KNOT * at, 3).copy_from(&turn);
        if sample.quantity == Quantity::SpecificForce {
            row.rows_mut(KNOT * at + 3, 3).copy_from(&(axis * value));
        }
    }
    row / sample.sigma
}

/// Value, first and second derivative \[1/s, 1/s2\] of the four cubic B-splines over an interval, `u` of it along.
fn weights(u: f64) -> [[f64; 3]; SUPPORT] {
    let v = 1.0 - u;
    let (first, second) = (CYCLE_S, CYCLE_S * CYCLE_S);
    [
        [v * v * v / 6.0, -v * v / 2.0 / first, v / second],
        [
            (3.0 * u * u * u - 6.0 * u * u + 4.0) / 6.0,
            (3.0 * u * u - 4.0 * u) / 2.0 / first,
            (3.0 * u - 2.0) / second,
        ],
        [
            (-3.0 * u * u * u + 3.0 * u * u + 3.0 * u + 1.0) / 6.0,
            (-3.0 * u * u + 2.0 * u + 1.0) / 2.0 / first,
            (1.0 - 3.0 * u) / second,
        ],
        [u * u * u / 6.0, u * u / 2.0 / first, u / second],
    ]
}
