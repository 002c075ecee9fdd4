//! A cycle's rotation through the calibration: the gyros' integrals, each with its own scale, bias and axis.
//!
//! In: [`Increments`], the parameter [`Set`], and the gyros that are believed. Out: the rotation vector of b, its white
//! variance, the time it covers.
//!
//! ```text
//! angle_k = scale_k (integral_k - bias_k t)        angle_b = least squares over the gyros + coning
//! ```
//!
//! The coning correction needs every fast sample, so it comes with the increments, by nominal geometry: there it is what
//! their rotation has beyond the sum of their integrals. It is of second order, and a calibration changes it by parts of
//! a hundred. Where a gyro had a part in it that is not believed, it is left out.
//!
//! A gyro that missed samples, or stood at the end of its range, is left out while three are left. Of saturated gyros
//! alone the rotation is a lower bound, and is said to be. Refuses (by covering no time) fewer than three believed gyros.

use nalgebra::{Vector3, Vector4};

use crate::{
    calibration::{Set, Temperatures},
    geometry::{PLATES, rate_from_gyros},
    increments::Increments,
    redundancy::{Known, solve},
    sample::Kind,
};

/// [counts] a rate beyond the range (ADIS16265 data sheet, Table 1: 320 deg/s are 4368 counts).
const RANGE_COUNTS: u16 = 4368;

/// What b turned by in a cycle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Turn {
    /// [rad] rotation vector in b.
    pub angle_b: Vector3<f32>,
    /// [rad2] white variance of a component.
    pub variance: f32,
    /// [s] time it covers; 0 if nothing is known.
    pub covered_s: f32,
    /// It is a lower bound.
    pub saturated: bool,
}

/// The rotation of a cycle by the gyros whose bit in `believed` is set.
pub(super) fn turn(set: &Set, temperatures: &Temperatures, increments: &Increments, believed: u16) -> Turn {
    let covered_s = increments.covered_us as f32 * 1e-6;
    let samples = increments.gyro.iter().fold(0, |most, gyro| most.max(gyro.count));
    let which = |is: &dyn Fn(usize) -> bool| (0..PLATES).filter(|k| is(*k)).fold(0, |bits, k| bits | 1_u16 << k);
    let seen = which(&|k| increments.gyro[k].count > 0);
    let whole = which(&|k| increments.gyro[k].count == samples) & seen;
    let clipped = which(&|k| {
        let gyro = &increments.gyro[k];
        gyro.least.unsigned_abs() >= RANGE_COUNTS || gyro.most.unsigned_abs() >= RANGE_COUNTS
    }) & seen;
    let free = whole & believed & !clipped;
    let saturated = free.count_ones() < 3 && clipped != 0;
    let used = if saturated { whole & believed } else { free };
    let axes_b = set.gyro.map(|axis| axis.axis_b);
    let angles: [f32; PLATES] = core::array::from_fn(|k| {
        let above_c = temperatures.gyro_c(k).unwrap_or(set.reference_c).clamp(set.lowest_c, set.highest_c)
            - set.reference_c;
        let axis = &set.gyro[k];
        axis.scale_at(above_c) * (increments.gyro[k].integral_counts_s - axis.bias_counts_at(above_c) * covered_s)
    });
    let solution = solve(&axes_b, &angles, &[1.0; PLATES], used);
    if solution.known != Known::All || covered_s <= 0.0 {
        return Turn {
            angle_b: Vector3::zeros(),
            variance: 0.0,
            covered_s: 0.0,
            saturated,
        };
    }
    let noise = set.gyro.iter().map(|axis| axis.noise * axis.noise).sum::<f32>() / PLATES as f32;
    let sampled_s = covered_s / f32::from(samples);
    Turn {
        angle_b: solution.vector_b + coning(set, increments, seen, used),
        variance: noise * sampled_s * covered_s * solution.covariance_b.trace() / 3.0,
        covered_s,
        saturated,
    }
}

/// What the increments' rotation has beyond the sum of their integrals, both by nominal geometry; zero unless exactly
/// the gyros that are used had a part in it.
fn coning(set: &Set, increments: &Increments, seen: u16, used: u16) -> Vector3<f32> {
    let Some(matrix) = rate_from_gyros(used as u8).filter(|_| used == seen) else {
        return Vector3::zeros();
    };
    let integrals = Vector4::from(increments.gyro.map(|gyro| gyro.integral_counts_s));
    let nominal_b = matrix * integrals * set.ranges.nominal_scale(Kind::Gyro);
    Vector3::from(increments.angle_b) - nominal_b
}
