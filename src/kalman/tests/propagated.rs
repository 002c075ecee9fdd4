//! One step of the gyros, and samples at their own instants, in f64.

use super::*;
use crate::{
    draws::{Draws, near},
    kalman::path,
};

fn of(x: f32) -> f64 {
    f64::from(x)
}

fn v(vector: &Vector3<f32>) -> Vector3<f64> {
    vector.cast()
}

/// A filter in the middle of nothing, everything it knows of the gyros drawn.
fn drawn(draws: &mut Draws) -> Filter {
    let mut filter = Filter::new(Params {
        earth_rate_n: draws.vector(0.05),
        angle_noise: 0.01,
        turn_noise: 0.02,
        gap_rate_sd: 0.3,
        saturated_rate_sd: 0.4,
        ..params()
    });
    filter.q_nb = draws.attitude();
    filter.bias_b = draws.vector(0.05);
    filter.gyro_matrix = Matrix3::from_fn(|_, _| draws.within(-0.05, 0.05));
    filter.rate_b = draws.vector(1.0);
    filter.silent_s = draws.one_of([0.0, 0.2]);
    filter.gyro_b = draws.one_of([true, false]).then(|| draws.vector(1.0));
    filter
}

#[test]
fn a_step_turns_the_attitude_and_adds_the_variance_of_what_is_not_known() {
    for seed in 0..400 {
        let mut draws = Draws::of(seed);
        let before = drawn(&mut draws);
        let params = before.params;
        let covered_s = draws.within(0.05, 0.2);
        let gap_s = draws.one_of([0.0, 4e-4, 6e-4, 0.15]);
        let rotation = draws.below(4) > 0;
        let turning = draws.one_of([0.02, 1.0]);
        let mut step = World::new(UnitQuaternion::identity(), params).step(draws.vector(5.0));
        step.angle_b = draws.vector(turning);
        step.angle_variance = draws.within(0.0, 1e-3);
        step.saturated = draws.below(2) == 0;
        let mut filter = before.clone();
        filter.propagate(&step, covered_s, gap_s, rotation);
        let gyro_b = if rotation { step.angle_b } else { Vector3::zeros() };
        let (matrix, bias_b) = (before.gyro_matrix.cast::<f64>(), v(&before.bias_b));
        let bridged_b = v(&before.rate_b) * of(gap_s);
        let q: UnitQuaternion<f64> = before.q_nb.cast();
        let began = q * UnitQuaternion::from_scaled_axis(bridged_b);
        // The rates at both ends say how the turn bends, unless there was a gap between them.
        let rates_b = before
            .gyro_b
            .filter(|_| gap_s < 5e-4)
            .map(|began_b| [began_b, step.rate_b]);
        let (_, mean) = path::through(&began.cast(), &gyro_b, rates_b, covered_s);
        let wrong_b = matrix * v(&gyro_b) + bias_b * of(covered_s);
        let moved_n = mean.cast::<f64>() * wrong_b + v(&params.earth_rate_n) * of(covered_s + gap_s);
        let expected =
            UnitQuaternion::from_scaled_axis(-moved_n) * began * UnitQuaternion::from_scaled_axis(v(&gyro_b));
        assert!(filter.q_nb.cast::<f64>().angle_to(&expected) < 3e-5, "{seed}");
        for axis in 0..3 {
            for k in 0..3 {
                let drive = -of(mean[(axis, k)]) * of(covered_s);
                assert!(near(filter.window.drive[axis][k], drive, 1e-4, 1e-5), "{seed}");
            }
        }
        let silent_s = of(before.silent_s + gap_s);
        let mut variance = of(params.angle_noise).powi(2) * of(covered_s + gap_s)
            + of(params.turn_noise).powi(2) * (v(&gyro_b) - wrong_b + bridged_b).norm()
            + of(params.gap_rate_sd).powi(2) * (silent_s.powi(2) - of(before.silent_s).powi(2));
        if rotation {
            variance += of(step.angle_variance);
            let rate_b = v(&step.rate_b) - matrix * v(&step.rate_b) - bias_b;
            assert!((v(&filter.rate_b) - rate_b).norm() < 1e-5, "{seed}");
        } else {
            assert_eq!(filter.rate_b, before.rate_b);
        }
        if step.saturated {
            variance += (of(params.saturated_rate_sd) * of(covered_s)).powi(2);
        }
        assert!(near(filter.window.angle_variance, variance, 1e-4, 1e-9), "{seed}");
        let (of_gyros, silent_s) = if rotation {
            (step.angle_variance, 0.0)
        } else {
            (0.0, before.silent_s + gap_s)
        };
        assert_eq!(
            (filter.window.gyro_variance, filter.silent_s),
            (of_gyros, silent_s),
            "{seed}"
        );
        assert_eq!(filter.gyro_b, rotation.then_some(step.rate_b));
        assert!(near(filter.window.duration_s, of(covered_s + gap_s), 1e-5, 0.0));
    }
}

