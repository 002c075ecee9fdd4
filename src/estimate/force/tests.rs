use nalgebra::{ComplexField, UnitQuaternion};

use super::*;
use crate::{
    attitude::from_rotation_vector,
    calibration::Ranges,
    increments::{Increments, Integrator},
    sample::NOT_READ,
    unit::Settings,
};

/// \[s\] from the first reading to the packet's, and between readings.
const APART_S: f32 = 0.066;
const ALL: u16 = 0xFFF;
const GRAVITY_N: Vector3<f32> = Vector3::new(0.0, 0.0, -9.81);
const RATE_B: Vector3<f32> = Vector3::new(1.2, -0.8, 1.5);

/// A unit whose accelerometers are not nominal.
fn set() -> Set {
    let mut set = Set::nominal(Ranges::of(&Settings::NOMINAL));
    for (k, axis) in set.acc.iter_mut().enumerate() {
        axis.bias_counts = 40.0 - 7.0 * k as f32;
        axis.scale *= 1.0 + 0.01 * (k % 5) as f32;
    }
    set
}

fn counts(set: &Set, force_b: &Vector3<f32>) -> [[i16; 3]; 4] {
    let along = set
        .acc
        .map(|axis| ComplexField::round(axis.axis_b.dot(force_b) / axis.scale + axis.bias_counts) as i16);
    core::array::from_fn(|plate| core::array::from_fn(|k| along[3 * plate + k]))
}

/// Force in b at the packet, by a unit that turns at `RATE_B` and whose gyros see `seen_b`, after
/// the pushes in n at the two readings and the packet; `spoil` may change what was read between.
fn mean(seen_b: Vector3<f32>, pushes_n: [f32; 3], spoil: impl Fn(&mut Increments)) -> Sampled {
    let set = set();
    let force_b = |reading: usize| {
        let turned = from_rotation_vector(RATE_B * APART_S * (reading as f32 + 1.0));
        turned.inverse_transform_vector(&(GRAVITY_N + Vector3::x() * pushes_n[reading]))
    };
    let mut increments = Integrator::new(1.0).take();
    for (reading, force) in increments.forces.iter_mut().enumerate() {
        let begun_s = APART_S * (reading as f32 + 1.0);
        *force = Force {
            acc_p: counts(&set, &force_b(reading)),
            angle_b: (seen_b * (begun_s - 0.006)).into(),
            covered_us: ((begun_s - 0.006) * 1e6) as u32,
            after_us: 6_000,
        };
    }
    increments.covered_us = (3.0 * APART_S * 1e6) as u32 - 4_000;
    let covered_s = increments.covered_us as f32 * 1e-6;
    increments.angle_b = (seen_b * covered_s).into();
    spoil(&mut increments);
    let before_b = GRAVITY_N;
    let mut averager = Averager::EMPTY;
    let known = Solution {
        vector_b: before_b,
        known: Known::All,
        used: ALL,
        ..Solution::NOTHING
    };
    averager.begin(&counts(&set, &before_b), &known, &set);
    averager.complete(1, &increments.forces, &set);
    let mut force = Sampled {
        value_b: force_b(2),
        variance: 3e-4,
        scatter: 0.0,
        at_us: 0,
    };
    let turn = Turn {
        calibrated_b: RATE_B * covered_s,
        nominal_b: increments.angle_b,
        since_b: RATE_B * 0.004,
        covered_s,
    };
    averager.average(&mut force, ALL, &turn);
    force
}

fn at_the_packet(push_n: f32) -> Vector3<f32> {
    let turned: UnitQuaternion<f32> = from_rotation_vector(RATE_B * 3.0 * APART_S);
    turned.inverse_transform_vector(&(GRAVITY_N + Vector3::x() * push_n))
}

/// [m/s2] half a count on each of twelve axes, and the third order of the rotations.
const ROUNDING: f32 = 0.02;

#[test]
fn what_stands_still_is_seen_alike_by_a_unit_that_turns() {
    let force = mean(RATE_B, [0.0; 3], |_| {});
    let force_b = force.value_b;
    assert!((force_b - at_the_packet(0.0)).norm() < ROUNDING, "{force_b}");
    assert!((force.variance - 1e-4).abs() < 1e-9);
    assert_eq!(force.scatter, 0.0);
    // As it is without turning what was read.
    let unturned = |increments: &mut Increments| {
        let angle_b = increments.angle_b;
        increments.forces.iter_mut().for_each(|force| force.angle_b = angle_b);
    };
    let force_b = mean(RATE_B, [0.0; 3], unturned).value_b;
    assert!((force_b - at_the_packet(0.0)).norm() > 10.0 * ROUNDING, "{force_b}");
}

