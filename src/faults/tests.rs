//! What motion leaves unsure of the accelerometers: each term of it, by itself.

mod monitor;
pub(super) mod reference;

use nalgebra::ComplexField;

use super::*;
use crate::{
    calibration::{Channels, Ranges},
    unit::Settings,
};

/// \[s\] from cycle to cycle.
const DT_S: f32 = 0.2;
/// [m/s2] specific force at the centre.
const FORCE_B: Vector3<f32> = Vector3::new(0.5, -0.3, -9.8);
/// Relative rounding of differences of variances.
const ROUNDING: f32 = 0.02;

/// The nominal set, its accelerometers without biases: learning those would hide everything else.
fn nominal() -> Set {
    let mut set = Set::nominal(Ranges::of(&Settings::NOMINAL));
    set.uncertainty[0].bias = 1e-4;
    set
}

/// What a unit with this set measures at a rate and an angular acceleration, `read` being the gyros that answer.
fn measured(set: &Set, rate_b: Vector3<f32>, acceleration_b: Vector3<f32>, read: u16) -> Measured {
    let at_place =
        |place_b: Vector3<f32>| FORCE_B + acceleration_b.cross(&place_b) + rate_b.cross(&rate_b.cross(&place_b));
    let present = Channels::default()
        .with(Kind::Accelerometer, 0xFFF)
        .with(Kind::Magnetometer, 0xFFF)
        .with(Kind::Gyro, read);
    Measured {
        acc: core::array::from_fn(|k| set.acc[k].axis_b.dot(&at_place(set.place_b[k / 3]))),
        mag: core::array::from_fn(|k| set.mag[k].axis_b.dot(&Vector3::new(18.0, 0.0, -14.0))),
        gyro: core::array::from_fn(|k| set.gyro[k].axis_b.dot(&rate_b)),
        present,
        saturated: Channels::default(),
        temperature_held: false,
        gyros_above_c: [0.0; 4],
        beyond_validity: false,
    }
}

/// Specific force after two cycles at `from_b` [rad/s] and one at `to_b`.
fn force(set: &Set, from_b: Vector3<f32>, to_b: Vector3<f32>, read: u16) -> Solution {
    let mut monitor = Monitor::new(set);
    let mut step = |n: i16, rate_b: Vector3<f32>, acceleration_b: Vector3<f32>| {
        monitor
            .step(set, &distinct(n), &measured(set, rate_b, acceleration_b, read), DT_S)
            .force_b
    };
    step(1, from_b, Vector3::zeros());
    step(2, from_b, Vector3::zeros());
    step(3, to_b, (to_b - from_b) / DT_S)
}

/// By how much two sets differ in the variance of one axis's force: four plates share it.
fn apart(a: &Solution, b: &Solution) -> f32 {
    4.0 * (a.covariance_b.trace() - b.covariance_b.trace()) / 3.0
}

#[test]
fn the_force_is_that_at_the_centre_of_a_spinning_unit() {
    let (spin_b, faster_b) = (Vector3::new(2.0, -1.0, 4.0), Vector3::new(2.5, -1.0, 4.5));
    // Without taking out 21 rad2/s2 of squared rate, 42 mm long arms show one metre per second squared.
    for to_b in [spin_b, faster_b] {
        let found = force(&nominal(), spin_b, to_b, 0xF);
        assert!((found.vector_b - FORCE_B).norm() < 1e-4, "{found:?}");
        assert_eq!((found.used, found.known), (0xFFF, Known::All));
    }
}

#[test]
fn unsure_places_count_by_squared_rate_and_angular_acceleration() {
    let (exact, unsure) = (
        Set {
            place_sigma: 0.0,
            ..nominal()
        },
        Set {
            place_sigma: 0.01,
            ..nominal()
        },
    );
    let (spin_b, faster_b) = (Vector3::new(0.0, 0.0, 4.0), Vector3::new(0.0, 0.0, 5.0));
    let difference = |to_b| apart(&force(&unsure, spin_b, to_b, 0xF), &force(&exact, spin_b, to_b, 0xF));
    // Steady: place_sigma w^2. The arms' own noise term is in both.
    let steady = 0.01 * 16.0;
    let arm = arm_noise(0.0);
    let expected = (steady + arm) * (steady + arm) - arm * arm;
    assert!(
        (difference(spin_b) / expected - 1.0).abs() < ROUNDING,
        "{}",
        difference(spin_b)
    );
    // Faster by 5 rad/s2: place_sigma (w' + w^2), and the arms' lag of half the change of w'.
    let (moved, lag) = (0.01 * (5.0 + 25.0), longest_arm() * 2.5 + arm_noise(1.0));
    let expected = (moved + lag) * (moved + lag) - lag * lag;
    assert!(
        (difference(faster_b) / expected - 1.0).abs() < ROUNDING,
        "{}",
        difference(faster_b)
    );
}

fn longest_arm() -> f32 {
    nominal()
        .place_b
        .iter()
        .map(|place_b| place_b.norm())
        .fold(0.0, f32::max)
}

/// The nominal set with every plate at the centre, and with the plates at their known places.
fn without_and_with_arms() -> (Set, Set) {
    let placed = Set {
        place_sigma: 0.0,
        ..nominal()
    };
    let centred = Set {
        place_b: [Vector3::zeros(); PLATES],
        ..placed
    };
    (centred, placed)
}

