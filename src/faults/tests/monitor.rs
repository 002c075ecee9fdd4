//! All sensors together: which of them repeat themselves, what the vectors are taken for, and who is asked when.

use super::*;
use crate::{
    calibration::{CHANNELS, Channel},
    draws::{Draws, near},
    faults::tests::reference::of,
};

const RATE_B: Vector3<f32> = Vector3::new(0.1, -0.2, 0.3);

/// Cycles of a unit in which nothing repeats itself; `change` has the last word on each.
fn fly(monitor: &mut Monitor, set: &Set, cycles: i16, change: impl Fn(i16, &mut Reading, &mut Measured)) -> Vectors {
    let mut last = None;
    for n in 0..cycles {
        let mut reading = distinct(n);
        let mut measured = measured(set, RATE_B, Vector3::zeros(), 0xF);
        change(n, &mut reading, &mut measured);
        last = Some(monitor.step(set, &reading, &measured, DT_S));
    }
    last.expect("a cycle")
}

/// Each sensor by itself repeats its counts: it is frozen, its axes have that verdict and are not used, and no other's.
#[test]
fn a_sensor_that_repeats_itself_is_frozen() {
    let set = nominal();
    for sensor in 0..12 {
        let (kind, plate) = (sensor / 4, sensor % 4);
        let mut monitor = Monitor::new(&set);
        let vectors = fly(&mut monitor, &set, 60, |_, reading, _| match kind {
            0 => reading.acc_p[plate] = [7; 3],
            1 => reading.mag_p[plate] = [7; 3],
            _ => reading.gyro[plate] = 7,
        });
        for n in 0..CHANNELS as u8 {
            let channel = Channel(n);
            let of_it = [Kind::Accelerometer, Kind::Magnetometer, Kind::Gyro][kind] == channel.kind();
            let is_frozen = of_it && channel.plate() == plate;
            let expected = if is_frozen { Verdict::Frozen } else { Verdict::Sound };
            assert_eq!(monitor.verdict(channel), expected, "{sensor} {n}");
            assert_eq!(vectors.health.uses(channel), !is_frozen, "{sensor} {n}");
        }
        // The same counts in all axes of a sensor, but for one of them, or one axis not read: it is not.
        let mut moves = Monitor::new(&set);
        let vectors = fly(&mut moves, &set, 60, |n, reading, measured| match kind {
            0 => reading.acc_p[plate] = [7, 7, n],
            1 => reading.mag_p[plate] = [n, 7, 7],
            _ => measured.present = measured.present.with(Kind::Thermometer, 0),
        });
        assert_eq!(vectors.health.unused_channels(), Channels::default(), "{sensor}");
        if kind < 2 {
            let mut unread = Monitor::new(&set);
            fly(&mut unread, &set, 60, |_, reading, measured| {
                let channel = Channel::of([Kind::Accelerometer, Kind::Magnetometer][kind], 3 * plate + 1);
                measured.present = Channels(measured.present.0 & !(1 << channel.0));
                match kind {
                    0 => reading.acc_p[plate] = [7; 3],
                    _ => reading.mag_p[plate] = [7; 3],
                }
            });
            let first = Channel((12 * kind + 3 * plate) as u8);
            assert_eq!(unread.verdict(first), Verdict::Sound, "{sensor}");
        }
    }
}

/// A calibration is in doubt by either of two reasons.
#[test]
fn the_calibration_is_in_doubt_by_its_temperature_or_its_validity() {
    let set = nominal();
    for (held, beyond) in [(false, false), (true, false), (false, true), (true, true)] {
        let vectors = fly(&mut Monitor::new(&set), &set, 2, |_, _, measured| {
            (measured.temperature_held, measured.beyond_validity) = (held, beyond);
        });
        assert_eq!(vectors.health.contains(SensorHealth::CALIBRATION), held || beyond);
    }
}