#[test]
fn the_calibration_of_the_gyros_holds_for_the_turn_up_to_a_reading_too() {
    let biased = RATE_B + Vector3::new(0.05, -0.04, 0.03);
    let force_b = mean(biased, [0.0; 3], |_| {}).value_b;
    assert!((force_b - at_the_packet(0.0)).norm() < ROUNDING, "{force_b}");
}

#[test]
fn a_push_between_two_packets_counts_for_its_part() {
    let force_b = mean(RATE_B, [3.0, 0.0, -1.5], |_| {}).value_b;
    assert!((force_b - at_the_packet(0.5)).norm() < ROUNDING, "{force_b}");
}

/// Once a packet the push is as it was: from packet to packet nothing moves.
#[test]
fn what_moves_between_two_packets_is_in_the_variance_of_the_mean() {
    const PUSH: f32 = 3.0;
    // 0, 1, -1, 0: twice off the line through the two before, by three times the push each.
    let force = mean(RATE_B, [PUSH, -PUSH, 0.0], |_| {});
    let of_a_reading = PUSH * PUSH * 9.0 / 6.0 / 3.0;
    assert!(
        (force.scatter - 3.0 * of_a_reading).abs() < 0.05 * of_a_reading,
        "{force:?}"
    );
    assert!(
        (force.variance - of_a_reading / 3.0).abs() < 0.02 * of_a_reading,
        "{force:?}"
    );
    // A push that grows evenly is a motion that is seen.
    let force = mean(RATE_B, [PUSH, 2.0 * PUSH, 3.0 * PUSH], |_| {});
    assert_eq!(force.scatter, 0.0);
}

#[test]
fn readings_of_a_cycle_that_was_lost_are_forgotten() {
    let set = set();
    let known = Solution {
        vector_b: GRAVITY_N,
        known: Known::All,
        used: ALL,
        ..Solution::NOTHING
    };
    let reading = |force_n: Vector3<f32>| Force {
        acc_p: counts(&set, &force_n),
        covered_us: 60_000,
        ..Force::NONE
    };
    let mut averager = Averager::EMPTY;
    averager.begin(&counts(&set, &GRAVITY_N), &known, &set);
    averager.take(7, &reading(GRAVITY_N * 1.3), &set);
    let forces = [reading(GRAVITY_N), reading(GRAVITY_N)];
    averager.complete(8, &forces, &set);
    assert_eq!((averager.kept, averager.taken), (2.0, 2));
    assert!((averager.sum_b - GRAVITY_N * 2.0).norm() < 2.0 * ROUNDING);
}

#[test]
fn a_reading_with_an_axis_that_is_wrong_missing_or_at_its_end_is_left_out() {
    for wrong in [NOT_READ, 2047, -2048, 300] {
        let force = mean(RATE_B, [0.0; 3], |increments| increments.forces[1].acc_p[2][1] = wrong);
        let (force_b, variance) = (force.value_b, force.variance);
        assert!((force_b - at_the_packet(0.0)).norm() < ROUNDING, "{wrong}: {force_b}");
        // That an axis moved so far costs the mean its weight, too.
        let is_in_range = RANGE.contains(&wrong);
        assert_eq!(force.scatter > 0.0, is_in_range);
        assert!(is_in_range || (variance - 1.5e-4).abs() < 1e-9, "{wrong}: {variance}");
    }
    // An axis that has just come to its end.
    let set = set();
    let mut before = counts(&set, &GRAVITY_N);
    before[0][0] = 2040;
    let known = Solution {
        vector_b: GRAVITY_N,
        known: Known::All,
        used: ALL,
        ..Solution::NOTHING
    };
    for (end, kept) in [(2046, 1.0), (2047, 0.0)] {
        let mut averager = Averager::EMPTY;
        averager.begin(&before, &known, &set);
        let mut acc_p = before;
        acc_p[0][0] = end;
        averager.take(1, &Force { acc_p, ..Force::NONE }, &set);
        assert_eq!(averager.kept, kept, "{end}");
    }
    // Other axes in the cycle than before it.
    let averager = Averager {
        used: ALL & !1,
        kept: 2.0,
        sum_b: GRAVITY_N,
        ..Averager::EMPTY
    };
    let mut force = Sampled {
        value_b: GRAVITY_N,
        variance: 3e-4,
        scatter: 0.0,
        at_us: 0,
    };
    let turn = Turn {
        calibrated_b: Vector3::zeros(),
        nominal_b: [0.0; 3],
        since_b: Vector3::zeros(),
        covered_s: 0.2,
    };
    averager.average(&mut force, ALL, &turn);
    assert_eq!((force.value_b, force.variance), (GRAVITY_N, 3e-4));
    let force = mean(RATE_B, [9.0, 9.0, 0.0], |increments| {
        increments.forces = [Force::NONE; crate::increments::forces::READINGS];
    });
    assert_eq!((force.value_b, force.variance), (at_the_packet(0.0), 3e-4));
}