/// Samples before and after the end of the step, with delays of all sensors, are carried to n by the attitude at their own instant;
/// those a window away are left out.
#[test]
fn samples_are_carried_by_the_attitude_of_their_instant() {
    let (mut taken, mut left) = (0, 0);
    for seed in 0..300 {
        let mut draws = Draws::of(seed);
        let mut filter = drawn(&mut draws);
        filter.params.delays = Delays {
            gyro_s: draws.within(0.0, 0.05),
            acc_s: draws.within(0.0, 0.05),
            mag_s: draws.within(0.0, 0.05),
        };
        let longest_us = draws.one_of([100_000, 1_100_000]);
        let at = |draws: &mut Draws, at_us: u64| {
            let off_us = draws.below(longest_us);
            if draws.below(2) == 0 {
                at_us - off_us
            } else {
                at_us + off_us
            }
        };
        let mut step = World::new(UnitQuaternion::identity(), params()).step(Vector3::zeros());
        step.at_us = 9_000_000;
        let sampled = |draws: &mut Draws| {
            let value_b = draws.vector(9.0);
            Sampled {
                value_b,
                variance: 0.5,
                scatter: 0.0,
                at_us: at(draws, 9_000_000),
            }
        };
        let (acc, mag) = (sampled(&mut draws), sampled(&mut draws));
        (step.acc, step.mag) = (Some(acc), Some(mag));
        let dcm = crate::attitude::dcm_nb(&filter.q_nb);
        filter.gather(&step, &dcm);
        let delays = filter.params.delays;
        let offset_s =
            |sampled: &Sampled, delay_s: f32| (sampled.at_us as f64 - 9e6) * 1e-6 + of(delays.gyro_s) - of(delay_s);
        let in_n = |sampled: &Sampled, offset_s: f64| {
            let turned = UnitQuaternion::from_scaled_axis(v(&filter.rate_b) * offset_s);
            filter.q_nb.cast::<f64>() * turned * v(&sampled.value_b)
        };
        let acc_n = filter.window.means(&filter.params, false).acc_n;
        let mag_n = filter
            .window
            .field()
            .if_any()
            .map(|sums| sums.mean(&Vector3::zeros()).mag_n);
        let of_acc = offset_s(&acc, delays.acc_s);
        let of_mag = offset_s(&mag, delays.mag_s);
        let window_s = of(filter.params.window_s);
        for (offset_s, found, sampled) in [
            (of_acc, Some(acc_n).filter(|acc_n| acc_n.norm() > 0.0), acc),
            (of_mag, mag_n, mag),
        ] {
            assert!((offset_s.abs() - window_s).abs() > 1e-4, "no seed is on the edge");
            let Some(found) = found else {
                left += 1;
                assert!(offset_s.abs() > window_s, "{seed}: {offset_s}");
                continue;
            };
            taken += 1;
            assert!(offset_s.abs() < window_s, "{seed}: {offset_s}");
            let off = (v(&found) - in_n(&sampled, offset_s)).norm();
            assert!(off < 2e-4, "{seed}: {off}");
        }
    }
    assert!(taken > 300 && left > 20, "{taken} {left}");
}

/// What is not believed of a sample leaves it out, and the step counts all the same.
#[test]
fn an_unbelievable_sample_is_left_out() {
    let mut filter = Filter::new(params());
    let mut step = World::new(tilted(), params()).step(Vector3::zeros());
    step.acc.as_mut().unwrap().variance = f32::NAN;
    step.mag.as_mut().unwrap().value_b.x = f32::INFINITY;
    filter.take(&step, &mut Outcome::default());
    let means = filter.window.means(&params(), false);
    assert_eq!((means.acc_n, filter.window.field().count), (Vector3::zeros(), 0.0));
    assert_eq!(means.duration_s, STEP_S);
}
