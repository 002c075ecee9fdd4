//! When windows close, and when their work is done: what others may ask of the filter in between.

use super::*;
use crate::{
    draws::{Draws, near},
    kalman::pending::Stage,
};

#[test]
fn microseconds_are_seconds_beyond_32_bits_too() {
    for us in [
        0,
        1,
        999_999,
        4_294_967_295,
        4_294_967_296,
        5_000_000_000,
        86_400_000_000,
    ] {
        assert!(near(seconds(us), us as f64 * 1e-6, 1e-6, 0.0), "{us}");
    }
}

/// Steps of any length that add up to a window close it, and the filter says before which of them does.
#[test]
fn a_window_closes_with_the_step_that_completes_it() {
    for (step_s, steps) in [(0.02, 50), (0.05, 20), (0.1, 10), (0.2, 5)] {
        let mut world = World::new(tilted(), params());
        world.fly(3.0, Vector3::zeros(), nothing);
        while !world.filter.closes_at(world.at_us + STEP_US) {
            world.fly(STEP_S, Vector3::zeros(), nothing);
        }
        world.fly(STEP_S, Vector3::zeros(), nothing);
        assert_eq!(world.filter.window.duration_s, 0.0);
        for step in 1..=steps {
            let at_us = world.at_us + (step_s * 1e6) as u64;
            // Not a millisecond earlier than that.
            let closes = step == steps;
            assert_eq!(world.filter.closes_at(at_us), closes, "{step_s} {step}");
            assert!(!world.filter.closes_at(at_us - 1_000), "{step_s} {step}");
            world.at_us = at_us;
            let mut taken = world.step(Vector3::zeros());
            taken.covered_s = step_s;
            world.filter.step(&taken);
            assert_eq!(world.filter.window.duration_s == 0.0, closes, "{step_s} {step}");
        }
    }
}

/// The attitude now is ahead of the gyros' samples by their delay.
#[test]
fn the_attitude_is_bridged_over_the_delay_of_the_gyros() {
    let mut draws = Draws::of(1);
    for _ in 0..20 {
        let mut filter = Filter::new(params());
        filter.q_nb = draws.attitude();
        filter.rate_b = draws.vector(3.0);
        filter.params.delays.gyro_s = draws.within(0.0, 0.3);
        let turn_b = filter.rate_b.cast::<f64>() * f64::from(filter.params.delays.gyro_s);
        let expected = filter.q_nb.cast::<f64>() * UnitQuaternion::from_scaled_axis(turn_b);
        assert!(filter.attitude().cast::<f64>().angle_to(&expected) < 1e-5);
    }
}

/// What is asked of the covariance meanwhile is that of the latest window; asking changes nothing.
#[test]
fn the_covariance_asked_for_is_that_of_the_latest_window() {
    let mut world = World::new(tilted(), params());
    world.fly(3.0, Vector3::zeros(), nothing);
    while !world.filter.closes_at(world.at_us + STEP_US) {
        world.fly(STEP_S, Vector3::zeros(), nothing);
    }
    let counted = world.filter.settled().expect("complete").1;
    world.fly(STEP_S, Vector3::zeros(), nothing);
    let (asked, mut stages) = (world.filter.covariance(), 0);
    while !world.filter.pending.is_done() {
        // It is the same whenever it is asked for, and a step that is left to others does nothing but
        // learn of the iron.
        assert!(near(world.filter.covariance().worst(), asked.worst().into(), 1e-5, 0.0));
        let mut stage = world.filter.pending.stage();
        if stages % 2 == 0 {
            world.filter.spare();
            world.fly(STEP_S, Vector3::zeros(), nothing);
            if stage == Stage::Learn {
                (stage, stages) = (Stage::Passage, stages + 1);
            }
            assert_eq!(world.filter.pending.stage(), stage, "spared");
        }
        match world.filter.settled() {
            Some((_, now)) => assert!(now == counted && !matches!(stage, Stage::Scalars(_))),
            None => assert!(matches!(stage, Stage::Scalars(_))),
        }
        world.fly(STEP_S, Vector3::zeros(), nothing);
        stages += 1;
    }
    let (settled, now) = world.filter.settled().expect("complete");
    assert_eq!((now, settled), (counted.wrapping_add(1), &asked));
    // Look, velocity, field, correct, learn, passage, and seven scalars two at a time.
    assert_eq!(stages, 6 + 4);
}

