//! Nodes in which the plate stands still, and the attitude that it begins with.
//!
//! In: [`Samples`]. Out: of every node whether it is one of rest: rates and forces scatter within it as their noise does, and it is one of a run
//! of [`RUN_S`] at least, for a hand that turns back is still for a fraction of a second.

use nalgebra::{Matrix3, UnitQuaternion, Vector3};

use crate::parity::plate::{
    filter::{Model, NODE_S},
    node::{Calibration, Node},
    samples::Samples,
};

/// Times the described noise that a node of rest may scatter: its fifty samples scatter by a tenth of it by chance, and a table shakes.
const AS_NOISE: f64 = 1.5;

/// \[s\] of a run, as in [`crate::parity::smooth::rests`].
const RUN_S: f64 = 2.0;

/// \[s\] over which the first attitude is seen.
const FIRST_S: f64 = 1.0;

/// Of every node, whether the plate stands still.
pub fn rests(samples: &Samples, begins: &[usize], model: &Model) -> Vec<bool> {
    let is_quiet = |pair: &[usize]| {
        let within = |own: &[Vector3<f64>], sigma: f64| spread(own) < AS_NOISE * sigma;
        within(&samples.rates.in_b[pair[0]..pair[1]], model.gyro[0])
            && within(&samples.forces[pair[0]..pair[1]], model.force[0])
    };
    let mut rests: Vec<bool> = begins.windows(2).map(is_quiet).collect();
    let least = (RUN_S / NODE_S).round() as usize;
    let mut at = 0;
    while at < rests.len() {
        let run = rests[at..].iter().take_while(|own| **own).count();
        if run < least {
            rests[at..at + run].fill(false);
        }
        at += run.max(1);
    }
    rests
}

/// Standard deviation of an axis.
fn spread(own: &[Vector3<f64>]) -> f64 {
    let mean = own.iter().sum::<Vector3<f64>>() / own.len() as f64;
    let square: f64 = own.iter().map(|one| (one - mean).norm_squared()).sum();
    (square / (3.0 * own.len() as f64)).sqrt()
}

/// The attitude of the first second: gravity exactly, then the field (Black 1964), both as the gyros see them stand still; without a field, any
/// heading.
pub fn first(samples: &Samples, model: &Model) -> UnitQuaternion<f64> {
    let t_s = &samples.rates.t_s;
    let last = t_s
        .partition_point(|own_s| *own_s < t_s[0] + FIRST_S)
        .min(t_s.len() - 1);
    let begin = UnitQuaternion::identity();
    let second = Node::of(samples, (0, last), begin, Calibration::default(), samples.step_s());
    let field_b = second.field.map_or_else(Vector3::zeros, |(field, ..)| field);
    let (up_n, field_n) = (-Vector3::z(), model.field_n_ut);
    let frame = |first: Vector3<f64>, second: Vector3<f64>| {
        let x = first.try_normalize(f64::EPSILON)?;
        let y = x.cross(&second).try_normalize(f64::EPSILON)?;
        Some(Matrix3::from_columns(&[x, y, x.cross(&y)]))
    };
    match (frame(up_n, field_n), frame(second.force_n, field_b)) {
        (Some(n), Some(b)) => UnitQuaternion::from_matrix(&(n * b.transpose())),
        _ => UnitQuaternion::rotation_between(&second.force_n, &up_n).unwrap_or_else(UnitQuaternion::identity),
    }
}