/// A direction is a unit vector with the variance of either angle, if all of it is known and it is known well.
#[test]
fn a_direction_has_the_variance_of_its_angles() {
    let solution = |vector_b: Vector3<f32>, variance: f32| Solution {
        vector_b,
        covariance_b: Matrix3::from_diagonal(&Vector3::new(0.5, 1.0, 1.5)) * variance,
        known: Known::All,
        used: 0xFFF,
    };
    let mut draws = Draws::of(1);
    for _ in 0..100 {
        let (vector_b, variance, turned) = (draws.vector(10.0), draws.within(0.0, 0.2), draws.within(0.0, 0.08));
        let expected = of(variance) / vector_b.cast::<f64>().norm_squared() + of(turned).powi(2);
        let found = direction(&solution(vector_b, variance), turned);
        if (expected / 0.01 - 1.0).abs() < 1e-3 {
            continue;
        }
        assert_eq!(found.is_some(), expected < 0.01, "{expected}");
        if let Some(found) = found {
            assert!(near(found.variance, expected, 1e-4, 0.0));
            assert!((found.along_b.cast::<f64>() - vector_b.cast::<f64>().normalize()).norm() < 1e-5);
        }
    }
    assert!(direction(&solution(Vector3::zeros(), 0.0), 0.0).is_none());
    let flat = Solution {
        known: Known::Nothing,
        ..solution(Vector3::x(), 0.0)
    };
    assert!(direction(&flat, 0.0).is_none() && direction(&solution(Vector3::x(), 0.0), 0.0).is_some());
}

/// Cycles until a gyro that is off by `bias` \[rad/s\] is out, of a unit at rest, whose vectors turn as they should.
fn named_after(
    set: &Set,
    plate: usize,
    bias: f32,
    known: Option<f32>,
    change: impl Fn(i16, &mut Measured),
) -> Option<i16> {
    let mut monitor = Monitor::new(set);
    let mut draws = Draws::of(plate as u64);
    // What a filter knows of the bias of the rate is not held against a gyro.
    let bias_b = known.map_or_else(Vector3::zeros, |_| Vector3::new(0.02, -0.01, 0.015));
    for n in 0..600 {
        let reading = distinct(n);
        let mut measured = measured(set, bias_b, Vector3::zeros(), 0xF);
        // At rest the force is that at the centre.
        let still = self::measured(set, Vector3::zeros(), Vector3::zeros(), 0xF);
        measured.acc = still.acc;
        for (k, value) in measured.gyro.iter_mut().enumerate() {
            *value += set.gyro[k].noise * draws.within(-1.0, 1.0);
        }
        if n > 100 {
            // It creeps there within seconds, so that it does not leap.
            measured.gyro[plate] += bias * (f32::from(n - 100) / 50.0).min(1.0);
        }
        change(n, &mut measured);
        if let Some(sigma) = known {
            monitor.know_bias(bias_b, sigma);
        }
        let vectors = monitor.step(set, &reading, &measured, DT_S);
        let out = monitor.verdict(Channel(24 + plate as u8)) != Verdict::Sound;
        if out {
            // And no gyro but it.
            let unused = vectors.health.unused_channels();
            assert_eq!(unused.0 >> 24 & !(1 << plate), 0, "{n}");
            return Some(n - 100);
        }
    }
    None
}