/// Long steps have the correction with the window and more of the rest in each: it is done in as many steps as the page says.
#[test]
fn long_steps_do_more_at_once() {
    let steps_until_done = |step_s: f32| {
        let mut world = World::new(tilted(), params());
        let step = |world: &mut World| {
            world.at_us += (step_s * 1e6) as u64;
            let mut step = world.step(Vector3::zeros());
            step.covered_s = step_s;
            world.filter.step(&step)
        };
        (0..(4.0 / step_s) as u32).for_each(|_| drop(step(&mut world)));
        while world.filter.window.duration_s != 0.0 {
            step(&mut world);
        }
        let corrected = !world.filter.pending.corrects();
        let mut steps = 0;
        while !world.filter.pending.is_done() {
            step(&mut world);
            steps += 1;
        }
        (corrected, steps)
    };
    assert_eq!(steps_until_done(0.049), (false, 6 + 4));
    // Learning and the passage with two scalars, four, and the seventh.
    assert_eq!(steps_until_done(0.1), (true, 3));
    assert_eq!(steps_until_done(LONG_STEP_S), (true, 3));
}

/// A flipped bit of each part of the state is found when the window's work is done, and the filter begins anew.
#[test]
fn a_state_that_is_no_number_begins_anew() {
    let spoil: [fn(&mut Filter); 6] = [
        |filter| filter.bias_b.y = f32::NAN,
        |filter| filter.gyro_matrix.m23 = f32::INFINITY,
        |filter| filter.velocity_n.y = f32::NEG_INFINITY,
        |filter| filter.q_nb.as_mut_unchecked().coords.x = f32::NAN,
        |filter| filter.iron.iron_b.z = f32::NAN,
        |filter| filter.iron.covariance.m11 = f32::NAN,
    ];
    for (k, spoil) in spoil.iter().enumerate() {
        let mut world = World::new(tilted(), params());
        world.fly(3.0, Vector3::zeros(), nothing);
        let mut filter = world.filter.clone();
        filter.keep_finite();
        assert!(filter.aligned);
        spoil(&mut filter);
        assert_eq!(filter.is_finite(), k >= 4, "{k}");
        filter.keep_finite();
        assert!(!filter.aligned && filter.is_finite() && filter.iron.is_finite(), "{k}");
    }
}

/// An increment is taken for no longer than since the step before, and one that is no rotation for a gap.
#[test]
fn a_step_covers_no_more_than_has_passed() {
    let mut world = World::new(tilted(), params());
    world.fly(0.1, Vector3::zeros(), nothing);
    let mut next = |covered_s: f32, angle: f32| {
        world.at_us += STEP_US;
        let mut step = world.step(Vector3::zeros());
        (step.covered_s, step.angle_b.x) = (covered_s, angle);
        let before = world.filter.window.clone();
        let outcome = world.filter.step(&step);
        let drive = |window: &Window| Vector3::from_fn(|axis, _| window.drive[axis][0]).norm();
        (
            outcome.refusal,
            world.filter.window.duration_s - before.duration_s,
            drive(&world.filter.window) - drive(&before),
        )
    };
    for (covered_s, angle, refusal, covered) in [
        (STEP_S, 0.0, None, STEP_S),
        (0.5 * STEP_S, 0.0, None, 0.5 * STEP_S),
        (3.0 * STEP_S, 0.0, None, STEP_S),
        (STEP_S, 7.0, Some(Refusal::NotARotation), 0.0),
    ] {
        let (refused, lasted_s, drive) = next(covered_s, angle);
        assert_eq!(refused, refusal);
        assert!((lasted_s - STEP_S).abs() < 1e-6, "{covered_s}");
        assert!((drive - covered).abs() < 1e-5, "{covered_s}: {drive}");
    }
}

/// A first step that is no rotation covers nothing: nothing is known of how long it lasted.
#[test]
fn a_first_step_that_is_no_rotation_covers_nothing() {
    let mut filter = Filter::new(params());
    let mut step = World::new(tilted(), params()).step(Vector3::zeros());
    step.angle_b.x = 7.0;
    assert_eq!(filter.step(&step).refusal, Some(Refusal::NotARotation));
    assert_eq!((filter.window.duration_s, filter.last_us), (0.0, Some(step.at_us)));
}

/// At rest the gyros measure their bias and the Earth's turn.
#[test]
fn the_earth_turns_at_rest_too() {
    let earth_rate_n = Vector3::new(0.004, 0.001, -0.006);
    let params = Params {
        earth_rate_n,
        ..params()
    };
    let mut world = World::new(tilted(), params);
    for _ in 0..20 {
        let earth_b = tilted().inverse_transform_vector(&earth_rate_n);
        world.fly(1.0, Vector3::zeros(), |_, step| {
            step.rate_b += earth_b;
            step.angle_b += earth_b * STEP_S;
        });
    }
    assert!(world.filter.bias_b.norm() < 1e-4, "{:?}", world.filter.bias_b);
    world.off_by_less_than(0.1);
}
