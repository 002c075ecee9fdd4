//! A cycle's rotation through the calibration: the gyros' integrals, each with its own scale, bias and axis.
//!
//! In: [`Increments`], the parameter [`Set`], and the gyros that are believed. Out: the rotation vector of b, its white
//! variance, the time it covers.
//!
//! ```text
//! angle_k = scale_k (integral_k - bias_k t)        angle_b = increments' angle_b + C angle - N nominal angle
//! ```
//!
//! with `C` and `N` least squares over the gyros by calibrated and by nominal geometry. The increments have what needs
//! every fast sample: coning, and the right matrix where a gyro missed some. The calibration only corrects it, by parts of
//! a hundred, and the error of that is of second order.
//!
//! Where a gyro had a part in the increments that is not believed or stood at the end of its range, they are not used:
//! `angle_b = C angle` over the believed ones that missed no sample. With fewer than three of those free of saturation all
//! are used, and the rotation is said to be a lower bound. Refuses (by covering no time) fewer than three believed gyros.

use nalgebra::{Matrix3, SMatrix, Vector3, Vector4};

use crate::{
    calibration::Set,
    geometry::{PLATES, rate_from_gyros},
    increments::{GyroCycle, Increments},
    redundancy::matrix,
    sample::Kind,
    sensor::adis16265::RANGE_COUNTS,
};

/// What b turned by in a cycle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Turn {
    /// \[rad\] rotation vector in b.
    pub angle_b: Vector3<f32>,
    /// \[rad2\] white variance of a component.
    pub variance: f32,
    /// \[s\] time it covers; 0 if nothing is known.
    pub covered_s: f32,
    /// It is a lower bound.
    pub saturated: bool,
}

/// Least squares over some gyros, and its covariance for a variance of one: found anew only when they are others.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Solver {
    gyros: u16,
    found: Option<(SMatrix<f32, 3, PLATES>, Matrix3<f32>)>,
}

impl Solver {
    fn of(&mut self, set: &Set, gyros: u16) -> Option<&(SMatrix<f32, 3, PLATES>, Matrix3<f32>)> {
        if self.gyros != gyros {
            let found = matrix(&set.gyro.map(|axis| axis.axis_b), gyros);
            *self = Solver { gyros, found };
        }
        self.found.as_ref()
    }
}

/// The rotation of a cycle by the gyros whose bit in `believed` is set, each so far above the reference temperature \[degC\].
pub(super) fn turn(
    set: &Set,
    above_c: &[f32; PLATES],
    increments: &Increments,
    believed: u16,
    solver: &mut Solver,
) -> Turn {
    let covered_s = increments.covered_us as f32 * 1e-6;
    let samples = increments.gyro.iter().fold(0, |most, gyro| most.max(gyro.count));
    let which = |is: &dyn Fn(&GyroCycle) -> bool| {
        let each = increments.gyro.iter().enumerate();
        each.fold(0_u16, |bits, (k, gyro)| bits | u16::from(is(gyro)) << k)
    };
    let seen = which(&|gyro| gyro.count > 0);
    let whole = which(&|gyro| gyro.count == samples) & seen & believed;
    let clipped =
        which(&|gyro| gyro.least.unsigned_abs().max(gyro.most.unsigned_abs()) >= RANGE_COUNTS.unsigned_abs()) & seen;
    let sound = seen & believed & !clipped;
    let saturated = clipped != 0 && (whole & !clipped).count_ones() < 3;
    let used = match (sound == seen, saturated) {
        (true, _) => seen,
        (false, true) => whole,
        (false, false) => whole & !clipped,
    };
    let angles = calibrated(set, above_c, increments, covered_s);
    let finite = angles.iter().all(|angle| angle.abs() <= f32::MAX);
    let (Some((matrix, covariance_b)), true) = (solver.of(set, used), finite && covered_s > 0.0) else {
        return Turn {
            angle_b: Vector3::zeros(),
            variance: 0.0,
            covered_s: 0.0,
            saturated,
        };
    };
    let beyond = if sound == seen {
        beyond_integrals(set, increments, used)
    } else {
        Vector3::zeros()
    };
    let noise = set.gyro.iter().map(|axis| axis.noise * axis.noise).sum::<f32>() / PLATES as f32;
    let sampled_s = covered_s / f32::from(samples);
    Turn {
        angle_b: matrix * Vector4::from(angles) + beyond,
        variance: noise * sampled_s * covered_s * covariance_b.trace() / 3.0,
        covered_s,
        saturated,
    }
}

/// \[rad\] each gyro about its own axis.
fn calibrated(set: &Set, above_c: &[f32; PLATES], increments: &Increments, covered_s: f32) -> [f32; PLATES] {
    core::array::from_fn(|k| {
        let (axis, above_c) = (&set.gyro[k], above_c[k]);
        axis.scale_at(above_c) * (increments.gyro[k].integral_counts_s - axis.bias_counts_at(above_c) * covered_s)
    })
}