#[test]
fn the_vectors_name_the_gyro_that_creeps() {
    let mut set = nominal();
    set.uncertainty[2].bias = 0.002;
    for plate in 0..PLATES {
        let named = named_after(&set, plate, 0.06, Some(1e-4), |_, _| {});
        assert!(
            named.is_some_and(|after| (10..150).contains(&after)),
            "{plate}: {named:?}"
        );
    }
    // In free fall and without a field nothing is asked of them.
    let nothing = |_: i16, measured: &mut Measured| {
        measured.acc = [0.01; 12];
        measured.present = Channels(measured.present.0 & !(0xFFF << 12));
    };
    assert_eq!(named_after(&set, 1, 0.06, Some(1e-4), nothing), None);
    // Field alone, where force is not gravity's and turns as it likes.
    let climbing = |n: i16, measured: &mut Measured| {
        let (sin, cos) = ComplexField::sin_cos(0.02 * f32::from(n));
        let force_b = Vector3::new(25.0 * cos, 25.0 * sin, -5.0);
        measured.acc = core::array::from_fn(|k| set.acc[k].axis_b.dot(&force_b));
    };
    let named = named_after(&set, 1, 0.06, Some(1e-4), climbing);
    assert!(named.is_some_and(|after| after < 400), "{named:?}");
    // Force alone, without a field.
    let no_field = |_: i16, measured: &mut Measured| {
        measured.present = Channels(measured.present.0 & !(0xFFF << 12));
    };
    let named = named_after(&set, 1, 0.06, Some(1e-4), no_field);
    assert!(named.is_some_and(|after| after < 400), "{named:?}");
    // As long as nobody knows the bias better than the calibration a small fault is not isolable.
    set.uncertainty[2].bias = 0.05;
    assert!(named_after(&set, 1, 0.06, Some(1e-4), |_, _| {}).is_some());
    assert_eq!(named_after(&set, 1, 0.06, None, |_, _| {}), None);
}

/// An interval is one above zero and below a second; otherwise there is no angular acceleration, and nothing else changes.
#[test]
fn an_interval_that_is_none_is_a_gap() {
    let set = nominal();
    for (dt_s, is) in [
        (0.2, true),
        (0.999, true),
        (1.0, false),
        (0.0, false),
        (-0.2, false),
        (f32::NAN, false),
    ] {
        let mut monitor = Monitor::new(&set);
        let step = |monitor: &mut Monitor, n: i16, rate_b: Vector3<f32>, dt_s: f32| {
            let reading = distinct(n);
            monitor.step(&set, &reading, &measured(&set, rate_b, Vector3::zeros(), 0xF), dt_s)
        };
        step(&mut monitor, 1, Vector3::zeros(), DT_S);
        step(&mut monitor, 2, RATE_B, dt_s);
        let found = monitor.last.expect("a cycle").acceleration_b;
        let expected = if is { RATE_B / dt_s } else { Vector3::zeros() };
        assert!((found - expected).norm() < 1e-3, "{dt_s}: {found}");
    }
}

/// And of a unit that turns steadily: its directions are the less sure the faster it turns, and still tell. Force alone, field alone.
#[test]
fn the_vectors_name_the_gyro_that_creeps_of_a_unit_that_turns() {
    let mut set = nominal();
    set.uncertainty[2].bias = 0.002;
    for by_force in [true, false] {
        let turns_b = Vector3::new(0.3, 0.2, 0.4);
        let change = |n: i16, measured: &mut Measured| {
            // Where it has turned to since the beginning.
            let turned = nalgebra::Rotation3::from_scaled_axis(turns_b * (-DT_S * f32::from(n)));
            let (force_b, field_b) = (turned * FORCE_B, turned * Vector3::new(18.0, 0.0, -14.0));
            let force_b = if by_force { force_b } else { FORCE_B * 3.0 };
            measured.acc = core::array::from_fn(|k| set.acc[k].axis_b.dot(&force_b));
            measured.mag = core::array::from_fn(|k| set.mag[k].axis_b.dot(&field_b));
            if by_force {
                measured.present = Channels(measured.present.0 & !(0xFFF << 12));
            }
            for (value, axis) in measured.gyro.iter_mut().zip(&set.gyro) {
                *value += axis.axis_b.dot(&turns_b);
            }
        };
        let named = named_after(&set, 1, 0.1, Some(1e-4), change);
        assert!(named.is_some_and(|after| after < 400), "{by_force}: {named:?}");
    }
}