/// A reading of a cycle in which no sensor repeats what it sent in the one before: what repeats itself is frozen.
fn distinct(cycle: i16) -> Reading {
    let mut reading = Reading::unread(cycle as u16);
    reading.acc_p = [[cycle; 3]; PLATES];
    reading.mag_p = [[cycle; 3]; PLATES];
    reading.gyro = [cycle; PLATES];
    reading
}

/// [m/s2] what the errors of two rates make of the longest arm, the rate having changed by `change` [rad/s] in a cycle.
fn arm_noise(change: f32) -> f32 {
    let (noise, gyro) = (nominal().gyro[0].noise, nominal().uncertainty[2]);
    let timing = GYRO_TIMING_S * change / DT_S;
    let variance =
        noise * noise + (gyro.scale * gyro.scale + gyro.direction * gyro.direction) * change * change + timing * timing;
    // Trace of the covariance of a rate by four gyros: 2/1.35 + 1/1.3.
    longest_arm() * ComplexField::sqrt(2.0 * variance * (2.0 / 1.35 + 1.0 / 1.3) / 3.0) / DT_S
}

#[test]
fn long_arms_count_by_what_is_not_known_of_the_angular_acceleration() {
    let (centred, placed) = without_and_with_arms();
    let (slow_b, fast_b) = (Vector3::new(0.0, 0.0, 1.0), Vector3::new(0.0, 0.0, 2.0));
    let difference = |from_b, to_b, read| {
        apart(
            &force(&placed, from_b, to_b, read),
            &force(&centred, from_b, to_b, read),
        )
    };
    let arm = arm_noise(0.0);
    assert!((difference(slow_b, slow_b, 0xF) / (arm * arm) - 1.0).abs() < ROUNDING);
    // 5 rad/s2 that were not there before are half an interval old.
    let lag = longest_arm() * 2.5 + arm_noise(1.0);
    assert!((difference(slow_b, fast_b, 0xF) / (lag * lag) - 1.0).abs() < ROUNDING);
    // With two gyros a rate of four turns a second may be missing, and its square, beside what is known of it.
    let axes_b: [Vector3<f32>; 2] = core::array::from_fn(|k| nominal().gyro[k].axis_b);
    let missing_along = axes_b[0].cross(&axes_b[1]).normalize();
    let known = (slow_b - missing_along * missing_along.dot(&slow_b)).norm();
    let missing = longest_arm() * UNKNOWN_RATE * (known + UNKNOWN_RATE + UNKNOWN_RATE);
    let ratio = difference(slow_b, slow_b, 0b0011) / (missing * missing);
    assert!((ratio - 1.0).abs() < ROUNDING, "{ratio}");
}

/// An angular acceleration that goes on is no lag: the arms are as unsure as their noise makes them.
#[test]
fn a_steady_angular_acceleration_has_no_lag() {
    let (centred, placed) = without_and_with_arms();
    let spun_up = |set: &Set| {
        let mut monitor = Monitor::new(set);
        let acceleration_b = Vector3::new(0.0, 0.0, 2.0);
        let mut last = None;
        for n in 0..4_i16 {
            let reading = distinct(n);
            let rate_b = acceleration_b * (DT_S * f32::from(n));
            let given = measured(set, rate_b, acceleration_b, 0xF);
            last = Some(monitor.step(set, &reading, &given, DT_S).force_b);
        }
        last.expect("a cycle")
    };
    let difference = apart(&spun_up(&placed), &spun_up(&centred));
    // What it was a cycle before, in both: scale and timing of the gyros by the change of the rate, and no half of a change of 2 rad/s2.
    let lag = longest_arm() * 1.0;
    assert!(difference < 0.2 * lag * lag, "{difference} {lag}");
}

/// Sampling instants are unsure by milliseconds: at a rate each sensor has seen the force from where it was then.
#[test]
fn a_rate_makes_the_force_as_unsure_as_its_instants() {
    let centred = Set {
        place_b: [Vector3::zeros(); PLATES],
        place_sigma: 0.0,
        ..nominal()
    };
    let still = force(&centred, Vector3::zeros(), Vector3::zeros(), 0xF);
    let at = |rate: f32, read: u16| {
        let rate_b = Vector3::new(0.0, 0.0, rate);
        apart(&force(&centred, rate_b, rate_b, read), &still)
    };
    for rate in [0.5, 2.0] {
        let unsure = ACC_TIMING_S * rate * FORCE_B.norm();
        let ratio = at(rate, 0xF) / (unsure * unsure);
        assert!((ratio - 1.0).abs() < ROUNDING, "{rate}: {ratio}");
    }
    // What may be missing of the rate counts as well.
    let axes_b: [Vector3<f32>; 2] = core::array::from_fn(|k| nominal().gyro[k].axis_b);
    let missing_along = axes_b[0].cross(&axes_b[1]).normalize();
    let rate_b = Vector3::new(0.0, 0.0, 2.0);
    let known = (rate_b - missing_along * missing_along.dot(&rate_b)).norm();
    let unsure = ACC_TIMING_S * (known + UNKNOWN_RATE) * FORCE_B.norm();
    let ratio = at(2.0, 0b0011) / (unsure * unsure);
    assert!((ratio - 1.0).abs() < ROUNDING, "{ratio}");
}
