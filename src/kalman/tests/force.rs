//! Specific force that is not the vertical's: shaking, vibration, flight.

use super::*;

/// \[deg\] attitude error after 15 s in which vibration, folded down by slow samples, looks like a steady push to the north
/// and upwards.
fn folded(params: Params) -> f32 {
    let rate_b = Vector3::new(0.1, 0.05, 0.0);
    let mut world = World::new(tilted(), params);
    world.fly(20.0, rate_b, nothing);
    let mut q_nb = world.q_nb;
    world.fly(15.0, rate_b, |_, step| {
        q_nb *= from_rotation_vector(rate_b * STEP_S);
        let push_n = Vector3::new(1.5, 0.0, -1.5);
        step.acc.as_mut().unwrap().value_b += q_nb.inverse_transform_vector(&push_n);
    });
    world.off() / DEG
}

#[test]
fn vibration_that_is_folded_down_shows_along_the_vertical() {
    let (with, without) = (
        folded(params()),
        folded(Params {
            acc_excess: 0.0,
            ..params()
        }),
    );
    assert!(with < 0.5 * without, "{with} {without}");
}

#[test]
fn hard_shaking_up_and_down_still_tells_the_vertical() {
    // 12 m/s2 at 0.4 Hz: whole windows are a third of one g off.
    let rate_b = Vector3::new(0.1, 0.0, 0.0);
    let mut world = World::new(tilted(), params());
    world.fly(5.0, rate_b, nothing);
    let mut q_nb = world.q_nb;
    let mut velocities = 0;
    for second in 0..30 {
        let outcome = world.fly(1.0, rate_b, |t_s, step| {
            q_nb *= from_rotation_vector(rate_b * STEP_S);
            let shaken_n = Vector3::z() * (12.0 * ComplexField::sin(2.5 * (second as f32 + t_s)));
            step.acc.as_mut().unwrap().value_b += q_nb.inverse_transform_vector(&shaken_n);
        });
        let found = outcome
            .innovations
            .iter()
            .filter(|record| record.quantity == Quantity::Velocity);
        velocities += found.count();
    }
    world.off_by_less_than(1.0);
    assert!(velocities > 10, "{velocities}");
}

#[test]
fn shaking_is_not_taken_for_tilt() {
    // 5 m/s2 to and fro along north, at 0.8 Hz: single samples are tilted by 27 deg.
    let shaken = |t_s: f32, step: &mut Step, q_nb: &UnitQuaternion<f32>| {
        let acc_n = Vector3::new(5.0 * ComplexField::sin(5.0 * t_s), 0.0, 0.0);
        if let Some(acc) = &mut step.acc {
            acc.value_b += q_nb.inverse_transform_vector(&acc_n);
        }
    };
    let mut world = World::new(tilted(), params());
    world.fly(5.0, Vector3::zeros(), nothing);
    let q_nb = world.q_nb;
    world.fly(60.0, Vector3::zeros(), |t_s, step| shaken(t_s, step, &q_nb));
    world.off_by_less_than(1.0);
}

#[test]
fn boost_and_free_fall_after_lift_off_do_not_move_it() {
    let mut world = World::new(tilted(), params());
    world.fly(10.0, Vector3::zeros(), nothing);
    world.jump = 0.0;
    // 12 g along the forward axis for 3.3 s, begun in the middle of a window, then free fall.
    world.fly(3.3, Vector3::new(0.3, 0.0, 0.0), |t_s, step| {
        step.lift_off = true;
        if t_s > 0.5 {
            step.acc.as_mut().unwrap().value_b.x += 12.0 * GRAVITY;
        }
    });
    world.fly(60.0, Vector3::new(0.3, 0.1, 0.0), |_, step| {
        step.lift_off = true;
        step.acc.as_mut().unwrap().value_b = Vector3::repeat(0.001);
    });
    assert!(world.jump < 1.0 * DEG, "{}", world.jump / DEG);
    world.off_by_less_than(1.0);
}

#[test]
fn after_lift_off_a_steady_push_is_not_taken_for_the_vertical() {
    let mut world = World::new(tilted(), params());
    world.fly(10.0, Vector3::zeros(), nothing);
    let q_nb = world.q_nb;
    // 1.15 g, tilted by 29 deg: near enough to one g for a shaken unit's mean, not for a sample in flight.
    world.fly(20.0, Vector3::zeros(), |_, step| {
        step.lift_off = true;
        step.acc.as_mut().unwrap().value_b += q_nb.inverse_transform_vector(&Vector3::new(5.5, 0.0, 0.0));
    });
    world.off_by_less_than(1.0);
}

#[test]
fn in_micro_gravity_the_field_bounds_what_it_can() {
    let mut world = World::new(tilted(), params());
    world.fly(10.0, Vector3::zeros(), nothing);
    let drift = Vector3::new(0.0, 0.003, 0.0);
    world.fly(120.0, Vector3::new(0.0, 0.2, 0.4), |_, step| {
        step.lift_off = true;
        step.acc = None;
        step.angle_b += drift * STEP_S;
    });
    // 0.003 rad/s for two minutes is 20 deg.
    world.off_by_less_than(5.0);
}