/// What the increments' rotation has beyond the integrals of these gyros, both by nominal geometry.
fn beyond_integrals(set: &Set, increments: &Increments, gyros: u16) -> Vector3<f32> {
    let Some(matrix) = rate_from_gyros(gyros as u8) else {
        return Vector3::zeros();
    };
    let integrals = Vector4::from(increments.gyro.map(|gyro| gyro.integral_counts_s));
    let nominal_b = matrix * integrals * set.ranges.nominal_scale(Kind::Gyro);
    Vector3::from(increments.angle_b) - nominal_b
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        calibration::{Axis, Ranges},
        geometry::gyro_axes_b,
        increments::{Fast, Integrator},
        sample::NOT_READ,
        unit::Settings,
    };

    const ALL: u16 = 0b1111;
    /// \[rad\] half a count on each gyro for 0.2 s.
    const ROUNDING: f32 = 0.07326 * core::f32::consts::PI / 180.0 * 0.2;

    fn nominal() -> Set {
        Set::nominal(Ranges::of(&Settings::NOMINAL))
    }

    /// What a unit whose gyros are as `set` says integrates in 0.2 s at a constant rate.
    fn increments(set: &Set, rate_b: Vector3<f32>) -> Increments {
        let scale = nominal().ranges.nominal_scale(Kind::Gyro);
        let counts = set.gyro.map(|axis| {
            let exact = axis.axis_b.dot(&rate_b) / axis.scale + axis.bias_counts;
            nalgebra::ComplexField::round(exact).clamp(-4368.0, 4368.0) as i16
        });
        let mut integrator = Integrator::new(scale);
        for sample in 0..=20 {
            integrator.add(Fast {
                at_us: 10_000 * sample,
                counts,
            });
        }
        integrator.take()
    }

    /// Scales a percent off, axes tilted, biases of up to twenty counts.
    fn calibrated() -> Set {
        let mut set = nominal();
        for (k, axis) in set.gyro.iter_mut().enumerate() {
            let tilted = axis.axis_b + Vector3::new(0.01, -0.008, 0.012) * k as f32;
            *axis = Axis {
                axis_b: tilted.normalize(),
                scale: axis.scale * (1.01 - 0.005 * k as f32),
                bias_counts: 20.0 - 10.0 * k as f32,
                ..*axis
            };
        }
        set
    }

    fn turned(set: &Set, increments: &Increments, believed: u16) -> Turn {
        turn(set, &[0.0; PLATES], increments, believed, &mut Solver::default())
    }

    #[test]
    fn with_nominal_parameters_the_increments_come_back() {
        let increments = increments(&nominal(), Vector3::new(0.5, -1.0, 2.0));
        let turn = turned(&nominal(), &increments, ALL);
        assert!((turn.angle_b - Vector3::from(increments.angle_b)).norm() < 1e-6);
        assert_eq!((turn.covered_s, turn.saturated), (0.2, false));
    }

    #[test]
    fn scales_biases_and_axes_of_the_unit_are_undone() {
        let rate_b = Vector3::new(0.5, -1.0, 2.0);
        let increments = increments(&calibrated(), rate_b);
        let off = |set: &Set| (turned(set, &increments, ALL).angle_b - rate_b * 0.2).norm();
        assert!(off(&calibrated()) < ROUNDING, "{}", off(&calibrated()));
        assert!(off(&nominal()) > 5.0 * ROUNDING, "{}", off(&nominal()));
    }

    #[test]
    fn a_gyro_that_is_not_believed_has_no_part() {
        let rate_b = Vector3::new(0.5, -1.0, 2.0);
        let mut increments = increments(&nominal(), rate_b);
        increments.gyro[2].integral_counts_s += 500.0;
        increments.angle_b[0] += 1.0;
        let turn = turned(&nominal(), &increments, 0b1011);
        assert!((turn.angle_b - rate_b * 0.2).norm() < ROUNDING, "{turn:?}");
        assert_eq!(turned(&nominal(), &increments, 0b0011).covered_s, 0.0);
    }

    #[test]
    fn a_missed_sample_costs_the_rotation_nothing() {
        let rate_b = Vector3::new(0.5, -1.0, 2.0);
        let counts = nominal()
            .gyro
            .map(|axis| (axis.axis_b.dot(&rate_b) / axis.scale) as i16);
        let mut integrator = Integrator::new(nominal().ranges.nominal_scale(Kind::Gyro));
        for sample in 0..=20 {
            let mut counts = counts;
            // Two gyros miss one each, at different times: no three have them all.
            for (plate, missed) in [(0, 5), (2, 11)] {
                counts[plate] = if sample == missed { NOT_READ } else { counts[plate] };
            }
            integrator.add(Fast {
                at_us: 10_000 * sample,
                counts,
            });
        }
        let turn = turned(&nominal(), &integrator.take(), ALL);
        assert!((turn.angle_b - rate_b * 0.2).norm() < 2.0 * ROUNDING, "{turn:?}");
    }

    #[test]
    fn one_saturated_gyro_is_left_out_and_two_make_a_lower_bound() {
        // Gyro 4 looks along z: six radians a second are beyond its 5.6. Gyros 1 to 3 see a third of it.
        let spin_b = Vector3::new(0.1, 0.0, 6.0);
        let one = turned(&nominal(), &increments(&nominal(), spin_b), ALL);
        assert!(
            (one.angle_b - spin_b * 0.2).norm() < ROUNDING && !one.saturated,
            "{one:?}"
        );
        let fast_b = Vector3::new(9.0, 0.0, 9.0);
        let two = turned(&nominal(), &increments(&nominal(), fast_b), ALL);
        assert!(two.saturated && two.covered_s > 0.0, "{two:?}");
        assert!(two.angle_b.norm() < fast_b.norm() * 0.2);
    }

    #[test]
    fn the_noise_of_an_increment_is_that_of_twenty_samples() {
        let set = nominal();
        let gyro_axes_b = gyro_axes_b();
        let each = (gyro_axes_b.transpose() * gyro_axes_b)
            .try_inverse()
            .expect("they span space")
            .trace()
            / 3.0;
        let turn = turned(&set, &increments(&set, Vector3::zeros()), ALL);
        // 21 samples of 0.00344 rad/s, 0.2 s together.
        let expected = each * 0.00344 * 0.00344 * 0.2 * 0.2 / 21.0;
        assert!((turn.variance / expected - 1.0).abs() < 1e-3, "{turn:?} {expected}");
    }
}
